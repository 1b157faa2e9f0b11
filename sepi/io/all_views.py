"""The file of the maps of all views, written one view after the other: all of them may be more than memory holds."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import numpy.typing as npt

from sepi.io.hdf5 import UNITS, Attribute, create_hdf5
from sepi.lightfield import LightField

_MISSING = {"disparity": np.nan}


def write_all_views(
    path: Path,
    light_field: LightField,
    views: Iterable[tuple[tuple[int, int], Mapping[str, npt.NDArray[Any]]]],
    attributes: Mapping[str, Attribute],
) -> None:
    """Write the maps of all views, whole or not at all; equal content gives equal bytes.

    The file holds a dataset ``(T, S, H, W)`` for each name, and what tells where the views stand: ``present (T, S)``
    bool, and ``baselines (T, S, 2)``, down and across from the reference view in view steps, NaN for missing views.

    Parameters
    ----------
    path : Path
    light_field : LightField
        That the maps belong to.
    views : iterable of ((int, int), mapping of str to ndarray of shape (H, W))
        Position in the grid, and maps by name, the same of every view. Of views that do not come, the disparity is NaN
        and everything else 0.
    attributes : mapping
        What made the maps.

    Raises
    ------
    SepiError
        If the file cannot be written.
    """
    with create_hdf5(path) as file:
        present = light_field.present
        file.create_dataset("present", data=present)
        file.create_dataset("baselines", data=np.where(present[..., None], light_field.baselines, np.nan))
        file["baselines"].attrs["axes"] = "t s (down, across)"
        file["baselines"].attrs["units"] = "view steps"
        for key, value in attributes.items():
            file.attrs[key] = value
        file.attrs["view_position"] = light_field.reference_position
        for position, maps in views:
            for name, values in maps.items():
                _dataset(file, name, (*light_field.grid, *light_field.shape), values.dtype)[position] = values


def _dataset(file: h5py.File, name: str, shape: tuple[int, ...], dtype: npt.DTypeLike) -> h5py.Dataset:
    """The dataset of this name, made where it is not there yet; missing views take no room in it."""
    if name not in file:
        # as in stage files: masks shrink to almost nothing, float maps hardly
        packed = {"compression": "gzip", "compression_opts": 1} if np.dtype(dtype).itemsize < 4 else {}
        chunks = (1, 1, *shape[2:])
        file.create_dataset(name, shape, dtype, chunks=chunks, fillvalue=_MISSING.get(name), **packed)
        file[name].attrs["axes"] = "t s y x"
        if name in UNITS:
            file[name].attrs["units"] = UNITS[name]
    return file[name]
