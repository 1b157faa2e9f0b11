"""Finds from the views alone what files leave open: the grid of numbered views, and the axes of an array.

Names that only count the views do not tell the number of rows and columns, whether views are counted by row or by
column, whether the camera ran back and forth, or whether the views fill the grid: crosses and discs are common. Each
arrangement of that many views is tried; in the right one, neighbours match everywhere.

An axis of 3 or 4 beside one of views may hold colours or a row of the grid: colours show no parallax against each
other, views do.
"""

from __future__ import annotations

import math
import warnings
from collections.abc import Iterator, Mapping
from dataclasses import replace
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from sepi.errors import SepiError, SepiWarning
from sepi.inspection.view_layouts import MOVEMENT, Baseline, Views, baselines_under, matched
from sepi.inspection.view_order import odd_views
from sepi.io.readers.options import ReadOptions, arrange_numbers
from sepi.lightfield import LightField

Positions = npt.NDArray[np.int64]

# Largest radius of the discs that are tried, and largest ratio of a grid's longer side to its shorter
_LARGEST_RADIUS = 24
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
    yield from _discs(count)


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
    yield from _as_in_the_grid(name, cross)


def _discs(count: int) -> Iterator[Arrangement]:
    """Discs of views round the middle of a grid."""
    y, x = np.mgrid[-_LARGEST_RADIUS : _LARGEST_RADIUS + 1, -_LARGEST_RADIUS : _LARGEST_RADIUS + 1]
    distances = np.unique(y**2 + x**2)
    # the first is one view, the second and third are a cross and a square of 3x3
    for distance in distances[(distances > 2) & (distances <= _LARGEST_RADIUS**2)]:
        disc = np.argwhere(y**2 + x**2 <= distance)
        if len(disc) == count and math.isqrt(count) ** 2 != count:
            positions = disc - disc.min(axis=0)
            side = int(positions.max()) + 1
            yield from _as_in_the_grid(f"a disc in {side}x{side}", positions)


def _as_in_the_grid(name: str, positions: Positions) -> Iterator[Arrangement]:
    """Positions row by row, and column by column."""
    ordered = positions[np.lexsort((positions[:, 1], positions[:, 0]))]
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


# number of sequences of pictures, reductions for the search of movement, and its spacing
_SEQUENCES = 8
_REDUCTIONS = (1, 2, 4)
_SPACING = 0.3
# ratio of the matching cost in place to the least with movement: largest for colours, least for views
_COLOURS = 1.2
_VIEWS = 1.4
_COLOUR_COUNTS = (3, 4)


def fitting_axes(readings: Mapping[str, LightField]) -> str | None:
    """The order of axes in which an array's pictures match; None if ambiguous.

    Parameters
    ----------
    readings : mapping of str to LightField
        Orders of the axes, and the light field that the array is in each.
    """
    kept = [axes for axes, light_field in readings.items() if _is_consistent(light_field)]
    return kept[0] if len(kept) == 1 else None


def _is_consistent(light_field: LightField) -> bool:
    """Whether colours show no parallax, and views of an equally short row or column do."""
    views = light_field.views
    T, S, H, W, C = views.shape
    if C > 1 and not _parallax(np.moveaxis(views, 4, 2).reshape(-1, C, H, W)) <= _COLOURS:
        return False
    grey = views[..., C // 2]
    short = [np.moveaxis(grey, axis, 1).reshape(-1, n, H, W) for axis, n in enumerate((T, S)) if n in _COLOUR_COUNTS]
    return all(_parallax(pictures) >= _VIEWS for pictures in short)


def _parallax(pictures: npt.NDArray[np.generic]) -> float:
    """Ratio of the matching cost of pictures in place to that as a row or column of views; NaN if undecided.

    ``pictures`` are (K, M, H, W), K sequences of M.
    """
    pictures = pictures[:: max(1, len(pictures) // _SEQUENCES), ..., None]
    views, middle = Views(LightField(pictures, "pictures", arranged=False)), pictures.shape[1] // 2
    steps = np.array([step for step in range(-middle, pictures.shape[1] - middle) if step], np.float64)
    offsets = np.stack([np.stack([0 * steps, steps], 1), np.stack([steps, 0 * steps], 1)])
    best = np.nan
    for factor in (factor for factor in _REDUCTIONS if not views.is_too_small(factor)):
        costs = []
        for k in range(len(pictures)):
            places = [(k - views.middle[0], int(step) + middle - views.middle[1]) for step in (0, *steps)]
            found = [
                matched(views, places[0], places[1:], factor, offsets, movement, sampling=_SPACING)
                for movement in (MOVEMENT, 0)
            ]
            costs += [(*moved[0].mean(axis=0), still[0].mean()) for moved, still in [found] if moved and still]
        if costs:
            *moved, still = np.mean(costs, axis=0)
            best = np.fmax(best, still / max(min(moved), 1e-6))
    return float(best)
