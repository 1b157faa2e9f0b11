"""Number of threads of compiled loops and OpenCV."""

from __future__ import annotations

from numbers import Integral

import cv2

from sepi import kernels
from sepi.errors import SepiError
from sepi.validation import require_type

available_cores = kernels.available_cores
"""Number of cores that this process may use, which a container or a scheduler may limit."""

threads_used = kernels.thread_count
"""Number of threads of a compiled loop, as set by :func:`use_threads`; default: one for each core."""


def use_threads(count: int) -> None:
    """Limit the threads of compiled loops and OpenCV; there are never more than cores.

    Parameters
    ----------
    count : int
        Most threads, at least 1.

    Raises
    ------
    SepiError
        If it is not such a number.

    Examples
    --------
    Programs with several processes for many light fields give each process one thread:

    >>> from sepi.process.threads import use_threads
    >>> import cv2
    >>> use_threads(1)
    >>> cv2.getNumThreads()
    1
    """
    require_type("threads", count, Integral, "a whole number from 1 on")
    if count < 1:
        raise SepiError(f"threads: expected a whole number from 1 on, got {count}")
    count = min(int(count), available_cores())
    kernels.set_thread_count(count)
    cv2.setNumThreads(count)
