"""The file of the maps of all views, written and read view by view, since all maps may exceed the memory."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import numpy.typing as npt

from sepi.errors import SepiError
from sepi.io import hdf5
from sepi.io.disparity_maps import read_disparity
from sepi.io.provenance import RESULT, Origin, read_origin
from sepi.io.result_folder import all_views_file, place_in, read_result
from sepi.lightfield import FloatMap, LightField
from sepi.process.interrupts import interruptibly
from sepi.stage import ERROR_BARS, StageMaps

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


def read_disparity_at(path: Path, view: View | None) -> FloatMap:
    """Disparity map, (H, W) float32: that of ``view`` if the file has maps of all views, else the only one."""
    return read_disparity(path) if all_views_file(path, view) is None else read_result(path, view).disparity


def read_error_bars_at(path: Path, view: View | None = None) -> StageMaps | None:
    """The map of :func:`read_disparity_at` with its confidence and error bars; None if the file has none.

    Raises
    ------
    SepiError
        If the file is damaged.
    """
    path = all_views_file(path, view) or (path / RESULT if path.is_dir() else path)
    if not hdf5.has_dataset(path, "/", {"disparity", "confidence", *ERROR_BARS}.issubset, if_damaged=True):
        return None
    with hdf5.open_hdf5(path) as file:
        maps = hdf5.float_maps(path, file, place_in(path, file, view))
    if maps["disparity"].ndim != 2:
        return None
    if len({values.shape for values in maps.values()}) > 1:
        raise SepiError(f"{path}: damaged: error bars {maps[ERROR_BARS[0]].shape} do not fit the disparity")
    return StageMaps(maps.pop("disparity"), maps.pop("confidence"), maps)


def read_origin_at(path: Path, view: View | None) -> Origin | None:
    """Light field that a map was made from, as its file records it; for ``view`` if the file has maps of all views."""
    file_path = all_views_file(path, view)
    origin = read_origin(file_path or path)
    if origin is None or file_path is None:
        return origin
    return replace(origin, view=view or origin.view, picture=read_result(path, view).picture)


def surfaces_of(path: Path, name: str = "disparity") -> Callable[[View], FloatMap] | None:
    """Function from a view to its map, (H, W) float32, NaN where unknown; None without maps of all views.

    Parameters
    ----------
    path : Path
        As for :func:`sepi.read_result`.
    name : str
        ``"disparity"`` or ``"sigma"``.
    """
    if all_views_file(path, (0, 0)) is None or getattr(read_result(path), name) is None:
        return None

    def surface(view: View) -> FloatMap:
        result = read_result(path, view)
        return np.where(result.unknown, np.float32(np.nan), getattr(result, name))

    return surface


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
