"""Files of a result: their names, and checks of the folder and of the maps before they are written."""

from __future__ import annotations

import os
import re
from contextlib import nullcontext, suppress
from pathlib import Path

import numpy as np

from sepi.errors import SepiError
from sepi.io.files import remove_files
from sepi.io.provenance import RESULT, read_origin
from sepi.lightfield import LightField
from sepi.stage import ERROR_BARS, HIGH, LOW, SIGMA, StageMaps
from sepi.validation import require_type

_MAPS = ("disparity.pfm", "disparity.npy", "disparity_16bit.png", "disparity.png", "confidence.png")
RESULT_FILES = (*_MAPS, "points.ply", RESULT)
"""Files that :func:`write_result` always writes; masks, depth and error bars depend on the maps."""

RUNTIME = "runtime.txt"
"""Run time in seconds, if it is given."""

ALL_VIEWS = "all_views.h5"
"""Maps of all views, which an extension writes on request."""

_SOME = (RUNTIME, ALL_VIEWS, "depth.pfm", "depth_sigma.pfm", "sigma.pfm", "sigma.png", "interval.npz")

AS_TAKEN = ("original_disparity", "original_depth", "original_sigma")
"""Maps at the pixels of the image as a calibrated camera took it; names end with ``_T_S`` for other views."""

MASK_NAME = r"[\w-]+"
"""Regular expression of the name of a mask."""

# most files that a message names
_LISTED = 3


def require_own(folder: Path, light_field: LightField, *, force: bool = False) -> frozenset[str]:
    """Names of the files that an earlier result of this light field wrote to ``folder``, if one may be written there.

    Raises
    ------
    SepiError
        As :func:`require_target`. Unless ``force``, also if the folder holds anything but an earlier result of this
        light field, or a file with the name of a result's file that no result wrote.
    """
    require_target(folder)
    there = sorted(path.name for path in folder.iterdir() if path.name[0] != ".") if folder.is_dir() else []
    origin = None
    # force also replaces a damaged result
    with suppress(SepiError) if force else nullcontext():
        origin = read_origin(folder)
    # a forged record must not name files outside this folder
    files = frozenset() if origin is None else frozenset(filter(is_results_name, origin.files or RESULT_FILES))
    others = [name for name in there if name not in files and (origin is None or is_results_name(name))]
    if force:
        return files
    advice = "choose another folder, or overwrite it with --force (in Python force=True)"
    if others:
        listed = ", ".join(others[:_LISTED]) + (", ..." if len(others) > _LISTED else "")
        raise SepiError(f"{folder}: holds files that no earlier result wrote ({listed}); {advice}")
    if origin is not None and not origin.is_of(light_field):
        other = origin.source or origin.scene
        raise SepiError(f"{folder}: holds the result of another light field ({other}); {advice}")
    return files


def remove_result(folder: Path) -> None:
    """Remove all files with names of a result's files from a folder that is known to hold only these."""
    if folder.is_dir():
        remove_files(folder, [path.name for path in folder.iterdir() if is_results_name(path.name)])


def require_target(folder: Path) -> None:
    """Raise unless this folder can be made or written to; a check before a long computation.

    Raises
    ------
    SepiError
        If ``folder`` is a file or holds a light field, or it or its nearest existing parent is not a writable folder.
    """
    if folder.exists() and not folder.is_dir():
        raise SepiError(f"{folder}: is a file; expected a folder to write to")
    existing = next(path for path in (folder, *folder.absolute().parents) if path.exists())
    if not existing.is_dir() or not os.access(existing, os.W_OK | os.X_OK):
        raise SepiError(f"{folder}: cannot be written ({existing} is not a writable folder)")
    # the result's masks would replace those of the scene, which have the same names
    if folder.is_dir() and any(folder.glob("input_Cam*.png")):
        raise SepiError(f"{folder}: holds the views of a light field; choose another folder for the result")


def is_results_name(name: str) -> bool:
    """Whether a result may have a file of this name."""
    numbered = rf"mask_{MASK_NAME}\.png|({'|'.join(AS_TAKEN)})(_\d+_\d+)?\.pfm"
    return name in RESULT_FILES or name in _SOME or bool(re.fullmatch(numbered, name))


def names_as_taken(position: tuple[int, int] | None = None, *, with_sigma: bool = False) -> tuple[str, ...]:
    """Names of the maps in the image as a calibrated camera took it; default: of the result's own view."""
    names = AS_TAKEN if with_sigma else AS_TAKEN[:-1]
    return tuple("_".join([name, *map(str, position or ())]) + ".pfm" for name in names)


def names_of_others(light_field: LightField, *, with_sigma: bool = False) -> tuple[str, ...]:
    """The names of :func:`names_as_taken` for all views but the reference view; empty without a rig."""
    if light_field.camera is None or light_field.rig is None:
        return ()
    places = [(int(t), int(s)) for t, s in np.argwhere(light_field.present)]
    others = [place for place in places if place != light_field.reference_position]
    return tuple(name for place in others for name in names_as_taken(place, with_sigma=with_sigma))


UNKNOWN = "unknown"
"""Mask of the pixels for whose depth no view has evidence."""

# rounding by float32, relative and in pixels per view step, of disparities converted from other view steps
_ROUNDING = 1e-5


def sound_maps(light_field: LightField, maps: StageMaps) -> StageMaps:
    """Checked maps, with disparity, confidence and error bars as float32.

    Parameters
    ----------
    light_field : LightField
        The light field of the maps.
    maps : StageMaps

    Returns
    -------
    StageMaps

    Raises
    ------
    SepiError
        If a map does not have the light field's shape or holds no numbers, the confidence leaves 0..1, or the error
        bars are not valid: one of the three is missing, a standard deviation is negative, or an interval does not hold
        the disparity.
    """
    name, numbers = light_field.name, ("disparity", "confidence", *ERROR_BARS)
    for key, values in maps.all().items():
        require_type(f"{name}: map '{key}'", values, np.ndarray, "an array")
        kinds = {**dict.fromkeys(numbers, "fiu"), UNKNOWN: "b"}.get(key, "bfiu")
        if values.dtype.kind not in kinds:
            expected = "bool" if kinds == "b" else "numbers"
            raise SepiError(f"{name}: map '{key}': expected {expected}, got {values.dtype}")
        if values.shape != light_field.shape:
            raise SepiError(f"{name}: maps must have the views' shape {light_field.shape}, got {key} of {values.shape}")
        if values.dtype == bool and not re.fullmatch(MASK_NAME, key):
            raise SepiError(f"{name}: map '{key}': expected a name of letters, digits, '-' and '_'")
    if np.isnan(maps.confidence).all():
        raise SepiError(f"{name}: confidence must lie within 0..1, got NaN everywhere")
    known = maps.confidence
    if ((known < 0) | (known > 1)).any():
        raise SepiError(f"{name}: confidence must lie within 0..1, got {np.nanmin(known):g} to {np.nanmax(known):g}")
    _require_error_bars(name, maps)
    single = {key: values.astype(np.float32, copy=False) for key, values in maps.all().items() if key in numbers}
    return maps.updated(**single)


def _require_error_bars(name: str, maps: StageMaps) -> None:
    """Raise if the maps have error bars that are not valid."""
    given = [key for key in ERROR_BARS if key in maps.extra]
    if not given:
        return
    if len(given) < len(ERROR_BARS):
        raise SepiError(f"{name}: error bars are the maps sigma, low and high, got only {' and '.join(given)}")
    sigma, low, high = (maps.extra[key].astype(np.float64) for key in (SIGMA, LOW, HIGH))
    told, disparity = np.isfinite(maps.disparity), maps.disparity.astype(np.float64)
    slack = _ROUNDING * (1 + np.abs(np.where(told, disparity, 0)))
    sound = {
        "sigma must be finite and not negative": np.isfinite(sigma) & (sigma >= 0),
        "low must be no more than high": low <= high,
        # an unknown pixel has the whole range as its interval, and its disparity is a guess
        "low and high must enclose the disparity": maps.mask(UNKNOWN)
        | ((low - slack <= disparity) & (disparity <= high + slack)),
    }
    for what, holds in sound.items():
        for y, x in np.argwhere(told & ~holds)[:1]:
            got = f"sigma {sigma[y, x]:g}, low {low[y, x]:g}, high {high[y, x]:g} at {y},{x}"
            raise SepiError(f"{name}: {what}, got {got}")
