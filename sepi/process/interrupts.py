"""Delay of Ctrl-C and other signals that end a program, where they would be lost."""

from __future__ import annotations

import signal
import threading
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from types import FrameType
from typing import TypeVar, cast

_Value = TypeVar("_Value")
_END = object()
_ENDING = [getattr(signal, name) for name in ("SIGINT", "SIGTERM", "SIGHUP") if hasattr(signal, name)]


class _Delay:
    """Handlers of signals, and the signals that came in their place; a second one is handled at once."""

    def __init__(self) -> None:
        # only the main thread gets signals and may ask for handlers; handlers that are no function raise nothing
        numbers = _ENDING if threading.current_thread() is threading.main_thread() else []
        self.handlers = {number: handler for number in numbers if callable(handler := signal.getsignal(number))}
        self.came: list[int] = []

    def note(self, number: int, frame: FrameType | None) -> None:
        """Note a signal; as a handler."""
        self.came.append(number)
        if len(self.came) > 1:
            self.handlers[number](number, frame)

    def begin(self) -> None:
        """Note signals from now on."""
        for number in self.handlers:
            signal.signal(number, self.note)

    def end(self) -> None:
        """Handle signals again, and the first that came."""
        for number, handler in self.handlers.items():
            signal.signal(number, handler)
        for number in self.came[:1]:
            self.handlers[number](number, None)


@contextmanager
def no_interrupt_lost() -> Iterator[None]:
    """Delay the exception of a first signal to the end of the block; a second signal raises at once.

    For libraries that call Python from C, such as h5py when it frees an object or writes to a Python file. They report
    and drop an exception there, and the program would go on as if nobody had pressed Ctrl-C.
    """
    delay = _Delay()
    try:
        delay.begin()
        yield
    finally:
        delay.end()


def interruptibly(values: Iterable[_Value]) -> Iterator[_Value]:
    """The same values, computed so that signals raise at once, within a block of :func:`no_interrupt_lost`."""
    remaining = iter(values)
    holders = [getattr(handler, "__self__", None) for handler in _Delay().handlers.values()]
    delays = {holder for holder in holders if isinstance(holder, _Delay)}
    while True:
        for delay in delays:
            delay.end()
        try:
            value = next(remaining, _END)
        finally:
            for delay in delays:
                delay.begin()
        if value is _END:
            return
        yield cast(_Value, value)
