"""Maps from anywhere, looked at before they are written."""

from __future__ import annotations

import re

import numpy as np

from sepi.errors import SepiError
from sepi.io.result_files import MASK_NAME
from sepi.lightfield import LightField
from sepi.stage import ERROR_BARS, HIGH, LOW, SIGMA, StageMaps
from sepi.validation import require_type

UNKNOWN = "unknown"
"""Mask that has a meaning in a result."""

# part of a disparity, and pixels per view step, by which float32 rounds what was counted in other view steps
_ROUNDING = 1e-5


def sound_maps(light_field: LightField, maps: StageMaps) -> StageMaps:
    """Maps that can be written: disparity, confidence and error bars of float32 whatever numbers they were.

    Parameters
    ----------
    light_field : LightField
        That they belong to.
    maps : StageMaps

    Returns
    -------
    StageMaps

    Raises
    ------
    SepiError
        If a map is not of the light field's shape or of numbers, the confidence not within 0..1, or error bars are no
        such: some of the three missing, a standard deviation negative, an interval that does not hold the disparity.
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
    """Raise unless the maps have no error bars, or such as can be."""
    given = [key for key in ERROR_BARS if key in maps.extra]
    if not given:
        return
    if len(given) < len(ERROR_BARS):
        raise SepiError(f"{name}: error bars are the maps sigma, low and high, got {' and '.join(given)} alone")
    sigma, low, high = (maps.extra[key].astype(np.float64) for key in (SIGMA, LOW, HIGH))
    told = np.isfinite(maps.disparity)
    bad = told & ~(np.isfinite(sigma) & (sigma >= 0))
    if bad.any():
        raise SepiError(f"{name}: sigma must be finite and not negative, got {sigma[bad][0]:g}")
    bad = told & ~(low <= high)
    if bad.any():
        raise SepiError(f"{name}: low must be no more than high, got {low[bad][0]:g} and {high[bad][0]:g}")
    disparity = maps.disparity.astype(np.float64)
    slack = _ROUNDING * (1 + np.abs(np.where(told, disparity, 0)))
    # what no view knows has the whole range, and a disparity that may be any
    outside = told & ~maps.mask(UNKNOWN) & ~((low - slack <= disparity) & (disparity <= high + slack))
    if outside.any():
        y, x = np.argwhere(outside)[0]
        raise SepiError(
            f"{name}: low and high must enclose the disparity, got {low[y, x]:g} to {high[y, x]:g} and "
            f"{disparity[y, x]:g} at row {y}, column {x}"
        )
