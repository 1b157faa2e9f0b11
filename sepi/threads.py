"""How many threads this process may use, and the libraries that keep to it."""

from __future__ import annotations

import os
import sys
from numbers import Integral

from sepi.errors import SepiError
from sepi.validation import require_type


def available_cores() -> int:
    """Cores that this process may use: a container or a scheduler may give it fewer than the machine has."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def threads_used() -> int:
    """Threads of a compiled loop: as :func:`use_threads` said, else what numba takes by itself."""
    if "numba" in sys.modules:
        import numba

        return int(numba.get_num_threads())
    return int(os.environ.get("NUMBA_NUM_THREADS", available_cores()))


def use_threads(count: int) -> None:
    """Let numba and OpenCV use at most so many threads, and never more than this process has cores.

    Neither is imported for that, since not every job needs them: what is not there yet is told when it starts.

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
    if "numba" in sys.modules:
        import numba

        # numba refuses more threads than it started with
        numba.set_num_threads(min(count, numba.config.NUMBA_NUM_THREADS))  # type: ignore[attr-defined]
    else:
        os.environ["NUMBA_NUM_THREADS"] = str(min(count, int(os.environ.get("NUMBA_NUM_THREADS", count))))
    if "cv2" in sys.modules:
        import cv2

        cv2.setNumThreads(count)
    else:
        os.environ["OPENCV_FOR_THREADS_NUM"] = str(count)
