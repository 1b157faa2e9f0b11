"""Grid from the numbers in the names of views, and the position of each view in it."""

from __future__ import annotations

from dataclasses import dataclass
from math import gcd, isqrt, prod
from pathlib import Path

from sepi.errors import SepiError
from sepi.io.readers.name_groups import EXAMPLES, Kind, fill, origin
from sepi.io.readers.options import ReadOptions
from sepi.io.readers.view_files import MAX_VIEWS
from sepi.io.readers.view_names import ViewNumbers

_POSITIONS_PER_PICTURE = 100
# part of what it filled before that a grid must still be filled when it is widened for views that are left out
_AS_FULL = 0.8
# part of the grid of the names from which on they are taken for row and column, and a --grid that differs for an error
_WELL_FILLED = 0.5

Numbers = dict[str, tuple[int, ...]]
"""Name of a view to its row and column, or its number."""


@dataclass(frozen=True)
class Layout:
    """Where views stand.

    Attributes
    ----------
    grid : tuple of int
        Rows and columns of the given grid.
    positions : dict of str to int
        Name to number ``t * S + s`` in it.
    notes : list of str
        What was assumed.
    arranged : bool
        False: one row of views, whose grid the names do not tell.
    """

    grid: tuple[int, int]
    positions: dict[str, int]
    notes: list[str]
    arranged: bool = True

    @property
    def fill(self) -> float:
        """How much of the grid has a view."""
        return len(self.positions) / (self.grid[0] * self.grid[1])


def laid_out(folder: Path, named: ViewNumbers, numbers: Numbers, options: ReadOptions) -> Layout:
    """Put views where their numbers say.

    Parameters
    ----------
    folder : Path
        For messages.
    named : ViewNumbers
        How the names of the folder were understood.
    numbers : dict of str to tuple of int
        The views; no two have the same numbers.
    options : ReadOptions
        ``grid`` and ``pattern`` are used.

    Raises
    ------
    SepiError
        If the grid that is given does not hold them, or they make none that is likely.
    """
    if named.kind is Kind.GRID:
        try:
            return _by_row_and_column(folder, named, numbers, options)
        except SepiError:
            # times, such as minute and second
            rows, columns = zip(*numbers.values(), strict=True)
            if options.grid is None or len(numbers) != prod(options.grid) or fill(rows, columns) >= _WELL_FILLED:
                raise
            return _sorted(folder, numbers, options.grid)
    if options.grid is None:
        return _in_one_row(named, numbers)
    return _by_number(folder, named, numbers, options.grid)


def widened(folder: Path, named: ViewNumbers, numbers: Numbers, others: Numbers, options: ReadOptions) -> Layout:
    """The layout of views, and of others that are not read if those have places among them.

    A corner or an edge that is left out is part of the grid still; a picture numbered beyond a full grid is not.
    """
    layout = laid_out(folder, named, numbers, options)
    others = {name: values for name, values in others.items() if values not in numbers.values()}
    try:
        whole = laid_out(folder, named, {**numbers, **others}, options)
    except SepiError:
        return layout
    if options.grid is not None or whole.grid == layout.grid:
        return whole
    if whole.arranged:
        fits = whole.fill == 1 or 1 > layout.fill <= whole.fill / _AS_FULL
    else:
        # the ends of a sequence are ambiguous, but sequences usually fill a square
        fits = not _is_square(layout.grid[1]) and _is_square(whole.grid[1])
    return whole if fits else layout


def _is_square(count: int) -> bool:
    return isqrt(count) ** 2 == count


def _by_row_and_column(folder: Path, named: ViewNumbers, numbers: Numbers, options: ReadOptions) -> Layout:
    rows, columns = zip(*numbers.values(), strict=True)
    (top, row_step), (left, column_step) = origin(rows), origin(columns)
    step = gcd(*(step for step, values in ((row_step, rows), (column_step, columns)) if len(set(values)) > 1)) or 1
    spread = max(rows) - top, max(columns) - left
    if options.grid is not None:
        grid = options.grid
        # views that are missing, if the grid has a position for them
        step = 1 if spread[0] < grid[0] and spread[1] < grid[1] else step
    else:
        grid = spread[0] // step + 1, spread[1] // step + 1
        _require_plausible(folder, grid, numbers)
    if spread[0] // step >= grid[0] or spread[1] // step >= grid[1]:
        raise SepiError(
            f"{folder}: rows {top} to {max(rows)}, columns {left} to {max(columns)}; --grid has {grid[0]}x{grid[1]}"
        )
    notes = []
    if named.said:
        notes = [f"the names say row and column{_like(named)}"]
    elif options.pattern is None:
        notes = [f"names are taken for row and column, in that order{_like(named)}; --order transpose if the other way"]
    if top not in (0, 1) or left not in (0, 1):
        notes.append(f"the names count rows from {top}, columns from {left}")
    notes += _step_notes(step)
    positions = {
        name: (row - top) // step * grid[1] + (column - left) // step for name, (row, column) in numbers.items()
    }
    return Layout(grid, positions, notes)


def _in_one_row(named: ViewNumbers, numbers: Numbers) -> Layout:
    """A sequence of views whose grid the names do not tell."""
    values = [number for (number,) in numbers.values()]
    lowest, step = origin(values)
    count = (max(values) - lowest) // step + 1
    notes = [_sorted_note(numbers)]
    if named.kind is Kind.COUNT:
        gaps = f", {count - len(values)} of them missing" if count > len(values) else ""
        notes = [f"views are numbered {lowest} to {max(values)}{gaps}{_like(named)}", *_step_notes(step)]
    return Layout((1, count), {name: (number - lowest) // step for name, (number,) in numbers.items()}, notes, False)


def _by_number(folder: Path, named: ViewNumbers, numbers: Numbers, grid: tuple[int, int]) -> Layout:
    """Views numbered through a grid that is given, row by row."""
    count = grid[0] * grid[1]
    values = [number for (number,) in numbers.values()]
    lowest, highest = min(values), max(values)
    base = _base(lowest, highest, count)
    # numbers that are missing, if the grid has a position for them
    step = 1 if highest - base < count else origin(values)[1]
    fits = (highest - base) // step < count
    if named.kind is Kind.SORT or (not fits and len(values) == count):
        return _sorted(folder, numbers, grid)
    if not fits:
        name = max(numbers, key=lambda name: numbers[name])
        raise SepiError(f"{folder / name}: beyond the {grid[0]}x{grid[1]} views of --grid, numbered from {base}")
    notes = [
        f"views are numbered {lowest} to {highest}{_like(named)}, taken row by row; --order transpose if by columns"
    ]
    if base not in (0, 1):
        notes.append(f"the names count views from {base}")
    notes += _step_notes(step)
    return Layout(grid, {name: (number - base) // step for name, (number,) in numbers.items()}, notes)


def _sorted(folder: Path, numbers: Numbers, grid: tuple[int, int]) -> Layout:
    """Views one after the other, row by row."""
    if len(numbers) != grid[0] * grid[1]:
        raise SepiError(
            f"{folder}: the names only sort the {len(numbers)} pictures, and the {grid[0]}x{grid[1]} grid that --grid "
            f"gives has {grid[0] * grid[1]} views; expected as many pictures, or names such as {EXAMPLES}"
        )
    ranked = sorted(numbers, key=lambda name: numbers[name])
    notes = [f"{_sorted_note(numbers)}, taken row by row; --order transpose if by columns"]
    return Layout(grid, {name: rank for rank, name in enumerate(ranked)}, notes)


def _base(lowest: int, highest: int, count: int) -> int:
    """The number of the first position: 0 or 1 where only that lets the numbers end with the grid."""
    if lowest > 1 and highest in (count - 1, count):
        return highest - count + 1
    return lowest


def _require_plausible(folder: Path, grid: tuple[int, int], numbers: Numbers) -> None:
    positions, pictures = grid[0] * grid[1], len(numbers)
    if positions > min(MAX_VIEWS, _POSITIONS_PER_PICTURE * pictures):
        raise SepiError(
            f"{folder}: the names ({next(iter(numbers))}) give a grid of {grid[0]}x{grid[1]} positions for "
            f"{pictures} pictures; say which numbers are row and column with --pattern, such as {EXAMPLES}"
        )


def _sorted_note(numbers: Numbers) -> str:
    return f"the numbers in the names count no views ({next(iter(numbers))}): views are in the order of their names"


def _like(named: ViewNumbers) -> str:
    return f", as in '{named.pattern}'" if named.pattern else ""


def _step_notes(step: int) -> list[str]:
    return [f"the numbers go up in steps of {step}, taken for neighbouring views"] if step > 1 else []
