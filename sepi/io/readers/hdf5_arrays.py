"""HDF5 files of other programs: an array of any name, at the top or in groups."""

from __future__ import annotations

from pathlib import Path

import h5py

from sepi.errors import SepiError
from sepi.io.hdf5 import open_hdf5, read_dataset
from sepi.io.readers.arrays import Array
from sepi.io.readers.named_arrays import Shapes, datasets_in, light_field_from_arrays
from sepi.io.readers.options import ReadOptions
from sepi.lightfield import LightField

# of files of this package, with light fields and with maps
_OWN = ("views", "disparity")


def matches(path: Path) -> bool:
    """Whether ``path`` is an HDF5 file with an array of 4 or 5 axes that is none of this package's."""
    if not path.is_file() or not h5py.is_hdf5(path):
        return False
    try:
        with h5py.File(path, "r") as file:
            own = any(name in file for name in _OWN)
        return not own and any(len(shape) in (4, 5) for shape, _ in array_shapes(path).values())
    except (SepiError, OSError, LookupError, ValueError, RuntimeError):
        return False


def read(path: Path, options: ReadOptions) -> LightField:
    """Read the array ``options.variable`` of such a file; without it, what can be a light field."""

    def load(name: str) -> Array:
        with open_hdf5(path) as file:
            return read_dataset(path, file[name])

    return light_field_from_arrays(path, array_shapes(path), options, load)


def array_shapes(path: Path) -> Shapes:
    """Shape and type of each array of numbers; values are not read."""
    with open_hdf5(path) as file:
        return {name: (array.shape, array.dtype) for name, array in datasets_in(file, _is_numbers).items()}


def _is_numbers(entry: object) -> bool:
    return isinstance(entry, h5py.Dataset) and entry.dtype.kind in "iuf" and entry.shape is not None
