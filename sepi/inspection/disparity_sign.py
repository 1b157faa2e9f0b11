"""Sign of the disparities from occlusion: which of two surfaces is in front.

Where two surfaces meet in a view, it shows the nearer one. Suppose the disparities move two pixels of the reference
view to the same position in a view. The occluded one matches the views on that side worse than those on the opposite
side. It must be the one of lesser disparity; if it is repeatedly the other, all disparities have the wrong sign.
"""

from __future__ import annotations

import itertools
import math
from enum import Enum
from typing import NamedTuple

import cv2
import numpy as np
import numpy.typing as npt

from sepi.inspection.coarse_sweep import agreeing, coarse_sweep, dark_corners
from sepi.inspection.view_layouts import Baseline, Trial, Views, baselines_under
from sepi.kernels import view_order as kernels
from sepi.lightfield import BoolMap, FloatMap, LightField

# A quick check uses bands of so many rows, one band in so many; smaller pictures than this are unsuited to it
_BAND_ROWS = 24
_BANDS = 3
_LEAST_PIXELS_TO_GLANCE = 100_000
# Farthest views used, in rows or columns: the farther the view, the wider the occluded strips
_FARTHEST = 24
# Largest movement searched, pixels. Larger pictures are reduced by a whole factor, but less than in the search for the
# order of the views: occluded strips are narrow
_MOST_MOVEMENT = 16
_MOST_PIXELS = 1_200_000
# Matching: half width of the window, pixels; largest difference of one view, and difference in flat areas, the
# picture's deviation = 1; largest ratio of the lowest cost to the lowest outside its valley
_SWEEP_RADIUS = 2
_TRUNCATION = 1.5
_FLAT = 0.02
_MOST_AMBIGUITY = 0.6
_NOISE_FLOOR = 0.05
# Surfaces: this share of the window around a pixel has its disparity, within the sampling; noise can make one surface
# look like two
_SURFACE_WINDOW = 7
_LEAST_SUPPORT = 0.6
# Squared difference by rounding to 8 bits, full range = 1; its largest value, the picture's variance = 1, since in
# pictures of a few grey levels rounding looks like surfaces
_ROUNDING = 1 / (6 * 255**2)
_MOST_ROUNDING = 0.02
# Residuals: half width of the window, pixels; least noise, the picture's variance = 1 (as by interpolation); largest
# residual of a pixel that is seen; least of one that is hidden, as a multiple of the noise
_WINDOW_RADIUS = 2
_LEAST_NOISE = 3e-3
_SEEN = 0.3
_HIDDEN = 4.0
# Two surfaces count as two where they are this far apart in a view, pixels; they meet in it within this distance
_LEAST_SHIFT = 1.5
_MEETING = 0.75
# Logarithm of the ratio of residuals: largest value of a pair; least value that counts
_MOST_EVIDENCE = 2.0
_LEAST_EVIDENCE = 1.0
# Number of the farthest views on each side that are tested for occlusion
_HIDING_VIEWS = 2
# Side of a region, pixels, at most and as part of the picture's (pairs in one region are one observation); its pairs
_REGION = 16
_REGIONS_ACROSS = 16
_PAIRS = 3

_DIRECTIONS: tuple[Baseline, ...] = ((0, 1), (0, -1), (1, 0), (-1, 0))


class Evidence(NamedTuple):
    """Evidence of occlusion for the sign of the disparities, by regions of the picture.

    Attributes
    ----------
    mean : float
        From -2 to 2: above 0 if the surface of larger disparity is in front, as it should be.
    errors : float
        Absolute value of the mean, in standard errors.
    regions, agreeing : int
        Number of regions with evidence, and of those that agree with the mean.
    """

    mean: float
    errors: float
    regions: int
    agreeing: int


class Look(Enum):
    """Thoroughness of the check, which takes time."""

    GLANCE = 1
    """Bands of rows in the views beside the reference view; enough for scenes with much occlusion."""
    AXES = 2
    """The views of the middle row and column."""
    MANY_VIEWS = 3
    """Also other views, for noise or little texture."""


def occlusion_evidence(light_field: LightField, trial: Trial, look: Look, views: Views) -> Evidence:
    """Evidence that the surface of larger disparity is in front.

    ``views`` are those of the trial, whose best layout is assumed; the sign is that of the layout's first order. There
    is no evidence without views on opposite sides, or with hardly any contrast.
    """
    finer = Views(light_field, _MOST_PIXELS)
    views = views if views.factor == finer.factor else finer
    order = next(iter(trial.best))
    largest = trial.largest_disparity / views.factor
    reach, directions = _directions(views, largest)
    rows = np.ones(views.shape[0], bool)
    if look is Look.GLANCE:
        # points move along rows and stay in their band
        directions = [
            d for d in directions if not baselines_under(order, views.in_steps(light_field, _at(d, reach)))[:, 0].any()
        ]
        rows = np.arange(views.shape[0]) // _BAND_ROWS % _BANDS == _BANDS // 2
    # in units of the picture's own contrast
    scale = np.float32(1 / max(float(views.plain((0, 0)).std()), 1e-6))
    rounding = _ROUNDING * float(scale) ** 2
    too_small = look is Look.GLANCE and math.prod(views.shape) < _LEAST_PIXELS_TO_GLANCE
    if not directions or rounding > _MOST_ROUNDING or too_small:
        return Evidence(0.0, 0.0, 0, 0)
    sides = {
        direction: _at(direction, reach) + (_beside(views, direction, reach) if look is Look.MANY_VIEWS else [])
        for direction in directions
    }
    pictures = {at: views.plain(at)[rows] * scale for side in [[(0, 0)], *sides.values()] for at in side}
    positions = {at: baselines_under(order, views.in_steps(light_field, [at]))[0].astype(np.float32) for at in pictures}
    movement = min(_MOST_MOVEMENT, math.ceil(1.15 * largest * reach) + 1)
    sampling = 1 / reach
    disparity, trusted = _disparity(
        pictures[0, 0],
        [(np.stack([pictures[v] for v in side]), np.stack([positions[v] for v in side])) for side in sides.values()],
        (np.arange(-movement, movement + 1) * sampling).astype(np.float32),
    )
    alike = agreeing(disparity, trusted, _SURFACE_WINDOW, sampling)
    surface = trusted & (alike >= _LEAST_SUPPORT * _SURFACE_WINDOW**2)
    surface &= ~dark_corners(views.reference_view, views.shape, movement)[rows]
    residual = {
        at: _residual(pictures[0, 0], pictures[at], positions[at], disparity, trusted)
        for direction in directions
        for at in _at(direction, reach)
    }
    noise = max(_LEAST_NOISE, rounding, _typical([values[trusted] for values in residual.values()]))
    side = max(4, min(_REGION, round(math.sqrt(disparity.size) / _REGIONS_ACROSS)))
    total, count = np.zeros((2, *(-(-length // side) for length in disparity.shape)))
    for t, s in directions:
        there = [residual[at] for at in _at((-t, -s), reach)]
        opposite = np.asarray(np.mean(there, axis=0), np.float32)
        for at in _at((t, s), reach)[-_HIDING_VIEWS:]:
            # views on the other side see both pixels of a pair
            usable = surface & (opposite <= _SEEN) & np.isfinite(residual[at])
            rise = np.zeros(disparity.shape, np.float32)
            rise[usable] = np.log((residual[at][usable] + noise) / (opposite[usable] + noise))
            down, across = np.sign(positions[at]).astype(int).tolist()
            farthest, length, hidden = 2 * movement, np.abs(positions[at]).max(), _HIDDEN * noise
            add_pairs(
                rise, residual[at], disparity, usable, (down, across), farthest, length, hidden, side, total, count
            )
    return _summary(total, count)


def _residual(reference: FloatMap, view: FloatMap, baseline: FloatMap, disparity: FloatMap, asked: BoolMap) -> FloatMap:
    """Mean squared difference between each pixel's window and its position in a view; shape (H, W), float32.

    ``baseline`` leads down and across to the view, in view steps. Infinite outside the mask ``asked``, and where the
    window leaves either picture.
    """
    out = np.empty_like(reference)
    kernels.residuals(reference, view, baseline, disparity, asked, _WINDOW_RADIUS, out)
    return out


def add_pairs(
    rise: FloatMap,
    residual: FloatMap,
    disparity: FloatMap,
    usable: BoolMap,
    direction: Baseline,
    farthest: int,
    length: np.float32,
    hidden: float,
    side: int,
    total: npt.NDArray[np.float64],
    count: npt.NDArray[np.float64],
) -> None:
    """Add the evidence of usable pixel pairs that meet in a view, and their number, to regions of ``side`` pixels.

    The nearer pixel lies 2 to ``farthest`` steps of ``direction``, each -1, 0 or 1 down and across, from the other. The
    view is ``length`` view steps away, and a pixel that is hidden in it has a greater residual than ``hidden``.
    """
    height, width = disparity.shape
    suspect = usable & (residual > hidden)
    y, x = np.nonzero(suspect)
    # few pixels are hidden: each is paired with possible occluders, and with pixels that it may occlude
    for distance, towards in itertools.product(range(2, farthest + 1), (1, -1)):
        i, j = y + towards * distance * direction[0], x + towards * distance * direction[1]
        inside = (i >= 0) & (i < height) & (j >= 0) & (j < width)
        one, other = (y[inside], x[inside]), (i[inside], j[inside])
        here, there = (one, other) if towards == 1 else (other, one)
        shift = (disparity[there] - disparity[here]) * length
        meet = usable[other] & (np.abs(shift - distance) <= _MEETING) & (shift >= _LEAST_SHIFT)
        meet &= np.maximum(rise[here], rise[there]) > _LEAST_EVIDENCE
        if towards == -1:
            # its other pixel gives the same pair
            meet &= ~suspect[other]
        regions = here[0][meet] // side, here[1][meet] // side
        np.add.at(total, regions, np.clip(rise[here] - rise[there], -_MOST_EVIDENCE, _MOST_EVIDENCE)[meet])
        np.add.at(count, regions, 1)


def _summary(total: npt.NDArray[np.float64], count: npt.NDArray[np.float64]) -> Evidence:
    """Mean over the regions, weighted by their pairs, with its error."""
    heard = count >= _PAIRS
    regions = int(heard.sum())
    if regions < 2:
        return Evidence(0.0, 0.0, regions, 0)
    values, weights = total[heard] / count[heard], count[heard]
    mean = float((weights * values).sum() / weights.sum())
    # equal values in all regions do not mean that there is no error
    deviation = max(float(np.sqrt((weights**2 * (values - mean) ** 2).sum() / (weights**2).sum())), 0.1)
    error = deviation * float(np.sqrt((weights**2).sum()) / weights.sum())
    return Evidence(mean, abs(mean) / error, regions, int((values * mean > 0).sum()))


def _directions(views: Views, largest: float) -> tuple[int, list[Baseline]]:
    """Distance of the views to use, and directions with views at it and at half of it, on both sides.

    It is the largest distance at which all movement stays within the search, since hidden strips are widest there.
    """
    axes = [(n * t, n * s) for t, s in _DIRECTIONS for n in range(1, _FARTHEST + 1)]
    present = set(views.worth_matching([baseline for baseline in views.baselines if baseline in axes]))
    for reach in range(_FARTHEST, 0, -1):
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
    """Baselines to the views at the distance and at quarters of it."""
    return [(n * direction[0], n * direction[1]) for n in sorted({max(1, reach * k // 4) for k in range(1, 5)})]


def _beside(views: Views, direction: Baseline, reach: int) -> list[Baseline]:
    """Baselines to the views on one side off its axis, at 45 degrees to those on it."""
    t, s = direction
    distances = [abs(down + across) for down, across in _at(direction, reach)]
    corners = [(n * (t + k * s), n * (s + k * t)) for n in distances for k in (-1, 1)]
    present = set(views.baselines)
    return views.worth_matching([corner for corner in corners if corner in present])


def _disparity(
    reference: FloatMap, sides: list[tuple[FloatMap, FloatMap]], candidates: FloatMap
) -> tuple[FloatMap, BoolMap]:
    """Disparity of each pixel from the side with the better match, and mask of trusted ones.

    A pixel that is hidden on one side still shows its disparity on the other.
    """
    sweeps = [
        coarse_sweep(reference, pictures, positions, candidates, _TRUNCATION, _SWEEP_RADIUS)
        for pictures, positions in sides
    ]
    chosen = np.stack([sweep[0] for sweep in sweeps]).argmin(axis=0)
    lowest, second, mean, disparity = (np.choose(chosen, [sweep[n] for sweep in sweeps]) for n in range(4))
    with np.errstate(invalid="ignore"):
        # without the constant that noise adds to all costs
        floor = np.quantile(lowest[np.isfinite(lowest)], _NOISE_FLOOR) if np.isfinite(lowest).any() else 0
        trusted = (lowest - floor < _MOST_AMBIGUITY * (second - floor)) & (mean - lowest > _FLAT)
    spacing = candidates[1] - candidates[0]
    trusted &= abs(disparity - cv2.medianBlur(disparity, 5)) < spacing
    return disparity, trusted


def _typical(parts: list[FloatMap]) -> float:
    """Median of the finite values; 0 if there are none."""
    values = np.concatenate(parts)
    # every seventh value is enough
    values = values[np.isfinite(values)][::7]
    return float(np.median(values)) if values.size else 0.0
