"""Pixels that no view knows anything about, and what becomes of them in the final maps.

A depth map has a value everywhere. At some pixels it is a guess for which there is no evidence at all:

- regions without a signal, where the view is as dark as nothing, or at full scale, and varies no more than its noise: a
  black background, what is overexposed;
- the dark corners that a lens leaves (vignettes), which stray light may lift above black;
- pixels that hardly any other view holds: at their disparity they lie outside the others' pictures.

A bare wall is none of these: it is neither black nor overexposed, and what it borders on tells its depth.
"""

from __future__ import annotations

import cv2
import numpy as np

from sepi.image.noise import noise_level
from sepi.lightfield import BoolMap, FloatMap, LightField, full_scale
from sepi.stage import StageMaps

UNKNOWN = "unknown"
"""Name of the map."""

BLACK = 0.01
"""As dark as nothing: brightness as part of the brightest there is..."""

LENS_CORNER = 0.05
"""...and where a region holds a corner of the picture, which stray light may have lifted."""

SATURATED = 254 / 255
"""As bright as can be told."""

LEAST_SHARE = 1e-3
"""Part of the picture below which a region without a signal belongs to what surrounds it..."""

LEAST_AREA = 50
"""...and so does one of fewer pixels."""

LEAST_VIEWS = 2
"""Other views that must hold a pixel, where there are as many."""

# squared gradients are averaged over so many pixels each way; more than so many times what noise explains is a signal
_WINDOW = 5
_NOISE_FACTOR = 4.0
# white noise hardly ever exceeds so many of its standard deviations
_NOISE_REACH = 3.0
# noise beyond this part of the brightest there is would be texture
_MOST_NOISE = 0.03
# least noise: rounding of integers, in levels; of floats
_ROUNDING = 0.3
_FLOAT_ROUNDING = 1e-5


def with_unknown(light_field: LightField, maps: StageMaps) -> StageMaps:
    """A variant's final maps with the mask ``unknown``, and no confidence there; the disparity stays as it is.

    Parameters
    ----------
    light_field : LightField
    maps : StageMaps
        Of the last stage.

    Returns
    -------
    StageMaps
    """
    unknown = unknown_pixels(light_field, maps.disparity)
    return maps.updated(maps.disparity, np.where(unknown, np.float32(0), maps.confidence), **{UNKNOWN: unknown})


def unknown_pixels(light_field: LightField, disparity: FloatMap) -> BoolMap:
    """Pixels that no view knows anything about.

    Parameters
    ----------
    light_field : LightField
    disparity : ndarray, shape (H, W), float32
        Final disparity, pixels per view step.

    Returns
    -------
    ndarray, shape (H, W), bool
    """
    return without_signal(light_field) | held_by_few(light_field, disparity)


def without_signal(light_field: LightField) -> BoolMap:
    """Regions of the reference view that are black, or at full scale, with nothing above the noise; (H, W), bool."""
    view, dtype = light_field.reference_view, light_field.views.dtype
    rounding = _FLOAT_ROUNDING if dtype == np.float32 else _ROUNDING / full_scale(dtype)
    white = float(np.quantile(view.max(axis=2), 0.999))
    black = _flat_regions(view, *_dark(view, BLACK, white, rounding))
    corners = _flat_regions(view, *_dark(view, LENS_CORNER, white, rounding))
    bright = _flat_regions(view, view.min(axis=2) >= SATURATED, rounding)
    return _large(black) | _large(bright) | _large(corners, at_corners=True)


def held_by_few(light_field: LightField, disparity: FloatMap) -> BoolMap:
    """Pixels that lie, at their disparity, outside all but one of the other views; shape (H, W), bool."""
    H, W = disparity.shape
    others = light_field.present.copy()
    others[light_field.reference_position] = False
    baselines = light_field.baselines[others]
    least = min(LEAST_VIEWS, len(baselines))
    y, x = (side.ravel() for side in np.mgrid[:H, :W])
    d, held = disparity.ravel().astype(np.float64), np.zeros(H * W, np.int64)
    left = np.arange(H * W)
    # the nearest views first: they hold almost every pixel
    for down, across in baselines[np.argsort((baselines**2).sum(axis=1), kind="stable")]:
        row, column = y[left] - d[left] * down, x[left] - d[left] * across
        held[left] += (row >= -0.5) & (row <= H - 0.5) & (column >= -0.5) & (column <= W - 0.5)
        left = left[held[left] < least]
    return (held < least).reshape(H, W)


def _dark(view: FloatMap, share: float, white: float, rounding: float) -> tuple[BoolMap, float]:
    """Where a view is no brighter than a share of ``white`` and its noise, and that noise."""
    level = cv2.blur(view, (3, 3)).max(axis=2)
    noise = min(noise_level(view), _MOST_NOISE * white)
    # texture passes for noise; where it is dark there may be less of both
    dark = level <= share * white + noise
    noise = max(min(noise, noise_level(view, dark)), rounding)
    return (level <= share * white + noise) & (view.max(axis=2) <= share * white + _NOISE_REACH * noise), noise


def _flat_regions(view: FloatMap, candidates: BoolMap, noise: float) -> BoolMap:
    """The candidates in and beside windows in which the view varies no more than its noise; shape (H, W), bool."""
    # single pixels of noise neither make nor break a region
    candidates = cv2.medianBlur(candidates.astype(np.uint8), 3) > 0
    down, across = np.gradient(view, axis=(0, 1))
    energy = cv2.blur((down**2 + across**2).sum(axis=2), (_WINDOW, _WINDOW))
    # central differences halve the noise along each of the two axes; three channels
    flat = candidates & (energy < _NOISE_FACTOR * 3 * noise**2)
    # a window that reaches beyond the region is not flat, nor are its outermost pixels
    reach = np.ones((_WINDOW + 2, _WINDOW + 2), np.uint8)
    return np.asarray(candidates & (cv2.dilate(flat.astype(np.uint8), reach) > 0))


def _large(region: BoolMap, *, at_corners: bool = False) -> BoolMap:
    """The connected parts of a region that are large enough for a background, and hold a corner of the picture."""
    _, labels, figures, _ = cv2.connectedComponentsWithStats(region.astype(np.uint8), connectivity=4)
    kept = figures[:, cv2.CC_STAT_AREA] >= max(LEAST_AREA, LEAST_SHARE * region.size)
    if at_corners:
        kept &= np.isin(np.arange(len(kept)), labels[[0, 0, -1, -1], [0, -1, 0, -1]])
    return np.asarray(kept[labels] & region)
