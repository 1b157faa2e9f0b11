"""The file of the maps of all views, written view by view, since all maps may exceed the memory."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import numpy.typing as npt

from sepi.io import hdf5
from sepi.lightfield import LightField
from sepi.process.interrupts import interruptibly
from sepi.stage import ERROR_BARS

View = tuple[int, int]
_Maps = Mapping[str, npt.NDArray[Any]]
_Attributes = Mapping[str, hdf5.Attribute]

_MISSING = dict.fromkeys(("disparity", *ERROR_BARS), np.nan)


def write_all_views(
    path: Path, light_field: LightField, views: Iterable[tuple[View, _Maps]], attributes: _Attributes
) -> None:
    """Write the maps of all views, whole or not at all; equal content gives equal bytes.

    The file holds a dataset ``(T, S, H, W)`` for each name, the views as ``picture (T, S, H, W, C)``, and where the
    views stand: ``present (T, S)`` bool, and ``baselines (T, S, 2)``, down and across from the reference view in view
    steps, NaN for missing views.

    Parameters
    ----------
    path : Path
    light_field : LightField
        The light field of the maps.
    views : iterable of ((int, int), mapping of str to ndarray of shape (H, W))
        Position in the grid, and maps by name; every view has the same names. For views that are not given, disparity
        and error bars are NaN and everything else is 0.
    attributes : mapping
        What made the maps.

    Raises
    ------
    SepiError
        If the file cannot be written.
    """
    with hdf5.create_hdf5(path) as file:
        present = light_field.present
        baselines = np.where(present[..., None], light_field.baselines, np.nan)
        hdf5.put(file, "present", present)
        hdf5.put(file, "baselines", baselines, axes="t s (down, across)")
        file.attrs.update(attributes)
        file.attrs["view_position"] = light_field.reference_position
        for position, maps in interruptibly(views):
            for name, values in {**maps, "picture": light_field.views[position]}.items():
                _dataset(file, name, light_field.grid, values)[position] = values


def _dataset(file: h5py.File, name: str, grid: tuple[int, int], values: npt.NDArray[Any]) -> h5py.Dataset:
    """Dataset for values of this shape for each view, made at first use; missing views take no room in it."""
    if name not in file:
        # small types compress well, as in stage files
        packed = hdf5.PACKED if values.dtype.itemsize < 4 else {}
        shape, chunks = (*grid, *values.shape), (1, 1, *values.shape)
        file.create_dataset(name, shape, values.dtype, chunks=chunks, fillvalue=_MISSING.get(name), **packed)
        file[name].attrs["axes"] = "t s y x" if values.ndim == 2 else "t s y x channel"
        if name in hdf5.UNITS:
            file[name].attrs["units"] = hdf5.UNITS[name]
    return file[name]
