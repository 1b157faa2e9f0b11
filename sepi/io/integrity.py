"""Integrity of an HDF5 file: it begins with a digest of all bytes that follow.

HDF5 may read other numbers from a damaged file, crash, or hang, so a file is checked before anything is made of it. The
digest lies in what HDF5 calls the user block, which other programs skip.
"""

from __future__ import annotations

import hashlib
import io
import time
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import h5py
import numpy as np

from sepi.errors import SepiError, printable
from sepi.io.files import DEFLATE_RATIO

BLOCK = 512
"""Bytes of the user block; HDF5 wants a power of two, 512 at least."""

_MARK = b"sepi sha256 "
# a file's time tells a later change when it is so many seconds old, as disks keep times no finer
_SETTLED = 2

# whether files are sound, by device, number, size and time
_sound: dict[tuple[int, int, int, int], bool] = {}


def members(group: h5py.Group | Mapping[str, Any]) -> list[tuple[str, Any]]:
    """Names and entries of a group, all at once.

    h5py's own iterator holds its lock until it is exhausted. If an error ends a loop early, the lock stays as long as
    anyone keeps that error: another thread that needs HDF5, even to release a file, would wait for ever.
    """
    return list(group.items())


def require_held(path: Path, dataset: Any) -> None:
    """Raise unless a dataset lies in its file and can have as many values as it claims."""
    name = printable(str(dataset.name).lstrip("/"))
    if not isinstance(dataset, h5py.Dataset) or dataset.shape is None:
        raise SepiError(f"{path}: damaged HDF5 file: '{name}' is no array")
    if dataset.is_virtual or dataset.external or dataset.file.filename != str(path):
        raise SepiError(f"{path}: the values of '{name}' lie in another file; copy them into this one")
    if dataset.dtype.hasobject:
        # as of such attributes
        raise SepiError(f"{path}: the values of '{name}' are of variable length; expected numbers")
    held = dataset.id.get_storage_size()
    # what is not compressed is stored as it is, but for chunks never written
    if held > path.stat().st_size or dataset.nbytes > held * (DEFLATE_RATIO if dataset.chunks else 1):
        raise SepiError(f"{path}: damaged HDF5 file: '{name}' of shape {dataset.shape} cannot lie in {held} bytes")


def require_sound(path: Path) -> None:
    """Refuse a file of this package that does not hold what was written, once looked at by this process."""
    status = path.stat()
    now = (status.st_dev, status.st_ino, status.st_size, status.st_mtime_ns)
    sound = _sound.get(now)
    if sound is None:
        sound = _is_as_written(path)
        if status.st_mtime < time.time() - _SETTLED:
            _sound[now] = sound
    if not sound:
        raise SepiError(f"{path}: damaged, or changed by another program; remove it and make it again")


def _is_as_written(path: Path) -> bool:
    """Whether the digest of a file is that of its bytes; others than those of this package have none."""
    with path.open("rb") as file:
        block = file.read(BLOCK)
        return not block.startswith(_MARK) or block == digest_block(file)


def is_own(entry: h5py.Group | h5py.Dataset | None) -> bool:
    """Whether a group or dataset is in a file that this package wrote: others may call theirs so, too."""
    if entry is None:
        return False
    with Path(entry.file.filename).open("rb") as file:
        return file.read(len(_MARK)) == _MARK


def digest_block(file: io.BufferedReader | io.BufferedRandom) -> bytes:
    """The user block for what follows in a file."""
    file.seek(BLOCK)
    return (_MARK + hashlib.file_digest(file, "sha256").hexdigest().encode()).ljust(BLOCK, b"\0")


def fixed_text(text: str) -> np.bytes_:
    """Text to be stored at a fixed length; HDF5 may hang on a damaged file that holds text of variable length."""
    return np.bytes_(text.encode() or b"\0")
