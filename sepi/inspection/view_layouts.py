"""Matching cost of the views under each order of their grid, regardless of the sign of the disparities.

Points of one view are matched with other views under each layout, over disparities of both signs: in the right layout,
all views agree on one disparity for each point. Layouts can also differ in the spacing of rows, see
:mod:`sepi.inspection.arrangement`.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from typing import NamedTuple

import cv2
import numpy as np
import numpy.typing as npt

from sepi.image.noise import noise_level
from sepi.io.readers.options import ORDERS
from sepi.kernels import view_order as kernels
from sepi.lightfield import FloatMap, LightField, as_unit_float
from sepi.process.threads import threads_used

REACH = 8
"""Views up to this many rows or columns away are looked at."""

Baseline = tuple[int, int]
"""Rows and columns of views from one view to another."""

# Larger pictures are reduced by a whole factor; smaller ones tell nothing
_MOST_PIXELS = 300_000
_LEAST_SIDE = 16
_BLUR_SIGMA = 0.8
_HIGH_PASS = 9

# Baselines to the views that are tried first, and how many views; movement in the most distant of them, pixels, that is
# searched, and its spacing; reductions that reach disparities beyond that
_FIRST_REACH = 4
_MOST_VIEWS = 16
MOVEMENT = 10
SAMPLING = 0.6
_REDUCTIONS = (2, 4, 8)
# Unusable views: those below this part of the reference's brightness or contrast
_LEAST_BRIGHTNESS = 0.3
_LEAST_CONTRAST = 0.4
# Half width of a patch, pixels; points along a side of the picture
_PATCH_RADIUS = 2
_CELLS = 24
# Clear: fewest points, next layout's matching cost over the best's, and how many standard errors their difference is
FEWEST_POINTS = 30
_CLEAR_RATIO = 1.1
_CLEAR_ERRORS = 8.0
# Matching cost of a point that is matched, and part of those that may lie at an end of the search
MATCHED = 0.5
AT_END = 0.02
# Contrast of detail, as a multiple of the noise, that is texture: of noise alone a quarter is left
_LEAST_TEXTURE = 1.5


class Views:
    """The views about the middle of the grid, reduced and filtered when they are first asked for.

    ``middle`` is the position of the view in the middle, ``baselines`` lead from it to each other one that is present,
    in rows and columns. ``factor`` is what larger pictures are reduced by, ``shape`` their height and width then, in
    pixels.
    """

    def __init__(self, light_field: LightField, most_pixels: int = _MOST_PIXELS) -> None:
        self._views = light_field.rgb_views
        self.factor = max(1, math.ceil(math.sqrt(math.prod(light_field.shape) / most_pixels)))
        self._grey: dict[tuple[int, int, int], FloatMap] = {}
        self._detail: dict[tuple[int, int, int], FloatMap] = {}
        positions = np.argwhere(light_field.present)
        distance = abs(positions - np.array(light_field.grid) // 2).sum(axis=1)
        t0, s0 = self.middle = tuple(map(int, positions[distance.argmin()]))
        self.baselines: list[Baseline] = [
            (int(t) - t0, int(s) - s0) for t, s in positions if (int(t), int(s)) != self.middle
        ]
        height, width = light_field.shape
        self.shape = (height // self.factor, width // self.factor)

    @property
    def reference_view(self) -> FloatMap:
        """The view in the middle as it is, (H, W, 3) float32."""
        return as_unit_float(self._views[self.middle])

    def in_steps(self, light_field: LightField, baselines: list[Baseline]) -> npt.NDArray[np.float64]:
        """Baselines in view steps, shape (V, 2), of the light field with its views where they are known to be."""
        t, s = (np.array(baselines, np.int64).reshape(-1, 2) + self.middle).T
        return np.asarray(light_field.baselines[t, s] - light_field.baselines[self.middle], np.float64)

    def is_too_small(self, factor: int) -> bool:
        """Whether the views tell nothing, reduced by a further factor."""
        return min(self.shape) // factor < _LEAST_SIDE

    def worth_matching(self, baselines: list[Baseline]) -> list[Baseline]:
        """The views that are neither dark nor low in contrast beside the reference; all, if those are too few.

        Lenses darken and blur the views towards the edge of the grid, so that hardly more than noise is left.
        """
        self.details(baselines)
        own, *lights = np.array([self._light(baseline) for baseline in ((0, 0), *baselines)])
        least = own * (_LEAST_BRIGHTNESS, _LEAST_CONTRAST)
        kept = [baseline for baseline, light in zip(baselines, lights, strict=True) if (light >= least).all()]
        return kept if 2 * len(kept) >= min(len(baselines), 4) else baselines

    def details(self, baselines: list[Baseline]) -> list[FloatMap]:
        """:meth:`detail` of several views."""
        # which all are compared with: not to be made by each thread
        self.detail((0, 0))
        # OpenCV works outside Python's lock, on one thread for pictures as small as these
        with ThreadPoolExecutor(threads_used()) as pool:
            return list(pool.map(self.detail, baselines))

    def _light(self, baseline: Baseline) -> tuple[float, float]:
        """Mean and contrast of a view as it is."""
        contrast = cv2.meanStdDev(self.detail(baseline))[1][0, 0]
        return cv2.mean(self._read(baseline, 1))[0], contrast / self._gain(baseline, 1)

    def _gain(self, baseline: Baseline, factor: int) -> float:
        """What makes a view as bright as the reference."""
        own, mean = (cv2.mean(self._read(at, factor))[0] for at in ((0, 0), baseline))
        return own / mean if mean > 0 else 1.0

    def plain(self, baseline: Baseline, factor: int = 1) -> FloatMap:
        """Grey, slightly blurred view, (H, W) float32, reduced by a further factor; as bright as the reference."""
        grey = self._read(baseline, factor)
        return grey if baseline == (0, 0) else np.asarray(grey * np.float32(self._gain(baseline, factor)))

    def _read(self, baseline: Baseline, factor: int) -> FloatMap:
        key = (*baseline, factor)
        if key not in self._grey:
            view = np.ascontiguousarray(self._views[self.middle[0] + baseline[0], self.middle[1] + baseline[1]])
            factor *= self.factor
            size = (max(1, view.shape[1] // factor), max(1, view.shape[0] // factor))
            reduced = cv2.resize(view, size, interpolation=cv2.INTER_AREA) if factor > 1 else view
            grey = as_unit_float(cv2.cvtColor(reduced, cv2.COLOR_RGB2GRAY))
            self._grey[key] = np.asarray(cv2.GaussianBlur(grey, (0, 0), _BLUR_SIGMA), np.float32)
        return self._grey[key]

    def detail(self, baseline: Baseline, factor: int = 1) -> FloatMap:
        """The same, high-pass filtered: differences of brightness between views do not count."""
        key = (*baseline, factor)
        if key not in self._detail:
            grey = self.plain(baseline, factor)
            self._detail[key] = np.asarray(grey - cv2.blur(grey, (_HIGH_PASS, _HIGH_PASS)), np.float32)
        return self._detail[key]


class Trial(NamedTuple):
    """Layouts compared by the views at one distance: those orders of the views that differ by more than the sign."""

    costs: dict[str, float]
    """Mean matching cost of each order, 0..1."""
    best: dict[str, int]
    """Orders of the layout that fits best, with the sign that they give to its disparities."""
    gap: float
    """By how much the next layout's matching cost is above the best's."""
    errors: float
    """The gap in standard errors."""
    clear: bool
    """Whether the best layout is clearly better than any other."""
    largest_disparity: float
    """Under the best layout, but for a few outliers: absolute, pixels of the light field per view step."""
    within: bool
    """Whether the search goes beyond the scene's disparities."""


def best_trial(light_field: LightField, views: Views) -> tuple[Trial | None, bool]:
    """The first trial that is clear and whose search is wide enough, or else the clearest; None if there is nothing.

    And whether none is clear because views that show texture beyond their noise match badly under every order, at any
    distance: where nothing moves between them, they match under all.
    """
    tried, bad = [], []
    for reach, factor in search_distances(views):
        trial = _tried(light_field, views, reach, factor)
        if factor == 1:
            bad.append(trial is not None and min(trial.costs.values()) >= MATCHED)
        if trial is None:
            continue
        if trial.clear and trial.within:
            return trial, False
        tried.append(trial)
    best = max(tried, key=lambda trial: trial.errors, default=None)
    if best is None or best.clear or not all(bad):
        return best, False
    return best, bool(views.detail((0, 0)).std() >= _LEAST_TEXTURE * noise_level(views.reference_view))


def baselines_under(order: str, baselines: npt.NDArray[np.float64]) -> npt.NDArray[np.float64]:
    """Baselines (V, 2) of views after their grid is laid out anew by an order."""
    grid = ORDERS[order](np.arange(9).reshape(3, 3))
    # where the views one row and one column after the centre go
    matrix = np.stack([np.argwhere(grid == view)[0] - 1 for view in (7, 5)])
    return np.asarray(baselines @ matrix)


def search_distances(views: Views) -> Iterator[tuple[int, int]]:
    """Baselines to the most distant view used, and further reduction: first a middle distance, then less, then more."""
    most_distant = min(REACH, max(max(map(abs, baseline)) for baseline in views.baselines))
    reach = min(most_distant, _FIRST_REACH)
    while reach:
        yield reach, 1
        reach //= 2
    for factor in _REDUCTIONS:
        yield 1, factor
    if most_distant > _FIRST_REACH:
        yield most_distant, 1


def _tried(light_field: LightField, views: Views, reach: int, factor: int) -> Trial | None:
    """Compare the layouts by the views about ``reach`` rows or columns away; None where they say nothing."""
    baselines = views.worth_matching(ring(views.baselines, reach))
    layouts, offsets = _layouts(views.in_steps(light_field, baselines))
    if len(layouts) < 2 or views.is_too_small(factor):
        return None
    found = matched(views, (0, 0), baselines, factor, offsets)
    if found is None:
        return None
    cost, disparity = found
    mean = cost.mean(axis=0)
    best, following = mean.argsort(kind="stable")[:2]
    difference = cost[:, following] - cost[:, best]
    gap = float(difference.mean())
    errors = gap * math.sqrt(len(cost)) / max(float(difference.std()), 1e-6)
    sizes = abs(factor * disparity[cost[:, best] < MATCHED, best])
    extent = factor * round(MOVEMENT / SAMPLING) * SAMPLING / float(abs(offsets).max())
    largest = float(np.quantile(sizes, 1 - AT_END)) if sizes.size else extent
    return Trial(
        costs={order: float(mean[n]) for n, layout in enumerate(layouts) for order in layout},
        best=layouts[best],
        gap=gap,
        errors=errors,
        clear=bool(mean[following] >= _CLEAR_RATIO * mean[best]) and errors >= _CLEAR_ERRORS,
        largest_disparity=views.factor * largest,
        within=largest < 0.95 * extent,
    )


def matched(
    views: Views,
    reference: Baseline,
    baselines: list[Baseline],
    factor: int,
    offsets: npt.NDArray[np.floating],
    movement: float = MOVEMENT,
    most_points: int | None = None,
    sampling: float = SAMPLING,
) -> tuple[FloatMap, FloatMap] | None:
    """Matching costs of a view's points with other views, under several layouts of these.

    Parameters
    ----------
    views : Views
    reference, baselines : pair of int, list of pairs of int
        The view, and the others.
    factor : int
        By which the views are reduced further.
    offsets : ndarray, shape (L, V, 2)
        Baseline ``(down, across)`` to each of the others under each layout.
    movement, sampling : float
        Of points in the farthest view, pixels: the most that is searched, and in which steps.
    most_points : int, optional
        As in :func:`points_to_match`.

    Returns
    -------
    cost, disparity : ndarrays, shape (P, L), float32
        Lowest mean over the views of ``r^2 / (r^2 + s^2)``, 0..1, where ``s^2`` is a part of the patch's own variation;
        1 where no candidate keeps half of the views in sight. The candidate of the lowest, in pixels per unit of the
        baselines. None where there are too few points.
    """
    detail = views.detail(reference, factor)
    points = points_to_match(detail, most_points)
    if len(points) < FEWEST_POINTS:
        return None
    count = round(movement / sampling)
    candidates = (np.arange(-count, count + 1) * (sampling / abs(offsets).max())).astype(np.float32)
    others = np.stack([views.detail(baseline, factor) for baseline in baselines])
    positions = np.ascontiguousarray(offsets, np.float32)
    cost, disparity = np.empty((2, len(points), len(offsets)), np.float32)
    kernels.layout_costs(detail, others, positions, candidates, points, _PATCH_RADIUS, cost, disparity)
    return cost, disparity


def ring(baselines: list[Baseline], reach: int) -> list[Baseline]:
    """Views beyond half of ``reach``; first those along the axes and diagonals, and more distant ones."""

    def rank(baseline: Baseline) -> tuple[int, int, Baseline]:
        t, s = abs(baseline[0]), abs(baseline[1])
        return min(t, s, abs(t - s)), -max(t, s), baseline

    return sorted((baseline for baseline in baselines if reach / 2 < max(map(abs, baseline)) <= reach), key=rank)[
        :_MOST_VIEWS
    ]


def _layouts(baselines: npt.NDArray[np.float64]) -> tuple[list[dict[str, int]], FloatMap]:
    """Orders that put views ``(V, 2)`` at the same positions but for the sign, and those positions, (L, V, 2)."""
    layouts: list[dict[str, int]] = []
    positions: list[npt.NDArray[np.float64]] = []
    for order in ORDERS:
        position = baselines_under(order, baselines)
        for layout, known in zip(layouts, positions, strict=True):
            if np.array_equal(position, known) or np.array_equal(position, -known):
                layout[order] = 1 if np.array_equal(position, known) else -1
                break
        else:
            layouts.append({order: 1})
            positions.append(position)
    return layouts, np.stack(positions).astype(np.float32)


def points_to_match(detail: FloatMap, most: int | None = None) -> npt.NDArray[np.int64]:
    """Pixels ``(y, x)`` to match, shape (P, 2): the most corner-like pixel of each cell of the picture.

    With ``most``, only that many of the most corner-like, in picture order.
    """
    H, W = detail.shape
    # away from the border as far as views move, where the picture is large enough
    edge = min(MOVEMENT, min(H, W) // 4) + _PATCH_RADIUS + 1
    strength = cv2.cornerMinEigenVal(detail, 5)[edge : H - edge, edge : W - edge]
    side = max(2, math.ceil(math.sqrt(strength.size) / _CELLS))
    rows, columns = strength.shape[0] // side, strength.shape[1] // side
    if rows * columns == 0:
        return np.empty((0, 2), np.int64)
    cells = strength[: rows * side, : columns * side].reshape(rows, side, columns, side).swapaxes(1, 2)
    flat = cells.reshape(rows, columns, side * side)
    position = flat.argmax(axis=2)
    y = np.arange(rows)[:, None] * side + position // side + edge
    x = np.arange(columns)[None] * side + position % side + edge
    points, strengths = np.stack([y, x], axis=2).reshape(-1, 2), flat.max(axis=2).ravel()
    kept = np.flatnonzero(strengths > 0)
    if most is not None:
        kept = np.sort(kept[np.argsort(-strengths[kept], kind="stable")[:most]])
    return np.asarray(points[kept], np.int64)
