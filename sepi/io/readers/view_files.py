"""Image files of views, in one folder or in a folder for each row of the grid.

Folders of rows, ``row_0/col_0.png`` or ``0/0.png``, are distinguished from folders of light fields.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping
from math import isqrt
from pathlib import Path

import numpy as np
import numpy.typing as npt

from sepi.errors import SepiError
from sepi.io.files import reading
from sepi.io.images import SUFFIXES, read_views
from sepi.io.readers.arrays import Array, with_white
from sepi.io.readers.options import ReadOptions
from sepi.io.readers.view_grid import Numbers, arrange_numbers
from sepi.io.readers.view_names import CAMERAS, infer_view_numbers, pair_view_numbers
from sepi.lightfield import BoolMap

# number of a row or of a column, alone or after a word for it
_NAME = re.compile(
    rf"(?:.*[^a-z])?(?:row|line|r|t|v|y|column|col|c|s|u|x|{'|'.join(CAMERAS)})[^a-z0-9]*[0-9]+|([^a-z]*[0-9]+)"
)
# number of images in a folder from which a square number is rather a grid of its own
_SQUARE = 9


def view_files(folder: Path) -> list[Path]:
    """Files of a folder that may be views; if it has none, files of the subfolders that may be its rows.

    Raises
    ------
    SepiError
        If a folder cannot be read.
    """
    with reading(folder, "folder of views"):
        files = files_in(folder)
        rows = _rows(folder) if len(numbered(files)) < 2 else []
        return [file for row in rows for file in files_in(row)] or files


def has_rows(folder: Path, *, surely: bool) -> bool:
    """Whether a folder has subfolders that may be rows of one light field; ``surely``: hardly light fields.

    Folders named by just a number may be either: with a square number of images, each is a light field.
    """
    rows = _rows(folder)
    if not rows or not surely:
        return bool(rows)
    bare = all(match[1] is not None for row in rows if (match := _NAME.fullmatch(row.name.lower())))
    most = max(len(numbered(files_in(row))) for row in rows)
    return not bare or most < _SQUARE or most == len(rows) or isqrt(most) ** 2 != most


def files_in(folder: Path) -> list[Path]:
    """Files, and links that do not lead to a folder, without hidden ones."""
    shown = (file for file in folder.iterdir() if not file.name.startswith("."))
    return sorted(file for file in shown if file.is_file() or (file.is_symlink() and not file.is_dir()))


def numbered(files: list[Path]) -> list[str]:
    """Names of images with numbers, or of a pair; lenslet images are left out, since each is a light field."""
    names = [file.name for file in files if file.suffix.lower() in SUFFIXES]
    if pair := pair_view_numbers(names):
        return list(pair.numbers)
    return [name for name in names if re.search("[0-9]", Path(name).stem) and "eslf" not in name.lower()]


def _rows(folder: Path) -> list[Path]:
    """Subfolders, if there are several and each has the name and the images of a row."""
    inner = sorted(row for row in folder.iterdir() if row.is_dir() and not row.name.startswith("."))
    rows = [row for row in inner if _is_row(row)]
    return rows if len(rows) > 1 and len(rows) == len(inner) else []


def _is_row(folder: Path) -> bool:
    match = _NAME.fullmatch(folder.name.lower())
    if folder.is_symlink() or match is None:
        return False
    try:
        files = [file for file in files_in(folder) if file.suffix.lower() in SUFFIXES]
        # one image of each camera; a folder whose names give row and column is a light field itself
        return (len(files) == 1 and match[1] is None) or not infer_view_numbers(str(folder), numbered(files)).is_grid
    except (SepiError, OSError):
        return False


MAX_VIEWS = 10_000
"""Most views of a grid."""


def read_grid(
    folder: Path, files: Mapping[int, Path], grid: tuple[int, int], options: ReadOptions
) -> tuple[Array, BoolMap, Numbers, npt.NDArray[np.str_]]:
    """Read the views of a grid and put them in their positions; excluded views are not opened.

    Parameters
    ----------
    folder : Path
        For messages; views may be links out of it only if the options allow it.
    files : mapping of int to Path
        Number ``t * S + s`` in the given grid to file; views without a file are missing.
    grid : (int, int)
        Rows and columns of the given grid.
    options : ReadOptions

    Returns
    -------
    views : ndarray, shape (T, S, H, W, C)
        Zero where a view is missing.
    present : ndarray, shape (T, S), bool
    numbers : ndarray, shape (T, S), int64
        Number of each view in the given grid; -1 for excluded ones.
    names : ndarray, shape (T, S), str
        File name of each view in the folder; empty where it is missing.

    Raises
    ------
    SepiError
        If the options do not fit the grid, no view is left, or a file cannot be read, is a link out of the folder, or
        differs from the others in size or type.
    """
    if grid[0] * grid[1] > MAX_VIEWS:
        raise SepiError(f"{folder}: a grid of {grid[0]}x{grid[1]} views; expected at most {MAX_VIEWS} views")
    # files that are not views may be excluded, too
    names = {name: -1 for name in options.exclude if (folder / name).exists()}
    names |= {path.relative_to(folder).as_posix(): number for number, path in files.items()}
    numbers = arrange_numbers(str(folder), grid, options, names)
    present = np.isin(numbers, list(files))
    positions = np.flatnonzero(present)
    paths = [files[int(number)] for number in numbers.ravel()[positions]]
    if not paths:
        raise SepiError(f"{folder}: no view is left")
    if not options.follow_links:
        _require_within(folder, paths)
    white = options.white
    views: Array = read_views(paths, positions.tolist(), numbers.size, any_floats=white is not None)
    views = views.reshape(*numbers.shape, *views.shape[1:])
    views = views if white is None else with_white(views, present, folder, white)
    own = {number: name for name, number in names.items() if number >= 0}
    return views, present, numbers, np.array([own.get(n, "") for n in numbers.ravel().tolist()]).reshape(numbers.shape)


def _require_within(folder: Path, paths: Iterable[Path]) -> None:
    """Raise if a file is a link that leads out of the folder."""
    home = folder.resolve()
    for path in filter(Path.is_symlink, paths):
        try:
            target = path.resolve()
        except (OSError, RuntimeError) as error:
            raise SepiError(f"{path}: a link that leads back to itself") from error
        if not target.is_relative_to(home):
            raise SepiError(f"{path}: a link out of the folder, to {target}; copy the file, or pass --follow-links")
