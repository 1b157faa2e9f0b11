"""How well views fit together under each order of their grid, but for the sign of the disparities.

Points of one view are matched with other views under each layout, over disparities of both signs: in the right layout
each point has a disparity at which all views agree.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass

import cv2
import numpy as np
import numpy.typing as npt

from sepi.inspection.view_order_kernels import layout_costs
from sepi.io.readers.options import ORDERS
from sepi.lightfield import FloatMap, LightField, as_unit_float

REACH = 8
"""Views up to this many steps away are looked at."""

Step = tuple[int, int]

# Larger pictures are reduced by a whole factor; smaller ones tell nothing
_MOST_PIXELS = 300_000
_LEAST_SIDE = 16
_BLUR_SIGMA = 0.8
_HIGH_PASS = 9

# Steps to the views that are tried first, and how many views; movement in the most distant of them, pixels, that is
# searched, and its step; reductions that reach disparities beyond that
_FIRST_REACH = 4
_MOST_VIEWS = 16
_MOVEMENT = 10
_MOVEMENT_STEP = 0.6
_REDUCTIONS = (2, 4)
# Half width of a patch, pixels; points along a side of the picture
_PATCH_RADIUS = 2
_CELLS = 24
# Clear: fewest points, next layout's matching cost over the best's, and how many standard errors their difference is
_FEWEST_POINTS = 30
_CLEAR_RATIO = 1.1
_CLEAR_ERRORS = 8.0
# Matching cost of a point that is matched, and part of those that may lie at an end of the search
_MATCHED = 0.5
_AT_END = 0.02


class Views:
    """The views about the middle of the grid, reduced and filtered when they are first asked for.

    ``steps`` lead from the view in the middle to each other one that is present: rows and columns of views. ``shape``
    is the height and width in pixels, as reduced.
    """

    def __init__(self, light_field: LightField) -> None:
        self._views = light_field.rgb_views
        self._factor = max(1, math.ceil(math.sqrt(math.prod(light_field.shape) / _MOST_PIXELS)))
        self._grey: dict[tuple[int, int, int], FloatMap] = {}
        positions = np.argwhere(light_field.present)
        distance = abs(positions - np.array(light_field.grid) // 2).sum(axis=1)
        self._middle = positions[distance.argmin()]
        self.steps: list[Step] = [(int(t), int(s)) for t, s in positions - self._middle if (t, s) != (0, 0)]
        height, width = light_field.shape
        self.shape = (height // self._factor, width // self._factor)

    def plain(self, step: Step, factor: int = 1) -> FloatMap:
        """Grey, slightly blurred view, (H, W) float32 in 0..1, reduced by a further factor."""
        key = (*step, factor)
        if key not in self._grey:
            view = np.ascontiguousarray(self._views[self._middle[0] + step[0], self._middle[1] + step[1]])
            factor *= self._factor
            size = (max(1, view.shape[1] // factor), max(1, view.shape[0] // factor))
            reduced = cv2.resize(view, size, interpolation=cv2.INTER_AREA) if factor > 1 else view
            grey = as_unit_float(cv2.cvtColor(reduced, cv2.COLOR_RGB2GRAY))
            self._grey[key] = np.asarray(cv2.GaussianBlur(grey, (0, 0), _BLUR_SIGMA), np.float32)
        return self._grey[key]

    def detail(self, step: Step, factor: int) -> FloatMap:
        """The same, high-pass filtered: differences of brightness between views do not count."""
        grey = self.plain(step, factor)
        return np.asarray(grey - cv2.blur(grey, (_HIGH_PASS, _HIGH_PASS)), np.float32)


@dataclass(frozen=True)
class Trial:
    """Layouts compared by the views at one distance."""

    layouts: list[dict[str, int]]
    """Orders of each layout, with the sign that they give to its disparities."""
    cost: FloatMap
    """Of each point under each layout, shape (P, L), 0..1."""
    disparity: FloatMap
    """Likewise, pixels per view step."""
    extent: float
    """Largest disparity searched, pixels per view step."""

    def matching_costs(self) -> dict[str, float]:
        """Mean matching cost of each order."""
        mean = self.cost.mean(axis=0)
        return {order: float(mean[n]) for n, layout in enumerate(self.layouts) for order in layout}

    @property
    def best(self) -> dict[str, int]:
        """Orders of the layout that fits best, with their signs."""
        return self.layouts[self._ranking[0]]

    @property
    def gap(self) -> float:
        """By how much the next layout's matching cost is above the best's."""
        return float(self._difference.mean())

    @property
    def errors(self) -> float:
        """The gap in standard errors."""
        return self.gap * math.sqrt(len(self.cost)) / max(float(self._difference.std()), 1e-6)

    @property
    def clear(self) -> bool:
        """Whether the best layout is clearly better than any other."""
        best, following = self.cost.mean(axis=0)[self._ranking[:2]]
        return bool(following >= _CLEAR_RATIO * best and self.errors >= _CLEAR_ERRORS)

    @property
    def largest_disparity(self) -> float:
        """Largest absolute disparity under the best layout, but for a few outliers."""
        best = self._ranking[0]
        matched = abs(self.disparity[self.cost[:, best] < _MATCHED, best])
        return float(np.quantile(matched, 1 - _AT_END)) if matched.size else self.extent

    @property
    def within(self) -> bool:
        """Whether the search goes beyond the scene's disparities."""
        return self.largest_disparity < 0.95 * self.extent

    @property
    def _ranking(self) -> list[int]:
        return [int(n) for n in self.cost.mean(axis=0).argsort(kind="stable")]

    @property
    def _difference(self) -> FloatMap:
        best, following = self._ranking[:2]
        return np.asarray(self.cost[:, following] - self.cost[:, best], np.float32)


def best_trial(views: Views) -> Trial | None:
    """The first trial that is clear and whose search is wide enough, or else the clearest; None if there is nothing."""
    best: Trial | None = None
    for reach, factor in _distances(views):
        trial = _tried(views, reach, factor)
        if trial is None:
            continue
        if trial.clear and trial.within:
            return trial
        if best is None or trial.errors > best.errors:
            best = trial
    return best


def steps_under(order: str, steps: list[Step]) -> npt.NDArray[np.int64]:
    """Steps of views after their grid is laid out anew by an order, shape (V, 2)."""
    grid = ORDERS[order](np.arange(9).reshape(3, 3))
    # where the views one row and one column after the centre go
    matrix = np.stack([np.argwhere(grid == view)[0] - 1 for view in (7, 5)])
    return np.asarray(np.array(steps, np.int64).reshape(-1, 2) @ matrix, np.int64)


def _distances(views: Views) -> Iterator[tuple[int, int]]:
    """Steps to the most distant view used, and further reduction: first a middle distance, then less, then more."""
    most_distant = min(REACH, max(max(map(abs, step)) for step in views.steps))
    reach = min(most_distant, _FIRST_REACH)
    while reach:
        yield reach, 1
        reach //= 2
    for factor in _REDUCTIONS:
        yield 1, factor
    if most_distant > _FIRST_REACH:
        yield most_distant, 1


def _tried(views: Views, reach: int, factor: int) -> Trial | None:
    """Compare the layouts by the views about ``reach`` steps away; None where they say nothing."""
    steps = _ring(views.steps, reach)
    layouts, offsets = _layouts(steps)
    if len(layouts) < 2 or min(views.shape) // factor < _LEAST_SIDE:
        return None
    reference = views.detail((0, 0), factor)
    points = _points(reference)
    if len(points) < _FEWEST_POINTS:
        return None
    count = round(_MOVEMENT / _MOVEMENT_STEP)
    candidates = (np.arange(-count, count + 1) * (_MOVEMENT_STEP / abs(offsets).max())).astype(np.float32)
    others = np.stack([views.detail(step, factor) for step in steps])
    cost, disparity = layout_costs(reference, others, offsets, candidates, points, _PATCH_RADIUS)
    return Trial(layouts, cost, disparity * factor, float(candidates[-1]) * factor)


def _ring(steps: list[Step], reach: int) -> list[Step]:
    """Views beyond half of ``reach``; first those along the axes and diagonals, and more distant ones."""

    def rank(step: Step) -> tuple[int, int, Step]:
        t, s = abs(step[0]), abs(step[1])
        return min(t, s, abs(t - s)), -max(t, s), step

    return sorted((step for step in steps if reach / 2 < max(map(abs, step)) <= reach), key=rank)[:_MOST_VIEWS]


def _layouts(steps: list[Step]) -> tuple[list[dict[str, int]], FloatMap]:
    """Orders that put these views at the same positions but for the sign, and those positions, shape (L, V, 2)."""
    layouts: list[dict[str, int]] = []
    positions: list[npt.NDArray[np.int64]] = []
    for order in ORDERS:
        position = steps_under(order, steps)
        for layout, known in zip(layouts, positions, strict=True):
            if np.array_equal(position, known) or np.array_equal(position, -known):
                layout[order] = 1 if np.array_equal(position, known) else -1
                break
        else:
            layouts.append({order: 1})
            positions.append(position)
    return layouts, np.stack(positions).astype(np.float32)


def _points(detail: FloatMap) -> npt.NDArray[np.int64]:
    """Pixels ``(y, x)`` to match, shape (P, 2): the one of each cell of the picture that is most like a corner."""
    H, W = detail.shape
    # away from the border as far as views move, where the picture is large enough
    edge = min(_MOVEMENT, min(H, W) // 4) + _PATCH_RADIUS + 1
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
    return np.asarray(np.stack([y, x], axis=2)[flat.max(axis=2) > 0], np.int64)
