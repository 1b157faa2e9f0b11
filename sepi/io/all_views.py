"""Maps of a result's own view, or of another one from the file of the maps of all views."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

from sepi.errors import SepiError
from sepi.io import hdf5
from sepi.io.disparity_maps import read_disparity
from sepi.io.provenance import RESULT, Origin, read_origin
from sepi.io.result_folder import all_views_file, place_in, read_result
from sepi.lightfield import FloatMap
from sepi.stage import ERROR_BARS, StageMaps

View = tuple[int, int]


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
