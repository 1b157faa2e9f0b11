"""Folders with one image for each view, under any names that count or sort them.

Names give row and column, ``view_03_07.png`` or ``row_3/col_7.png``, or a running number, ``img_034.jpg``. They may
also give camera positions, ``out_00_01_-703.002197_468.153625.png``.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Iterable, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from itertools import combinations
from math import gcd, isqrt, prod
from pathlib import Path

import numpy as np
import numpy.typing as npt

from sepi.errors import SepiError
from sepi.io.files import name_of
from sepi.io.images import SUFFIXES, picture_header
from sepi.io.readers import view_names
from sepi.io.readers.camera_positions import off_grid, positions_from_cameras
from sepi.io.readers.name_groups import EXAMPLES, Kind, fill, origin
from sepi.io.readers.options import ReadOptions, is_position, unarranged
from sepi.io.readers.view_files import MAX_VIEWS, files_in, has_rows, numbered, read_grid, view_files
from sepi.io.readers.view_names import ViewNumbers
from sepi.lightfield import LightField

_POSITIONS_PER_PICTURE = 100
# share of its former filling that a grid must keep when it is widened for views that are left out
_AS_FULL = 0.8
# filled share of the grid above which names count as row and column, and a --grid that differs is an error
_WELL_FILLED = 0.5

Numbers = dict[str, tuple[int, ...]]
"""Name of a view to its row and column, or its running number."""


@dataclass(frozen=True)
class Layout:
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
        return len(self.positions) / (self.grid[0] * self.grid[1])


def laid_out(folder: Path, named: ViewNumbers, numbers: Numbers, options: ReadOptions) -> Layout:
    """Layout of views by their numbers.

    Parameters
    ----------
    folder : Path
        For messages.
    named : ViewNumbers
        Interpretation of the names in the folder.
    numbers : dict of str to tuple of int
        Numbers of the views; no two views have the same.
    options : ReadOptions
        ``grid`` and ``pattern`` are used.

    Raises
    ------
    SepiError
        If the given grid does not hold the views, or they make no likely grid.
    """
    if named.kind is Kind.GRID:
        try:
            return _by_row_and_column(folder, named, numbers, options)
        except SepiError:
            # two numbers may be a time, such as minute and second
            rows, columns = zip(*numbers.values(), strict=True)
            if options.grid is None or len(numbers) != prod(options.grid) or fill(rows, columns) >= _WELL_FILLED:
                raise
            return _sorted(folder, numbers, options.grid)
    if options.grid is None:
        return _in_one_row(named, numbers)
    return _by_number(folder, named, numbers, options.grid)


def widened(folder: Path, named: ViewNumbers, numbers: Numbers, others: Numbers, options: ReadOptions) -> Layout:
    """Layout of views, widened for views that are left out if these belong to the grid.

    A corner or an edge that is left out is still part of the grid; an image numbered beyond a full grid is not.
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
        # the ends of a sequence are unclear, but sequences usually fill a square
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
        # gaps are missing views if the grid has positions for them
        step = 1 if spread[0] < grid[0] and spread[1] < grid[1] else step
    else:
        grid = spread[0] // step + 1, spread[1] // step + 1
        if grid[0] * grid[1] > min(MAX_VIEWS, _POSITIONS_PER_PICTURE * len(numbers)):
            raise SepiError(
                f"{folder}: the names ({next(iter(numbers))}) give a grid of {grid[0]}x{grid[1]} for {len(numbers)} "
                f"images; say which numbers are row and column with --pattern, such as {EXAMPLES}"
            )
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
    """Layout in one row: the names number the views, and do not tell the grid."""
    values = [number for (number,) in numbers.values()]
    lowest, step = origin(values)
    count = (max(values) - lowest) // step + 1
    notes = [_sorted_note(numbers)]
    if named.kind is Kind.COUNT:
        gaps = f", {count - len(values)} of them missing" if count > len(values) else ""
        notes = [f"views are numbered {lowest} to {max(values)}{gaps}{_like(named)}", *_step_notes(step)]
    return Layout((1, count), {name: (number - lowest) // step for name, (number,) in numbers.items()}, notes, False)


def _by_number(folder: Path, named: ViewNumbers, numbers: Numbers, grid: tuple[int, int]) -> Layout:
    """Layout of views numbered row by row through a given grid."""
    count = grid[0] * grid[1]
    values = [number for (number,) in numbers.values()]
    lowest, highest = min(values), max(values)
    # the first position has number 0 or 1 if only then the last number ends the grid
    base = highest - count + 1 if lowest > 1 and highest in (count - 1, count) else lowest
    # gaps are missing views if the grid has positions for them
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
    """Layout of views in the order of their names, row by row."""
    if len(numbers) != grid[0] * grid[1]:
        raise SepiError(f"{folder}: the names only sort the {len(numbers)} images; --grid gives {grid[0]}x{grid[1]}")
    ranked = sorted(numbers, key=lambda name: numbers[name])
    notes = [f"{_sorted_note(numbers)}, taken row by row; --order transpose if by columns"]
    return Layout(grid, {name: rank for rank, name in enumerate(ranked)}, notes)


def _sorted_note(numbers: Numbers) -> str:
    return f"the numbers in the names count no views ({next(iter(numbers))}): views are in the order of their names"


def _like(named: ViewNumbers) -> str:
    return f", as in '{named.pattern}'" if named.pattern else ""


def _step_notes(step: int) -> list[str]:
    return [f"the numbers go up in steps of {step}, taken for neighbouring views"] if step > 1 else []


# largest deviation in steps of cameras on the grid, from rounded decimals
_ON_GRID = 1e-3


def matches(path: Path) -> bool:
    """Whether ``path`` is a folder with at least two images with numbers in their names, or a folder of rows."""
    try:
        return len(numbered(files_in(path))) >= 2 or has_rows(path, surely=True)
    except OSError:
        return False


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
    considered = [name for name in files if name not in excluded and (options.pattern or _is_picture(name))]
    named, odd = _views(path, considered, options)
    if len(named.numbers) < 2:
        raise SepiError(f"{path}: only one view, {next(iter(named.numbers))}; depth needs at least two")
    _require_different(path, named)
    for name, why in odd.items():
        if name in widened(path, named, named.numbers, _numbers_of(named, [name]), options).positions:
            raise SepiError(f"{path / name}: {why}; all views must be alike; replace it, or pass --exclude {name}")
    layout = widened(path, named, named.numbers, _numbers_of(named, excluded), options)
    if not layout.arranged:
        options = unarranged(options)
    views = {layout.positions[name]: path / name for name in named.numbers}
    pixels, present, numbers, names = read_grid(path, views, layout.grid, options)
    unmatched = [name for name in named.unmatched if _is_picture(name)]
    notes = _left_out(unmatched, "whose name is unlike the views'", "whose names are unlike the views'")
    told = (*notes, *_left_out(list(odd), *2 * ["of another size than all others"]), *layout.notes)
    arranged, name = layout.arranged, str(name_of(path))
    light_field = LightField(
        pixels, name, str(path), present, view=options.view, notes=told, arranged=arranged, files=names
    )
    return _with_positions(light_field, layout, numbers) if arranged and not named.in_decimals else light_field


def _views(folder: Path, names: Sequence[str], options: ReadOptions) -> tuple[ViewNumbers, dict[str, str]]:
    """Interpretation of the names, and the images left out for their size, each with the reason.

    Images of odd sizes are left out first: the name of a thumbnail may differ in a number that all views share.
    """
    odd = odd_pictures(folder, filter(_is_picture, names))
    named = _named(folder, [name for name in names if name not in odd], options)
    # with images of other names, such as small copies of all views, no size may prevail
    if not odd and (odd := odd_pictures(folder, named.numbers)):
        named = _named(folder, [name for name in names if name not in odd], options)
    return named, odd


def _named(folder: Path, names: Sequence[str], options: ReadOptions) -> ViewNumbers:
    if options.pattern is not None:
        return view_names.parse_view_numbers(str(folder), names, options.pattern)
    try:
        return view_names.pair_view_numbers(names) or view_names.infer_view_numbers(str(folder), names)
    except SepiError:
        # a given grid that is filled needs only an order
        if options.grid is None or math.prod(options.grid) != len(names):
            raise
        return view_names.sorted_view_numbers(names)


def _is_picture(name: str) -> bool:
    return Path(name).suffix.lower() in SUFFIXES


def _numbers_of(named: ViewNumbers, names: Iterable[str]) -> Numbers:
    """Numbers of the names that match those of the views."""
    return {name: numbers for name in sorted(names) if (numbers := named.numbers_of(name)) is not None}


def _with_positions(light_field: LightField, layout: Layout, numbers: npt.NDArray[np.int64]) -> LightField:
    """Light field with camera positions, if two decimal numbers in the names fit its grid."""
    decimals = view_names.decimals_in(list(layout.positions))
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


def _left_out(names: Sequence[str], singular: str, plural: str) -> list[str]:
    if not names:
        return []
    pictures = f"1 image {singular} was" if len(names) == 1 else f"{len(names)} images {plural} were"
    return [f"{pictures} left out: {', '.join(names[:3])}{', ...' if len(names) > 3 else ''}"]


def _require_different(path: Path, named: ViewNumbers) -> None:
    seen: dict[tuple[int, ...], str] = {}
    for name, numbers in named.numbers.items():
        if seen.setdefault(numbers, name) != name:
            where = ", ".join(map(str, numbers))
            raise SepiError(f"{path / name}: view {where} is given twice, also as {seen[numbers]}")


# share of the images, or one image, that may differ if all others agree
_ODD = 0.1


def odd_pictures(folder: Path, names: Iterable[str]) -> dict[str, str]:
    """The few images of another size than all others, each with its size; empty if no size prevails.

    Reading reports unreadable images and links.
    """
    sizes: dict[str, tuple[int, int]] = {}
    for name in names:
        with suppress(SepiError):
            if not (folder / name).is_symlink():
                header = picture_header(folder / name)
                sizes[name] = header.width, header.height
    if not sizes:
        return {}
    usual, count = Counter(sizes.values()).most_common(1)[0]
    if count < 2 or len(sizes) - count > max(1, _ODD * len(sizes)):
        return {}
    most = "pixels, but all other views have {}x{}".format(*usual)
    return {name: f"{width}x{height} {most}" for name, (width, height) in sizes.items() if (width, height) != usual}
