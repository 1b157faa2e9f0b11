"""Folders with one image for each view, under any names that count or sort them.

Names give row and column, ``view_03_07.png`` or ``row_3/col_7.png``, or a running number, ``img_034.jpg``. They may
also give camera positions, ``out_00_01_-703.002197_468.153625.png``.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import combinations
from math import gcd, isqrt, prod
from pathlib import Path

import numpy as np
import numpy.typing as npt

from sepi.errors import SepiError
from sepi.io.files import name_of
from sepi.io.images import SUFFIXES
from sepi.io.readers import view_names
from sepi.io.readers.options import ReadOptions, is_position, unarranged
from sepi.io.readers.view_files import MAX_VIEWS, files_in, has_rows, numbered, read_grid, view_files
from sepi.io.readers.view_grid import off_grid, positions_from_cameras
from sepi.io.readers.view_names import EXAMPLES, ViewNumbers, decimals_in, origin, require_different
from sepi.lightfield import LightField

_POSITIONS_PER_PICTURE = 100
# share of its former filling that a grid must keep when it is widened for views that are left out
_AS_FULL = 0.8
# largest deviation in steps of cameras on the grid, from rounded decimals
_ON_GRID = 1e-3

Numbers = dict[str, tuple[int, ...]]
"""Name of a view to its row and column, or its running number."""


def matches(path: Path) -> bool:
    """Whether ``path`` is a folder with at least two images with numbers in their names, or a folder of rows."""
    return len(numbered(files_in(path))) >= 2 or has_rows(path, surely=True)


def read(path: Path, options: ReadOptions) -> LightField:
    """Read a folder of views.

    Returns
    -------
    LightField
        Its notes say how the names were interpreted. The views stay in one row if the names only number or sort them
        and no grid is given.
    """
    if not path.is_dir():
        raise SepiError(f"{path}: not a folder of views")
    files = [file.relative_to(path).as_posix() for file in view_files(path)]
    excluded = {name for name in options.exclude if name in files and not is_position(name)}
    named = _named(path, [name for name in files if name not in excluded], options)
    if len(named.numbers) < 2:
        raise SepiError(f"{path}: only one view, {next(iter(named.numbers))}; depth needs at least two")
    require_different(path, named)
    others = {name: values for name in sorted(excluded) if (values := named.numbers_of(name)) is not None}
    layout = _widened(path, named, others, options)
    if not layout.arranged:
        options = unarranged(options)
    views = {layout.positions[name]: path / name for name in named.numbers}
    pixels, present, numbers, names = read_grid(path, views, layout.grid, options)
    told = (*_left_out([name for name in named.unmatched if _is_picture(name)]), *layout.notes)
    arranged, name = layout.arranged, str(name_of(path))
    found = LightField(pixels, name, str(path), present, view=options.view, notes=told, arranged=arranged, files=names)
    # of decimals of which a part is row or column, none is a position
    counted = re.search(r"[0-9}*]\.\{|\}\.[0-9{*]", options.pattern or "")
    return _with_positions(found, layout, numbers) if arranged and not counted else found


@dataclass(frozen=True)
class _Layout:
    """Positions of the views in the given grid.

    Attributes
    ----------
    grid : tuple of int
        Rows and columns of the given grid.
    positions : dict of str to int
        Name to number ``t * S + s`` in the grid.
    notes : list of str
        Assumptions that were made.
    arranged : bool
        False: one row of views, since the names do not tell the grid.
    """

    grid: tuple[int, int]
    positions: dict[str, int]
    notes: list[str]
    arranged: bool = True

    @property
    def fill(self) -> float:
        """Share of the grid that has a view."""
        return len(self.positions) / prod(self.grid)


def _widened(folder: Path, named: ViewNumbers, others: Numbers, options: ReadOptions) -> _Layout:
    """Layout of views, widened for views that are left out if these belong to the grid.

    A corner or an edge that is left out is still part of the grid; an image numbered beyond a full grid is not.
    """
    layout = _laid_out(folder, named, named.numbers, options)
    others = {name: values for name, values in others.items() if values not in named.numbers.values()}
    try:
        whole = _laid_out(folder, named, {**named.numbers, **others}, options)
    except SepiError:
        return layout
    if options.grid is not None or whole.grid == layout.grid:
        return whole
    if whole.arranged:
        fits = whole.fill == 1 or 1 > layout.fill <= whole.fill / _AS_FULL
    else:
        # the ends of a sequence are unclear, but sequences usually fill a square
        count, more = layout.grid[1], whole.grid[1]
        fits = isqrt(count) ** 2 != count and isqrt(more) ** 2 == more
    return whole if fits else layout


def _laid_out(folder: Path, named: ViewNumbers, numbers: Numbers, options: ReadOptions) -> _Layout:
    """Layout of views by their numbers; no two views have the same."""
    if named.is_grid:
        return _by_row_and_column(folder, named, numbers, options)
    return _by_number(folder, named, {name: number for name, (number,) in numbers.items()}, options.grid)


def _by_row_and_column(folder: Path, named: ViewNumbers, numbers: Numbers, options: ReadOptions) -> _Layout:
    rows, columns = zip(*numbers.values(), strict=True)
    (top, row_step), (left, column_step) = origin(rows), origin(columns)
    step = gcd(*(step for step, values in ((row_step, rows), (column_step, columns)) if len(set(values)) > 1)) or 1
    spread = max(rows) - top, max(columns) - left
    if options.grid is not None:
        grid = options.grid
        # gaps are missing views if the grid has positions for them
        step = 1 if spread[0] < grid[0] and spread[1] < grid[1] else step
    else:
        grid = spread[0] // step + 1, spread[1] // step + 1
        if prod(grid) > min(MAX_VIEWS, _POSITIONS_PER_PICTURE * len(numbers)):
            raise SepiError(
                f"{folder}: the names ({next(iter(numbers))}) give a grid of {grid[0]}x{grid[1]} for {len(numbers)} "
                f"images; say which numbers are row and column with --pattern, such as {EXAMPLES}"
            )
    if spread[0] // step >= grid[0] or spread[1] // step >= grid[1]:
        ends = f"rows {top} to {max(rows)}, columns {left} to {max(columns)}"
        raise SepiError(f"{folder}: {ends}; --grid has {grid[0]}x{grid[1]}")
    notes = []
    if named.said:
        notes = [f"the names say row and column{_like(named)}"]
    elif options.pattern is None:
        notes = [f"names are taken for row and column, in that order{_like(named)}; --order transpose if the other way"]
    if top not in (0, 1) or left not in (0, 1):
        notes.append(f"the names count rows from {top}, columns from {left}")
    notes += _step_notes(step)
    places = {name: ((row - top) // step, (column - left) // step) for name, (row, column) in numbers.items()}
    return _Layout(grid, {name: row * grid[1] + column for name, (row, column) in places.items()}, notes)


def _by_number(folder: Path, named: ViewNumbers, numbers: dict[str, int], grid: tuple[int, int] | None) -> _Layout:
    """Layout of numbered or sorted views: row by row through a given grid, else in one row."""
    lowest, highest = min(numbers.values()), max(numbers.values())
    base, step = origin([*numbers.values()])
    count = (highest - lowest) // step + 1 if grid is None else prod(grid)
    if grid is not None:
        # the first position has number 0 or 1 if only then the last number ends the grid
        base = highest - count + 1 if lowest > 1 and highest in (count - 1, count) else lowest
        # gaps are missing views if the grid has positions for them
        step = 1 if highest - base < count else step
    counted = named.counted and (highest - base) // step < count
    if not counted and grid is not None and len(numbers) != count:
        span = f" numbered {lowest} to {highest}" if named.counted else ""
        raise SepiError(f"{folder}: {len(numbers)} images{span}; --grid gives {grid[0]}x{grid[1]}")
    ranks = {name: rank for rank, name in enumerate(sorted(numbers, key=numbers.__getitem__))}
    note = f"the numbers in the names count no views ({next(iter(numbers))}): views are in the order of their names"
    if counted:
        gaps = f", {count - len(numbers)} of them missing" if grid is None and count > len(numbers) else ""
        note = f"views are numbered {lowest} to {highest}{gaps}{_like(named)}"
        ranks = {name: (number - base) // step for name, number in numbers.items()}
    notes = [note if grid is None else f"{note}, taken row by row; --order transpose if by columns"]
    notes += [f"the names count views from {base}"] if counted and grid is not None and base not in (0, 1) else []
    notes += _step_notes(step) if counted else []
    return _Layout(grid or (1, count), ranks, notes, arranged=grid is not None)


def _like(named: ViewNumbers) -> str:
    return f", as in '{named.pattern}'" if named.pattern else ""


def _step_notes(step: int) -> list[str]:
    return [f"the numbers go up in steps of {step}, taken for neighbouring views"] if step > 1 else []


def _named(folder: Path, names: Sequence[str], options: ReadOptions) -> ViewNumbers:
    if options.pattern is not None:
        return view_names.parse_view_numbers(str(folder), names, options.pattern)
    names = list(filter(_is_picture, names))
    try:
        return view_names.pair_view_numbers(names) or view_names.infer_view_numbers(str(folder), names)
    except SepiError:
        # a given grid that is filled needs only an order
        if options.grid is None or prod(options.grid) != len(names):
            raise
        return view_names.sorted_view_numbers(names)


def _is_picture(name: str) -> bool:
    return Path(name).suffix.lower() in SUFFIXES


def _with_positions(light_field: LightField, layout: _Layout, numbers: npt.NDArray[np.int64]) -> LightField:
    """Light field with camera positions, if two decimal numbers in the names fit its grid."""
    decimals = decimals_in(list(layout.positions))
    given = np.full((layout.grid[0] * layout.grid[1], len(decimals[0])), np.nan)
    given[list(layout.positions.values())] = decimals
    for pair in combinations(range(given.shape[1]), 2):
        found = positions_from_cameras(given[numbers][..., pair], light_field.present)
        if found is not None:
            positions, row_spacing, directions = found
            strays = off_grid(positions, row_spacing, light_field.present)
            on_grid = strays < _ON_GRID
            apart = f"rows {row_spacing:.3g} steps apart, " if min(numbers.shape) > 1 else ""
            where = "on the grid" if on_grid else f"off the grid by up to {strays:.2g} steps"
            notes = (*light_field.notes, f"camera positions from the names; {apart}{where}")
            light_field = replace(light_field, row_spacing=row_spacing, directions=directions, notes=notes)
            return light_field if on_grid else replace(light_field, positions=positions)
    return light_field


def _left_out(names: Sequence[str]) -> list[str]:
    if not names:
        return []
    number = len(names)
    what, were = ("1 image whose name is", "was") if number == 1 else (f"{number} images whose names are", "were")
    return [f"{what} unlike the views' {were} left out: {', '.join(names[:3])}{', ...' if len(names) > 3 else ''}"]
