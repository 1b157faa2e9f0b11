"""Pictures that threads decode before anybody asks for them: while Python imports what will."""

from __future__ import annotations

import sys
import threading
from collections.abc import Callable, Iterable
from concurrent.futures import Future
from pathlib import Path
from typing import Any

import numpy.typing as npt

from sepi.meanwhile import SHORTLY

MOST_BYTES = 2**26
"""What is decoded and not asked for yet takes about so much memory at most."""


class _Ahead:
    """Pictures that are decoded one after the other, until they are asked for."""

    def __init__(self, paths: Iterable[Path], decode: Callable[[Path], npt.NDArray[Any]]) -> None:
        self._lock = threading.Lock()
        # in the order in which they were given
        self._waiting = dict.fromkeys(paths)
        self._begun: dict[Path, Future[npt.NDArray[Any]]] = {}
        self._decode, self._bytes = decode, 0

    def work(self) -> None:
        while True:
            with self._lock:
                path = next(iter(self._waiting), None)
                if path is None or self._bytes >= MOST_BYTES:
                    return
                del self._waiting[path]
                future = self._begun[path] = Future()
            try:
                picture = self._decode(path)
            except BaseException as error:
                future.set_exception(error)
            else:
                with self._lock:
                    self._bytes += picture.nbytes
                future.set_result(picture)

    def taken(self, path: Path) -> npt.NDArray[Any] | None:
        with self._lock:
            self._waiting.pop(path, None)
            future = self._begun.pop(path, None)
        if future is None or future.exception() is not None:
            return None
        picture = future.result()
        with self._lock:
            self._bytes -= picture.nbytes
        return picture

    def end(self) -> None:
        with self._lock:
            self._waiting.clear()
            self._begun.clear()


_ahead: _Ahead | None = None
_usual_interval = 0.0


def begin(paths: Iterable[Path], decode: Callable[[Path], npt.NDArray[Any]], threads: int) -> None:
    """Have pictures decoded by threads of their own, until :func:`end` is called.

    Parameters
    ----------
    paths : iterable of Path
        In the order in which they will be asked for, about.
    decode : callable
        Decodes one, without a word about what is wrong with it: what fails is left to whoever asks for it.
    threads : int
    """
    global _ahead, _usual_interval
    end()
    _ahead = _Ahead(paths, decode)
    _usual_interval = sys.getswitchinterval()
    # between two pictures a thread needs Python's lock, which imports hold
    sys.setswitchinterval(SHORTLY)
    for _ in range(threads):
        # nobody waits for them when the program ends
        threading.Thread(target=_ahead.work, daemon=True).start()


def taken(path: Path) -> npt.NDArray[Any] | None:
    """A picture that was decoded ahead, once; None where it was not, which it is not any more then."""
    return None if _ahead is None else _ahead.taken(path)


def end() -> None:
    """Decode no more of them, and forget those that nobody asked for."""
    global _ahead
    if _ahead is not None:
        _ahead.end()
        _ahead = None
        sys.setswitchinterval(_usual_interval)
