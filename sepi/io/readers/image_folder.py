"""Folders with one picture for each view, under any names that count them.

Names give row and column, ``view_03_07.png``, or number the views through row by row, ``img_034.jpg``.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path

from sepi.errors import SepiError
from sepi.io.files import reading
from sepi.io.images import SUFFIXES
from sepi.io.readers.options import ReadOptions
from sepi.io.readers.view_files import MAX_VIEWS, read_grid
from sepi.io.readers.view_names import EXAMPLES, ViewNumbers, infer_view_numbers, parse_view_numbers
from sepi.lightfield import LightField

_POSITIONS_PER_PICTURE = 100


_Layout = tuple[tuple[int, int], dict[str, int], list[str]]
"""The given grid, the number ``t * S + s`` in it of each name, and what was assumed."""


def matches(path: Path) -> bool:
    """Whether ``path`` is a folder with at least two pictures that have numbers in their names."""
    try:
        names = [file.stem for file in _files(path) if file.suffix.lower() in SUFFIXES]
    except OSError:
        return False
    # several lenslet pictures are several light fields
    return sum(any("0" <= sign <= "9" for sign in name) and "eslf" not in name.lower() for name in names) >= 2


def read(path: Path, options: ReadOptions) -> LightField:
    """Read a folder.

    Returns
    -------
    LightField
        Its notes say how the names were understood.
    """
    if not path.is_dir():
        raise SepiError(f"{path}: not a folder of views")
    with reading(path, "folder of views"):
        files = _files(path)
    pictures = [file.name for file in files if file.suffix.lower() in SUFFIXES]
    if options.pattern is None:
        named = infer_view_numbers(str(path), pictures)
    else:
        named = parse_view_numbers(str(path), [file.name for file in files], options.pattern)
    if len(named.numbers) < 2:
        raise SepiError(f"{path}: only one view, {next(iter(named.numbers))}; depth needs at least two")
    _require_different(path, named)
    two_numbers = len(next(iter(named.numbers.values()))) == 2
    grid, positions, notes = (
        _by_row_and_column(path, named, options) if two_numbers else _by_number(path, named, options)
    )
    views = {number: path / name for name, number in positions.items()}
    pixels, present, _ = read_grid(path, views, grid, options)
    unmatched = [name for name in named.unmatched if name in pictures]
    return LightField(
        views=pixels,
        name=path.resolve().name,
        source=str(path),
        present=present,
        view=options.view,
        notes=(*_left_out(unmatched), *notes),
    )


def _files(folder: Path) -> list[Path]:
    """Files and links that lead to no folder; hidden ones are not views."""
    return sorted(
        file
        for file in folder.iterdir()
        if not file.name.startswith(".") and (file.is_file() or (file.is_symlink() and not file.is_dir()))
    )


def _left_out(names: Sequence[str]) -> list[str]:
    if not names:
        return []
    pictures = "1 picture whose name is" if len(names) == 1 else f"{len(names)} pictures whose names are"
    left = "was" if len(names) == 1 else "were"
    more = ", ..." if len(names) > 3 else ""
    return [f"{pictures} unlike the views' {left} left out: {', '.join(names[:3])}{more}"]


def _require_different(path: Path, named: ViewNumbers) -> None:
    seen: dict[tuple[int, ...], str] = {}
    for name, numbers in named.numbers.items():
        if numbers in seen:
            where = ", ".join(map(str, numbers))
            raise SepiError(f"{path / name}: view {where} is given twice, also as {seen[numbers]}")
        seen[numbers] = name


def _by_row_and_column(path: Path, named: ViewNumbers, options: ReadOptions) -> _Layout:
    rows, columns = zip(*named.numbers.values(), strict=True)
    base = min(rows), min(columns)
    step = math.gcd(*(row - base[0] for row in rows), *(column - base[1] for column in columns))
    spread = max(rows) - base[0], max(columns) - base[1]
    if options.grid is not None:
        grid = options.grid
        # views that are missing, if the grid has a position for them
        step = 1 if spread[0] < grid[0] and spread[1] < grid[1] else step
    else:
        grid = spread[0] // step + 1, spread[1] // step + 1
        _require_plausible(path, grid, named)
    if spread[0] // step >= grid[0] or spread[1] // step >= grid[1]:
        raise SepiError(
            f"{path}: the names have rows {base[0]} to {max(rows)} and columns {base[1]} to {max(columns)}, which the "
            f"{grid[0]}x{grid[1]} grid that --grid gives does not hold"
        )
    first = next(iter(named.numbers))
    notes = []
    if options.pattern is None:
        notes = [f"names are taken for row and column, in that order ({first}); --order transpose if the other way"]
    if base[0] not in (0, 1) or base[1] not in (0, 1):
        notes.append(f"the names count rows from {base[0]}, columns from {base[1]}")
    notes += _step_notes(step)
    positions = {
        name: (row - base[0]) // step * grid[1] + (column - base[1]) // step
        for name, (row, column) in named.numbers.items()
    }
    return grid, positions, notes


def _by_number(path: Path, named: ViewNumbers, options: ReadOptions) -> _Layout:
    numbers = {name: number for name, (number,) in named.numbers.items()}
    lowest, highest = min(numbers.values()), max(numbers.values())
    step = math.gcd(*(number - lowest for number in numbers.values()))
    if options.grid is None:
        base = lowest
        grid, note = _inferred_grid(path, named, [(number - base) // step for number in numbers.values()])
    else:
        grid, note = options.grid, ""
        count = grid[0] * grid[1]
        base = _base(lowest, highest, count)
        # numbers that are missing, if the grid has a position for them
        step = 1 if highest - base < count else step
        if (highest - base) // step >= count:
            name = max(numbers, key=lambda name: numbers[name])
            raise SepiError(
                f"{path / name}: beyond the {count} views of the {grid[0]}x{grid[1]} grid that --grid gives, numbered "
                f"from {base}"
            )
    notes = [note or f"views are numbered {lowest} to {highest}, taken row by row; --order transpose if by columns"]
    if base not in (0, 1):
        notes.append(f"the names count views from {base}")
    notes += _step_notes(step)
    return grid, {name: (number - base) // step for name, number in numbers.items()}, notes


def _base(lowest: int, highest: int, count: int) -> int:
    """The number of the first position: 0 or 1 where only that lets the numbers end with the grid."""
    if lowest > 1 and highest in (count - 1, count):
        return highest - count + 1
    return lowest


def _inferred_grid(path: Path, named: ViewNumbers, positions: Sequence[int]) -> tuple[tuple[int, int], str]:
    """The grid that the views fill, and what was assumed."""
    count = len(positions)
    numbers = [number for (number,) in named.numbers.values()]
    span = f"{min(numbers)} to {max(numbers)}"
    if max(positions) + 1 != count:
        raise SepiError(
            f"{path}: {count} pictures numbered {span}, so numbers are missing; give --grid ROWSxCOLUMNS of the whole "
            f"grid, or --pattern, such as {EXAMPLES}, if another number counts them"
        )
    side = math.isqrt(count)
    square = side**2 == count
    line = (1, count) if named.line == "row" else (count, 1)
    if square and not (named.line and named.line_likely):
        return (side, side), f"views are numbered {span}, taken for a {side}x{side} grid row by row"
    if square:
        raise SepiError(
            f"{path}: the names ({next(iter(named.numbers))}) may be those of a single {named.line} of {count} views "
            f"or of a {side}x{side} grid; give --grid {line[0]}x{line[1]} or --grid {side}x{side}"
        )
    if named.line:
        return line, f"the names all have one {named.line}: taken for a single {named.line} of {count} views"
    raise SepiError(f"{path}: {count} views numbered {span} are no square grid; give --grid ROWSxCOLUMNS")


def _require_plausible(path: Path, grid: tuple[int, int], named: ViewNumbers) -> None:
    positions, pictures = grid[0] * grid[1], len(named.numbers)
    if positions > min(MAX_VIEWS, _POSITIONS_PER_PICTURE * pictures):
        raise SepiError(
            f"{path}: the names ({next(iter(named.numbers))}) give a grid of {grid[0]}x{grid[1]} positions for "
            f"{pictures} pictures; say which numbers are row and column with --pattern, such as {EXAMPLES}"
        )


def _step_notes(step: int) -> list[str]:
    return [f"the numbers go up in steps of {step}, taken for neighbouring views"] if step > 1 else []
