"""Finds the grid that a numbered sequence of views fills, from the views alone.

Names that only count the views do not tell the number of rows and columns, whether views are counted by row or by
column, whether the camera ran back and forth, or whether the views fill the grid: crosses are common. Each
arrangement of that many views is tried; in the right one, neighbours match everywhere.
"""

from __future__ import annotations

import math
import warnings
from collections.abc import Iterator
from dataclasses import replace
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from sepi.errors import SepiError, SepiWarning
from sepi.inspection.view_layouts import Baseline, Views, baselines_under, matched
from sepi.inspection.view_order import odd_views
from sepi.io.readers.options import ReadOptions
from sepi.io.readers.view_grid import arrange_numbers
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
        square = next(
            (way for way in tried if way.grid[0] == way.grid[1] and len(way.positions) == way.grid[0] ** 2), None
        )
        if square is None:
            raise SepiError(
                f"{source}: {count} views without row and column, and their arrangement is unclear "
                f"({names}); give --grid ROWSxCOLUMNS"
            )
        warnings.warn(
            f"{source}: the grid of the views is unclear; taken for {square.name}, set another by --grid",
            SepiWarning,
            stacklevel=2,
        )
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
        offsets = np.stack([baselines_under(order, positions[near] - positions[place]) for order in _ORDERS])
        here, *others = (_baseline(views, n) for n in (place, *near))
        found = matched(views, here, others, factor, offsets, most_points=_POINTS)
        if found is not None:
            costs.append(found[0].mean(axis=0))
    if not costs:
        return math.inf
    worst = np.sort(np.stack(costs), axis=0)[-math.ceil(len(costs) / _WORST) :]
    return float(worst.mean(axis=0).min())


def _neighbours(positions: Positions, present: npt.NDArray[np.bool_], place: int, reach: int) -> list[int]:
    """Some neighbours of a view, as places in the sequence; those along the axes and diagonals first."""
    steps = abs(positions - positions[place])
    far = steps.max(axis=1)
    near = np.flatnonzero(present & (far <= reach) & (far > (reach - 1) // 2))
    rank = sorted(near.tolist(), key=lambda n: (min(*steps[n], abs(steps[n][0] - steps[n][1])), int(far[n]), n))
    return rank[:_NEIGHBOURS]


def _baseline(views: Views, place: int) -> Baseline:
    """Baseline from the middle view to a view of the sequence."""
    return 0, place - views.middle[1]


def _placed(light_field: LightField, way: Arrangement, options: ReadOptions, note: str) -> LightField:
    """The light field in the grid of an arrangement, with order and selection of the options."""
    rows, columns = way.grid
    sequence = np.full((rows, columns), -1)
    sequence[tuple(way.positions.T)] = np.arange(len(way.positions))
    numbers = arrange_numbers(light_field.source or light_field.name, way.grid, options)
    # number in the grid to number in the sequence; -1 for missing and excluded views
    order = np.where(numbers >= 0, sequence.ravel()[numbers], -1)
    present = (order >= 0) & light_field.present[0][order]
    files = None if light_field.files is None else np.where(present, light_field.files[0][order], "")
    views = light_field.views[0][order]
    views[~present] = 0
    notes = (*light_field.notes, note)
    return replace(
        light_field, views=views, present=present, view=options.view, arranged=True, files=files, notes=notes
    )
