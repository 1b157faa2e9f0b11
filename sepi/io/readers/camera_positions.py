"""View positions of a light field from the camera positions in its files, in view steps."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np
import numpy.typing as npt

from sepi.io.readers.options import ORDERS
from sepi.lightfield import BoolMap, LightField

Positions = npt.NDArray[np.float64]

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
