"""Which of two surfaces is in front, by what hides what: the sign of the disparities.

Where two surfaces meet in a view, the nearer one is seen. Its disparity must be the greater; if it is the lesser again
and again, all disparities have the wrong sign.
"""

from __future__ import annotations

import math

import cv2
import numpy as np
import numpy.typing as npt

from sepi.inspection.coarse_sweep import coarse_sweep
from sepi.inspection.view_layouts import REACH, Baseline, Trial, Views, baselines_under
from sepi.inspection.view_order_kernels import count_occlusions, residuals
from sepi.lightfield import BoolMap, FloatMap

# Movement searched at most, pixels; of larger pictures, the middle is looked at
_MOST_MOVEMENT = 16
_MOST_PIXELS = 200_000
# Matching: half width of the window, pixels; largest difference of one view, and what flat areas differ by, the
# picture's deviation = 1; lowest cost as part of the lowest outside its valley
_SWEEP_RADIUS = 2
_TRUNCATION = 1.5
_FLAT = 0.02
_MOST_AMBIGUITY = 0.6
# Residuals: half width of the window, pixels; least that is taken for noise, the picture's variance = 1; as multiples
# of the noise, those of pixels that are seen and that are hidden; least ratio of the two at one pixel
_WINDOW_RADIUS = 2
_LEAST_NOISE = 3e-4
# what rounding to 8 bits adds to the square of a difference, full range = 1; most of it, the picture's variance = 1:
# in pictures of a few grey levels, rounding looks like surfaces
_ROUNDING = 1 / (6 * 255**2)
_MOST_ROUNDING = 0.02
_SEEN = 4.0
_HIDDEN = 9.0
_HIDDEN_TO_SEEN = 6.0

_DIRECTIONS: tuple[Baseline, ...] = ((0, 1), (0, -1), (1, 0), (-1, 0))


def occlusion_votes(views: Views, trial: Trial) -> tuple[int, int]:
    """At how many pixels the greater, and at how many the lesser disparity is that of the surface in front.

    The best layout of the trial is taken for right; the signs are those of that layout's first order. Both numbers are
    0 where there are no views on opposite sides, or hardly any contrast.
    """
    reach, directions = _directions(views, trial.largest_disparity)
    if not directions:
        return 0, 0
    # in units of the picture's own contrast
    scale = np.float32(1 / max(float(views.plain((0, 0)).std()), 1e-6))
    rounding = _ROUNDING * float(scale) ** 2
    if rounding > _MOST_ROUNDING:
        return 0, 0
    reference = _middle(views.plain((0, 0))) * scale
    baselines = {direction: _at(direction, reach) for direction in directions}
    pictures = {
        at: _as_bright(_middle(views.plain(at)) * scale, reference) for both in baselines.values() for at in both
    }
    order = next(iter(trial.best))
    positions = {at: (int(t), int(s)) for at in pictures for t, s in baselines_under(order, [at])}
    movement = min(_MOST_MOVEMENT, math.ceil(1.15 * trial.largest_disparity * reach) + 1)
    candidates = (np.arange(-movement, movement + 1) / reach).astype(np.float32)
    sides = [
        (np.stack([pictures[at] for at in both]), np.array([positions[at] for at in both], np.int64))
        for both in baselines.values()
    ]
    disparity, trusted = _disparity(reference, sides, candidates)
    residual = {
        at: residuals(reference, picture, *positions[at], disparity, _WINDOW_RADIUS) for at, picture in pictures.items()
    }
    noise = max(_LEAST_NOISE, rounding, _typical([values[trusted] for values in residual.values()]))
    greater, lesser = 0, 0
    for t, s in directions:
        here, there = ([residual[at] for at in baselines[direction]] for direction in ((t, s), (-t, -s)))
        more, less = count_occlusions(
            here[-1],
            np.maximum(there[0], there[-1]),
            np.maximum.reduce([*here, *there]),
            *positions[baselines[t, s][-1]],
            disparity,
            trusted,
            _SEEN * noise,
            _HIDDEN * noise,
            _HIDDEN_TO_SEEN,
            2 * movement,
        )
        greater, lesser = greater + more, lesser + less
    return greater, lesser


def _directions(views: Views, largest: float) -> tuple[int, list[Baseline]]:
    """Distance, and directions in which there are views at it and at half of it, on both sides.

    The most distant at which nothing moves by more than is searched: the strips that are hidden are widest there.
    """
    present = set(views.baselines)
    for reach in range(REACH, 0, -1):
        if reach > 1 and largest * reach > _MOST_MOVEMENT:
            continue
        both = [
            direction
            for direction in _DIRECTIONS
            if present.issuperset(_at(direction, reach) + _at((-direction[0], -direction[1]), reach))
        ]
        if both:
            return reach, both
    return 1, []


def _at(direction: Baseline, reach: int) -> list[Baseline]:
    """Baselines to the views at half of the distance and at all of it."""
    return [(n * direction[0], n * direction[1]) for n in sorted({max(1, reach // 2), reach})]


def _middle(picture: FloatMap) -> FloatMap:
    """The middle of a picture, of the same proportions, where it is large."""
    part = min(1.0, math.sqrt(_MOST_PIXELS / picture.size))
    rows, columns = (slice(round(n * (1 - part) / 2), round(n * (1 + part) / 2)) for n in picture.shape)
    return np.ascontiguousarray(picture[rows, columns])


def _as_bright(picture: FloatMap, reference: FloatMap) -> FloatMap:
    """A view with the mean of the reference: lenses darken the views towards the edge of the grid."""
    mean = float(picture.mean())
    return np.asarray(picture * np.float32(float(reference.mean()) / mean if mean > 0 else 1), np.float32)


def _disparity(
    reference: FloatMap, sides: list[tuple[FloatMap, npt.NDArray[np.int64]]], candidates: FloatMap
) -> tuple[FloatMap, BoolMap]:
    """Disparity of each pixel, and where it is trusted, by the side from which the pixel is seen best.

    A pixel that is hidden on one side still shows its disparity on the other.
    """
    sweeps = [
        coarse_sweep(reference, pictures, positions, candidates, np.float32(_TRUNCATION), _SWEEP_RADIUS)
        for pictures, positions in sides
    ]
    chosen = np.stack([sweep[0] for sweep in sweeps]).argmin(axis=0)
    lowest, second, mean, disparity = (np.choose(chosen, [sweep[n] for sweep in sweeps]) for n in range(4))
    with np.errstate(invalid="ignore"):
        trusted = (lowest < _MOST_AMBIGUITY * second) & (mean - lowest > _FLAT)
    spacing = candidates[1] - candidates[0]
    trusted &= abs(disparity - cv2.medianBlur(disparity, 5)) < spacing
    return disparity, trusted


def _typical(parts: list[FloatMap]) -> float:
    """Median of the finite values; 0 if there are none."""
    values = np.concatenate(parts)
    # every seventh is enough
    values = values[np.isfinite(values)][::7]
    return float(np.median(values)) if values.size else 0.0
