"""Error bars that a file of finished maps holds beside the disparity, where it holds any."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from sepi.errors import SepiError
from sepi.io.hdf5 import open_hdf5, read_dataset
from sepi.io.origin import RESULT
from sepi.stage import ERROR_BARS, StageMaps


def read_error_bars(path: Path) -> StageMaps | None:
    """Disparity, confidence and error bars of one view; None where there are no error bars, or nothing but a map.

    Parameters
    ----------
    path : Path
        What :func:`sepi.io.disparity_maps.read_disparity` reads.

    Raises
    ------
    SepiError
        If the file is damaged.
    """
    path = path / RESULT if path.is_dir() else path
    if path.suffix.lower() not in (".h5", ".hdf5") or not path.is_file():
        return None
    with open_hdf5(path) as file:
        names = ("disparity", "confidence", *ERROR_BARS)
        if not all(name in file for name in names) or file["disparity"].ndim != 2:
            return None
        disparity, confidence, *bars = (read_dataset(path, file[name]).astype(np.float32) for name in names)
    if {values.shape for values in bars} != {disparity.shape} or confidence.shape != disparity.shape:
        raise SepiError(f"{path}: damaged: error bars {bars[0].shape} do not fit the disparity {disparity.shape}")
    return StageMaps(disparity, confidence, dict(zip(ERROR_BARS, bars, strict=True)))
