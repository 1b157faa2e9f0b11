"""Find the disparity range of a scene from its views alone.

A coarse plane sweep over far more disparities than a scene has, with few views; then the extremes of the disparities
that can be trusted: pixels whose best match is unambiguous and whose neighbours agree. A range that is a bit too wide
costs little; one that leaves out the nearest or most distant surface spoils that surface, so the choices below lean to
the wide side.
"""

from __future__ import annotations

import math

import cv2
import numpy as np
import numpy.typing as npt

from sepi.errors import SepiError
from sepi.lightfield import BoolMap, DisparityRange, FloatMap, LightField, as_unit_float

# Search: pixels per view step to each side at first, and if surfaces lie beyond
_EXTENTS = (16.0, 32.0, 64.0)
# views up to this many steps from the centre: more distant ones see less of the same
_REACH = 4
# views when there is no cross of them
_MOST_VIEWS = 16
# larger pictures are reduced by a whole factor
_MOST_PIXELS = 600_000

# Filters, pixels: against noise, against differences of brightness between views; matching window
_BLUR_SIGMA = 0.8
_HIGH_PASS = 9
_RADIUS = 2
# largest difference that counts, full range = 1
_TRUNCATION = 0.1

# What is black, as part of the brightest there is
_BLACK = 0.05

# Trust: lowest cost as part of the lowest outside its valley. A limit on the cost itself would add nothing here, and
# would have to know the noise.
_MOST_AMBIGUITY = 0.8
# mean above lowest cost, full range = 1: less is rounding
_FLAT = 1e-4
# pixels of the 5x5 neighbourhood, itself included, that agree within a candidate step
_LEAST_SUPPORT = 13
# trusted pixels that a range needs, as part of the picture, for the search to end
_ENOUGH = 0.02
_FEWEST_PIXELS = 20

# Range: extreme pixels that may be wrong (a number and a part of all), and the margin on each side as part of the span
_OUTLIERS = 4
_OUTLIER_PART = 1e-5
_MARGIN = 0.06


def estimate_range(light_field: LightField) -> DisparityRange:
    """Disparity range of the reference view, found from the views.

    Parameters
    ----------
    light_field : LightField
        Its own range, ground truth and masks are not looked at.

    Returns
    -------
    DisparityRange
        Pixels per view step, with a margin on both sides; source ``"estimated"``.

    Raises
    ------
    SepiError
        If too few pixels can be matched (no texture, or no disparity within 64 pixels per view step).
    """
    # here, since it brings the compiler with it, and most scenes name their range
    from sepi.inspection.coarse_sweep import coarse_sweep

    positions = _positions(light_field)
    factor = math.ceil(math.sqrt(math.prod(light_field.shape) / _MOST_PIXELS))
    reference = _prepared(light_field.rgb_views[light_field.reference_position], factor)
    views = np.stack([_prepared(light_field.rgb_views[position], factor) for position in positions])
    offsets = np.stack([light_field.baselines[position] for position in positions]).astype(np.float32)
    # the most distant view moves by one pixel from candidate to candidate
    step = 1 / float(abs(offsets).max())
    seen = ~_dark_corners(light_field.reference_view, reference.shape)
    found: FloatMap = np.empty(0, np.float32)
    # at most half a picture at the most distant view
    for extent in sorted({min(extent, max(reference.shape) * step / 2) for extent in _EXTENTS}):
        number = max(1, math.ceil(extent / step))
        candidates = (np.arange(-number, number + 1) * step).astype(np.float32)
        sweep = coarse_sweep(reference, views, offsets, candidates, np.float32(_TRUNCATION), _RADIUS)
        trusted = sweep[-1][_trusted(*sweep, step) & seen]
        if trusted.size > found.size:
            found = trusted
        if found.size > _ENOUGH * reference.size and abs(np.stack(_extremes(found))).max() < extent - max(1, 2 * step):
            break
    if found.size < _FEWEST_PIXELS:
        raise SepiError(
            f"{light_field.name}: the disparity range cannot be estimated, too few pixels match between the views; "
            "give one (MIN MAX, pixels per view step)"
        )
    low, high = _extremes(found)
    margin = max(_MARGIN * (high - low), step / 2)
    # two decimals: a number that can be read and typed
    return DisparityRange(
        math.floor(100 * factor * (low - margin)) / 100, math.ceil(100 * factor * (high + margin)) / 100, "estimated"
    )


def settle_range(light_field: LightField, given: tuple[float, float] | None = None) -> LightField:
    """The light field with a disparity range: the given one, else its own, else one estimated from the views.

    Raises
    ------
    SepiError
        If the given range is none, or nothing is known and the views do not tell, or a disparity of the range would
        move every pixel out of the neighbouring view.
    """
    if given is not None:
        light_field = light_field.with_range(DisparityRange(*given, "given"))
    if light_field.disparity_range is None:
        return light_field.with_range(estimate_range(light_field))
    known, side = light_field.disparity_range, max(light_field.shape)
    if max(-known.minimum, known.maximum) >= side:
        raise SepiError(
            f"{light_field.source or light_field.name}: disparity range ({known.source}) of {known.minimum:g} to "
            f"{known.maximum:g} pixels per view step; expected less than the {side} pixels of a view"
        )
    return light_field


def _positions(light_field: LightField) -> list[tuple[int, int]]:
    """Grid positions to match with the centre: its row and column; any others where those are not there."""
    t0, s0 = light_field.reference_position
    present = [
        (int(t), int(s))
        for t, s in np.argwhere(light_field.present)
        if (t, s) != (t0, s0) and max(abs(t - t0), abs(s - s0)) <= _REACH
    ]
    cross = [(t, s) for t, s in present if t == t0 or s == s0]
    if len(cross) > 1:
        return cross
    if present:
        return present[:: math.ceil(len(present) / _MOST_VIEWS)]
    raise SepiError(f"{light_field.name}: no view within {_REACH} steps of the centre is present")


def _prepared(view: npt.NDArray[np.generic], factor: int) -> FloatMap:
    """Grey, reduced, high-pass filtered picture, (H, W) float32, of a view (H, W, C)."""
    grey = as_unit_float(view).mean(axis=2)
    if factor > 1:
        size = (max(1, grey.shape[1] // factor), max(1, grey.shape[0] // factor))
        grey = cv2.resize(grey, size, interpolation=cv2.INTER_AREA)
    smooth = cv2.GaussianBlur(grey, (0, 0), _BLUR_SIGMA)
    return np.asarray(smooth - cv2.blur(smooth, (_HIGH_PASS, _HIGH_PASS)), np.float32)


def _dark_corners(reference_view: FloatMap, shape: tuple[int, int]) -> BoolMap:
    """What the lens leaves black in the corners, and what lies so near that the filters mix it in; of ``shape``.

    The edge of such a corner moves from view to view as the lens has it, not as anything in the scene.
    """
    brightness = reference_view.max(axis=2)
    black = brightness < _BLACK * np.quantile(brightness, 0.99)
    black = cv2.resize(black.astype(np.uint8), shape[::-1], interpolation=cv2.INTER_AREA)
    _, labels = cv2.connectedComponents(black)
    corners = set(labels[[0, 0, -1, -1], [0, -1, 0, -1]].tolist()) - {0}
    reach = 2 * (_HIGH_PASS + _RADIUS) + 1
    dark = np.isin(labels, list(corners)).astype(np.uint8)
    return cv2.dilate(dark, np.ones((reach, reach), np.uint8)) > 0


def _trusted(lowest: FloatMap, second: FloatMap, mean: FloatMap, disparity: FloatMap, step: float) -> BoolMap:
    """Pixels whose best candidate is clear, and has enough of the like about it, shape (H, W)."""
    clear = (lowest < _MOST_AMBIGUITY * second) & (mean - lowest > _FLAT)
    H, W = disparity.shape
    padded = np.pad(np.where(clear, disparity, np.inf), 2, constant_values=np.inf)
    support = np.zeros((H, W), np.int32)
    for dy, dx in np.ndindex(5, 5):
        support += abs(padded[dy : dy + H, dx : dx + W] - disparity) < step
    return clear & (support >= _LEAST_SUPPORT)


def _extremes(disparity: FloatMap) -> tuple[float, float]:
    """Lowest and highest disparity but for a few outliers."""
    ordered = np.sort(disparity)
    left_out = min(int(_OUTLIERS + _OUTLIER_PART * ordered.size), (ordered.size - 1) // 2)
    return float(ordered[left_out]), float(ordered[-1 - left_out])
