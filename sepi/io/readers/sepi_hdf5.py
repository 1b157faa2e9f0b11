"""Light fields that this package wrote (:mod:`sepi.io.hdf5`), as one of the formats that are read."""

from __future__ import annotations

from pathlib import Path

from sepi.io.hdf5 import has_dataset, read_light_field
from sepi.io.readers.arrays import rearrange
from sepi.io.readers.options import ReadOptions, require_unused
from sepi.lightfield import LightField


def matches(path: Path) -> bool:
    """Whether ``path`` is an HDF5 file that may be a light field of this package: it holds views, or is damaged."""
    return has_dataset(path, "views", if_damaged=True)


def read(path: Path, options: ReadOptions) -> LightField:
    """Read a light field and arrange its views as asked for.

    Raises
    ------
    SepiError
        If the file is no such file, or the options do not fit it.
    """
    require_unused(str(path), options, ("grid", "pattern", "axes", "variable", "follow_links"))
    return rearrange(read_light_field(path), options)
