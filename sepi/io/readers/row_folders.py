"""Folders with a folder for each row of views, ``row_0/col_0.png`` or ``0/0.png``, told from those of light fields."""

from __future__ import annotations

import re
from math import isqrt
from pathlib import Path

from sepi.errors import SepiError
from sepi.io.files import reading
from sepi.io.images import SUFFIXES
from sepi.io.readers.name_groups import CAMERAS, Kind
from sepi.io.readers.view_names import infer_view_numbers, pair_view_numbers

# the number of a row, or of a column, behind a word for it or alone
_NAME = re.compile(
    rf"(?:.*[^a-z])?(?:row|line|r|t|v|y|column|col|c|s|u|x|{'|'.join(CAMERAS)})[^a-z0-9]*[0-9]+|([^a-z]*[0-9]+)"
)
# pictures in a folder from which on a square number of them is rather a grid of its own
_SQUARE = 9


def view_files(folder: Path) -> list[Path]:
    """Files of a folder that may be views, or of the folders that may be its rows where it has no views itself.

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
    """Whether there are folders that may be the rows of one light field; ``surely``, that are hardly light fields.

    Folders with no more than a number for a name may be either: each is one if it has a square number of pictures.
    """
    rows = _rows(folder)
    if not rows or not surely:
        return bool(rows)
    bare = all(match[1] is not None for row in rows if (match := _NAME.fullmatch(row.name.lower())))
    most = max(len(numbered(files_in(row))) for row in rows)
    return not bare or most < _SQUARE or most == len(rows) or isqrt(most) ** 2 != most


def files_in(folder: Path) -> list[Path]:
    """Files and links that lead to no folder; hidden ones are not views."""
    return sorted(
        file
        for file in folder.iterdir()
        if not file.name.startswith(".") and (file.is_file() or (file.is_symlink() and not file.is_dir()))
    )


def numbered(files: list[Path]) -> list[str]:
    """Names of pictures that have numbers, or of a pair; several lenslet pictures are several light fields."""
    names = [file.name for file in files if file.suffix.lower() in SUFFIXES]
    if pair := pair_view_numbers(names):
        return list(pair.numbers)
    return [name for name in names if re.search("[0-9]", Path(name).stem) and "eslf" not in name.lower()]


def _rows(folder: Path) -> list[Path]:
    """The folders in a folder, if there are several, and each has the name and the pictures of a row."""
    inner = sorted(row for row in folder.iterdir() if row.is_dir() and not row.name.startswith("."))
    rows = [row for row in inner if _is_row(row)]
    return rows if len(rows) > 1 and len(rows) == len(inner) else []


def _is_row(folder: Path) -> bool:
    match = _NAME.fullmatch(folder.name.lower())
    if folder.is_symlink() or match is None:
        return False
    try:
        files = [file for file in files_in(folder) if file.suffix.lower() in SUFFIXES]
        # one picture of each camera; whose names give row and column is a light field itself
        return (len(files) == 1 and match[1] is None) or (
            infer_view_numbers(str(folder), numbered(files)).kind is not Kind.GRID
        )
    except (SepiError, OSError):
        return False
