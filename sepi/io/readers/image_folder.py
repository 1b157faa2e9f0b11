"""Folders with one picture for each view, under any names that count or sort them.

Names give row and column, ``view_03_07.png`` or ``row_3/col_7.png``, or number the views through, ``img_034.jpg``. They
may also say where the cameras stood, ``out_00_01_-703.002197_468.153625.png``.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Iterable, Sequence
from contextlib import suppress
from dataclasses import replace
from itertools import combinations
from pathlib import Path

import numpy as np
import numpy.typing as npt

from sepi.errors import SepiError
from sepi.io.files import name_of
from sepi.io.images import SUFFIXES, picture_header
from sepi.io.readers.camera_positions import off_grid, positions_from_cameras
from sepi.io.readers.folder_layout import Layout, Numbers, widened
from sepi.io.readers.options import ReadOptions, is_position, unarranged
from sepi.io.readers.row_folders import files_in, has_rows, numbered, view_files
from sepi.io.readers.view_files import read_grid
from sepi.io.readers.view_names import (
    ViewNumbers,
    decimals_in,
    infer_view_numbers,
    pair_view_numbers,
    parse_view_numbers,
    sorted_view_numbers,
)
from sepi.lightfield import LightField

# steps by which cameras that stand on the grid may seem to miss it: decimals are rounded
_ON_GRID = 1e-3


def matches(path: Path) -> bool:
    """Whether ``path`` is a folder with at least two pictures that have numbers in their names, or a folder of rows."""
    try:
        return len(numbered(files_in(path))) >= 2 or has_rows(path, surely=True)
    except OSError:
        return False


def read(path: Path, options: ReadOptions) -> LightField:
    """Read a folder.

    Returns
    -------
    LightField
        Its notes say how the names were understood. Not arranged where they only number or sort the views and no grid
        is given.
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
        _require_no_place(path, named, name, why, options)
    layout = widened(path, named, named.numbers, _numbers_of(named, excluded), options)
    if not layout.arranged:
        options = unarranged(options)
    views = {layout.positions[name]: path / name for name in named.numbers}
    pixels, present, numbers, names = read_grid(path, views, layout.grid, options)
    unmatched = [name for name in named.unmatched if _is_picture(name)]
    light_field = LightField(
        views=pixels,
        name=str(name_of(path)),
        source=str(path),
        present=present,
        view=options.view,
        notes=(
            *_left_out(unmatched, "whose name is unlike the views'", "whose names are unlike the views'"),
            *_left_out(list(odd), *2 * ["of another size than all others"]),
            *layout.notes,
        ),
        arranged=layout.arranged,
        files=names,
    )
    return _with_positions(light_field, layout, numbers) if layout.arranged else light_field


def _views(folder: Path, names: Sequence[str], options: ReadOptions) -> tuple[ViewNumbers, dict[str, str]]:
    """What the names of the views say, and the pictures that are set apart for their size, with what is odd about them.

    They are set apart first: the name of a thumbnail may differ in a number that all views share.
    """
    odd = odd_pictures(folder, filter(_is_picture, names))
    named = _named(folder, [name for name in names if name not in odd], options)
    if not odd:
        # among pictures of other names, such as small copies of all views, none may stand out
        odd = odd_pictures(folder, named.numbers)
        if odd:
            named = _named(folder, [name for name in names if name not in odd], options)
    return named, odd


def _named(folder: Path, names: Sequence[str], options: ReadOptions) -> ViewNumbers:
    if options.pattern is not None:
        return parse_view_numbers(str(folder), names, options.pattern)
    try:
        return pair_view_numbers(names) or infer_view_numbers(str(folder), names)
    except SepiError:
        # a grid that is given and filled needs no more than an order
        if options.grid is None or math.prod(options.grid) != len(names):
            raise
        return sorted_view_numbers(names)


def _is_picture(name: str) -> bool:
    return Path(name).suffix.lower() in SUFFIXES


def _numbers_of(named: ViewNumbers, names: Iterable[str]) -> Numbers:
    """Numbers of names that are like those of the views."""
    return {name: numbers for name in sorted(names) if (numbers := named.numbers_of(name)) is not None}


def _require_no_place(folder: Path, named: ViewNumbers, name: str, why: str, options: ReadOptions) -> None:
    """Raise where a picture that is unlike the views is needed as one."""
    if name in widened(folder, named, named.numbers, _numbers_of(named, [name]), options).positions:
        raise SepiError(f"{folder / name}: {why}; all views must be alike; replace it, or pass --exclude {name}")


def _with_positions(light_field: LightField, layout: Layout, numbers: npt.NDArray[np.int64]) -> LightField:
    """The light field with the positions of its cameras where two decimal numbers of the names fit its grid."""
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
            return replace(
                light_field,
                positions=None if on_grid else positions,
                row_spacing=row_spacing,
                directions=directions,
                notes=(*light_field.notes, f"camera positions from the names; {apart}{where}"),
            )
    return light_field


def _left_out(names: Sequence[str], singular: str, plural: str) -> list[str]:
    if not names:
        return []
    pictures = f"1 picture {singular} was" if len(names) == 1 else f"{len(names)} pictures {plural} were"
    return [f"{pictures} left out: {', '.join(names[:3])}{', ...' if len(names) > 3 else ''}"]


def _require_different(path: Path, named: ViewNumbers) -> None:
    seen: dict[tuple[int, ...], str] = {}
    for name, numbers in named.numbers.items():
        if seen.setdefault(numbers, name) != name:
            where = ", ".join(map(str, numbers))
            raise SepiError(f"{path / name}: view {where} is given twice, also as {seen[numbers]}")


# part of the pictures, or one, that may be odd where all others agree
_ODD = 0.1


def odd_pictures(folder: Path, names: Iterable[str]) -> dict[str, str]:
    """The few pictures of another size than all others, and what is odd about them; none where no size prevails.

    Pictures that cannot be read, and links, are left to those that read them.
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
    return {
        name: f"{size[0]}x{size[1]} pixels, but all other views have {usual[0]}x{usual[1]}"
        for name, size in sizes.items()
        if size != usual
    }
