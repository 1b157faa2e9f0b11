"""What files leave open, from the views alone: the grid that a numbered sequence fills, and the spacing of its rows.

Names that only count the views do not tell the number of rows and columns, whether views are counted by row or by
column, whether the camera ran back and forth, or whether the views fill the grid: crosses are common. Each arrangement
of that many views is tried; in the right one, neighbours match everywhere.

A camera gantry may use different vertical and horizontal steps. Points of one view are matched with views above and
below it, and with those beside it: their movements along columns and rows of views tell the ratio of the steps.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import replace
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from sepi.errors import SepiError, warn
from sepi.inspection import view_layouts
from sepi.inspection.view_layouts import AT_END, FEWEST_POINTS, MATCHED, MOVEMENT, Views, matched
from sepi.inspection.view_order import odd_views
from sepi.io.readers.options import ReadOptions
from sepi.io.readers.view_grid import arrange_numbers, taken
from sepi.lightfield import LightField

Positions = npt.NDArray[np.int64]

# Largest ratio of a grid's longer side to its shorter
_MOST_SLENDER = 6
# Number of reference views, spread over the sequence, of neighbours matched with each, and of points in each. The worst
# matches decide (one in so many): a wrong arrangement may be right except at the ends of its rows
_REFERENCES = 24
_NEIGHBOURS = 12
_POINTS = 40
_WORST = 3
# Distances to the neighbours, and image reductions that make larger movement searchable
_DISTANCES = ((2, 1), (2, 2), (2, 4), (6, 1))
# The rows of views may run up or down; the sign of the disparity does not matter
_ORDERS = ("as-given", "flip-rows")
# Decision: least ratio and difference of the next arrangement's matching cost to the best's; ratio from which on no
# other distance is tried; largest cost of views that fit together
_CLEAR_RATIO = 1.15
_LEAST_DIFFERENCE = 0.01
_PLAIN_RATIO = 1.5
_MOST_COST = 0.65
# steps by the golden ratio spread positions evenly, and out of step with rows
_GOLDEN = (math.sqrt(5) - 1) / 2


class Arrangement(NamedTuple):
    """A way to put a sequence of views into a grid.

    Attributes
    ----------
    name : str
        Name for users: ``"3x3 row by row"``.
    positions : ndarray, shape (N, 2), int64
        Row and column of each view of the sequence.
    """

    name: str
    positions: Positions

    @property
    def grid(self) -> tuple[int, int]:
        """Rows and columns."""
        rows, columns = self.positions.max(axis=0) + 1
        return int(rows), int(columns)


def arrange(light_field: LightField, options: ReadOptions) -> LightField:
    """The light field with its numbered views in the grid in which they fit together.

    Parameters
    ----------
    light_field : LightField
        A single row of views in the order of their numbers.
    options : ReadOptions
        ``central``, ``order``, ``exclude`` by position and ``view`` refer to the grid.

    Returns
    -------
    LightField
        With a note on the arrangement.

    Warns
    -----
    SepiWarning
        If the arrangement is unclear, and a square is assumed.

    Raises
    ------
    SepiError
        If the views fit together in no arrangement, it is unclear, or the options do not fit the grid.
    """
    source, count = light_field.source or light_field.name, light_field.grid[1]
    tried = list(arrangements(count))
    costs = _costs(Views(light_field), light_field.present[0], tried)
    ranked = sorted(range(len(tried)), key=lambda n: costs[n])
    names = ", ".join(way.name for way in tried)
    if math.isfinite(costs[ranked[0]]) and costs[ranked[0]] > _MOST_COST:
        odd = "; ".join(odd_views(light_field)) or "leave out pictures that are not views by --exclude"
        raise SepiError(
            f"{source}: {count} views without row and column fit together in no arrangement tried ({names}); "
            f"give --grid ROWSxCOLUMNS, or {odd}"
        )
    best, reason = tried[ranked[0]], "in which they fit together"
    if len(tried) > 1 and not _CLEAR_RATIO * costs[ranked[0]] + _LEAST_DIFFERENCE <= costs[ranked[1]] < math.inf:
        square = next((one for one in tried if one.grid[0] ** 2 == len(one.positions) == one.grid[1] ** 2), None)
        if square is None:
            raise SepiError(f"{source}: {count} views whose arrangement is unclear ({names}); give --grid ROWSxCOLUMNS")
        warn(f"{source}: the grid of the views is unclear; taken for {square.name}, set another by --grid")
        best, reason = square, "since the views are unclear"
    note = f"{count} numbered views taken for {best.name}, {reason}; set another by --grid"
    return _placed(light_field, best, options, note)


def arrangements(count: int) -> Iterator[Arrangement]:
    """Arrangements to try for a number of views; a square first."""
    sides = [side for side in range(math.isqrt(count), 1, -1) if count % side == 0 and count <= _MOST_SLENDER * side**2]
    for short in sides:
        long = count // short
        for rows, columns in sorted({(short, long), (long, short)}):
            grid = np.stack(np.divmod(np.arange(count), columns), axis=1)
            yield Arrangement(f"{rows}x{columns} row by row", grid)
            back = grid.copy()
            back[grid[:, 0] % 2 == 1, 1] = columns - 1 - back[grid[:, 0] % 2 == 1, 1]
            yield Arrangement(f"{rows}x{columns} row by row, back and forth", back)
            # the transpose of the arrangement row by row in a grid of COLUMNSxROWS
            yield Arrangement(f"{columns}x{rows} column by column", grid[:, ::-1])
            yield Arrangement(f"{columns}x{rows} column by column, back and forth", back[:, ::-1])
    line = np.stack([np.zeros(count, np.int64), np.arange(count)], axis=1)
    yield Arrangement(f"a single row of {count}", line)
    yield Arrangement(f"a single column of {count}", line[:, ::-1])
    yield from _crosses(count)


def _crosses(count: int) -> Iterator[Arrangement]:
    """Crosses of a row and a column of equal length; the first one is whole, the other lacks the middle."""
    if count % 4 != 1 or count < 5:
        return
    half = count // 4
    along = np.arange(2 * half + 1)
    whole = np.stack([np.full_like(along, half), along], axis=1)
    cross = np.concatenate([whole, np.delete(whole[:, ::-1], half, axis=0)])
    name = f"a cross of {len(along)}x{len(along)}"
    yield Arrangement(f"{name}, the row first", cross)
    yield Arrangement(f"{name}, the column first", cross[:, ::-1])
    ordered = cross[np.lexsort((cross[:, 1], cross[:, 0]))]
    yield Arrangement(f"{name} row by row", ordered)
    yield Arrangement(f"{name} column by column", ordered[:, ::-1])


def _costs(views: Views, present: npt.NDArray[np.bool_], tried: list[Arrangement]) -> list[float]:
    """Matching cost of each arrangement, 0..1, from the views that best separate them; infinite without texture."""
    best, clearest = [math.inf] * len(tried), -1.0
    for reach, factor in _DISTANCES:
        if views.is_too_small(factor):
            continue
        costs = [_cost(views, present, way.positions, reach, factor) for way in tried]
        first, second = sorted([*costs, math.inf])[:2]
        clear = second / max(first, 1e-6) if first <= _MOST_COST and len(tried) > 1 else 1 - first
        if math.isfinite(first) and clear > clearest:
            best, clearest = costs, clear
        if clearest >= _PLAIN_RATIO:
            break
    return best


def _cost(views: Views, present: npt.NDArray[np.bool_], positions: Positions, reach: int, factor: int) -> float:
    """Matching cost of the views that match their neighbours worst, under the better order."""
    count = len(positions)
    places = dict.fromkeys(int(count * ((n + 0.5) * _GOLDEN % 1)) for n in range(_REFERENCES))
    costs = []
    for place in places:
        near = _neighbours(positions, present, place, reach)
        if not present[place] or not near:
            continue
        away = positions[near] - positions[place]
        offsets = np.stack([view_layouts.baselines_under(order, away) for order in _ORDERS])
        # baselines from the middle view
        here, *others = ((0, n - views.middle[1]) for n in (place, *near))
        found = matched(views, here, others, factor, offsets, most_points=_POINTS)
        if found is not None:
            costs.append(found[0].mean(axis=0))
    if not costs:
        return math.inf
    return float(np.sort(np.stack(costs), axis=0)[-math.ceil(len(costs) / _WORST) :].mean(axis=0).min())


def _neighbours(positions: Positions, present: npt.NDArray[np.bool_], place: int, reach: int) -> list[int]:
    """Some neighbours of a view, as places in the sequence; those along the axes and diagonals first."""
    steps = abs(positions - positions[place])
    far = steps.max(axis=1)
    near = np.flatnonzero(present & (far <= reach) & (far > (reach - 1) // 2))
    rank = sorted(near.tolist(), key=lambda n: (min(*steps[n], abs(steps[n][0] - steps[n][1])), int(far[n]), n))
    return rank[:_NEIGHBOURS]


def _placed(light_field: LightField, way: Arrangement, options: ReadOptions, note: str) -> LightField:
    """The light field in the grid of an arrangement, with order and selection of the options."""
    rows, columns = way.grid
    sequence = np.full((rows, columns), -1)
    sequence[tuple(way.positions.T)] = np.arange(len(way.positions))
    numbers = arrange_numbers(light_field.source or light_field.name, way.grid, options)
    # number in the grid to number in the sequence; -1 for missing and excluded views
    order = np.where(numbers >= 0, sequence.ravel()[numbers], -1)
    notes = (*light_field.notes, note)
    return replace(light_field, view=options.view, arranged=True, notes=notes, **taken(light_field, order))


# Reductions of the pictures, and distances of views, in which movements are searched
_REDUCTIONS, _REACHES = (1, 2, 4, 8), (8, 4, 2, 1)
# Spacing of the movements that are compared, pixels in the farthest view
_FINE_SAMPLING = 0.1
# A spacing is clear if movements differ from those of equal spacing by this multiple of what they differ from its own
_CLEARLY = 3.0
# Smaller differences from one are not reported: they are within the measurement error
_LEAST_CHANGE = 0.04
# Spacings within this factor of one need a second test: interpolation smooths noise, and decoded lenslet pictures are
# shifted by a few hundredths of a pixel; either can favour a spacing that is a tenth off
_DOUBTED = 1.25


def settle_row_spacing(light_field: LightField, views: Views | None = None) -> LightField:
    """The light field with the row spacing estimated from its views, and a note; unchanged if that fails.

    Nothing is done where a spacing or positions of the views are known already. ``views``: its views, where they are
    looked at otherwise, too.
    """
    if light_field.settled or light_field.positions is not None or light_field.row_spacing != 1:
        return light_field
    spacing = estimate_row_spacing(views or Views(light_field))
    if spacing is None:
        return light_field
    spacing = round(spacing, 3)
    note = f"rows of views are {spacing:g} times as far apart as columns (estimated); set it by --row-spacing"
    return replace(light_field, row_spacing=spacing, notes=(*light_field.notes, note))


def estimate_row_spacing(views: Views) -> float | None:
    """Distance of rows in view steps, if another than that of columns fits clearly better.

    Parameters
    ----------
    views : Views
        Their own row spacing is not used.

    Returns
    -------
    float or None
        For the order in which the light field was read. None if rows are as far apart as columns, there is only one
        row or column, or the spacing is unclear.
    """
    for factor in _REDUCTIONS:
        rows, columns = (_movements(views, axis, factor) for axis in (0, 1))
        # rows and columns of views each move points along their own axis of the pictures
        if rows is None or columns is None or rows.axis == columns.axis:
            continue
        both = rows.matched & columns.matched & (columns.steps != 0)
        if both.sum() < FEWEST_POINTS:
            continue
        down, across = rows.steps[both], columns.steps[both]
        # of the points that move most
        ratio = float(np.median((down / across)[abs(across) >= np.median(abs(across))]))
        sign, off = math.copysign(1, ratio), abs(down - ratio * across)
        if _CLEARLY * np.median(off) >= np.median(abs(down - sign * across)):
            return None
        kept = off <= 2 * np.median(off)
        spacing = float(abs(down[kept]).sum() / abs(across[kept]).sum())
        if not spacing or abs(math.log(spacing)) < _LEAST_CHANGE:
            return None
        near = abs(math.log(spacing)) < math.log(_DOUBTED)
        return None if near and not _is_slope(sign * down, across, spacing) else spacing
    return None


class _Movements(NamedTuple):
    """How points of the middle view move along its column or row of views.

    Along the pictures' ``axis``, by ``steps`` (P,) pixels of :class:`Views` from view to view, which are known of the
    ``matched`` points.
    """

    axis: int
    steps: npt.NDArray[np.floating]
    matched: npt.NDArray[np.bool_]


def _movements(views: Views, axis: int, factor: int) -> _Movements | None:
    """Movements along the column (axis 0) or row (1) of the middle view, in the farthest views that the search reaches.

    None where nothing can be matched.
    """
    line = [baseline for baseline in views.baselines if baseline[1 - axis] == 0]
    for reach in _REACHES:
        baselines = views.worth_matching(view_layouts.ring(line, reach))
        if not baselines or views.is_too_small(factor):
            continue
        steps = np.array([baseline[axis] for baseline in baselines], np.float64)
        farthest = abs(steps).max()
        offsets = np.stack([steps[:, None] * one / farthest for one in np.eye(2)])
        found = matched(views, (0, 0), baselines, factor, offsets)
        if found is None:
            continue
        best = int(found[0].mean(axis=0).argmin())
        moved = abs(found[1][found[0][:, best] < MATCHED, best])
        if moved.size < FEWEST_POINTS or np.quantile(moved, 1 - AT_END) > 0.95 * MOVEMENT:
            continue
        farther = factor * float(moved.max()) + 1
        found = matched(views, (0, 0), baselines, 1, offsets[[best]], farther, sampling=_FINE_SAMPLING)
        if found is not None:
            return _Movements(best, found[1][:, 0] / farthest, found[0][:, 0] < MATCHED)
    return None


def _is_slope(down: npt.NDArray[np.floating], across: npt.NDArray[np.floating], spacing: float) -> bool:
    """Whether a line through the movements has this slope, surely not one.

    It may miss the origin, so that a shift of all views does not count.
    """
    # here, since it takes a while to load, and hardly any light field needs it
    from scipy.stats import theilslopes

    if not np.ptp(across):
        return False
    # where nearly all movements are the same its interval is none, and no number is nearer than that
    with np.errstate(invalid="ignore"):
        line = theilslopes(down, across)
    # all of the slope's interval of confidence is nearer to the spacing than to one
    middle = math.sqrt(spacing)
    return bool(line.low_slope > middle if spacing > 1 else line.low_slope > 0 and line.high_slope < middle)
