"""Number of threads of compiled loops and OpenCV."""

from __future__ import annotations

import os
import sys
from numbers import Integral

from sepi import kernels
from sepi.errors import SepiError
from sepi.validation import require_type


def available_cores() -> int:
    """Number of cores that this process may use, which a container or a scheduler may limit."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def threads_used() -> int:
    """Number of threads of a compiled loop, as set by :func:`use_threads`; default: one for each core."""
    return kernels.thread_count()


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
    >>> use_threads(1)
    >>> import cv2
    >>> cv2.getNumThreads()
    1
    """
    require_type("threads", count, Integral, "a whole number from 1 on")
    if count < 1:
        raise SepiError(f"threads: expected a whole number from 1 on, got {count}")
    count = min(int(count), available_cores())
    kernels.set_thread_count(count)
    if "cv2" in sys.modules:
        sys.modules["cv2"].setNumThreads(count)
    else:
        # OpenCV reads this when loaded
        os.environ["OPENCV_FOR_THREADS_NUM"] = str(count)
