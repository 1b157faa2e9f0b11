"""Arrays of numbers in MATLAB files of version 5 (``save -v6``, ``-v7``).

SciPy has a reader too, but it crashes on some damaged files (it trusts type codes), so the few parts that an array of
numbers needs are read here. After a header of 128 bytes come elements, each a tag of type and length and then data; a
variable is a *matrix* element, or that compressed by zlib. Inside it are the elements flags, dimensions, name, values.
"""

from __future__ import annotations

import math
import struct
import zlib
from dataclasses import dataclass
from pathlib import Path
from typing import IO, Any

import numpy as np

from sepi.errors import SepiError
from sepi.io.readers.arrays import DEFLATE_RATIO, Array

HEADER = 128
"""Bytes before the first element."""

BYTE_ORDERS = {b"\x00\x01IM": "<", b"\x01\x00MI": ">"}
"""Last four bytes of the header (version and byte order) to NumPy's word for the order."""

_MATRIX, _COMPRESSED = 14, 15
_INT8, _INT32, _UINT32 = 1, 5, 6
# type of an element to that of its numbers
_STORED = {1: "i1", 2: "u1", 3: "i2", 4: "u2", 5: "i4", 6: "u4", 7: "f4", 9: "f8", 12: "i8", 13: "u8"}
# class of a variable to the type of its numbers; other classes are cells, structures, text, ...
_CLASSES = {6: "f8", 7: "f4", 8: "i1", 9: "u1", 10: "i2", 11: "u2", 12: "i4", 13: "u4", 14: "i8", 15: "u8"}
_COMPLEX, _LOGICAL = 0x800, 0x200
# enough for all that comes before the values: names have at most 63 letters
_PREFIX = 4096


@dataclass(frozen=True)
class Variable:
    """An array of numbers in a file.

    Attributes
    ----------
    name : str
    shape : tuple of int
    kind : numpy.dtype
        What MATLAB shows.
    stored : numpy.dtype
        What the file holds, which may be smaller: MATLAB saves doubles that are small whole numbers as bytes.
    start : int
        Bytes from the start of the matrix element to the values.
    element : int
        Bytes of the matrix element.
    at, held : int
        Where the element or its compressed form lies in the file, and its length there.
    compressed : bool
    """

    name: str
    shape: tuple[int, ...]
    kind: np.dtype[Any]
    stored: np.dtype[Any]
    start: int
    element: int
    at: int
    held: int
    compressed: bool


def variables(path: Path) -> dict[str, Variable]:
    """Arrays of real numbers in a file, by name; nothing but what comes before their values is read.

    Raises
    ------
    SepiError
        If the file cannot be read, is damaged, or an array claims more bytes than the file can hold.
    """
    found = {}
    try:
        with path.open("rb") as file:
            order = BYTE_ORDERS[file.read(HEADER)[-4:]]
            at, size = HEADER, path.stat().st_size
            while at < size:
                file.seek(at)
                kind, held = struct.unpack(order + "II", file.read(8))
                if kind == 0:
                    raise _damaged(path, "zeros stand where a variable should begin")
                if at + 8 + held > size:
                    raise _damaged(path, f"it ends {at + 8 + held - size} bytes too early")
                variable = _variable(path, file, order, kind, (at + 8, held))
                if variable is not None and variable.name:
                    found[variable.name] = variable
                at += 8 + held
    except OSError as error:
        raise SepiError(f"{path}: cannot be read ({error.strerror})") from error
    except struct.error as error:
        raise _damaged(path, "it is cut off or garbled") from error
    except (KeyError, ValueError, zlib.error) as error:
        raise _damaged(path, str(error)) from error
    return found


def read_variable(path: Path, variable: Variable) -> Array:
    """Values of a variable, of the type and in the order of axes that MATLAB shows.

    Raises
    ------
    SepiError
        If the file cannot be read or its compressed values are damaged.
    """
    try:
        if variable.compressed:
            with path.open("rb") as file:
                file.seek(variable.at)
                content = _unpacked(path, file.read(variable.held), variable.element)
            count = math.prod(variable.shape)
            values: Array = np.frombuffer(content, variable.stored, count, variable.start)
            values = values.reshape(variable.shape, order="F")
        else:
            # mapped: only the views in use are read
            values = np.memmap(path, variable.stored, "r", variable.at + variable.start, variable.shape, "F")
    except OSError as error:
        raise SepiError(f"{path}: cannot be read ({error.strerror})") from error
    except (ValueError, zlib.error) as error:
        raise _damaged(path, str(error)) from error
    return values if values.dtype.newbyteorder("=") == variable.kind else values.astype(variable.kind)


def _variable(path: Path, file: IO[bytes], order: str, kind: int, place: tuple[int, int]) -> Variable | None:
    """The variable of a top-level element at the place (start, length) in the file; None if it is no array."""
    at, held = place
    if kind == _COMPRESSED:
        head = zlib.decompressobj().decompress(file.read(min(held, 2 * _PREFIX)), _PREFIX)
        kind, element = struct.unpack_from(order + "II", head)
        # from here on as if the matrix's tag were part of it
        element, begin, limit = element + 8, 8, held * DEFLATE_RATIO
    else:
        head = file.read(min(held, _PREFIX))
        element, begin, limit = held, 0, held
    if kind != _MATRIX:
        return None
    flags_kind, flags_at, _, dimensions_tag = _tag(order, head, begin)
    flags = struct.unpack_from(order + "I", head, flags_at)[0]
    if flags_kind != _UINT32:
        raise ValueError("a variable without flags")
    if flags & 0xFF not in _CLASSES or flags & (_COMPLEX | _LOGICAL):
        return None
    dimensions_kind, dimensions_at, length, name_tag = _tag(order, head, dimensions_tag)
    name_kind, name_at, name_length, values_tag = _tag(order, head, name_tag)
    values_kind, start, nbytes, _ = _tag(order, head, values_tag)
    if (dimensions_kind, name_kind) != (_INT32, _INT8) or values_kind not in _STORED:
        raise ValueError("a variable without dimensions, name or values")
    name = head[name_at : name_at + name_length].decode("latin-1")
    shape = struct.unpack_from(f"{order}{length // 4}i", head, dimensions_at)
    if not name.isprintable():
        raise ValueError("a variable's name is garbled")
    stored = np.dtype(order + _STORED[values_kind])
    if min(shape, default=-1) < 0 or math.prod(shape) * stored.itemsize != nbytes:
        raise _damaged(path, f"'{name}' of shape {shape} has {nbytes} bytes of values")
    if not (start + nbytes <= element <= limit):
        raise _damaged(path, f"'{name}' of shape {shape} cannot lie in {held} bytes")
    compressed = begin > 0
    return Variable(name, shape, np.dtype(_CLASSES[flags & 0xFF]), stored, start, element, at, held, compressed)


def _tag(order: str, head: bytes, at: int) -> tuple[int, int, int, int]:
    """Type of the element at ``at``, where its data begin, their bytes, and where the next element begins."""
    word, length = struct.unpack_from(order + "II", head, at)
    if word >> 16:
        # up to four bytes of data stand in the tag itself
        return word & 0xFFFF, at + 4, word >> 16, at + 8
    return word, at + 8, length, at + 8 + -(-length // 8) * 8


def _unpacked(path: Path, data: bytes, size: int) -> bytes:
    """A compressed element of ``size`` bytes; its checksum is verified."""
    unpacker = zlib.decompressobj()
    content = unpacker.decompress(data, size)
    # the checksum comes after the last byte
    if len(content) != size or unpacker.decompress(unpacker.unconsumed_tail, 1) or not unpacker.eof:
        raise _damaged(path, f"a compressed variable has not the {size} bytes it says")
    return content


def _damaged(path: Path, reason: str) -> SepiError:
    return SepiError(f"{path}: damaged MATLAB file: {reason}")
