"""One execution: a reader is given a file; a value or one clear line may come of it, and all else is a finding."""

import ctypes
import os
import resource
import sys
import tempfile
import time
import traceback
import warnings
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path

from mutations import Wrapping

from sepi.errors import SepiError, SepiWarning

SECONDS = 10.0
"""What an execution may take."""

MEMORY = 2**30
"""Bytes that an execution may take, of address space and of memory: more than any header of so small a file is due."""

MOST_BYTES = 2**16
"""Largest file that is tried."""

# warnings that a reader may give of one file
_MOST_WARNINGS = 10

_libc = ctypes.CDLL(None)


class FindingError(Exception):
    """What a reader must not do; ``key`` is the same for what is probably the same fault."""

    def __init__(self, what: str, key: str) -> None:
        super().__init__(what)
        self.key = key


@dataclass(frozen=True)
class Target:
    """A reader of what users hand in, and how to try it.

    Attributes
    ----------
    file : str
        Name of the file that is changed, in a folder of its own.
    seeds : callable
        Makes files in an empty folder and returns the contents to begin with.
    read : callable
        Reads the file at a path as a user's command would.
    around : callable
        Puts into the folder what has to lie beside the file; it is left alone.
    names_path : bool
        Whether messages begin with a path; what a user types has none.
    wrappings : tuple of Wrapping
        What hides the content of the file from changes.
    """

    file: str
    seeds: Callable[[Path], Iterable[bytes]]
    read: Callable[[Path], object]
    around: Callable[[Path], object] = lambda _: None
    names_path: bool = True
    wrappings: tuple[Wrapping, ...] = ()

    def first(self) -> list[bytes]:
        """The files to begin with."""
        with tempfile.TemporaryDirectory() as folder:
            return list(self.seeds(Path(folder)))


class Trial:
    """Executions of one target in a folder of its own.

    Parameters
    ----------
    target : Target
    folder : Path
        Empty.
    """

    def __init__(self, target: Target, folder: Path) -> None:
        self._target, self._folder = target, folder
        self._path = folder / target.file
        target.around(folder)
        self._path.parent.mkdir(parents=True, exist_ok=True)

    def run(self, data: bytes) -> str:
        """Let the target read these bytes.

        Returns
        -------
        str
            The line with which they were refused; empty where they were taken.

        Raises
        ------
        FindingError
            If anything else came of it.
        """
        self._path.write_bytes(data)
        # those who are not told of the folder look into the working one
        before = Path.cwd()
        os.chdir(self._folder)
        try:
            with _limits(), _silence(), _few_warnings():
                self._target.read(self._path)
        except SepiError as error:
            self._require_one_line(error)
            return str(error)
        except FindingError:
            raise
        except Exception as error:
            raise FindingError(f"{type(error).__name__}: {error}", f"{type(error).__name__} {_place(error)}") from error
        finally:
            os.chdir(before)
        return ""

    def _require_one_line(self, error: SepiError) -> None:
        text = str(error)
        below: BaseException | None = error
        while below is not None:
            if isinstance(below, MemoryError):
                raise FindingError(f"memory taken on a header's word: {text!r}", f"memory {_place(below)}") from error
            below = below.__cause__
        if not text.isprintable():
            raise FindingError(f"not one printable line: {text!r}", f"unprintable {_place(error)}") from error
        if self._target.names_path and not text.startswith(str(self._folder)):
            raise FindingError(f"does not begin with the path: {text!r}", f"path {_place(error)}") from error


def _place(error: BaseException) -> str:
    """The last line of this package that an error went through."""
    frames = [frame for frame in traceback.extract_tb(error.__traceback__) if "sepi" in Path(frame.filename).parts]
    return f"{Path(frames[-1].filename).name}:{frames[-1].lineno}" if frames else "?"


@contextmanager
def _limits() -> Iterator[None]:
    """Raise a finding where time or memory run out; a time without end is for whoever watches this process."""
    started = time.monotonic()
    soft, hard = resource.getrlimit(resource.RLIMIT_AS)
    held = _memory("VmSize")
    if held:
        resource.setrlimit(resource.RLIMIT_AS, (held + MEMORY, hard))
    # what was the most until now is forgotten, where the system can
    with suppress(OSError):
        Path("/proc/self/clear_refs").write_text("5")
    before = _memory("VmRSS")
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_AS, (soft, hard))
        took, taken = time.monotonic() - started, _memory("VmHWM") - before
        if took > SECONDS:
            raise FindingError(f"took {took:.1f} s", "slow")
        if before and taken > MEMORY:
            raise FindingError(f"took {taken / 1e6:.0f} MB", "memory")


def _memory(key: str) -> int:
    """Bytes that the system states of this process; 0 where it does not."""
    with suppress(OSError, StopIteration):
        lines = Path("/proc/self/status").read_text(encoding="ascii").splitlines()
        return next(int(line.split()[1]) for line in lines if line.startswith(f"{key}:")) * 1024
    return 0


@contextmanager
def _silence() -> Iterator[None]:
    """Raise a finding where anything is printed, by libraries in C, too."""
    sys.stdout.flush()
    sys.stderr.flush()
    kept = [os.dup(1), os.dup(2)]
    with tempfile.TemporaryFile() as printed:
        try:
            for number in (1, 2):
                os.dup2(printed.fileno(), number)
            yield
        finally:
            _libc.fflush(None)
            for number, saved in zip((1, 2), kept, strict=True):
                os.dup2(saved, number)
                os.close(saved)
        text = os.pread(printed.fileno(), 200, 0)
    if text:
        raise FindingError(f"printed {text!r}", f"printed {text[:20]!r}")


@contextmanager
def _few_warnings() -> Iterator[None]:
    """Raise a finding where a warning is none for the user, or there are many."""
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        yield
    for warning in caught:
        if not issubclass(warning.category, SepiWarning):
            place = f"{Path(warning.filename).name}:{warning.lineno}"
            raise FindingError(f"{warning.category.__name__}: {warning.message} ({place})", f"warning {place}")
        if not str(warning.message).isprintable():
            raise FindingError(f"warning not one printable line: {warning.message!s:.300}", "unprintable warning")
    if len(caught) > _MOST_WARNINGS:
        raise FindingError(f"{len(caught)} warnings", "warnings")
