"""NumPy files: an array in ``.npy``, or one of those in ``.npz``."""

from __future__ import annotations

import zipfile
from pathlib import Path
from typing import IO, Any

import numpy as np
from numpy.lib import format as npy

from sepi.errors import SepiError, printable
from sepi.io.hdf5 import DEFLATE_RATIO
from sepi.io.readers.arrays import Array, damage_named, light_field_from_array, variable_of
from sepi.io.readers.options import ReadOptions, require_unused
from sepi.lightfield import LightField

_KIND = "NumPy file"
# of a ZIP archive with members, and of an empty one
_ZIP_MAGICS = (b"PK\x03\x04", b"PK\x05\x06")
_HEADERS = {(1, 0): npy.read_array_header_1_0, (2, 0): npy.read_array_header_2_0}


def matches(path: Path) -> bool:
    """Whether ``path`` is a file with NumPy's header, an archive of such, or has the ending ``.npy`` or ``.npz``."""
    if not path.is_file():
        return False
    if path.suffix.lower() in (".npy", ".npz"):
        return True
    try:
        if not _is_zipped(path):
            with path.open("rb") as file:
                return npy.read_magic(file) is not None
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
    with damage_named(path, _KIND):
        zipped = _is_zipped(path)
    if not zipped:
        require_unused(str(path), options, ("variable",))
    array = _read_npz(path, options.variable) if zipped else read_array(path)
    return light_field_from_array(array, name=path.stem, source=str(path), options=options)


def read_array(path: Path) -> Array:
    """The array of a ``.npy`` file, mapped: its values are read when they are used.

    Raises
    ------
    SepiError
        If the file cannot be read, is damaged or holds Python objects.
    """
    with damage_named(path, _KIND):
        with path.open("rb") as file:
            _require_plain(path, "", _read_header(path, file)[1])
        array: Array = np.load(path, mmap_mode="r", allow_pickle=False)
        return array


def shapes(path: Path) -> dict[str, tuple[tuple[int, ...], np.dtype[Any]]]:
    """Shape and type of each array in a file by its name, the empty one in ``.npy``; values are not read.

    Raises
    ------
    SepiError
        If the file cannot be read or is damaged.
    """
    with damage_named(path, _KIND):
        if not _is_zipped(path):
            with path.open("rb") as file:
                return {"": _read_header(path, file)}
        found = {}
        with zipfile.ZipFile(path) as archive:
            for info in filter(_is_array, archive.infolist()):
                _require_room(path, info)
                with archive.open(info) as file:
                    found[info.filename.removesuffix(".npy")] = _read_header(path, file)
        return found


def _read_npz(path: Path, variable: str | None) -> Array:
    found = shapes(path)
    numbers = {name: shape for name, (shape, kind) in found.items() if kind.kind in "iuf" or name == variable}
    name = variable_of(str(path), numbers, variable)
    _require_plain(path, f": {printable(name)}.npy", found[name][1])
    with damage_named(path, _KIND), np.load(path, allow_pickle=False) as archive:
        array: Array = archive[name]
        return array


def _is_zipped(path: Path) -> bool:
    with path.open("rb") as file:
        return file.read(4) in _ZIP_MAGICS


def _is_array(info: zipfile.ZipInfo) -> bool:
    return info.filename.endswith(".npy")


def _require_room(path: Path, info: zipfile.ZipInfo) -> None:
    """Raise unless a member of an archive can be as large as the archive says."""
    if info.compress_type not in (zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED) or info.flag_bits & 1:
        raise SepiError(f"{path}: {printable(info.filename)} is encrypted or packed in a way that NumPy does not use")
    held = min(info.compress_size, path.stat().st_size)
    if info.file_size > held * (DEFLATE_RATIO if info.compress_type == zipfile.ZIP_DEFLATED else 1):
        raise SepiError(
            f"{path}: damaged NumPy file: {printable(info.filename)} of {info.file_size} bytes cannot lie in {held}"
        )


def _read_header(path: Path, file: IO[bytes]) -> tuple[tuple[int, ...], np.dtype[Any]]:
    """Shape and type of the array that a file begins with."""
    try:
        version = npy.read_magic(file)
    except ValueError as error:
        raise SepiError(f"{path}: not a NumPy file: no header of one") from error
    if version not in _HEADERS:
        raise SepiError(f"{path}: NumPy file of version {version[0]}.{version[1]}; expected one array of numbers")
    shape, _, kind = _HEADERS[version](file)
    return shape, kind


def _require_plain(path: Path, member: str, kind: np.dtype[Any]) -> None:
    if kind.hasobject:
        raise SepiError(f"{path}{member}: holds Python objects, which are not read; save the views as numbers")
