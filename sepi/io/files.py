"""Reading files with one clear error, and writing them whole or not at all.

A file is written under a temporary name in the same folder, then renamed.
"""

from __future__ import annotations

import atexit
import io
import os
import re
import secrets
import shutil
from collections.abc import Iterable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any

from sepi.errors import SepiError, one_line, printable

DEFLATE_RATIO = 1100
"""Most bytes that a compressed byte can unpack to; zlib's limit is 1032."""

# an interrupt may come where no `finally` is in force; what is still listed at the end of the program is removed
_unfinished: set[Path] = set()
_TOKEN_BYTES = 6
_TEMPORARY = re.compile(rf"\..+-[0-9a-f]{{{2 * _TOKEN_BYTES}}}(\.[^.]*)?")


def name_of(path: Path) -> Path:
    """Name by which a path was given, even of a link; for ``.`` the name of the folder."""
    return Path(Path(os.path.abspath(path)).name)


def is_temporary(path: Path) -> bool:
    """Whether a path has the name of a temporary file or folder of this module."""
    return _TEMPORARY.fullmatch(path.name) is not None


@contextmanager
def naming(path: Path | str) -> Iterator[None]:
    """Put the path before an error that does not begin with it."""
    try:
        yield
    except SepiError as error:
        if str(error).startswith(one_line(str(path))):
            # raising it from itself would make an endless chain of causes
            raise
        raise SepiError(f"{path}: {error}") from error


@contextmanager
def reading(path: Path, kind: str) -> Iterator[None]:
    """Turn any failure while a file is read into one error that names the file.

    Libraries fail on damage in many ways; their message follows in brackets.

    Parameters
    ----------
    path : Path
    kind : str
        What the file should be; the message says "not a ``kind``".
    """
    try:
        with naming(path):
            yield
    except (SepiError, AssertionError, NameError, MemoryError):
        # not the file's fault
        raise
    except Exception as error:
        if isinstance(error, OSError) and error.strerror:
            raise SepiError(f"{path}: cannot be read ({error.strerror})") from error
        reason = printable(str(error))[:200] or type(error).__name__
        raise SepiError(f"{path}: not a {kind}, or damaged or cut off ({reason})") from error


@contextmanager
def atomic_path(path: Path) -> Iterator[Path]:
    """Give a temporary path beside ``path`` to write to; rename it on success, remove it on any failure.

    The temporary file exists and is empty. If ``path`` is a link, the link is replaced.

    Raises
    ------
    SepiError
        If the folder cannot be made or written to, the disk is full, or ``path`` is a device, a pipe or a folder.
    """
    if path.exists() and not path.is_file():
        raise SepiError(f"{path}: cannot be written (not a file)")
    with _temporary_beside(path, path.suffix, path) as temporary:
        path.parent.mkdir(parents=True, exist_ok=True)
        temporary.touch(exist_ok=False)
        yield temporary
        temporary.replace(path)


def write_whole(path: Path, content: str | bytes) -> None:
    """Write a file, whole or not at all, as :func:`atomic_path` does; text as UTF-8."""
    with atomic_path(path) as temporary:
        temporary.write_bytes(content.encode() if isinstance(content, str) else content)


@contextmanager
def atomic_folder(path: Path, *, replace: bool = False, add: bool = False) -> Iterator[Path]:
    """Give a temporary folder to fill; rename it on success, remove it on any failure.

    With ``replace``, it replaces an existing folder. With ``add``, its files move into a folder that has files, in the
    order in which they were made. If ``path`` is a link, the folder that it leads to is written.

    Raises
    ------
    SepiError
        If ``path`` exists and is not an empty folder, or cannot be made or written to, or the disk is full.
    """
    path = Path(os.path.realpath(path)) if add or path.is_symlink() else path
    full = path.is_dir() and any(path.iterdir())
    if path.exists() and (not path.is_dir() or (full and not replace and not add)):
        raise SepiError(f"{path}: exists already; remove it or choose a folder that does not exist")
    made = path / "files" if full and add else path
    with _temporary_beside(made, "", path) as temporary:
        made.parent.mkdir(parents=True, exist_ok=True)
        temporary.mkdir()
        yield temporary
        if replace:
            shutil.rmtree(path, ignore_errors=True)
        if made == path:
            temporary.replace(path)
            return
        for file in sorted(temporary.iterdir(), key=lambda file: file.stat().st_mtime_ns):
            file.replace(path / file.name)


def remove_files(folder: Path, names: Iterable[str]) -> None:
    """Remove files that an earlier run wrote, if they exist."""
    for name in names:
        try:
            (folder / name).unlink(missing_ok=True)
        except OSError as error:
            raise SepiError(f"{folder / name}: an earlier run's file cannot be removed ({error.strerror})") from error


@contextmanager
def _temporary_beside(path: Path, suffix: str, target: Path) -> Iterator[Path]:
    """Name for a temporary file or folder, removed at the end; system errors are reported for ``target``."""
    # the token keeps programs apart that write the same file; a long stem is cut to leave room for it
    temporary = path.parent / f".{path.stem[:40]}-{secrets.token_hex(_TOKEN_BYTES)}{suffix}"
    _unfinished.add(temporary)
    interrupted = False
    try:
        yield temporary
    except (KeyboardInterrupt, SystemExit):
        interrupted = True
        raise
    except OSError as error:
        raise SepiError(f"{target}: cannot be written ({error.strerror or error})") from error
    except SepiError as error:
        # name the final file, not the temporary one
        raise SepiError(str(error).replace(str(temporary), str(target))) from error
    finally:
        remove_temporary(temporary)
        if interrupted:
            # a thread that was just started may still write there; it has ended when the program ends
            _unfinished.add(temporary)


def remove_temporary(temporary: Path) -> None:
    """Remove a temporary file or folder that was not renamed."""
    if temporary.is_dir():
        shutil.rmtree(temporary, ignore_errors=True)
    else:
        # the folder may never have been made
        with suppress(OSError):
            temporary.unlink(missing_ok=True)
    _unfinished.discard(temporary)


@atexit.register
def _remove_unfinished() -> None:
    for temporary in list(_unfinished):
        remove_temporary(temporary)


class PatientFile(io.FileIO):
    """A file that stores its first write error instead of raising it, since HDF5 crashes on a full disk."""

    failure: OSError | None = None

    def write(self, data: Any) -> int:
        """Write all of ``data``."""
        left = memoryview(data).cast("B")
        size = len(left)
        try:
            while left:
                left = left[super().write(left) :]
        except OSError as error:
            self.failure = self.failure or error
            self.seek(len(left), io.SEEK_CUR)
        return size

    def truncate(self, size: int | None = None) -> int:
        """Set the file's size."""
        try:
            return super().truncate(size)
        except OSError as error:
            self.failure = self.failure or error
            return self.tell() if size is None else size
