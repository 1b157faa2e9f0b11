"""What a process needs soon, done while its threads decode pictures: they leave Python's lock to whoever imports."""

from __future__ import annotations

import sys
import threading
from collections.abc import Callable

_SHORTLY = 0.0002
"""So long Python's lock is kept from a thread that needs it between two pictures, seconds; usual are 5 ms."""

_SOON: list[Callable[[], None]] = []
_BUSY = threading.Lock()


def do_meanwhile(task: Callable[[], None]) -> None:
    """Have something done that does not depend on the pictures: when they are decoded next, or never.

    Parameters
    ----------
    task : callable
        Such as one that imports a library; whoever needs what it does must do with its not having been called.
    """
    if task not in _SOON:
        _SOON.append(task)


def wait_usefully() -> None:
    """Do what was given to :func:`do_meanwhile`, for the caller has to wait anyway; nothing if a thread is at it."""
    if not _BUSY.acquire(blocking=False):
        return
    usual = sys.getswitchinterval()
    sys.setswitchinterval(_SHORTLY)
    try:
        while _SOON:
            _SOON.pop()()
    finally:
        sys.setswitchinterval(usual)
        _BUSY.release()
