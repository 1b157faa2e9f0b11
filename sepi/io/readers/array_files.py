"""NumPy's and HDF5's files of arrays: which of them is the light field, and reading it.

A NumPy file is the array in ``.npy``, or one of the arrays in ``.npz``. In HDF5 files of other programs, the array may
have any name, at the root or in groups.
"""

from __future__ import annotations

import io
import math
import re
import warnings
import zipfile
from collections.abc import Callable, Iterator, Mapping
from contextlib import nullcontext
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import IO, Any, NamedTuple

import h5py
import numpy as np
from numpy.lib import format as npy

from sepi.errors import SepiError, printable
from sepi.io.files import DEFLATE_RATIO, reading
from sepi.io.hdf5 import has_dataset, is_own, open_hdf5, read_dataset
from sepi.io.readers.arrays import Array, is_likely, light_field_from_array
from sepi.io.readers.options import ReadOptions
from sepi.lightfield import LightField
from sepi.validation import require_known


class StoredArray(NamedTuple):
    """An array in a file: its shape and type, and what reads its values."""

    shape: tuple[int, ...]
    dtype: np.dtype[Any]
    read: Callable[[], Array]


Arrays = Mapping[str, StoredArray]
"""Name of each array in a file to the array."""

# words for the channels, long and short
_COLOURS = (("red", "green", "blue"), ("r", "g", "b"))
_STYLES = (str.lower, str.upper, str.capitalize)
# most arrays that a message names
_LISTED = 12


def light_field_of(path: Path, arrays: Arrays, options: ReadOptions) -> LightField:
    """Light field from one of a file's arrays, or from three that are its channels.

    Parameters
    ----------
    path : Path
    arrays : mapping of str to StoredArray
    options : ReadOptions
        ``variable`` names an array; for others see :func:`sepi.io.readers.arrays.light_field_from_array`.

    Raises
    ------
    SepiError
        If no array or several can be the light field, or it cannot be read.
    """
    names = _chosen(path, arrays, options.variable)
    if len(names) == 1:
        return light_field_from_array(arrays[names[0]].read(), path, options)
    if options.axes is not None:
        options = replace(options, axes=re.sub("[cC]", "", options.axes) + "C")
    channels = np.stack([arrays[name].read() for name in names], axis=-1)
    light_field = light_field_from_array(channels, path, options)
    note = f"the arrays {', '.join(map(printable, names))} are taken as red, green and blue"
    return replace(light_field, notes=(note, *light_field.notes))


def _channels_from(red: str) -> Iterator[tuple[str, ...]]:
    """Possible names of three channels with this first one: ``lfr lfg lfb``, ``LF_Red LF_Green LF_Blue``."""
    for red_word, *others in dict.fromkeys((*map(style, words),) for words in _COLOURS for style in _STYLES):
        for match in re.finditer(red_word, red):
            yield red, *(red[: match.start()] + word + red[match.end() :] for word in others)


def _chosen(path: Path, arrays: Arrays, requested: str | None) -> tuple[str, ...]:
    """Name of the array that is the light field, or names of its red, green and blue arrays.

    Unless the user chooses, it is the only array whose axes fit, or among several the only ``LF``, or three channels.
    """
    shapes = {name: one.shape for name, one in arrays.items() if one.dtype.kind in "iuf" or name == requested}
    if requested is not None:
        require_known(f"{path}: --variable", [requested], shapes)
        return (requested,)
    likely = [name for name, shape in shapes.items() if is_likely(shape)]
    # beside arrays with a grid, a stack of grey images may be anything
    fitting = [name for name in likely if len(shapes[name]) > len("NHW")] or likely
    if len(fitting) == 1:
        return (fitting[0],)
    called = [name for name in fitting if name.rpartition("/")[2] == "LF"]
    if len(called) == 1:
        return (called[0],)
    triples = [names for name in fitting for names in _channels_from(name) if set(names) <= set(fitting)]
    triples = [
        names for names in triples if len({arrays[name][:2] for name in names}) == 1 and len(shapes[names[0]]) == 4
    ]
    if len(triples) == 1:
        return triples[0]
    if fitting:
        several = _listed({name: arrays[name] for name in fitting})
        raise SepiError(f"{path}: several arrays may be the light field; choose one with --variable: {several}")
    raise SepiError(f"{path}: {no_light_field(arrays)}")


def no_light_field(arrays: Arrays) -> str:
    """Message for a file without a light field: the arrays that it holds."""
    found = _listed(arrays) or "nothing"
    return f"holds no array of numbers of 4 or 5 axes (found: {found}); for an image of all views pass --format mosaic"


def _listed(arrays: Arrays) -> str:
    return ", ".join(
        f"{printable(name)} {'x'.join(map(str, one.shape))}{'' if one.dtype.kind in 'iuf' else f' of {one.dtype}'}"
        for name, one in list(arrays.items())[:_LISTED]
    )


def as_stored(path: Path, name: str, entry: Any) -> StoredArray | None:
    """The array of an entry of an HDF5 file; None if that is not an array of numbers."""
    if isinstance(entry, h5py.Dataset) and entry.shape is not None and entry.dtype.kind in "iuf":
        return StoredArray(entry.shape, entry.dtype, partial(_hdf5_array, path, name))
    return None


def hdf5_arrays(
    path: Path, check: bool = True, stored: Callable[[Path, str, Any], StoredArray | None] = as_stored
) -> Arrays:
    """Each array of numbers; arrays in groups only if none outside may be a light field.

    No values are read; ``check=False`` does not read the whole file for its digest.
    """
    found: dict[str, StoredArray] = {}
    with open_hdf5(path, check=check) as file:

        def take(name: str, entry: object) -> None:
            if (array := stored(path, name, entry)) is not None:
                found[name] = array

        for name in file:
            take(name, file.get(name))
        if not any(is_likely(one.shape) for one in found.values()):
            file.visititems(take)
    return found


def _hdf5_array(path: Path, name: str) -> Array:
    with open_hdf5(path) as file:
        return read_dataset(path, file[name])


_NUMPY = "NumPy file"
# NumPy itself refuses longer ones
_LONGEST_HEADER = 2**14
_OBJECTS = "Python objects, which may be any program; save images as one array, numpy.stack(them)"
_HEADERS = {(1, 0): npy.read_array_header_1_0, (2, 0): npy.read_array_header_2_0}


def matches_numpy(path: Path) -> bool:
    """Whether ``path`` is a file or an archive of NumPy, by its content or its suffix ``.npy`` or ``.npz``."""
    return path.is_file() and (path.suffix.lower() in (".npy", ".npz") or bool(numpy_arrays(path)))


def numpy_arrays(path: Path) -> Arrays:
    """Each array by name; a ``.npy`` has the file's own name. No values are read."""
    found = {}
    with reading(path, _NUMPY), warnings.catch_warnings(action="ignore"), path.open("rb") as file:
        # zipfile.is_zipfile also finds what lies at an end by chance
        if file.read(4) not in (b"PK\x03\x04", b"PK\x05\x06") and file.seek(0) == 0:
            shape, kind = _form(file, path.stat().st_size)
            if kind.hasobject:
                raise SepiError(_OBJECTS)
            return {path.stem: StoredArray(shape, kind, partial(_values, path, None, kind))}
        with zipfile.ZipFile(file) as archive:
            for info in archive.infolist():
                if info.filename.endswith(".npy"):
                    _require_room(path, info)
                    name = info.filename.removesuffix(".npy")
                    with archive.open(info) as member:
                        shape, kind = _form(member, info.file_size)
                    found[name] = StoredArray(shape, kind, partial(_values, path, name, kind))
    return found


def _form(file: IO[bytes], size: int) -> tuple[tuple[int, ...], np.dtype[Any]]:
    """Shape and type of an array that can lie in so many bytes; NumPy would allocate any."""
    head = io.BytesIO(file.read(_LONGEST_HEADER))
    shape, _, kind = _HEADERS[npy.read_magic(head)](head)
    if not 0 <= math.prod(shape) * kind.itemsize <= size:
        raise ValueError(f"an array of shape {shape} cannot lie in {size} bytes")
    return shape, kind


def _values(path: Path, name: str | None, kind: np.dtype[Any]) -> Array:
    """The array of a file, memory-mapped, or that of this name in an archive."""
    with reading(path, _NUMPY), warnings.catch_warnings(action="ignore"):
        if kind.hasobject:
            raise SepiError(_OBJECTS)
        stored = np.load(path, mmap_mode="r", allow_pickle=False)
        with nullcontext(stored) if name is None else stored:
            array: Array = stored if name is None else stored[name]
        return array


def _require_room(path: Path, info: zipfile.ZipInfo) -> None:
    """Raise if a member of an archive cannot have the size that the archive states."""
    held = min(info.compress_size, path.stat().st_size)
    if info.file_size > held * (1 if info.compress_type == zipfile.ZIP_STORED else DEFLATE_RATIO):
        raise SepiError(f"damaged NumPy file: {printable(info.filename)}: {info.file_size} bytes cannot lie in {held}")


def matches_hdf5(path: Path) -> bool:
    """Whether ``path`` is an HDF5 file of another program, with an array that may be a light field."""
    others = has_dataset(path, "/", lambda root: not is_own(root))
    return others and any(is_likely(one.shape) for one in hdf5_arrays(path).values())
