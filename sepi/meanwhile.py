"""What a process needs soon, done while its threads work outside Python's lock: decode pictures, or run kernels."""

from __future__ import annotations

import sys
import threading
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager, suppress
from importlib import import_module

SHORTLY = 0.00005
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
    try:
        with _short_turns():
            while _SOON:
                _SOON.pop()()
    finally:
        _BUSY.release()


@contextmanager
def importing_meanwhile(modules: Iterable[str]) -> Iterator[None]:
    """Have a thread import modules, which others need later; what keeps it from that is left for them to meet.

    Parameters
    ----------
    modules : iterable of str
        One after the other; where all are there already, there is no thread.
    """
    wanted = [name for name in modules if name not in sys.modules]
    if not wanted:
        yield
        return

    def import_them() -> None:
        with suppress(Exception):
            for name in wanted:
                import_module(name)

    thread = threading.Thread(target=import_them, name="imports")
    with _short_turns():
        thread.start()
        try:
            yield
        finally:
            thread.join()


@contextmanager
def _short_turns() -> Iterator[None]:
    usual = sys.getswitchinterval()
    sys.setswitchinterval(SHORTLY)
    try:
        yield
    finally:
        sys.setswitchinterval(usual)
