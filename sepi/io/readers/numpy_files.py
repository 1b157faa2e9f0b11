"""NumPy files: an array in ``.npy``, or one of those in ``.npz``."""

from __future__ import annotations

import io
import math
import struct
import zipfile
from dataclasses import dataclass
from pathlib import Path
from typing import IO, Any

import numpy as np
from numpy.lib import format as npy

from sepi.errors import SepiError, printable
from sepi.io.hdf5 import DEFLATE_RATIO
from sepi.io.readers.arrays import Array, damage_named, light_field_from_array, variable_of
from sepi.io.readers.options import ReadOptions, require_unused
from sepi.lightfield import LightField

_MAGIC = b"\x93NUMPY"
# of a ZIP archive with members, and of an empty one
_ZIP_MAGICS = (b"PK\x03\x04", b"PK\x05\x06")
# format version to the struct of the header's length and the function that reads both
_VERSIONS = {(1, 0): ("<H", npy.read_array_header_1_0), (2, 0): ("<I", npy.read_array_header_2_0)}
# NumPy's own limit for headers of unknown origin
_LONGEST_HEADER = 10_000


@dataclass(frozen=True)
class _Header:
    """What stands before the values of an array."""

    shape: tuple[int, ...]
    fortran_order: bool
    dtype: np.dtype[Any]
    size: int

    @property
    def nbytes(self) -> int:
        return math.prod(self.shape) * self.dtype.itemsize


def matches(path: Path) -> bool:
    """Whether ``path`` is a file with NumPy's header, an archive of such, or has the ending ``.npy`` or ``.npz``."""
    if not path.is_file():
        return False
    if path.suffix.lower() in (".npy", ".npz"):
        return True
    try:
        with path.open("rb") as file:
            head = file.read(len(_MAGIC))
        if not head.startswith(_ZIP_MAGICS):
            return head == _MAGIC
        with zipfile.ZipFile(path) as archive:
            return any(map(_is_array, archive.infolist()))
    except Exception:
        # an archive of what, nobody can tell
        return False


def read(path: Path, options: ReadOptions) -> LightField:
    """Read the array of a NumPy file; of an archive, ``options.variable`` or the only one that can be a light field.

    Raises
    ------
    SepiError
        If the file is damaged, holds Python objects, or no such array; else as
        :func:`sepi.io.readers.arrays.light_field_from_array`.
    """
    require_unused(str(path), options, ("pattern", "follow_links"))
    with damage_named(path, "NumPy file"), path.open("rb") as file:
        zipped = file.read(len(_MAGIC)).startswith(_ZIP_MAGICS)
        file.seek(0)
        if not zipped:
            require_unused(str(path), options, ("variable",))
        array = _read_npz(path, options.variable) if zipped else _read_npy(path, file)
    return light_field_from_array(array, name=path.stem, source=str(path), options=options)


def read_array(path: Path) -> Array:
    """The array of a ``.npy`` file, mapped: its values are read when they are used.

    Raises
    ------
    SepiError
        If the file cannot be read, is damaged or holds Python objects.
    """
    with damage_named(path, "NumPy file"), path.open("rb") as file:
        return _read_npy(path, file)


def _read_npy(path: Path, file: IO[bytes]) -> Array:
    header = _read_header(str(path), file)
    _require_values(str(path), header, path.stat().st_size - header.size)
    # mapped: only the views in use are read
    order: Any = "F" if header.fortran_order else "C"
    return np.memmap(path, header.dtype, "r", header.size, header.shape, order)


def shapes(path: Path) -> dict[str, tuple[tuple[int, ...], np.dtype[Any]]]:
    """Shape and type of each array in a file by its name, the empty one in ``.npy``; values are not read.

    Raises
    ------
    SepiError
        If the file cannot be read or is damaged.
    """
    with damage_named(path, "NumPy file"), path.open("rb") as file:
        if not zipfile.is_zipfile(file):
            file.seek(0)
            header = _read_header(str(path), file)
            return {"": (header.shape, header.dtype)}
        with zipfile.ZipFile(file) as archive:
            return {name: (header.shape, header.dtype) for name, (_, header) in _members(path, archive).items()}


def _read_npz(path: Path, variable: str | None) -> Array:
    with zipfile.ZipFile(path) as archive:
        members = _members(path, archive)
        numbers = {
            name: header.shape
            for name, (_, header) in members.items()
            if header.dtype.kind in "iuf" or name == variable
        }
        name = variable_of(str(path), numbers, variable)
        info, header = members[name]
        _require_values(f"{path}: {printable(name)}.npy", header, info.file_size - header.size)
        with archive.open(info) as file:
            return npy.read_array(file, allow_pickle=False)


def _members(path: Path, archive: zipfile.ZipFile) -> dict[str, tuple[zipfile.ZipInfo, _Header]]:
    """Arrays of an archive and their headers, by name."""
    members = {}
    for info in filter(_is_array, archive.infolist()):
        _require_stored(path, info)
        with archive.open(info) as file:
            header = _read_header(f"{path}: {printable(info.filename)}", file)
        members[info.filename.removesuffix(".npy")] = info, header
    return members


def _is_array(info: zipfile.ZipInfo) -> bool:
    return info.filename.endswith(".npy")


def _require_stored(path: Path, info: zipfile.ZipInfo) -> None:
    """Raise unless a member of an archive can be as large as the archive says."""
    if info.compress_type not in (zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED) or info.flag_bits & 1:
        raise SepiError(f"{path}: {printable(info.filename)} is encrypted or packed in a way that NumPy does not use")
    held = min(info.compress_size, path.stat().st_size)
    if info.file_size > held * (DEFLATE_RATIO if info.compress_type == zipfile.ZIP_DEFLATED else 1):
        raise SepiError(
            f"{path}: damaged NumPy file: {printable(info.filename)} of {info.file_size} bytes cannot lie in {held}"
        )


def _read_header(where: str, file: IO[bytes]) -> _Header:
    """Read the header of an array, which may be a lie."""
    start = file.read(len(_MAGIC) + 2)
    if not start.startswith(_MAGIC) or len(start) < len(_MAGIC) + 2:
        raise SepiError(f"{where}: not a NumPy file: no header of one")
    version = (start[-2], start[-1])
    if version not in _VERSIONS:
        raise SepiError(f"{where}: NumPy file of version {version[0]}.{version[1]}; expected one array of numbers")
    form, parse = _VERSIONS[version]
    length_bytes = file.read(struct.calcsize(form))
    length = struct.unpack(form, length_bytes)[0] if len(length_bytes) == struct.calcsize(form) else 0
    if not 0 < length <= _LONGEST_HEADER:
        raise SepiError(f"{where}: damaged NumPy file: header of {length} bytes")
    shape, fortran_order, dtype = parse(io.BytesIO(length_bytes + file.read(length)))
    if any(size < 0 for size in shape):
        raise SepiError(f"{where}: damaged NumPy file: shape {shape}")
    return _Header(shape, fortran_order, dtype, len(start) + len(length_bytes) + length)


def _require_values(where: str, header: _Header, held: int) -> None:
    """Raise unless the values are plain and fit into the ``held`` bytes after the header."""
    if header.dtype.hasobject:
        raise SepiError(f"{where}: holds Python objects, which are not read; save the views as one array of numbers")
    if header.nbytes > held:
        raise SepiError(
            f"{where}: damaged NumPy file: expected {header.nbytes} bytes of values for {header.dtype} {header.shape}, "
            f"got {held}"
        )
