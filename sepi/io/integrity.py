"""Whether an HDF5 file holds what was written: digests of its bytes, and of its groups and datasets.

HDF5 may read other numbers from a damaged file, crash, or hang, so damage is told before anything is made of a file. It
begins with a digest of all that follows it (in what HDF5 calls the user block, which other programs skip). Where that
does not fit, another process looks whether all that was written is there yet, by digests of groups and datasets: then
another program only added attributes.
"""

from __future__ import annotations

import hashlib
import io
import json
import time
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import h5py
import numpy as np

from sepi.errors import SepiError, printable
from sepi.io import apart
from sepi.io.files import DEFLATE_RATIO

BLOCK = 512
"""Bytes of the user block; HDF5 wants a power of two, 512 at least."""

_MARK = b"sepi sha256 "
# attribute of a group or dataset: digest of it and of what is below it, and its other attributes that are ours
_OWN = "sepi_sha256"
# seconds of processor that a file may take but for what its size adds
_PATIENCE = 1
_BYTES_A_SECOND = 10_000_000
# bytes of a dataset that are read at once for its digest
_PART = 16_000_000
# a file's time tells a later change when it is so many seconds old, as disks keep times no finer
_SETTLED = 2

# whether files are sound, by device, number, size and time
_sound: dict[tuple[int, int, int, int], bool] = {}


def members(group: h5py.Group | Mapping[str, Any]) -> list[tuple[str, Any]]:
    """Names and entries of a group, all at once.

    Until the last is taken from h5py's own iterator, it holds its lock: where an error ends a loop before, for as long
    as anyone keeps that error. Another thread that needs HDF5, be it to forget a file, would wait for ever.
    """
    return list(group.items())


def own_attributes(holder: h5py.Group | h5py.Dataset) -> list[str]:
    """Names of the attributes; in a file of this package, of those that it was written with."""
    if has_digest(holder) and _OWN in holder.attrs:
        return list(json.loads(holder.attrs[_OWN].partition(b" ")[2]))
    return [name for name in holder.attrs if name != _OWN]


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
        sound = _is_as_written(path) or _was_added_to(path)
        if status.st_mtime < time.time() - _SETTLED:
            _sound[now] = sound
    if not sound:
        raise SepiError(f"{path}: damaged, or changed by another program; remove it and make it again")


def _is_as_written(path: Path) -> bool:
    """Whether the digest of a file is that of its bytes; others than those of this package have none."""
    with path.open("rb") as file:
        block = file.read(BLOCK)
        return not block.startswith(_MARK) or block == digest_block(file)


def _was_added_to(path: Path) -> bool:
    """Whether a file has attributes beside those that were written, and all else is what was written."""

    def found() -> bool:
        with h5py.File(path, "r") as file:
            known: dict[Any, bytes] = {}
            whole = file.attrs[_OWN] == record(file, known, path)
            return whole and any(len(entry.attrs) > len(own_attributes(entry)) + 1 for entry in known)

    return apart.CAN_TRY and apart.outcome(found, _PATIENCE + path.stat().st_size / _BYTES_A_SECOND) is True


def record(entry: h5py.Group | h5py.Dataset, known: dict[Any, bytes], path: Path | None = None) -> bytes:
    """What tells a group or dataset from a changed one: in the file at ``path``, or for a file that is being written.

    ``known`` are those of entries before: they may have several names.
    """
    if entry in known:
        return known[entry]
    names = sorted(entry.attrs) if path is None else own_attributes(entry)
    total = hashlib.sha256()
    for name in names:
        value = np.asarray(entry.attrs[name])
        total.update(repr((name, value.dtype.str, value.tolist())).encode())
    if isinstance(entry, h5py.Group):
        for name, member in members(entry):
            total.update(repr((name, record(member, known, path))).encode())
    else:
        if path is not None:
            require_held(path, entry)
        total.update(repr((entry.dtype.str, entry.shape)).encode())
        # a part of what is packed would be unpacked with all that is packed with it
        rows = max(1, len(entry) if entry.chunks else _PART * len(entry) // max(1, entry.nbytes))
        for start in range(0, len(entry), rows):
            total.update(entry[start : start + rows])
    known[entry] = fixed_text(f"{total.hexdigest()} {json.dumps(names)}")
    if path is None:
        entry.attrs[_OWN] = known[entry]
    return known[entry]


def has_digest(holder: h5py.Group | h5py.Dataset) -> bool:
    """Whether the file, which was opened, begins with a digest, which was looked at then."""
    with Path(holder.file.filename).open("rb") as file:
        return file.read(len(_MARK)) == _MARK


def is_own(entry: h5py.Group | h5py.Dataset | None) -> bool:
    """Whether a group or dataset is in a file of this package: others may call theirs so, too."""
    return entry is not None and _OWN in entry.file.attrs


def digest_block(file: io.BufferedReader | io.BufferedRandom) -> bytes:
    """The user block for what follows in a file."""
    file.seek(BLOCK)
    return (_MARK + hashlib.file_digest(file, "sha256").hexdigest().encode()).ljust(BLOCK, b"\0")


def fixed_text(text: str) -> np.bytes_:
    """Text to be stored at a fixed length; HDF5 may hang on a damaged file that holds text of variable length."""
    return np.bytes_(text.encode() or b"\0")
