"""Find the disparity range of a scene from its views alone.

A coarse plane sweep over far more disparities than a scene has tells where the scene lies; a second one, about there
only, with views as far away as possible, tells its range. Only disparities that can be trusted count: those of
surfaces, patches of pixels whose best match is unambiguous and whose neighbours agree. The range is that of nearly all
of them, with a margin: one that is too narrow spoils the nearest or most distant surface, one that is too wide costs
time and accuracy.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from typing import NamedTuple

import cv2
import numpy as np

from sepi.channels import largest_channel, mean_of_channels
from sepi.errors import SepiError
from sepi.inspection.coarse_sweep import agreeing, coarse_sweep
from sepi.inspection.dark_corners import dark_corners
from sepi.lightfield import BoolMap, DisparityRange, FloatMap, LightField, as_unit_float, require_light_field

# Search: pixels per view step to each side at first, and if surfaces lie beyond; views up to this many steps away at
# first, and if surfaces move by more than so many pixels
_EXTENTS = (16.0, 32.0, 64.0, 128.0)
_REACHES = (4, 2, 1)
_FAR = 40.0
# movement in the farthest view when the range is measured: pixels at most, also as part of the shorter side; sampling
_MOST_MOVEMENT = 24.0
_MOST_MOVEMENT_PART = 0.25
_SAMPLING = 0.5
# views when there is no cross of them
_MOST_VIEWS = 16
# views that are much darker than the reference are not looked at
_LEAST_BRIGHTNESS = 0.3
# larger pictures are reduced by a whole factor
_MOST_PIXELS = 600_000

# Filters, pixels: against noise, against differences of brightness between views; matching windows of the two sweeps
_BLUR_SIGMA = 0.8
_HIGH_PASS = 9
_SEARCH_RADIUS = 2
_RADIUS = 3
# window of the median of disparities
_MEDIAN = 5
# largest difference that counts, full range = 1
_TRUNCATION = 0.1

# Trust: lowest cost as part of the lowest outside its valley. A limit on the cost itself would add nothing here, and
# would have to know the noise.
_MOST_AMBIGUITY = 0.8
# mean above lowest cost, the brightest of the picture = 1: less is rounding; full range = 1: less is, where JPEG left
# blocks, their edges, which match those of any other block
_FLAT = 1e-3
_FLAT_BLOCKS = 3e-3
# side of these blocks; a picture has them where differences across their edges are so many times those inside; larger
# differences than this, full range = 1, are the scene's
_BLOCK = 8
_BLOCKINESS = 1.9
_FAINT = 4 / 255
# pixels of a window of so many, itself included, that agree within a candidate step
_SUPPORT_WINDOW = 5
_LEAST_SUPPORT = 13
# pixels of a patch, as part of the picture, and at least
_PATCH = 3e-4
_FEWEST_PIXELS = 20
# trusted pixels for the search to end, as part of the picture
_ENOUGH = 0.02

# Range: part of the pixels that is left out on either side, and the margin, as part of the span; in the search, fewer
_OUTLIERS = 0.001
_MARGIN = 0.06
_SEARCH_OUTLIERS = 0.0002
# outliers when it is decided whether surfaces lie beyond what was searched
_BEYOND = 0.001


class _Found(NamedTuple):
    """Disparities of the pixels that are trusted, and those of the patches that they make; pixels per view step."""

    pixels: FloatMap
    patches: FloatMap


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
        If too few pixels can be matched (no texture, or no disparity within 128 pixels per view step).

    Examples
    --------
    Before matching is done stage by stage; :func:`sepi.estimate_depth` does it by itself where no range is known.

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
    factor = math.ceil(math.sqrt(math.prod(light_field.shape) / _MOST_PIXELS))
    views = _Views(light_field, factor)
    low, high, sampling = _searched(views)
    # the search is sure to about two candidates
    measured, reach = _measured(views, low - 2 * sampling, high + 2 * sampling)
    if measured.pixels.size < _FEWEST_PIXELS:
        raise _undecided(light_field)
    low, high = (float(value) for value in np.quantile(measured.pixels, [_OUTLIERS, 1 - _OUTLIERS]))
    # small surfaces far before or behind the others are not outliers
    low, high = min(low, float(measured.patches.min())), max(high, float(measured.patches.max()))
    margin = max(_MARGIN * (high - low), _SAMPLING / 10 / reach)
    # two decimals more than the margin's first: numbers that can be read and typed
    digits = max(2, 1 - math.floor(math.log10(factor * margin)))
    scale = 10**digits
    return DisparityRange(
        math.floor(scale * factor * (low - margin)) / scale,
        math.ceil(scale * factor * (high + margin)) / scale,
        "estimated",
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


class _Views:
    """The reference view and others, filtered, reduced by a whole factor; disparities are in reduced pixels."""

    def __init__(self, light_field: LightField, factor: int) -> None:
        self.light_field, self._factor = light_field, factor
        self._prepared: dict[tuple[int, int], FloatMap] = {}
        self._own = light_field.reference_position
        self._brightness = float(light_field.reference_view.mean())
        self.reference = self._view(self._own)
        self.seen = ~dark_corners(light_field.reference_view, self.reference.shape, _HIGH_PASS + _SEARCH_RADIUS)
        view = light_field.reference_view
        brightest = float(np.quantile(largest_channel(view), 0.99))
        self._flat = max(_FLAT * brightest, _FLAT_BLOCKS if _has_blocks(view) else 0.0)

    def distances(self) -> tuple[int, int]:
        """Rows or columns from the reference view to the nearest and the farthest other view."""
        away = abs(np.argwhere(self.light_field.present) - self._own).max(axis=1)
        away = away[away > 0]
        return int(away.min()), int(away.max())

    def sweep(self, reach: int, distances: Iterable[int], candidates: FloatMap, radius: int) -> _Found:
        """Match the reference with views at some distances, ``reach`` at most; disparities that can be trusted."""
        positions = self._positions(reach, set(distances))
        if not positions:
            return _Found(np.empty(0, np.float32), np.empty(0, np.float32))
        views = np.stack([self._view(position) for position in positions])
        baselines = self.light_field.baselines[tuple(np.transpose(positions))].astype(np.float32)
        sweep = coarse_sweep(self.reference, views, baselines, candidates, _TRUNCATION, radius)
        sampling = float(candidates[1] - candidates[0])
        # neighbours agree within a pixel of the most distant view, however finely it is searched
        tolerance = max(sampling, 1 / reach)
        # against noise, which would stretch the range
        smooth = np.asarray(cv2.medianBlur(sweep[-1], _MEDIAN), np.float32)
        return _patches(_trusted(*sweep, tolerance, self._flat) & self.seen, smooth, tolerance)

    def _positions(self, reach: int, distances: set[int]) -> list[tuple[int, int]]:
        """Grid positions in the row and the column of the reference view; any others where those are not there."""
        t0, s0 = self._own
        present = [
            (int(t), int(s))
            for t, s in np.argwhere(self.light_field.present)
            if 0 < max(abs(t - t0), abs(s - s0)) <= reach
        ]
        cross = [(t, s) for t, s in present if t == t0 or s == s0]
        if len(cross) < 2:
            return self._bright(present[:: math.ceil(len(present) / _MOST_VIEWS)]) if present else []
        return self._bright([(t, s) for t, s in cross if max(abs(t - t0), abs(s - s0)) in distances] or cross)

    def _bright(self, positions: list[tuple[int, int]]) -> list[tuple[int, int]]:
        """Those that are not much darker than the reference view; all, if that leaves too few."""
        views = self.light_field.rgb_views
        limit = _LEAST_BRIGHTNESS * float(views[self._own].mean())
        bright = [position for position in positions if float(views[position].mean()) >= limit]
        return bright if len(bright) > 1 else positions

    def _view(self, position: tuple[int, int]) -> FloatMap:
        if position not in self._prepared:
            view = np.asarray(mean_of_channels(as_unit_float(self.light_field.rgb_views[position])), np.float32)
            # as bright as the reference: lenses darken the views towards the edge of the grid
            mean = float(view.mean())
            if position != self._own and mean > 0:
                view *= np.float32(self._brightness / mean)
            self._prepared[position] = _prepared(view, self._factor)
        return self._prepared[position]


def _searched(views: _Views) -> tuple[float, float, float]:
    """Lowest and highest disparity of a wide search, and its sampling."""
    nearest, farthest = views.distances()
    if nearest > _REACHES[0]:
        raise SepiError(f"{views.light_field.name}: no view within {_REACHES[0]} steps of the centre is present")
    best, sampling, extent = _Found(np.empty(0, np.float32), np.empty(0, np.float32)), 1.0, 0.0
    size = views.reference.size
    for reach in [n for n in _REACHES if nearest <= n <= farthest] or [nearest]:
        # at most half a picture at the most distant view
        widest = max(views.reference.shape) / 2 / reach
        for wanted in sorted({min(wanted, widest) for wanted in _EXTENTS}):
            if wanted < extent:
                continue
            number = max(1, math.ceil(wanted * reach))
            candidates = (np.arange(-number, number + 1) / reach).astype(np.float32)
            found = views.sweep(reach, range(1, reach + 1), candidates, _SEARCH_RADIUS)
            if found.pixels.size > best.pixels.size:
                best, sampling, extent = found, 1 / reach, wanted
            if found.pixels.size > _ENOUGH * size and _largest(found) < wanted - max(1, 2 / reach):
                break
        if best.pixels.size > _ENOUGH * size and _largest(best) / sampling < _FAR:
            break
    if best.pixels.size < _FEWEST_PIXELS:
        raise _undecided(views.light_field)
    low, high = np.quantile(best.pixels, [_SEARCH_OUTLIERS, 1 - _SEARCH_OUTLIERS])
    return float(low), float(high), sampling


def _measured(views: _Views, low: float, high: float) -> tuple[_Found, int]:
    """Disparities between two, by views as far away as possible; and how far that is."""
    _, farthest = views.distances()
    movement = min(_MOST_MOVEMENT, _MOST_MOVEMENT_PART * min(views.reference.shape))
    reach = int(max(1, min(farthest, movement / max(abs(low), abs(high)))))
    sampling = _SAMPLING / reach
    numbers = np.arange(math.floor(low / sampling), math.ceil(high / sampling) + 1)
    distances = [max(1, round(reach * n / 4)) for n in range(1, 5)]
    return views.sweep(reach, distances, (numbers * sampling).astype(np.float32), _RADIUS), reach


def _largest(found: _Found) -> float:
    """Largest absolute disparity but for outliers; infinite if there are none."""
    if not found.pixels.size:
        return math.inf
    return float(abs(np.quantile(found.pixels, [_BEYOND, 1 - _BEYOND])).max())


def _undecided(light_field: LightField) -> SepiError:
    return SepiError(
        f"{light_field.name}: the disparity range cannot be estimated, too few pixels match between the views; "
        "give one (MIN MAX, pixels per view step)"
    )


def _prepared(grey: FloatMap, factor: int) -> FloatMap:
    """Reduced, high-pass filtered picture, (H, W) float32, of a grey one."""
    if factor > 1:
        size = (max(1, grey.shape[1] // factor), max(1, grey.shape[0] // factor))
        grey = np.asarray(cv2.resize(grey, size, interpolation=cv2.INTER_AREA), np.float32)
    smooth = cv2.GaussianBlur(grey, (0, 0), _BLUR_SIGMA)
    return np.asarray(smooth - cv2.blur(smooth, (_HIGH_PASS, _HIGH_PASS)), np.float32)


def _has_blocks(view: FloatMap) -> bool:
    """Whether strong JPEG compression left its blocks in a picture, (H, W, 3)."""
    grey = mean_of_channels(view)
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
    """Pixels whose best candidate is clear, and has enough of the like about it, shape (H, W)."""
    clear = (lowest < _MOST_AMBIGUITY * second) & (mean - lowest > flat)
    return clear & (agreeing(disparity, clear, _SUPPORT_WINDOW, tolerance) >= _LEAST_SUPPORT)


def _patches(trusted: BoolMap, disparity: FloatMap, tolerance: float) -> _Found:
    """Trusted pixels in patches that are large enough: neighbours whose disparities are close to each other's."""
    H, W = trusted.shape
    # a pixel between any two neighbours says whether they are joined
    joined = np.zeros((2 * H - 1, 2 * W - 1), np.uint8)
    joined[::2, ::2] = trusted
    joined[::2, 1::2] = trusted[:, 1:] & trusted[:, :-1] & (abs(np.diff(disparity, axis=1)) < tolerance)
    joined[1::2, ::2] = trusted[1:] & trusted[:-1] & (abs(np.diff(disparity, axis=0)) < tolerance)
    labels = cv2.connectedComponents(joined, connectivity=4)[1][::2, ::2].ravel()
    areas = np.bincount(labels[trusted.ravel()], minlength=int(labels.max()) + 1)
    kept = trusted.ravel() & (areas[labels] >= max(_FEWEST_PIXELS, _PATCH * trusted.size))
    labels, pixels = labels[kept], disparity.ravel()[kept]
    order = np.lexsort((pixels, labels))
    starts = np.flatnonzero(np.diff(labels[order], prepend=-1))
    middles = starts + np.diff(starts, append=labels.size) // 2
    return _Found(pixels, pixels[order][middles])
