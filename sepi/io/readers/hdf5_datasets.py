"""The arrays in HDF5 files of other programs, MATLAB's of version 7.3 among them.

MATLAB stores the axes in reverse, structures as groups, and a cell array as references to its cells.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import h5py
import numpy as np

from sepi.io.hdf5 import attribute, open_hdf5, read_dataset
from sepi.io.readers.arrays import Array, is_likely
from sepi.io.readers.named_arrays import Shapes
from sepi.io.readers.view_files import MAX_VIEWS

MATLAB = b"MATLAB 7.3 MAT-file"
"""First bytes of a file of MATLAB's."""

_CLASS = "MATLAB_class"
# other classes are text, logical values, ...
_NUMBERS = ("uint8", "int8", "uint16", "int16", "uint32", "int32", "single", "uint64", "int64", "double")
_CELL, _MOST_CELLS = "cell", 8 * MAX_VIEWS


def array_shapes(path: Path, check: bool = True) -> Shapes:
    """Shape and type of each array of numbers; those in groups only where none outside of them may be a light field.

    Values are not read; unchecked, nor is the whole file for its digest.
    """
    found: dict[str, tuple[tuple[int, ...], np.dtype[Any]]] = {}
    with open_hdf5(path, check=check) as file:

        def take(name: str, entry: object) -> None:
            # what cells refer to lies in such groups
            if not name.startswith("#") and (cells := _cells(entry)):
                found[name] = (*_outer(entry), *cells[0].shape[:: _turn(path, cells[0])]), cells[0].dtype

        for name in file:
            take(name, file.get(name))
        if not any(is_likely(shape) for shape, _ in found.values()):
            file.visititems(take)
    return found


def read_named(path: Path, name: str) -> Array:
    """One of the arrays that :func:`array_shapes` found."""
    with open_hdf5(path) as file:
        cells = _cells(file[name])
        arrays = [read_dataset(path, cell).transpose([*range(cell.ndim)][:: _turn(path, cell)]) for cell in cells]
        return arrays[0] if len(arrays) == 1 else np.stack(arrays).reshape(*_outer(file[name]), *arrays[0].shape)


def _cells(entry: Any) -> list[h5py.Dataset]:
    """The array of numbers that an entry is, or those of the cells of a cell array if they are alike; else none."""
    if not isinstance(entry, h5py.Dataset) or entry.shape is None:
        return []
    if entry.dtype != h5py.ref_dtype:
        return [entry] if _is_numbers(entry) else []
    if _class(entry) != _CELL or not entry.nbytes <= entry.id.get_storage_size() <= _MOST_CELLS:
        return []
    try:
        cells = [entry.file[reference] for reference in entry[()].T.ravel()]
    except ValueError:
        # a reference to nothing
        return []
    alike = all(map(_is_numbers, cells)) and len({(cell.shape, cell.dtype) for cell in cells}) == 1
    return cells if alike else []


def _outer(entry: Any) -> tuple[int, ...]:
    """The axes of a cell array as MATLAB shows them, without those of one."""
    return tuple(n for n in entry.shape[::-1] if n > 1) if entry.dtype == h5py.ref_dtype else ()


def _turn(path: Path, dataset: h5py.Dataset) -> int:
    """-1 where the axes are in reverse, as MATLAB writes them; other programs do not."""
    with path.open("rb") as file:
        return -1 if _CLASS in dataset.attrs or file.read(len(MATLAB)) == MATLAB else 1


def _class(entry: h5py.Dataset) -> str:
    return str(attribute(entry, _CLASS)) if _CLASS in entry.attrs else ""


def _is_numbers(entry: Any) -> bool:
    held = isinstance(entry, h5py.Dataset) and entry.shape is not None and entry.dtype.kind in "iuf"
    return held and _class(entry) in ("", *_NUMBERS)
