"""HDF5 files of light fields that this package wrote."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

from sepi.io.hdf5 import has_dataset, is_own, read_light_field
from sepi.io.readers.arrays import rearrange
from sepi.io.readers.options import ReadOptions
from sepi.lightfield import LightField


def matches(path: Path) -> bool:
    """Whether ``path`` is a light field of this package, or an HDF5 file too damaged to tell."""
    return has_dataset(path, "views", is_own, if_damaged=True)


def read(path: Path, options: ReadOptions) -> LightField:
    """Light field as it was written, with its views arranged as the options ask."""
    light_field = read_light_field(path)
    return rearrange(light_field if light_field.source else replace(light_field, source=str(path)), options)


def truth_files(path: Path) -> list[Path]:
    """The file itself, which may hold ground truth and masks."""
    return [path]
