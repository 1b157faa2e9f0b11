"""NumPy files: the array in ``.npy``, or one of the arrays in ``.npz``."""

from __future__ import annotations

import functools
import math
import warnings
import zipfile
from pathlib import Path

import numpy as np
from numpy.lib import format as npy

from sepi.errors import SepiError, printable
from sepi.io.files import DEFLATE_RATIO, reading
from sepi.io.readers.arrays import Array
from sepi.io.readers.named_arrays import Shapes, light_field_from_arrays
from sepi.io.readers.options import ReadOptions
from sepi.lightfield import LightField

_KIND = "NumPy file"
# first bytes of a ZIP archive with members, and of an empty one
_ZIP_MAGICS = (b"PK\x03\x04", b"PK\x05\x06")
_OBJECTS = "Python objects, which may be any program; save images as one array, numpy.stack(them)"
_HEADERS = {(1, 0): npy.read_array_header_1_0, (2, 0): npy.read_array_header_2_0}


def matches(path: Path) -> bool:
    """Whether ``path`` is a file or an archive of NumPy, by its content or its suffix ``.npy`` or ``.npz``."""
    if not path.is_file():
        return False
    try:
        return path.suffix.lower() in (".npy", ".npz") or bool(array_shapes(path))
    except SepiError:
        return False


def read(path: Path, options: ReadOptions) -> LightField:
    """Light field from the array of a NumPy file; of an archive, ``options.variable`` or the array that fits."""
    return light_field_from_arrays(path, array_shapes(path), options, functools.partial(read_named, path))


def read_array(path: Path) -> Array:
    """Array of a ``.npy`` file, memory-mapped: values are read when used."""
    with reading(path, _KIND), warnings.catch_warnings(action="ignore"):
        with path.open("rb") as file:
            start = file.read(12)
            # NumPy allocates this length before it reads; two bytes in version 1, four in later ones
            length = int.from_bytes(start[8:10] if start[6:7] == b"\x01" else start[8:12], "little")
            if length > path.stat().st_size:
                raise ValueError(f"a header of {length} bytes")
            if b"'|O'" in file.read(length):
                raise SepiError(_OBJECTS)
        array: Array = np.load(path, mmap_mode="r", allow_pickle=False)
        return array


def array_shapes(path: Path) -> Shapes:
    """Shape and type of each array by name; a ``.npy`` has the file's own name. No values are read."""
    found = {}
    if not _is_zipped(path):
        array = read_array(path)
        return {path.stem: (array.shape, array.dtype)}
    with reading(path, _KIND), warnings.catch_warnings(action="ignore"), zipfile.ZipFile(path) as archive:
        for info in archive.infolist():
            if info.filename.endswith(".npy"):
                _require_room(path, info)
                with archive.open(info) as file:
                    shape, _, kind = _HEADERS[npy.read_magic(file)](file)
                # NumPy allocates this shape before it reads
                if math.prod(shape) * kind.itemsize > info.file_size:
                    raise ValueError(f"{info.filename} of shape {shape} cannot lie in {info.file_size} bytes")
                found[info.filename.removesuffix(".npy")] = shape, kind
    return found


def read_named(path: Path, name: str) -> Array:
    """Array of a name from :func:`array_shapes`."""
    if not _is_zipped(path):
        return read_array(path)
    with reading(path, _KIND), np.load(path, allow_pickle=False) as archive:
        if array_shapes(path)[name][1].hasobject:
            raise SepiError(_OBJECTS)
        array: Array = archive[name]
        return array


def _is_zipped(path: Path) -> bool:
    with reading(path, _KIND), path.open("rb") as file:
        return file.read(4) in _ZIP_MAGICS


def _require_room(path: Path, info: zipfile.ZipInfo) -> None:
    """Raise if a member of an archive cannot have the size that the archive states."""
    held = min(info.compress_size, path.stat().st_size)
    if info.file_size > held * (1 if info.compress_type == zipfile.ZIP_STORED else DEFLATE_RATIO):
        raise SepiError(f"damaged NumPy file: {printable(info.filename)}: {info.file_size} bytes cannot lie in {held}")
