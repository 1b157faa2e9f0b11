"""Arrangement of the views of the given grid, as :class:`sepi.io.readers.options.ReadOptions` ask."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
import numpy.typing as npt

from sepi.camera import Part
from sepi.errors import SepiError
from sepi.io.readers.options import ORDERS, POSITION, ReadOptions
from sepi.lightfield import LightField
from sepi.validation import require_known

Numbers = npt.NDArray[np.int64]
Map = npt.NDArray[Any]


def cut_like_views(values: Map, shape: tuple[int, int], part: Part | None) -> Map:
    """Map of the whole image, cropped like views of this ``shape`` (:attr:`ReadOptions.part`).

    A map that does not have the size of the whole image stays unchanged.
    """
    if part is None or values.shape == shape or values.shape != part[1::-1]:
        return values
    left, top = part[2:]
    return values[top : top + shape[0], left : left + shape[1]]


def arrange_numbers(source: str, grid: tuple[int, int], options: ReadOptions, names: Mapping[str, int] = {}) -> Numbers:
    """Number in the given grid of the view at each position of the light field's grid.

    Parameters
    ----------
    source : str
        Path, for messages.
    grid : (int, int)
        Rows and columns ``(T, S)`` of the given grid.
    options : ReadOptions
    names : mapping of str to int, optional
        Number ``t * S + s`` of each file, for views excluded by name; -1 for files that are not views.

    Returns
    -------
    ndarray, int64
        Number ``t * S + s`` in the given grid; -1 for excluded views.

    Raises
    ------
    SepiError
        If ``central``, ``order``, ``exclude`` or ``view`` does not fit the grid.
    """
    T, S = grid
    require_known("order", [options.order], ORDERS)
    numbers, side = np.arange(T * S).reshape(T, S), options.central
    if side is not None:
        # around the centre view of the light field; an even grid has one more row before it than after it
        top, left = T // 2 - side // 2, S // 2 - side // 2
        if side % 2 == 0 or top < 0 or left < 0 or top + side > T or left + side > S:
            raise SepiError(f"{source}: the central {side}x{side} views of {T}x{S}; expected an odd number that fits")
        numbers = numbers[top : top + side, left : left + side]
    numbers = ORDERS[options.order](numbers)
    if options.view is not None:
        _require_inside(source, numbers, options.view)
    excluded = [_excluded(source, view, numbers, names) for view in options.exclude]
    return np.where(np.isin(numbers, excluded), -1, numbers)


def taken(light_field: LightField, numbers: Numbers) -> dict[str, Any]:
    """Fields of a light field for its views with these numbers ``t * S + s``; -1 for none."""
    # -1 picks the last view, which `present` then marks as missing
    places = np.divmod(numbers, light_field.grid[1])
    present = light_field.present[places] & (numbers >= 0)
    views = light_field.views[places]
    views[~present] = 0
    missing = None if light_field.missing is None else light_field.missing[places] & present[..., None, None]
    files = None if light_field.files is None else np.where(present, light_field.files[places], "")
    return {"views": views, "present": present, "missing": missing, "files": files}


def position_of(numbers: Numbers, number: int) -> tuple[int, int] | None:
    """Position ``(t, s)`` of a view of the given grid; None if it was left out."""
    positions = np.argwhere(numbers == number)
    return (int(positions[0][0]), int(positions[0][1])) if len(positions) else None


def _excluded(source: str, view: str, numbers: Numbers, names: Mapping[str, int]) -> int:
    match = POSITION.fullmatch(view)
    if match is not None:
        position = int(match[1]), int(match[2])
        _require_inside(source, numbers, position)
        return int(numbers[position])
    if view not in names:
        found = f" (found: {', '.join(sorted(names)[:3])}, ...)" if names else ""
        raise SepiError(f"{source}: --exclude {view}: expected a position ROW,COLUMN or the file of a view{found}")
    return names[view]


def _require_inside(source: str, numbers: Numbers, position: tuple[int, int]) -> None:
    T, S = numbers.shape
    if not (0 <= position[0] < T and 0 <= position[1] < S):
        raise SepiError(f"{source}: view {position[0]},{position[1]} lies outside the grid of {T}x{S}, counted from 0")
