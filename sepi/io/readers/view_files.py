"""Light fields that arrive as one picture file for each view."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from pathlib import Path

import numpy as np
import numpy.typing as npt

from sepi.errors import SepiError
from sepi.io.images import read_views
from sepi.io.readers.arrays import Array, with_white
from sepi.io.readers.options import Numbers, ReadOptions, arrange_numbers
from sepi.lightfield import BoolMap

MAX_VIEWS = 10_000
"""More views than any grid has."""


def read_grid(
    folder: Path, files: Mapping[int, Path], grid: tuple[int, int], options: ReadOptions
) -> tuple[Array, BoolMap, Numbers, npt.NDArray[np.str_]]:
    """Read the views of a grid and put them in their positions; those left out are not even opened.

    Parameters
    ----------
    folder : Path
        For messages; no view may be a link out of it unless the options say so.
    files : mapping of int to Path
        Number ``t * S + s`` in the given grid to file; numbers without a file are missing views.
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
        File of each view, as it is in the folder; empty where it is missing.

    Raises
    ------
    SepiError
        If the options do not fit the grid, no view is left, or a file cannot be read, is a link out of the folder, or
        is unlike the others.
    """
    if grid[0] * grid[1] > MAX_VIEWS:
        raise SepiError(f"{folder}: a grid of {grid[0]}x{grid[1]} views; expected at most {MAX_VIEWS} views")
    # what is no view may be excluded, too
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
    """Raise if one of the files is a link that leads out of the folder."""
    home = folder.resolve()
    for path in filter(Path.is_symlink, paths):
        try:
            target = path.resolve()
        except (OSError, RuntimeError) as error:
            raise SepiError(f"{path}: a link that leads back to itself") from error
        if not target.is_relative_to(home):
            raise SepiError(f"{path}: a link out of the folder, to {target}; copy the file, or pass --follow-links")
