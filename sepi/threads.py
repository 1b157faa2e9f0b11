"""How many threads this process may use: compiled loops and OpenCV keep to it."""

from __future__ import annotations

import os
import sys
from numbers import Integral

from sepi import kernels
from sepi.errors import SepiError
from sepi.validation import require_type


def available_cores() -> int:
    """Cores that this process may use: a container or a scheduler may give it fewer than the machine has."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def threads_used() -> int:
    """Threads of a compiled loop: as :func:`use_threads` said, else one for each core."""
    return kernels.thread_count()


def use_threads(count: int) -> None:
    """Let compiled loops and OpenCV use at most so many threads, and never more than this process has cores.

    Parameters
    ----------
    count : int
        Threads, at least 1.

    Raises
    ------
    SepiError
        If it is no such number.

    Examples
    --------
    Programs that work on many light fields in several processes give each of them one thread:

    >>> from sepi.threads import use_threads
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
        # read when it is loaded
        os.environ["OPENCV_FOR_THREADS_NUM"] = str(count)
