"""The folder of final maps: numbers for programs, pictures for people."""

from __future__ import annotations

import os
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import numpy.typing as npt

from sepi.errors import SepiError
from sepi.io.files import atomic_folder
from sepi.io.hdf5 import Attribute, write_stage
from sepi.io.images import write_png
from sepi.io.pfm import write_pfm
from sepi.lightfield import FloatMap, LightField
from sepi.stage import StageMaps

RESULT_FILES = ("disparity.pfm", "result.h5", "disparity.png", "confidence.png")
"""What :func:`write_result` writes."""

# part of the pixels beyond each end of the colour scale, so that a few wrong pixels do not use it up
_BEYOND = 0.005


def write_result(
    folder: Path, light_field: LightField, maps: StageMaps, attributes: Mapping[str, Attribute]
) -> tuple[str, ...]:
    """Write the maps of a light field.

    ``disparity.pfm`` and ``result.h5`` hold the numbers (pixels per view step; the HDF5 file also the confidence, the
    maps of all stages and ``attributes``), ``disparity.png`` is coloured from far (dark blue) to near (yellow),
    ``confidence.png`` is black (0) to white (1). Equal content gives equal bytes. A new folder appears whole or not at
    all; in an existing one each file is replaced at once, and others are left alone.

    Parameters
    ----------
    folder : Path
        Made where it does not exist.
    light_field : LightField
        Where the maps come from.
    maps : StageMaps
        Of the light field's shape.
    attributes : mapping
        What made the maps.

    Returns
    -------
    tuple of str
        Names of the files written.

    Raises
    ------
    SepiError
        If the maps are not of the light field's shape, or the folder is a file or cannot be written.
    """
    if maps.disparity.shape != light_field.shape:
        raise SepiError(
            f"{light_field.name}: maps must have the views' shape {light_field.shape}, got {maps.disparity.shape}"
        )
    require_target(folder)
    if folder.is_dir() and any(folder.iterdir()):
        _write_files(folder, maps, attributes)
    else:
        with atomic_folder(folder) as temporary:
            _write_files(temporary, maps, attributes)
    return RESULT_FILES


def require_target(folder: Path) -> None:
    """Raise unless a folder of this name can be made or written to; for telling before a long computation.

    Raises
    ------
    SepiError
        If ``folder`` is a file, or it or its nearest existing parent is not a writable folder.
    """
    if folder.exists() and not folder.is_dir():
        raise SepiError(f"{folder}: is a file; expected a folder to write to")
    existing = next(path for path in (folder, *folder.absolute().parents) if path.exists())
    if not existing.is_dir() or not os.access(existing, os.W_OK | os.X_OK):
        raise SepiError(f"{folder}: cannot be written ({existing} is not a writable folder)")


def coloured(values: FloatMap) -> npt.NDArray[np.uint8]:
    """A map (H, W) in perceptually uniform colours, (H, W, 3) RGB; black where it is not finite."""
    finite = np.isfinite(values)
    low, high = np.quantile(values[finite], (_BEYOND, 1 - _BEYOND)) if finite.any() else (0.0, 0.0)
    # a constant map gets the middle colour
    unit = (values - low) / (high - low) if high > low else np.full(values.shape, 0.5)
    levels = _levels(np.where(finite, unit, 0))
    colours = np.asarray(cv2.applyColorMap(levels, cv2.COLORMAP_VIRIDIS), np.uint8)[:, :, ::-1].copy()
    colours[~finite] = 0
    return colours


def _write_files(folder: Path, maps: StageMaps, attributes: Mapping[str, Attribute]) -> None:
    write_pfm(folder / "disparity.pfm", maps.disparity)
    write_stage(folder / "result.h5", maps, attributes)
    write_png(folder / "disparity.png", coloured(maps.disparity))
    write_png(folder / "confidence.png", _levels(maps.confidence))


def _levels(unit: npt.NDArray[np.floating[Any]]) -> npt.NDArray[np.uint8]:
    """0..1 as 0..255; not finite as 0."""
    known = np.nan_to_num(unit, posinf=0, neginf=0)
    return np.asarray(np.rint(255 * np.clip(known, 0, 1)), np.uint8)
