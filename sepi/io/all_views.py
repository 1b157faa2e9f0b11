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
from sepi.io.disparity_maps import read_disparity, read_error_bars
from sepi.io.provenance import Origin, read_origin
from sepi.io.result_files import ALL_VIEWS
from sepi.io.result_folder import Result, read_result
from sepi.lightfield import FloatMap, LightField
from sepi.process.interrupts import interruptibly
from sepi.stage import ERROR_BARS, StageMaps

View = tuple[int, int]
_Maps = Mapping[str, npt.NDArray[Any]]
_Attributes = Mapping[str, hdf5.Attribute]

_KIND = "file of maps of all views, of this version of 'sepi depth --all-views'"
# dataset that only this kind of file has
_MARK = "extended"
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


def read_result_at(path: Path, view: View | None = None) -> Result:
    """Result of one view.

    Parameters
    ----------
    path : Path
        Folder of a result, its ``result.h5``, or a file of maps of all views.
    view : (int, int), optional
        Row and column in the grid; default: the result's own view. In other views, pixels that no map shows and pixels
        of confidence 0 are unknown.

    Raises
    ------
    SepiError
        If the file has no map of this view, or is damaged.
    """
    file_path = _file_of(path, view)
    if file_path is not None:
        return _read_view(file_path, view)
    result, origin = read_result(path), read_origin(path)
    if view is not None and (origin is None or origin.view != view):
        own = "" if origin is None else " {},{}".format(*origin.view)
        raise SepiError(f"{path}: holds the map of view{own} alone; 'sepi depth --all-views' makes those of all")
    return result


def read_disparity_at(path: Path, view: View | None) -> FloatMap:
    """Disparity map, (H, W) float32: that of ``view`` if the file has maps of all views, else the only one."""
    return read_disparity(path) if _file_of(path, view) is None else read_result_at(path, view).disparity


def read_error_bars_at(path: Path, view: View | None) -> StageMaps | None:
    """The map of :func:`read_disparity_at` with its confidence and error bars; None if there are none."""
    if _file_of(path, view) is None:
        return read_error_bars(path)
    result = read_result_at(path, view)
    if result.sigma is None:
        return None
    return StageMaps(result.disparity, result.confidence, {name: getattr(result, name) for name in ERROR_BARS})


def read_origin_at(path: Path, view: View | None) -> Origin | None:
    """Light field that a map was made from, as its file records it; for ``view`` if the file has maps of all views."""
    file_path = _file_of(path, view)
    origin = read_origin(file_path or path)
    if origin is None or file_path is None:
        return origin
    return replace(origin, view=view or origin.view, picture=read_result_at(path, view).picture)


def surfaces_of(path: Path, name: str = "disparity") -> Callable[[View], FloatMap] | None:
    """Function from a view to its map, (H, W) float32, NaN where unknown; None without maps of all views.

    Parameters
    ----------
    path : Path
        As for :func:`read_result_at`.
    name : str
        ``"disparity"`` or ``"sigma"``.
    """
    file_path = _file_of(path, (0, 0))
    if file_path is None:
        return None

    # check once, not for each view
    with hdf5.open_hdf5(file_path, _KIND) as file:
        if name not in file:
            return None

    def surface(view: View) -> FloatMap:
        result = _read_view(file_path, view, check=False)
        return np.where(result.unknown, np.float32(np.nan), getattr(result, name))

    return surface


def _file_of(path: Path, view: View | None) -> Path | None:
    """The file of maps of all views; None: the map of a result's own view, or of another program."""
    path = path / ALL_VIEWS if path.is_dir() and view is not None else path
    # reading reports a damaged file
    return path if hdf5.has_dataset(path, _MARK, if_damaged=True) else None


def _read_view(file_path: Path, view: View | None, check: bool = True) -> Result:
    """Maps of a view; ``check=False`` does not read the whole file for its digest."""
    with hdf5.open_hdf5(file_path, _KIND, check) as file:
        position = _position(file_path, file, view)
        baseline = hdf5.read_dataset(file_path, file["baselines"])[position]
        down, across = (baseline + hdf5.attribute(file, "from_centre")).tolist()
        rig = hdf5.read_rig(file)
        maps = hdf5.float_maps(file_path, file, position)
        extended, picture = (hdf5.read_dataset(file_path, file[name], position) for name in (_MARK, "picture"))
        unknown = extended.astype(bool) | (maps["confidence"] == 0)
        rig = None if rig is None else rig.seen_from(baseline)
        scene, camera = str(hdf5.attribute(file, "scene")), hdf5.read_camera(file)
        return Result(scene, picture, **maps, unknown=unknown, camera=camera, from_centre=(down, across), rig=rig)


def _position(path: Path, file: h5py.File, view: View | None) -> View:
    """Row and column of a present view; default: the reference view."""
    t, s = map(int, hdf5.attribute(file, "view_position")) if view is None else view
    present = hdf5.read_dataset(path, file["present"])
    rows, columns = present.shape
    if not (0 <= t < rows and 0 <= s < columns and present[t, s]):
        raise SepiError(f"{path}: has no view {t},{s}; there are {present.sum()} of {rows}x{columns}, counted from 0")
    return t, s


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
