"""Delay of Ctrl-C and other signals that end a program, where they would be lost."""

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
    """A signal handler that notes the first signal and passes later ones to another handler."""

    def __init__(self, handler: Callable[[int, FrameType | None], object], came: list[int]) -> None:
        self.handler, self.came = handler, came

    def __call__(self, number: int, frame: FrameType | None) -> None:
        self.came.append(number)
        if len(self.came) > 1:
            self.handler(number, frame)


def _handlers() -> dict[int, object]:
    # only the main thread gets signals and may ask for handlers
    main = threading.current_thread() is threading.main_thread()
    return {number: signal.getsignal(number) for number in _ENDING} if main else {}


@contextmanager
def no_interrupt_lost() -> Iterator[None]:
    """Delay the exception of a first signal to the end of the block; a second signal raises at once.

    For libraries that call Python from C, such as h5py when it frees an object or writes to a Python file. They report
    and drop an exception there, and the program would go on as if nobody had pressed Ctrl-C.
    """
    came: list[int] = []
    # handlers that are no function raise nothing
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
    """The same values, computed so that signals raise at once, within a block of :func:`no_interrupt_lost`."""
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
