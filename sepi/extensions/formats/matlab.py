"""MATLAB files, ``.mat``: version 5 (``save -v6``, ``-v7``) and version 7.3 (``save -v7.3``), which is HDF5.

Axes are in the order that MATLAB shows. MATLAB drops trailing axes of size 1, so grey views have no axis of colours.
Version 7.3 stores the axes in reverse. The Light Field Toolbox [1]_ saves ``LF`` with the axes T S H W C and a weight
as the fourth channel.

SciPy is not used for version 5: it crashes on unknown value types, and reads whole structures for one array in them. A
file has a header of 128 bytes and then elements. An element is a tag of type and length, and data. A variable is a
*matrix* element, or one compressed by zlib; it begins with the elements flags, dimensions and name. In an array the
values follow. In a structure follow the length of the field names, the names, and a matrix element for each field of
each of its elements. Lengths are checked before any memory is taken.

References
----------
.. [1] D. G. Dansereau, O. Pizarro, S. B. Williams, "Decoding, calibration and rectification for lenselet-based
       plenoptic cameras", CVPR 2013. doi:10.1109/CVPR.2013.137
"""

from __future__ import annotations

import math
import struct
import zlib
from collections.abc import Callable, Iterator
from functools import partial
from pathlib import Path
from typing import Any, NamedTuple

import h5py
import numpy as np
import numpy.typing as npt

from sepi.errors import SepiError
from sepi.io.files import DEFLATE_RATIO, reading
from sepi.io.hdf5 import attribute, open_hdf5, read_dataset
from sepi.io.readers.array_files import Arrays, StoredArray, hdf5_arrays
from sepi.io.readers.arrays import Array, is_likely
from sepi.io.readers.formats import format_of_arrays
from sepi.io.readers.view_files import MAX_VIEWS

_HEADER = 128
"""Bytes of the file's header; the last four are version and byte order."""

_ORDERS = {b"\x00\x01IM": "<", b"\x01\x00MI": ">"}
"""Version and byte order to NumPy's sign for the order."""

_MATRIX, _COMPRESSED = 14, 15
_COMPLEX, _LOGICAL = 0x800, 0x200
# classes of variables: cell arrays, structures, and arrays of numbers with their types
_CELLS, _STRUCTURE = 1, 2
_CLASSES = dict(zip(range(6, 16), ("f8", "f4", "i1", "u1", "i2", "u2", "i4", "u4", "i8", "u8"), strict=True))
# types in which values may be stored
_TYPES = {1: "i1", 2: "u1", 3: "i2", 4: "u2", 5: "i4", 6: "u4", 7: "f4", 9: "f8", 12: "i8", 13: "u8"}
# enough for all elements before the values: names have at most 63 letters
_PREFIX = 4096
# number of elements before the values of an array
_BEFORE = 3


class _Part(NamedTuple):
    """An element: its type, the length in its tag, and as much of its data as was read."""

    kind: int
    length: int
    data: bytes | memoryview


def _arrays_of_version_5(path: Path) -> Arrays:
    """The arrays of real numbers, as MATLAB shows them.

    Arrays in structures, ``scene/LF`` or ``scene(2)/LF``, and cell arrays of equal shapes count only if no other array
    may be a light field.

    Raises
    ------
    SepiError, ValueError
        If the file is damaged.
    """
    found, holders = {}, []
    for order, name, parts, whole in _variables(path):
        if _is_real(order, parts):
            found[name] = StoredArray(*_form(order, parts)[:2], partial(_values, path, order, whole, name, name))
        elif _flags(order, parts) & 0xFF in (_CELLS, _STRUCTURE):
            holders.append((order, whole, name))
    if not any(is_likely(one.shape) for one in found.values()):
        for order, whole, holder in holders:
            for name, array in _fields(order, whole(), holder):
                read = partial(_values, path, order, whole, holder, name)
                found[name] = StoredArray(array.shape, array.dtype, read)
    return found


def _values(path: Path, order: str, whole: Callable[[], memoryview], holder: str, wanted: str) -> npt.NDArray[Any]:
    with reading(path, _KIND):
        return next(array for name, array in _fields(order, whole(), holder) if name == wanted)


def _form(order: str, parts: list[_Part]) -> tuple[tuple[int, ...], np.dtype[Any], np.dtype[Any]]:
    """Shape and type of an array, and the type in which its values are stored."""
    _, dimensions, name, values = parts[: _BEFORE + 1]
    if values.kind not in _TYPES:
        raise SepiError(f"damaged MATLAB file: an array with values of type {values.kind}")
    shape, stored = tuple(np.frombuffer(dimensions.data, order + "i4").tolist()), np.dtype(order + _TYPES[values.kind])
    if math.prod(shape) * stored.itemsize != values.length:
        raise ValueError(f"{_text(name)} of {values.length} bytes for {shape}")
    return shape, np.dtype(_CLASSES[_flags(order, parts) & 0xFF]), stored


def _fields(order: str, data: memoryview, name: str) -> Iterator[tuple[str, npt.NDArray[Any]]]:
    """Arrays in a matrix element, which may be a structure or a cell array."""
    parts = _parts(order, data)
    if any(part.length != len(part.data) for part in parts):
        raise ValueError(f"{name} is cut off")
    kind_of_matrix = _flags(order, parts) & 0xFF
    if kind_of_matrix == _STRUCTURE:
        width = struct.unpack(order + "i", parts[3].data)[0]
        text = bytes(parts[4].data)
        fields = [text[at : at + width].split(b"\0")[0].decode("latin-1") for at in range(0, len(text), width)]
        values = parts[5:]
        for number, value in enumerate(values):
            element, field = divmod(number, len(fields))
            # an empty matrix has no data at all
            if value.kind == _MATRIX and value.length:
                which = f"({element + 1})" if len(values) > len(fields) else ""
                yield from _fields(order, memoryview(value.data), f"{name}{which}/{fields[field]}")
    elif kind_of_matrix == _CELLS:
        shape = np.frombuffer(parts[1].data, order + "i4").tolist()
        cells = [cell for part in parts[3:] if part.length for _, cell in _fields(order, memoryview(part.data), name)]
        if len(cells) == math.prod(shape) and len({(cell.shape, cell.dtype) for cell in cells}) == 1:
            yield name, np.stack(cells)[np.arange(len(cells)).reshape(shape, order="F").squeeze()]
    elif _is_real(order, parts):
        shape, kind, stored = _form(order, parts)
        # MATLAB stores doubles that are small whole numbers as bytes
        yield name, np.frombuffer(parts[_BEFORE].data, stored).reshape(shape, order="F").astype(kind, copy=False)


def _variables(path: Path) -> Iterator[tuple[str, str, list[_Part], Callable[[], memoryview]]]:
    """Matrices: byte order, name, the first elements, and what gives the data of all."""
    data, at = np.memmap(path, np.uint8, "r").data, _HEADER
    order = _ORDERS[bytes(data[_HEADER - 4 : _HEADER])]
    while at < len(data):
        kind, length = struct.unpack_from(order + "II", data, at)
        stored = data[at + 8 : at + 8 + length]
        at += 8 + length
        if at > len(data):
            raise SepiError("damaged MATLAB file: it is cut off")
        head, most, packed = stored, length, kind == _COMPRESSED
        if packed:
            most = length * DEFLATE_RATIO
            unpacked = zlib.decompressobj().decompress(stored[:_PREFIX], _PREFIX)
            kind, head = _kind(order, unpacked), memoryview(unpacked)[8:]
        if kind == _MATRIX:
            parts = _parts(order, head, _BEFORE + 1)
            # SciPy would allocate these lengths, even for variables that nobody asks for
            if any(part.length > (most if n == _BEFORE else len(part.data)) for n, part in enumerate(parts)):
                raise ValueError("a variable whose head is longer than the file")
            yield order, _text(parts[2]), parts, partial(_content, stored, most if packed else 0)


def _content(stored: memoryview, most: int) -> memoryview:
    """Data of a matrix, unpacked to this size at most unless it is 0."""
    if not most:
        return stored
    packed = zlib.decompressobj()
    content = packed.decompress(stored, most)
    if not packed.eof:
        raise ValueError("a variable that is cut off")
    return memoryview(content)[8:]


def _parts(order: str, data: bytes | memoryview, most: int | None = None) -> list[_Part]:
    """Elements in the data of a matrix: the first ``most``, or all."""
    parts: list[_Part] = []
    at = 0
    while at + 8 <= len(data) and (most is None or len(parts) < most):
        kind, length = struct.unpack_from(order + "II", data, at)
        start, after = at + 8, at + 8 + -(-length // 8) * 8
        if kind >> 16:
            # the tag itself holds up to four bytes of data
            kind, length, start, after = kind & 0xFFFF, kind >> 16, at + 4, at + 8
        parts.append(_Part(kind, length, data[start : start + length]))
        at = after
    return parts


def _flags(order: str, parts: list[_Part]) -> int:
    """Class and kind of the values of a matrix."""
    return _kind(order, parts[0].data)


def _kind(order: str, data: bytes | memoryview) -> int:
    return int(struct.unpack_from(order + "I", data)[0])


def _is_real(order: str, parts: list[_Part]) -> bool:
    flags = _flags(order, parts)
    return flags & 0xFF in _CLASSES and not flags & (_COMPLEX | _LOGICAL)


def _text(part: _Part) -> str:
    return bytes(part.data).decode("latin-1")


_HDF5_MAGIC = b"MATLAB 7.3 MAT-file"
_CLASS = "MATLAB_class"
# MATLAB's classes of numbers; others are text, logical values, ...
_NUMBERS = ("uint8", "int8", "uint16", "int16", "uint32", "int32", "single", "uint64", "int64", "double")
_CELL, _MOST_CELLS = "cell", 8 * MAX_VIEWS


def _as_shown(path: Path, name: str, entry: Any) -> StoredArray | None:
    """The array of an entry of version 7.3 as MATLAB shows it, which may be a cell array of arrays that are alike."""
    # '#refs#' holds the contents of cells
    cells = [] if name.startswith("#") else _cells(entry)
    if not cells:
        return None
    shape = *_outer(entry), *cells[0].shape[:: _turn(path, cells[0])]
    return StoredArray(shape, cells[0].dtype, partial(_hdf5_array, path, name))


def _hdf5_array(path: Path, name: str) -> Array:
    with open_hdf5(path) as file:
        cells = _cells(file[name])
        arrays = [read_dataset(path, cell).transpose([*range(cell.ndim)][:: _turn(path, cell)]) for cell in cells]
        return arrays[0] if len(arrays) == 1 else np.stack(arrays).reshape(*_outer(file[name]), *arrays[0].shape)


def _cells(entry: Any) -> list[h5py.Dataset]:
    """The entry itself if it is an array of numbers, or the arrays of a cell array if all are alike; else empty."""
    if not isinstance(entry, h5py.Dataset) or entry.shape is None:
        return []
    if entry.dtype != h5py.ref_dtype:
        return [entry] if _is_numbers(entry) else []
    if _class(entry) != _CELL or not entry.nbytes <= entry.id.get_storage_size() <= _MOST_CELLS:
        return []
    try:
        cells = [entry.file[reference] for reference in entry[()].T.ravel()]
    except ValueError:
        # a null reference
        return []
    alike = all(map(_is_numbers, cells)) and len({(cell.shape, cell.dtype) for cell in cells}) == 1
    return cells if alike else []


def _outer(entry: Any) -> tuple[int, ...]:
    """Axes of a cell array as MATLAB shows them, without those of size 1."""
    return tuple(n for n in entry.shape[::-1] if n > 1) if entry.dtype == h5py.ref_dtype else ()


def _turn(path: Path, dataset: h5py.Dataset) -> int:
    """-1 if the axes are in reverse, as only MATLAB writes them; else 1."""
    with path.open("rb") as file:
        return -1 if _CLASS in dataset.attrs or file.read(len(_HDF5_MAGIC)) == _HDF5_MAGIC else 1


def _class(entry: h5py.Dataset) -> str:
    return str(attribute(entry, _CLASS)) if _CLASS in entry.attrs else ""


def _is_numbers(entry: Any) -> bool:
    held = isinstance(entry, h5py.Dataset) and entry.shape is not None and entry.dtype.kind in "iuf"
    return held and _class(entry) in ("", *_NUMBERS)


_KIND = "MATLAB file"


def matches(path: Path) -> bool:
    """Whether ``path`` is a file with MATLAB's header or the suffix ``.mat``."""
    if path.suffix.lower() == ".mat" or not path.is_file():
        return path.is_file()
    head = _head(path)
    return head[-4:] in _ORDERS or head.startswith(_HDF5_MAGIC)


def arrays_in(path: Path) -> Arrays:
    """Each array of real numbers in a file, as MATLAB shows it; no values are read but those in structures."""
    head = _head(path)
    # version 4 begins with a zero
    if head[-4:] in _ORDERS and 0 not in head[:4]:
        with reading(path, _KIND):
            return _arrays_of_version_5(path)
    if h5py.is_hdf5(path):
        return hdf5_arrays(path, stored=_as_shown)
    what = "is damaged" if head.startswith(_HDF5_MAGIC) else "is not a MATLAB file of version 5 or 7.3"
    raise SepiError(f"{path}: {what}; save it in MATLAB with -v7 or -v7.3")


def _head(path: Path) -> bytes:
    with reading(path, _KIND), path.open("rb") as file:
        return file.read(_HEADER)


FORMATS = {"matlab": format_of_arrays("MATLAB file", ".mat with an array such as LF", matches, arrays_in)}
