"""Ctrl-C and other signals that end a program wait where they would be lost."""

from __future__ import annotations

import signal
import threading
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from types import FrameType
from typing import TypeVar, cast

_Value = TypeVar("_Value")
_END = object()
_ENDING = [getattr(signal, name) for name in ("SIGINT", "SIGTERM", "SIGHUP") if hasattr(signal, name)]


class _Waiting:
    """A handler that only notes the first signal, and does with others what another one does."""

    def __init__(self, handler: Callable[[int, FrameType | None], object], came: list[int]) -> None:
        self.handler, self.came = handler, came

    def __call__(self, number: int, frame: FrameType | None) -> None:
        self.came.append(number)
        if len(self.came) > 1:
            self.handler(number, frame)


def _handlers() -> dict[int, object]:
    # other threads are not interrupted, and may not ask
    main = threading.current_thread() is threading.main_thread()
    return {number: signal.getsignal(number) for number in _ENDING} if main else {}


@contextmanager
def no_interrupt_lost() -> Iterator[None]:
    """Let signals that raise an exception do so at the end of the block; a second one does at once.

    For libraries that call Python from C, as h5py does when it lets go of an object or writes to a file of Python's:
    what is raised there is reported and forgotten, and the program goes on as if nobody had pressed Ctrl-C.
    """
    came: list[int] = []
    # what is no function raises nothing
    waiting = {number: _Waiting(handler, came) for number, handler in _handlers().items() if callable(handler)}
    try:
        for number, instead in waiting.items():
            signal.signal(number, instead)
        yield
    finally:
        for number, instead in waiting.items():
            signal.signal(number, instead.handler)
        if came:
            waiting[came[0]].handler(came[0], None)


def interruptibly(values: Iterable[_Value]) -> Iterator[_Value]:
    """The same values, for what is long in making inside a block of :func:`no_interrupt_lost`: signals raise there."""
    remaining = iter(values)
    while True:
        with _at_once():
            value = next(remaining, _END)
        if value is _END:
            return
        yield cast(_Value, value)


@contextmanager
def _at_once() -> Iterator[None]:
    waiting = {number: handler for number, handler in _handlers().items() if isinstance(handler, _Waiting)}
    try:
        for number, instead in waiting.items():
            signal.signal(number, instead.handler)
        for number, instead in waiting.items():
            if number in instead.came:
                instead.handler(number, None)
        yield
    finally:
        for number, instead in waiting.items():
            signal.signal(number, instead)
