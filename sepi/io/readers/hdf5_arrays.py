"""HDF5 files of other programs: an array of any name, at the root or in groups."""

from __future__ import annotations

import functools
from pathlib import Path

from sepi.errors import SepiError
from sepi.io.hdf5 import has_dataset, is_own
from sepi.io.readers.arrays import is_likely
from sepi.io.readers.named_arrays import hdf5_shapes, light_field_from_arrays, read_hdf5
from sepi.io.readers.options import ReadOptions
from sepi.lightfield import LightField


def matches(path: Path) -> bool:
    """Whether ``path`` is an HDF5 file of another program, with an array that may be a light field."""
    try:
        return has_dataset(path, "/", lambda root: not is_own(root)) and any(
            is_likely(shape) for shape, _ in hdf5_shapes(path).values()
        )
    except SepiError:
        return False


def read(path: Path, options: ReadOptions) -> LightField:
    """Light field from the array ``options.variable``; default: the array that can be a light field."""
    return light_field_from_arrays(path, hdf5_shapes(path), options, functools.partial(read_hdf5, path))
