"""Disparity range of a scene, estimated from its views alone.

A coarse plane sweep of the nearest views over all possible disparities locates the scene. A second sweep, around there
only, with views as far away as possible, measures its range. Only trusted disparities count: those of surfaces, that
is, patches of pixels whose best match is unambiguous and whose neighbours agree. Where there are few views, a match
must also hold in reverse. The range spans nearly all of them, with a margin: too narrow a range spoils the nearest or
most distant surface, too wide a one costs time and accuracy.

A third sweep checks whether the scene lies within a given range.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import cv2
import numpy as np
import numpy.typing as npt

from sepi.errors import SepiError, warn
from sepi.image.noise import noise_of_reference_view
from sepi.inspection.coarse_sweep import agreeing, coarse_sweep, dark_corners
from sepi.inspection.coded_views import BORNE, coding_error
from sepi.inspection.view_layouts import HIGH_PASS, Baseline, Views
from sepi.lightfield import BoolMap, DisparityRange, FloatMap, LightField, require_light_field

# Search: pixels per view step to each side, and at most this share of a view
_WIDEST = 128.0
_WIDEST_PART = 0.75
# largest movement in the farthest view for the measurement, in pixels and as a share of the shorter side; sampling
_MOST_MOVEMENT = 24.0
_MOST_MOVEMENT_PART = 0.25
_SAMPLING = 0.5
# number of views if there is no cross of them
_MOST_VIEWS = 16
# larger pictures are reduced by a whole factor; those that are searched by a larger one
_MOST_PIXELS = 600_000
_MOST_SEARCHED = 100_000

# half width of the matching window, pixels
_RADIUS = 3
# window of the median of disparities
_MEDIAN = 5
# largest difference that counts, full range = 1
_TRUNCATION = 0.1

# Trust: largest ratio of the lowest cost to the lowest outside its valley. A limit on the cost itself adds nothing, and
# would depend on the noise.
_MOST_AMBIGUITY = 0.8
# least mean minus lowest cost: smaller differences are rounding (the picture's brightest = 1), or in views with JPEG's
# blocks, edges of blocks that match any other block's (full range = 1)
_FLAT = 1e-3
_FLAT_BLOCKS = 3e-3
# window, and least number of its pixels that agree within a candidate step
_SUPPORT_WINDOW = 5
_LEAST_SUPPORT = 13
# least size of a patch, with pixels weighted by the clearness of their match: share of the picture, and pixels
_PATCH = 3e-4
_FEWEST_PIXELS = 25
# largest number of views for which matches are verified in reverse
_FEW_VIEWS = 2

# Range: share of the pixels that is left out on either side, and margin as a share of the span
_OUTLIERS = 0.001
_MARGIN = 0.06
# quantile of movement that limits the distance of views
_USUAL = 0.95

# Range that misses the scene: least mean with texture, full range = 1; least cost of an unmatched pixel relative to
# that mean; side of unmatched patches, pixels; their largest share of the textured pixels
_TEXTURE = 0.003
_MISFIT = 0.9
_HOLE = 5
_MOST_UNMATCHED = 0.08


def estimate_range(light_field: LightField) -> DisparityRange:
    """Disparity range of the reference view, found from the views.

    Parameters
    ----------
    light_field : LightField
        Its own range, ground truth and masks are not used.

    Returns
    -------
    DisparityRange
        Pixels per view step, with a margin on both sides; source ``"estimated"``.

    Raises
    ------
    SepiError
        If too few pixels can be matched (no texture, or no disparity within 128 pixels per view step).

    Examples
    --------
    Needed to call stages one by one; :func:`sepi.estimate_depth` estimates an unknown range itself.

    >>> import numpy as np
    >>> from sepi.inspection.disparity_range import estimate_range
    >>> from sepi.scenes import render
    >>> light_field = render("rack", size=96, views=5)
    >>> found = estimate_range(light_field)
    >>> truth = light_field.ground_truth
    >>> bool(found.minimum < truth.min() and truth.max() < found.maximum)
    True
    >>> bool(found.maximum - found.minimum < 1.3 * np.ptp(truth))
    True
    >>> light_field = light_field.with_range(found)
    >>> light_field.disparity_range.source
    'estimated'
    """
    require_light_field(light_field)
    coarse, fine = _Views(light_field, _MOST_SEARCHED), _Views(light_field, _MOST_PIXELS)
    nearest = coarse.nearest
    widest = min(_WIDEST, _WIDEST_PART * max(light_field.shape) / nearest)
    low, high, usual = coarse.ends(nearest, -widest, widest, 1.0)
    # the search is accurate to about a candidate
    slack = coarse.factor / nearest
    if coarse.reach(usual) > nearest:
        # more views, with fewer matches by chance
        low, high, usual = coarse.ends(coarse.reach(usual), low - slack, high + slack, _SAMPLING)
    reach = fine.reach(usual)
    low, high, _ = fine.ends(reach, low - slack, high + slack, _SAMPLING)
    margin = max(_MARGIN * (high - low), fine.factor * _SAMPLING / 10 / reach)
    # two more digits than the margin's first one, for readable numbers
    digits = max(2, 1 - math.floor(math.log10(margin)))
    scale = 10**digits
    low, high = math.floor(scale * (low - margin)) / scale, math.ceil(scale * (high + margin)) / scale
    return DisparityRange(low, high, "estimated")


def settle_range(light_field: LightField, given: tuple[float, float] | None = None) -> LightField:
    """The light field with a disparity range: the given one, else its own, else one estimated from the views.

    Warns (:class:`sepi.errors.SepiWarning`) if a part of the scene lies outside.

    Raises
    ------
    SepiError
        If the given range is invalid, the range is unknown and cannot be estimated, or a disparity of the range would
        move every pixel out of the neighbouring view.
    """
    if given is not None:
        light_field = light_field.with_range(DisparityRange(*given, "given"))
    if light_field.disparity_range is None:
        light_field = light_field.with_range(estimate_range(light_field))
    known, side = light_field.require_disparity_range(), max(light_field.shape)
    if max(-known.minimum, known.maximum) >= side:
        raise SepiError(
            f"{light_field.source or light_field.name}: disparity range ({known.source}) of {known.minimum:g} to "
            f"{known.maximum:g} pixels per view step; expected less than the {side} pixels of a view"
        )
    share = unmatched(light_field)
    if share > _MOST_UNMATCHED:
        warn(
            f"{light_field.source or light_field.name}: {100 * share:.0f} % of the textured pixels match nowhere in "
            f"the disparity range ({known.source}) of {known.minimum:g} to {known.maximum:g} pixels per view step; "
            "if the views are in the right order, give another range by --disparity-range"
        )
    return light_field


def unmatched(light_field: LightField) -> float:
    """Share of the textured pixels that match nowhere in the light field's disparity range, 0..1.

    Only pixels that the other views show over the whole range count. Occlusion alone gives up to 0.05, in tiny or very
    distant views 0.07.

    Raises
    ------
    SepiError
        If there is no range.
    """
    known = light_field.require_disparity_range()
    views = _Views(light_field, _MOST_SEARCHED)
    reach = views.reach(max(-known.minimum, known.maximum))
    baselines = views.chosen(reach, [reach])
    # a lowest cost at an end of the candidates is no match
    step = _SAMPLING * views.factor / reach
    candidates = views.candidates(reach, known.minimum - step, known.maximum + step, _SAMPLING)
    # a pixel hidden from the views on one side is seen on the other
    sides = filter(None, ([at for at in baselines if (sum(at) < 0) == before] for before in (True, False)))
    cost = np.minimum.reduce([views.sweep(side, candidates, truncation=math.inf)[0] for side in sides])
    texture = cv2.blur(abs(views.detail((0, 0))), (2 * _RADIUS + 1, 2 * _RADIUS + 1))
    # the mean absolute value of filtered noise is a quarter of its standard deviation
    textured = views.seen & (texture > max(_TEXTURE, noise_of_reference_view(light_field) / views.factor))
    y, x = np.ceil(abs(views.offsets(baselines)).max(axis=0) * abs(candidates).max()).astype(int) + _RADIUS
    counted = textured[y:-y, x:-x]
    if not counted.any():
        return 0.0
    alone = (counted & ~(cost < _MISFIT * texture)[y:-y, x:-x]).astype(np.uint8)
    # without the narrow bands beside edges that are hidden from some views
    return float(cv2.morphologyEx(alone, cv2.MORPH_OPEN, np.ones((_HOLE, _HOLE), np.uint8)).sum() / counted.sum())


class _Views(Views):
    """The views about the reference view; disparities are in reduced pixels."""

    def __init__(self, light_field: LightField, most_pixels: int) -> None:
        super().__init__(light_field, most_pixels, light_field.reference_position)
        self.light_field, view = light_field, light_field.reference_view
        self.seen = ~dark_corners(view, self.shape, HIGH_PASS + _RADIUS)
        brightest = float(np.quantile(np.max(cv2.split(view), axis=0), 0.99))
        self._flat = max(_FLAT * brightest, _FLAT_BLOCKS if coding_error(light_field) > BORNE else 0.0)
        away = [_distance(baseline) for baseline in self.baselines]
        self.nearest, self._farthest = min(away), max(away)

    def _in_grey(self, colours: npt.NDArray[Any]) -> npt.NDArray[Any]:
        # the mean has less noise
        return cv2.transform(colours, np.full((1, 3), 1 / 3))

    def reach(self, disparity: float) -> int:
        """Rows or columns to the farthest views in which a disparity does not move a pixel too far."""
        movement = min(_MOST_MOVEMENT * self.factor, _MOST_MOVEMENT_PART * min(self.light_field.shape))
        return int(max(self.nearest, min(self._farthest, movement / max(disparity, 1e-3))))

    def chosen(self, reach: int, distances: Sequence[int]) -> list[Baseline]:
        """Baselines to views in the row and the column of the reference view; to any others without those."""
        near = [baseline for baseline in self.baselines if _distance(baseline) <= reach]
        cross = [baseline for baseline in near if 0 in baseline]
        if len(cross) < 2:
            return self.worth_matching(near[:: math.ceil(len(near) / _MOST_VIEWS)])
        return self.worth_matching([baseline for baseline in cross if _distance(baseline) in distances] or cross)

    def candidates(self, reach: int, low: float, high: float, sampling: float) -> FloatMap:
        """Disparities from low to high, ``sampling`` pixels apart in views ``reach`` steps away."""
        sampling /= reach
        numbers = np.arange(math.floor(low / self.factor / sampling), math.ceil(high / self.factor / sampling) + 1)
        return (numbers * sampling).astype(np.float32)

    def offsets(self, baselines: list[Baseline], own: Baseline = (0, 0)) -> FloatMap:
        """Baselines (V, 2) in view steps from a view, the reference view unless given, to others."""
        return np.asarray(self.in_steps(baselines) - self.in_steps([own]), np.float32)

    def sweep(
        self, baselines: list[Baseline], candidates: FloatMap, own: Baseline = (0, 0), truncation: float = _TRUNCATION
    ) -> tuple[FloatMap, FloatMap, FloatMap, FloatMap]:
        """Match a view, the reference view unless given, with others (:func:`coarse_sweep`)."""
        views, offsets = np.stack(self.details(baselines)), self.offsets(baselines, own)
        return coarse_sweep(self.detail(own), views, offsets, candidates, truncation, _RADIUS)

    def ends(self, reach: int, low: float, high: float, sampling: float) -> tuple[float, float, float]:
        """Lowest and highest trusted disparity, from views at most ``reach`` away, and movement of most pixels."""
        baselines = self.chosen(reach, [max(1, round(reach * n / 4)) for n in range(1, 5)])
        candidates = self.candidates(reach, low, high, sampling)
        lowest, second, mean, disparity = self.sweep(baselines, candidates)
        # neighbours agree within a pixel of the farthest view, for any sampling
        tolerance = max(sampling, 1) / reach
        trusted = _trusted(lowest, second, mean, disparity, tolerance, self._flat) & self.seen
        if len(baselines) <= _FEW_VIEWS:
            trusted &= self._matches_back(baselines, candidates, disparity, tolerance)
        # against noise, which would stretch the range
        smooth = np.asarray(cv2.medianBlur(disparity, _MEDIAN), np.float32)
        # with few views, an unclear match counts less
        unclear = np.divide(lowest, second, out=np.ones_like(lowest), where=trusted)
        pixels, patches = _patches(trusted, np.minimum(1, len(baselines) * (1 - unclear)) ** 2, smooth, tolerance)
        if pixels.size < _FEWEST_PIXELS:
            raise SepiError(
                f"{self.light_field.name}: the disparity range cannot be estimated: too few pixels match between the "
                "views; give a range (MIN MAX, pixels per view step)"
            )
        low, high = np.quantile(pixels, [_OUTLIERS, 1 - _OUTLIERS])
        # small surfaces far in front of or behind the others are not outliers
        found = min(low, patches.min()), max(high, patches.max()), np.quantile(abs(pixels), _USUAL)
        low, high, usual = (self.factor * float(value) for value in found)
        return low, high, usual

    def _matches_back(
        self, baselines: list[Baseline], candidates: FloatMap, disparity: FloatMap, tolerance: float
    ) -> BoolMap:
        """Whether the first other view, matched with all others, has the same disparity there; shape (H, W)."""
        first, *others = baselines
        back = self.sweep([(0, 0), *others], candidates, first)[-1]
        down, across = self.offsets([first])[0]
        y, x = np.indices(disparity.shape, np.float32)
        there = cv2.remap(back, x - disparity * across, y - disparity * down, cv2.INTER_NEAREST, borderValue=math.inf)
        return np.asarray(abs(there - disparity) < tolerance)


def _distance(baseline: Baseline) -> int:
    return max(map(abs, baseline))


def _trusted(
    lowest: FloatMap, second: FloatMap, mean: FloatMap, disparity: FloatMap, tolerance: float, flat: float
) -> BoolMap:
    """Pixels whose best candidate is clear, and enough of whose neighbours agree; shape (H, W)."""
    clear = (lowest < _MOST_AMBIGUITY * second) & (mean - lowest > flat)
    return clear & (agreeing(disparity, clear, _SUPPORT_WINDOW, tolerance) >= _LEAST_SUPPORT)


def _patches(trusted: BoolMap, weight: FloatMap, disparity: FloatMap, tolerance: float) -> tuple[FloatMap, FloatMap]:
    """Disparities of trusted pixels in large patches of neighbours with close disparities, and each patch's median."""
    H, W = trusted.shape
    # a pixel between two neighbours tells whether they are joined
    joined = np.zeros((2 * H - 1, 2 * W - 1), np.uint8)
    joined[::2, ::2] = trusted
    joined[::2, 1::2] = trusted[:, 1:] & trusted[:, :-1] & (abs(np.diff(disparity, axis=1)) < tolerance)
    joined[1::2, ::2] = trusted[1:] & trusted[:-1] & (abs(np.diff(disparity, axis=0)) < tolerance)
    labels = cv2.connectedComponents(joined, connectivity=4)[1][::2, ::2].ravel()
    areas = np.bincount(labels, np.where(trusted, weight, 0).ravel())
    kept = trusted.ravel() & (areas[labels] >= max(_FEWEST_PIXELS, _PATCH * trusted.size))
    labels, pixels = labels[kept], disparity.ravel()[kept]
    order = np.lexsort((pixels, labels))
    starts = np.flatnonzero(np.diff(labels[order], prepend=-1))
    middles = starts + np.diff(starts, append=labels.size) // 2
    return pixels, pixels[order][middles]
