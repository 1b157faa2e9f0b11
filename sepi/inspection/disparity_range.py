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

import cv2
import numpy as np

from sepi.errors import SepiError, warn
from sepi.image.noise import noise_of_reference_view
from sepi.inspection.coarse_sweep import agreeing, coarse_sweep, dark_corners
from sepi.lightfield import BoolMap, DisparityRange, FloatMap, LightField, as_unit_float, require_light_field

# Search: pixels per view step to each side, and at most this share of a view
_WIDEST = 128.0
_WIDEST_PART = 0.75
# largest movement in the farthest view for the measurement, in pixels and as a share of the shorter side; sampling
_MOST_MOVEMENT = 24.0
_MOST_MOVEMENT_PART = 0.25
_SAMPLING = 0.5
# number of views if there is no cross of them
_MOST_VIEWS = 16
# views much darker than the reference view are skipped
_LEAST_BRIGHTNESS = 0.3
# larger pictures are reduced by a whole factor; those that are searched by a larger one
_MOST_PIXELS = 600_000
_MOST_SEARCHED = 100_000

# Filters, pixels: against noise, against differences of brightness between views; matching window
_BLUR_SIGMA = 0.8
_HIGH_PASS = 9
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
# side of these blocks; least ratio of differences across their edges to those inside; differences above the last, full
# range = 1, belong to the scene
_BLOCK = 8
_BLOCKINESS = 1.9
_FAINT = 4 / 255
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

# row and column of a view in the grid
_Position = tuple[int, int]
_Positions = list[_Position]


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
    positions = views.positions(reach, [reach])
    # a lowest cost at an end of the candidates is no match
    step = _SAMPLING * views.factor / reach
    candidates = views.candidates(reach, known.minimum - step, known.maximum + step, _SAMPLING)
    # a pixel hidden from the views on one side is seen on the other
    before = {place for place in positions if sum(place) < sum(light_field.reference_position)}
    sides = filter(None, (sorted(before), sorted({*positions} - before)))
    cost = np.minimum.reduce([views.sweep(side, candidates, truncation=math.inf)[0] for side in sides])
    texture = cv2.blur(abs(views.reference), (2 * _RADIUS + 1, 2 * _RADIUS + 1))
    # the mean absolute value of filtered noise is a quarter of its standard deviation
    textured = views.seen & (texture > max(_TEXTURE, noise_of_reference_view(light_field) / views.factor))
    y, x = np.ceil(abs(views.offsets(positions)).max(axis=0) * abs(candidates).max()).astype(int) + _RADIUS
    counted = textured[y:-y, x:-x]
    if not counted.any():
        return 0.0
    alone = (counted & ~(cost < _MISFIT * texture)[y:-y, x:-x]).astype(np.uint8)
    # without the narrow bands beside edges that are hidden from some views
    return float(cv2.morphologyEx(alone, cv2.MORPH_OPEN, np.ones((_HOLE, _HOLE), np.uint8)).sum() / counted.sum())


class _Views:
    """The reference view and others, filtered, reduced by a whole factor; disparities are in reduced pixels."""

    def __init__(self, light_field: LightField, most_pixels: int) -> None:
        self.light_field = light_field
        self.factor = math.ceil(math.sqrt(math.prod(light_field.shape) / most_pixels))
        self._prepared: dict[_Position, FloatMap] = {}
        self._own = light_field.reference_position
        self._brightness = float(light_field.reference_view.mean())
        self.reference = self._view(self._own)
        self.seen = ~dark_corners(light_field.reference_view, self.reference.shape, _HIGH_PASS + _RADIUS)
        view = light_field.reference_view
        brightest = float(np.quantile(np.max(cv2.split(view), axis=0), 0.99))
        self._flat = max(_FLAT * brightest, _FLAT_BLOCKS if _has_blocks(view) else 0.0)
        away = abs(np.argwhere(light_field.present) - self._own).max(axis=1)
        self.nearest, self._farthest = int(away[away > 0].min()), int(away.max())

    def reach(self, disparity: float) -> int:
        """Rows or columns to the farthest views in which a disparity does not move a pixel too far."""
        movement = min(_MOST_MOVEMENT * self.factor, _MOST_MOVEMENT_PART * min(self.light_field.shape))
        return int(max(self.nearest, min(self._farthest, movement / max(disparity, 1e-3))))

    def positions(self, reach: int, distances: Sequence[int]) -> _Positions:
        """Grid positions in the row and the column of the reference view; any others without those."""
        t0, s0 = self._own
        places = [(int(t), int(s)) for t, s in np.argwhere(self.light_field.present)]
        present = [(t, s) for t, s in places if 0 < max(abs(t - t0), abs(s - s0)) <= reach]
        cross = [(t, s) for t, s in present if t == t0 or s == s0]
        if len(cross) < 2:
            return self._bright(present[:: math.ceil(len(present) / _MOST_VIEWS)])
        return self._bright([(t, s) for t, s in cross if max(abs(t - t0), abs(s - s0)) in distances] or cross)

    def candidates(self, reach: int, low: float, high: float, sampling: float) -> FloatMap:
        """Disparities from low to high, ``sampling`` pixels apart in views ``reach`` steps away."""
        sampling /= reach
        numbers = np.arange(math.floor(low / self.factor / sampling), math.ceil(high / self.factor / sampling) + 1)
        return (numbers * sampling).astype(np.float32)

    def offsets(self, positions: _Positions, own: _Position | None = None) -> FloatMap:
        """Baselines (V, 2) from a view, the reference view unless given, to others."""
        baselines = self.light_field.baselines
        return np.asarray(baselines[tuple(np.transpose(positions))] - baselines[own or self._own], np.float32)

    def sweep(
        self, positions: _Positions, candidates: FloatMap, own: _Position | None = None, truncation: float = _TRUNCATION
    ) -> tuple[FloatMap, FloatMap, FloatMap, FloatMap]:
        """Match a view, the reference view unless given, with others (:func:`coarse_sweep`)."""
        views = np.stack([self._view(position) for position in positions])
        offsets = self.offsets(positions, own)
        return coarse_sweep(self._view(own or self._own), views, offsets, candidates, truncation, _RADIUS)

    def ends(self, reach: int, low: float, high: float, sampling: float) -> tuple[float, float, float]:
        """Lowest and highest trusted disparity, from views at most ``reach`` away, and movement of most pixels."""
        positions = self.positions(reach, [max(1, round(reach * n / 4)) for n in range(1, 5)])
        candidates = self.candidates(reach, low, high, sampling)
        lowest, second, mean, disparity = self.sweep(positions, candidates)
        # neighbours agree within a pixel of the farthest view, for any sampling
        tolerance = max(sampling, 1) / reach
        trusted = _trusted(lowest, second, mean, disparity, tolerance, self._flat) & self.seen
        if len(positions) <= _FEW_VIEWS:
            trusted &= self._matches_back(positions, candidates, disparity, tolerance)
        # against noise, which would stretch the range
        smooth = np.asarray(cv2.medianBlur(disparity, _MEDIAN), np.float32)
        # with few views, an unclear match counts less
        unclear = np.divide(lowest, second, out=np.ones_like(lowest), where=trusted)
        pixels, patches = _patches(trusted, np.minimum(1, len(positions) * (1 - unclear)) ** 2, smooth, tolerance)
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

    def _matches_back(self, places: _Positions, candidates: FloatMap, disparity: FloatMap, tolerance: float) -> BoolMap:
        """Whether the first other view, matched with all others, has the same disparity there; shape (H, W)."""
        first, *others = places
        back = self.sweep([self._own, *others], candidates, first)[-1]
        down, across = self.offsets([first])[0]
        y, x = np.indices(disparity.shape, np.float32)
        there = cv2.remap(back, x - disparity * across, y - disparity * down, cv2.INTER_NEAREST, borderValue=math.inf)
        return np.asarray(abs(there - disparity) < tolerance)

    def _bright(self, positions: _Positions) -> _Positions:
        """Positions of views that are not much darker than the reference view; all if these are too few."""
        views = self.light_field.rgb_views
        limit = _LEAST_BRIGHTNESS * float(views[self._own].mean())
        bright = [position for position in positions if float(views[position].mean()) >= limit]
        return bright if len(bright) > 1 else positions

    def _view(self, position: _Position) -> FloatMap:
        if position not in self._prepared:
            colours = as_unit_float(self.light_field.rgb_views[position])
            view = np.asarray(np.mean(cv2.split(colours), axis=0), np.float32)
            # as bright as the reference view, since lenses darken views at the border of the grid
            mean = float(view.mean())
            if position != self._own and mean > 0:
                view *= np.float32(self._brightness / mean)
            self._prepared[position] = _prepared(view, self.factor)
        return self._prepared[position]


def _prepared(grey: FloatMap, factor: int) -> FloatMap:
    """Reduced, high-pass filtered grey picture, (H, W) float32."""
    if factor > 1:
        size = (max(1, grey.shape[1] // factor), max(1, grey.shape[0] // factor))
        grey = np.asarray(cv2.resize(grey, size, interpolation=cv2.INTER_AREA), np.float32)
    smooth = cv2.GaussianBlur(grey, (0, 0), _BLUR_SIGMA)
    return np.asarray(smooth - cv2.blur(smooth, (_HIGH_PASS, _HIGH_PASS)), np.float32)


def _has_blocks(view: FloatMap) -> bool:
    """Whether strong JPEG compression left its blocks in a picture, (H, W, 3)."""
    grey = np.mean(cv2.split(view), axis=0)
    ratios = []
    for picture in (grey, grey.T):
        faint = np.minimum(abs(np.diff(picture, axis=1)), _FAINT).mean(axis=0)
        edges = np.arange(faint.size) % _BLOCK == _BLOCK - 1
        if not edges.any():
            return False
        ratios.append(float(faint[edges].mean()) / max(float(faint[~edges].mean()), 1e-6))
    return min(ratios) > _BLOCKINESS


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
