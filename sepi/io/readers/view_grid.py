"""Arrangement of the views of the given grid, as the options for reading ask, and where their cameras stood."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np
import numpy.typing as npt

from sepi.camera import Part
from sepi.errors import SepiError
from sepi.io.readers.options import ORDERS, POSITION, ReadOptions
from sepi.lightfield import BoolMap, LightField
from sepi.validation import require_known

Numbers = npt.NDArray[np.int64]
Positions = npt.NDArray[np.float64]
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


def rearrange(light_field: LightField, options: ReadOptions) -> LightField:
    """Light field with its views arranged as the options ask; ground truth and masks stay with their view."""
    numbers = arrange_numbers(light_field.source or light_field.name, light_field.grid, options)
    T, S = light_field.grid
    if np.array_equal(numbers, np.arange(T * S).reshape(T, S)):
        return light_field
    positions, row_spacing = reordered(light_field.positions, light_field.row_spacing, options.order, numbers)
    truth: dict[str, Any] = {"view": options.view, "ground_truth": None, "masks": {}}
    position = position_of(numbers, light_field.reference_position[0] * S + light_field.reference_position[1])
    if position is not None and (light_field.view is not None or light_field.ground_truth is not None):
        truth = {"view": position}
    return replace(light_field, **taken(light_field, numbers), **truth, positions=positions, row_spacing=row_spacing)


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


# Largest distance of a camera from the regular grid, single and on average, in steps of its axis: numbers that deviate
# more are not positions of these views
_FARTHEST = 0.35
_ON_AVERAGE = 0.15
# Least number of cameras beyond those that a line or plane always fits
_SURPLUS = 2
# In axes rotated by more than about 35 degrees, it is unclear which coordinate is which
_CLEARLY = 2.0


def positions_from_cameras(cameras: Positions, present: BoolMap) -> tuple[Positions, float, tuple[int, int]] | None:
    """View positions in view steps, from camera coordinates in any unit; None if they do not fit a grid.

    A regular grid is fitted to the coordinates. It gives the axis of each coordinate, its direction and the length of a
    step. Deviations of single cameras, rotation and shear of the grid are kept.

    Parameters
    ----------
    cameras : ndarray, shape (T, S, 2), float64
        Two coordinates of each camera, in either order; those of missing views are ignored.
    present : ndarray, shape (T, S), bool

    Returns
    -------
    positions : ndarray, shape (T, S, 2), float64
        ``(down, across)`` in view steps, growing with row and column; on the fitted grid where a view is missing. In a
        single row or column only the coordinate along it counts, since the direction of the other is unknown.
    row_spacing : float
        Distance of rows in view steps; 1 for a single row or column.
    directions : tuple of int
        1 or -1: whether the coordinates grow or fall with row and column; 0 across the only row or column.
    """
    axes = [axis for axis in (0, 1) if present.shape[axis] > 1]
    steps = np.argwhere(present)[:, axes]
    if len(steps) < len(axes) + 1 + _SURPLUS or not np.isfinite(cameras[present]).all():
        return None
    design = np.column_stack([np.ones(len(steps)), steps])
    fit, _, rank, _ = np.linalg.lstsq(design, cameras[present], rcond=None)
    if rank < design.shape[1]:
        return None
    chosen = _coordinates(fit[1:])
    if chosen is None:
        return None
    coordinates, fit = cameras[..., chosen], fit[:, chosen]
    step = np.diagonal(fit[1:])
    strays = np.abs(coordinates[present] - design @ fit) / np.abs(step)
    if strays.max() > _FARTHEST or np.sqrt((strays**2).mean(axis=0)).max() > _ON_AVERAGE:
        return None
    grid = np.indices(present.shape)[axes].transpose(1, 2, 0)
    filled = np.where(present[..., None], coordinates - fit[0], grid @ fit[1:])
    positions = np.zeros((*present.shape, 2))
    # one unit for both axes, a step between columns, so that rows and columns of pixels keep their proportions
    positions[..., axes] = filled * np.sign(step) / abs(step[-1])
    signs = dict(zip(axes, np.sign(step).astype(int).tolist(), strict=True))
    row_spacing = float(abs(step[0] / step[-1]))
    # rounding is no other spacing
    return positions, 1.0 if math.isclose(row_spacing, 1) else row_spacing, (signs.get(0, 0), signs.get(1, 0))


def _coordinates(slopes: npt.NDArray[np.floating[Any]]) -> list[int] | None:
    """Coordinate along each axis of the grid, by its change per step; None if unclear."""
    sizes = np.abs(slopes)
    if len(sizes) == 1:
        return [int(sizes[0].argmax())] if sizes.any() else None
    as_given, exchanged = sizes[0, 0] * sizes[1, 1], sizes[0, 1] * sizes[1, 0]
    if max(as_given, exchanged) <= _CLEARLY * min(as_given, exchanged):
        return None
    return [0, 1] if as_given > exchanged else [1, 0]


def off_grid(positions: Positions, row_spacing: float, present: BoolMap) -> float:
    """Largest distance along an axis of a view from its place in a regular grid, in view steps."""
    regular = np.indices(present.shape).transpose(1, 2, 0) * (row_spacing, 1.0)
    strays = (positions - regular)[present]
    return float(np.abs(strays - strays.mean(axis=0)).max())


def reordered(
    positions: Positions | None, row_spacing: float, order: str, numbers: npt.NDArray[np.int64]
) -> tuple[Positions | None, float]:
    """Positions and row spacing of a light field after its views are reordered.

    Parameters
    ----------
    positions : ndarray, shape (T, S, 2), float64, or None
    row_spacing : float
    order : str
        One of :data:`sepi.io.readers.options.ORDERS`.
    numbers : ndarray, int64
        Number ``t * S + s`` in the old grid of the view at each position of the new one; -1 for missing views.

    Returns
    -------
    positions : ndarray of the shape of ``numbers`` and 2, or None
        A step between the new columns is 1; positions grow along the new rows and columns.
    row_spacing : float
    """
    rows, columns = (ORDERS[order](axis.astype(np.int64)) for axis in np.indices((2, 2)))
    # change of the old row and column along a step down and a step across
    down = (rows[1, 0] - rows[0, 0], columns[1, 0] - columns[0, 0])
    across = (rows[0, 1] - rows[0, 0], columns[0, 1] - columns[0, 0])
    transposed = not down[0]
    if positions is not None:
        turned = positions.reshape(-1, 2)[numbers] @ np.array([down, across], float).T
        positions = turned / row_spacing if transposed else turned
    return positions, 1.0 / row_spacing if transposed else row_spacing


def with_row_spacing(light_field: LightField, row_spacing: float) -> LightField:
    """Light field with this row spacing, in view steps; known positions are stretched."""
    positions = light_field.positions
    if positions is not None:
        positions = positions * (row_spacing / light_field.row_spacing, 1.0)
    return replace(light_field, row_spacing=row_spacing, positions=positions)
