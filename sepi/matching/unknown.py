"""Pixels for whose depth no view has evidence, and their mask in the final maps.

A depth map has a value everywhere. It is a mere guess in

- regions without a signal: black or overexposed, and varying no more than their noise;
- the dark corners that a lens leaves (vignettes), which stray light may lift above black;
- pixels that lie, at their disparity, outside nearly all other views;
- pixels that the reference view itself does not show.

A bare wall is none of these: its border tells its depth.
"""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import cv2
import numpy as np
import numpy.typing as npt

from sepi.image.noise import SATURATED, noise_level, noise_of_reference_view
from sepi.lightfield import (
    BoolMap,
    FloatMap,
    LightField,
    as_unit_float,
    full_scale,
    require_light_field,
    without_reference,
)
from sepi.stage import HIGH, LIGHT_DEVIATION, LOW, SIGMA, StageMaps
from sepi.validation import require_map

UNKNOWN = "unknown"
"""Name of the mask."""

BLACK = 0.01
"""Highest brightness of a black region, as a share of the picture's brightest value."""

LENS_CORNER = 0.05
"""The same of a region that holds a corner of the picture: stray light may lift it above black."""

LEAST_SHARE = 2e-3
"""Least share of the picture that a region without a signal takes; a smaller one belongs to its surroundings."""

LEAST_AREA = 100
"""Least number of pixels of such a region."""

LEAST_VIEWS = 2
"""Number of other views that must hold a pixel; all of them if there are fewer."""

# pixels across and down over which squared gradients are averaged
_WINDOW = 5
# a mean beyond this multiple of what noise explains is a signal
_NOISE_FACTOR = 4.0
# white noise hardly ever exceeds this multiple of its standard deviation
_NOISE_REACH = 4.0
# number of views whose mean tells faint texture from noise
_MOST_AVERAGED = 16
# share of the squared gradients of texture that stays in the mean of many views; less stays of noise, although
# neighbouring views of one sensor have some noise in common
_SHARED = 0.5
# noise beyond this share of the brightest value would be texture
_MOST_NOISE = 0.03
# least noise: rounding of integers, in levels, and of floats
_ROUNDING = 0.3
_FLOAT_ROUNDING = 1e-5


def with_unknown(light_field: LightField, maps: StageMaps) -> StageMaps:
    """A variant's final maps with the mask ``unknown``.

    Unknown pixels keep their disparity. Their confidence is 0; error bars, if there are any, cover the whole range.

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
    extra = {UNKNOWN: unknown}
    if maps.sigma is not None:
        lowest, highest = light_field.require_disparity_range().candidates(2)
        # standard deviation of a uniform distribution over the range
        anywhere = {SIGMA: (highest - lowest) / np.float32(12) ** 0.5, LOW: lowest, HIGH: highest}
        extra |= {name: np.where(unknown, np.float32(value), maps.extra[name]) for name, value in anywhere.items()}
    # a cue of the error bars is no result
    maps = replace(maps, extra={name: values for name, values in maps.extra.items() if name != LIGHT_DEVIATION})
    return maps.updated(maps.disparity, np.where(unknown, np.float32(0), maps.confidence), **extra)


def unknown_pixels(light_field: LightField, disparity: FloatMap) -> BoolMap:
    """Pixels for whose depth no view has evidence: black, overexposed, in a lens's dark corner, or held by few views.

    :func:`sepi.estimate_depth` returns them as the mask ``unknown``. Use this function for maps of other programs.
    docs/reference/outputs.md has the thresholds.

    Parameters
    ----------
    light_field : LightField
    disparity : ndarray, shape (H, W), float32
        Final disparity, pixels per view step.

    Returns
    -------
    ndarray, shape (H, W), bool

    Examples
    --------
    A light field whose left third is black in every view:

    >>> from sepi.matching.unknown import unknown_pixels
    >>> from sepi.scenes import render
    >>> light_field = render("fronto_parallel", size=96, views=3)
    >>> light_field.views[:, :, :, :32] = 0
    >>> unknown = unknown_pixels(light_field, light_field.ground_truth)
    >>> bool(unknown[:, :24].all()), bool(unknown[1:-1, 40:-1].any())
    (True, False)
    """
    require_light_field(light_field)
    require_map(f"{light_field.name}: disparity", disparity, light_field.shape)
    unknown = without_signal(light_field, disparity) | held_by_few(light_field, disparity)
    if light_field.missing is not None:
        unknown |= light_field.missing[light_field.reference_position]
    return unknown


def without_signal(light_field: LightField, disparity: FloatMap) -> BoolMap:
    """Regions that are black or overexposed, and vary no more than their noise.

    Parameters
    ----------
    light_field : LightField
    disparity : ndarray, shape (H, W), float32
        Pixels per view step. Detail on which the views agree at these disparities is texture, not noise.

    Returns
    -------
    ndarray, shape (H, W), bool
    """
    view, dtype = light_field.reference_view, light_field.views.dtype
    rounding = _FLOAT_ROUNDING if dtype == np.float32 else _ROUNDING / full_scale(dtype)
    # NumPy is slow along the channels
    channels = cv2.split(view)
    energy, brightness = _energy(view), np.maximum.reduce(channels)
    bright = np.minimum.reduce(channels) >= SATURATED
    found = _large(_beside(bright & (energy < _of_noise(rounding)), bright))
    white = float(np.quantile(brightness, 0.999))
    # brightness with less noise
    level = np.maximum.reduce(cv2.split(cv2.blur(view, (3, 3))))
    most = min(noise_of_reference_view(light_field), _MOST_NOISE * white)
    for share, at_corners in ((BLACK, False), (LENS_CORNER, True)):
        limit = share * white
        # texture counts as noise; a dark region may have less of both than the whole view
        noise = max(min(most, noise_level(view, level <= limit + most)), rounding)
        even = level <= limit + noise
        # single brighter pixels in the dark are noise, too
        dark = even | (brightness <= limit + _NOISE_REACH * noise)
        core = even & (energy < _of_noise(noise))
        if _large(_beside(core, dark), at_corners).any():
            mean, number = _mean_of_dark(light_field, disparity, limit + _NOISE_REACH * noise)
            shared = _energy(mean)
            core &= (shared < _of_noise(rounding)) | (shared < energy * (_SHARED + (1 - _SHARED) / number))
            found |= _large(_beside(core, dark), at_corners)
    return found


def held_by_few(light_field: LightField, disparity: FloatMap) -> BoolMap:
    """Pixels that lie, at their disparity, outside all but one of the other views; shape (H, W), bool."""
    H, W = disparity.shape
    others = _nearest_first(light_field)
    least = min(LEAST_VIEWS, len(others))
    y, x = (side.ravel() for side in np.mgrid[:H, :W])
    finite = np.isfinite(disparity)
    d, held = np.where(finite, disparity, np.nan).ravel().astype(np.float64), np.zeros(H * W, np.int64)
    # the nearest views hold every pixel that lies farther from the border than its shift in them
    baselines = light_field.baselines
    nearest = [baselines[t, s] for t, s in others[:least]]
    moved = math.ceil(float(np.abs(disparity[finite]).max(initial=0)) * float(np.abs(nearest).max(initial=0)))
    inside = np.zeros((H, W), bool)
    if light_field.missing is None:
        inside[moved : H - moved, moved : W - moved] = finite[moved : H - moved, moved : W - moved]
    held[inside.ravel()] = least
    left = np.flatnonzero(~inside)
    for t, s in others:
        down, across = baselines[t, s]
        row, column = y[left] - d[left] * down, x[left] - d[left] * across
        holds = (row >= -0.5) & (row <= H - 0.5) & (column >= -0.5) & (column <= W - 0.5)
        if light_field.missing is not None:
            at = (np.clip(np.rint(place), 0, n - 1).astype(int) for place, n in ((row, H), (column, W)))
            holds &= ~light_field.missing[t, s][tuple(at)]
        held[left] += holds
        left = left[held[left] < least]
    return (held < least).reshape(H, W)


def _nearest_first(light_field: LightField) -> npt.NDArray[np.int64]:
    """Grid positions of the other views that are present, (N, 2)."""
    others = without_reference(light_field, light_field.present)
    distance = (light_field.baselines[others] ** 2).sum(axis=1)
    return np.argwhere(others)[np.argsort(distance, kind="stable")]


def _mean_of_dark(light_field: LightField, disparity: FloatMap, limit: float) -> tuple[FloatMap, FloatMap]:
    """Mean over the views in which a pixel is no brighter than ``limit``, and the number of these views.

    Returns
    -------
    mean : ndarray, shape (H, W, 3), float32
    number : ndarray, shape (H, W), float32
        At least 1, for the reference view.
    """
    total = light_field.reference_view.copy()
    number = np.ones(disparity.shape, np.float32)
    y, x = (side.astype(np.float32) for side in np.mgrid[: disparity.shape[0], : disparity.shape[1]])
    baselines = light_field.baselines.astype(np.float32)
    for t, s in _nearest_first(light_field)[:_MOST_AVERAGED]:
        down, across = baselines[t, s]
        position = x - disparity * across, y - disparity * down
        view = as_unit_float(light_field.rgb_views[t, s])
        if light_field.missing is not None:
            view[light_field.missing[t, s]] = 1
        seen = cv2.remap(view, *position, cv2.INTER_LINEAR, borderValue=(1, 1, 1))
        dark = np.max(cv2.split(seen), axis=0) <= limit
        total += seen * dark[..., None]
        number += dark
    return total / number[..., None], number


def _energy(image: FloatMap) -> FloatMap:
    """Squared gradients of an image (H, W, 3), summed over channels and averaged over a window; shape (H, W)."""
    squares: Any = 0
    # NumPy is slow along the channels
    for channel in cv2.split(image):
        down, across = np.gradient(channel)
        squares = squares + (down**2 + across**2)
    return np.asarray(cv2.blur(squares, (_WINDOW, _WINDOW)), np.float32)


def _of_noise(noise: float) -> float:
    """Highest energy (:func:`_energy`) that noise of this standard deviation explains."""
    # central differences halve the variance; two axes, three channels
    return _NOISE_FACTOR * 3 * noise**2


def _beside(core: BoolMap, region: BoolMap) -> BoolMap:
    """The pixels of a region whose window, or that of a neighbour, touches the core."""
    # windows at the region's border reach beyond it and so are not flat
    reach = np.ones((_WINDOW + 2, _WINDOW + 2), np.uint8)
    return np.asarray(region & (cv2.dilate(core.astype(np.uint8), reach) > 0))


def _large(region: BoolMap, at_corners: bool = False) -> BoolMap:
    """Connected parts of a region that are large enough; ``at_corners`` keeps those at the picture's corners only."""
    _, labels, figures, _ = cv2.connectedComponentsWithStats(region.astype(np.uint8), connectivity=4)
    kept = figures[:, cv2.CC_STAT_AREA] >= max(LEAST_AREA, LEAST_SHARE * region.size)
    if at_corners:
        kept &= np.isin(np.arange(len(kept)), labels[[0, 0, -1, -1], [0, -1, 0, -1]])
    return np.asarray(kept[labels] & region)
