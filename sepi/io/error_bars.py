"""Error bars that a file of finished maps holds beside the disparity, where it holds any."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from sepi.errors import SepiError
from sepi.io.hdf5 import open_hdf5, read_dataset
from sepi.io.result_files import ALL_VIEWS
from sepi.stage import ERROR_BARS, StageMaps

_RESULT = "result.h5"


def read_error_bars(path: Path, view: tuple[int, int] | None = None) -> StageMaps | None:
    """Disparity, confidence and error bars; None where there are no error bars, or nothing but a map.

    Parameters
    ----------
    path : Path
        What :func:`sepi.io.all_views.read_disparity_at` reads.
    view : (int, int), optional
        Row and column in the grid, as it takes them.

    Raises
    ------
    SepiError
        If the file is damaged.
    """
    if path.is_dir():
        path /= _RESULT if view is None or not (path / ALL_VIEWS).is_file() else ALL_VIEWS
    if path.suffix.lower() not in (".h5", ".hdf5") or not path.is_file():
        return None
    with open_hdf5(path) as file:
        names = ("disparity", "confidence", *ERROR_BARS)
        if not all(name in file for name in names) or (view is None and file["disparity"].ndim != 2):
            return None
        # of maps of all views, one
        part = view if view is not None and file["disparity"].ndim == 4 else ...
        disparity, confidence, *bars = (read_dataset(path, file[name], part).astype(np.float32) for name in names)
    if {values.shape for values in bars} != {disparity.shape} or confidence.shape != disparity.shape:
        raise SepiError(f"{path}: damaged: error bars {bars[0].shape} do not fit the disparity {disparity.shape}")
    return StageMaps(disparity, confidence, dict(zip(ERROR_BARS, bars, strict=True)))
