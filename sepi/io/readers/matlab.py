"""MATLAB files, ``.mat``: version 5 (``save -v6``, ``-v7``) and version 7.3 (``save -v7.3``), which is HDF5.

The axes are those that MATLAB shows. It drops trailing axes of size 1, so grey views have no axis of colours; version
7.3 stores the axes in reverse. The Light Field Toolbox [1]_ saves ``LF`` with the axes T S H W C and a weight as the
fourth channel.

SciPy reads version 5. It ends the program with a segmentation fault where the type of the values is none that there is
(such as code 60000 in place of 2, of bytes), so the types are looked at first. After a header of 128 bytes come
elements, each a tag of type and length and then data; a variable is a *matrix* element, or that compressed by zlib, and
begins with the elements flags, dimensions, name and values.

References
----------
.. [1] D. G. Dansereau, O. Pizarro, S. B. Williams, "Decoding, calibration and rectification for lenselet-based
       plenoptic cameras", CVPR 2013. doi:10.1109/CVPR.2013.137
"""

from __future__ import annotations

import struct
import warnings
import zlib
from pathlib import Path
from typing import Any, NamedTuple

import h5py
import numpy as np

from sepi.errors import SepiError
from sepi.io.files import reading
from sepi.io.hdf5 import DEFLATE_RATIO, attribute, open_hdf5, read_dataset
from sepi.io.readers.arrays import Array
from sepi.io.readers.named_arrays import Shapes, datasets_in, light_field_from_arrays
from sepi.io.readers.options import ReadOptions
from sepi.lightfield import LightField

_KIND = "MATLAB file"

# other classes are text, logical values, cells, ...
_NUMBERS = ("uint8", "int8", "uint16", "int16", "uint32", "int32", "single", "uint64", "int64", "double")
_TEXT_7_3 = b"MATLAB 7.3 MAT-file"

# bytes before the first element of version 5; the last four, version and byte order, as NumPy's word for the order
_HEADER = 128
_BYTE_ORDERS = {b"\x00\x01IM": "<", b"\x01\x00MI": ">"}
_MATRIX, _COMPRESSED = 14, 15
_COMPLEX, _LOGICAL = 0x800, 0x200
# classes of variables that are arrays of numbers, and the types in which their values may be stored
_CLASSES = range(6, 16)
_TYPES = (1, 2, 3, 4, 5, 6, 7, 9, 12, 13)
# enough for all that comes before the values: names have at most 63 letters
_PREFIX = 4096


def matches(path: Path) -> bool:
    """Whether ``path`` is a file with MATLAB's header or its ending ``.mat``."""
    if not path.is_file():
        return False
    if path.suffix.lower() == ".mat":
        return True
    try:
        head = _head(path)
    except SepiError:
        return False
    return head[-4:] in _BYTE_ORDERS or head.startswith(_TEXT_7_3)


def read(path: Path, options: ReadOptions) -> LightField:
    """Read the array ``options.variable`` of a MATLAB file; without it, what can be a light field."""
    shapes = array_shapes(path)

    def load(name: str) -> Array:
        array = _read_7_3(path, name) if h5py.is_hdf5(path) else _read_5(path, name, shapes[name][1])
        # the axes that MATLAB dropped
        while array.ndim < len(options.axes or "") <= 5:
            array = array[..., None]
        return array

    return light_field_from_arrays(path, shapes, options, load)


def array_shapes(path: Path) -> Shapes:
    """Shape and type, as MATLAB shows them, of each array of real numbers in a file; their values are not read."""
    head = _head(path)
    # what begins with a zero is of version 4 to SciPy, whatever else the header says
    if head[-4:] in _BYTE_ORDERS and 0 not in head[:4]:
        from scipy.io import whosmat

        with reading(path, _KIND), warnings.catch_warnings(action="ignore"):
            names = _real_arrays(path)
            return {name: (shape, np.dtype(kind)) for name, shape, kind in whosmat(path) if name in names}
    if h5py.is_hdf5(path):
        with open_hdf5(path) as file:
            # structures are groups
            arrays = datasets_in(file, _is_numbers)
            turn = {name: -1 if _is_turned(path, array) else 1 for name, array in arrays.items()}
            return {name: (array.shape[:: turn[name]], array.dtype) for name, array in arrays.items()}
    what = "is damaged" if head.startswith(_TEXT_7_3) else "is not a MATLAB file of version 5 or 7.3"
    raise SepiError(f"{path}: {what}; save it in MATLAB with -v7 or -v7.3")


def _head(path: Path) -> bytes:
    with reading(path, _KIND), path.open("rb") as file:
        return file.read(_HEADER)


def _read_5(path: Path, name: str, kind: np.dtype[Any]) -> Array:
    from scipy.io import loadmat

    with reading(path, _KIND), warnings.catch_warnings(action="ignore"):
        values: Array = loadmat(path, variable_names=[name])[name]
        # MATLAB saves doubles that are small whole numbers as bytes
        return values.astype(kind, copy=False)


def _real_arrays(path: Path) -> set[str]:
    """Names of a file's arrays of real numbers, whose values are of types that there are."""
    names = set()
    with path.open("rb") as file:
        order = _BYTE_ORDERS[file.read(_HEADER)[-4:]]
        while tag := file.read(8):
            kind, length = struct.unpack(order + "II", tag)
            end = file.tell() + length
            if end > path.stat().st_size:
                raise SepiError("damaged MATLAB file: it is cut off")
            head = file.read(min(length, _PREFIX))
            # bytes that the values can take
            most = length
            if kind == _COMPRESSED:
                most = length * DEFLATE_RATIO
                head = zlib.decompressobj().decompress(head, _PREFIX)
                kind, head = struct.unpack_from(order + "I", head)[0], head[8:]
            flags = struct.unpack_from(order + "I", head, 8)[0] if kind == _MATRIX else 0
            parts = _parts(order, head) if kind == _MATRIX else []
            # SciPy takes memory on the word of each, of variables that nobody asks for, too
            if any(part.length > len(part.data) for part in parts[:3]):
                raise ValueError("a variable whose head is longer than the file")
            if flags & 0xFF in _CLASSES and not flags & (_COMPLEX | _LOGICAL):
                _, _, name, values = parts
                if values.kind not in _TYPES:
                    raise SepiError(f"damaged MATLAB file: an array with values of type {values.kind}")
                if values.length > most:
                    raise ValueError("an array that is longer than the file")
                names.add(name.data.decode("latin-1"))
            file.seek(end)
    return names


class _Part(NamedTuple):
    """An element: its type, the length that its tag states, and as much of its data as was looked at."""

    kind: int
    length: int
    data: bytes


def _parts(order: str, head: bytes) -> list[_Part]:
    """The first four elements of a matrix, or as many as there are."""
    parts: list[_Part] = []
    at = 0
    while at + 8 <= len(head) and len(parts) < 4:
        kind, length = struct.unpack_from(order + "II", head, at)
        start, after = at + 8, at + 8 + -(-length // 8) * 8
        if kind >> 16:
            # up to four bytes of data stand in the tag itself
            kind, length, start, after = kind & 0xFFFF, kind >> 16, at + 4, at + 8
        parts.append(_Part(kind, length, head[start : start + length]))
        at = after
    return parts


def _read_7_3(path: Path, name: str) -> Array:
    with open_hdf5(path) as file:
        array = read_dataset(path, file[name])
        return array.T if _is_turned(path, file[name]) else array


def _is_turned(path: Path, dataset: h5py.Dataset) -> bool:
    """Whether the axes are in reverse, as MATLAB writes them; other programs do not."""
    return "MATLAB_class" in dataset.attrs or _head(path).startswith(_TEXT_7_3)


def _is_numbers(entry: Any) -> bool:
    if not isinstance(entry, h5py.Dataset) or entry.dtype.kind not in "iuf" or entry.shape is None:
        return False
    return "MATLAB_class" not in entry.attrs or attribute(entry, "MATLAB_class") in _NUMBERS
