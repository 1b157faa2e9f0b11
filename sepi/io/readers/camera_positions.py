"""Camera positions of a light field from its files, in steps of columns of views."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import numpy.typing as npt

from sepi.io.readers.options import ORDERS
from sepi.lightfield import BoolMap, LightField

Positions = npt.NDArray[np.float64]

# Farthest that a camera may stand from the place that a regular grid gives it, and all of them on average, in steps of
# its axis: numbers that stray further are no positions of these views
_FARTHEST = 0.35
_ON_AVERAGE = 0.15
# Cameras beyond those that any line or plane goes through
_SURPLUS = 2
# A frame turned by more than about 35 degrees does not tell which coordinate is which
_CLEARLY = 2.0


def positions_from_cameras(cameras: Positions, present: BoolMap) -> tuple[Positions, float, tuple[int, int]] | None:
    """Positions of views in view steps, from coordinates of their cameras in any unit.

    A regular grid is fitted to the coordinates. It tells which of the two is which axis, which way it runs and how long
    a step is; how far single cameras stand from it, and whether it is turned or sheared, is kept.

    Parameters
    ----------
    cameras : ndarray, shape (T, S, 2), float64
        Two coordinates of each camera, in either order; those of missing views do not count.
    present : ndarray, shape (T, S), bool

    Returns
    -------
    positions : ndarray, shape (T, S, 2), float64
        ``(down, across)`` in steps of columns, growing with row and column; on the fitted grid where a view is missing.
        Of a single row or column only the coordinate along it counts: nothing tells which way the other runs.
    row_spacing : float
        Distance of rows in steps of columns; 1 for a single row or column.
    directions : tuple of int
        1 or -1: whether the coordinates grow or fall with row and column; 0 across the only row or column.

    None where the coordinates do not fit a grid.
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
    # one length for both axes, that of a step between columns, so that the picture's axes stay alike
    positions[..., axes] = filled * np.sign(step) / abs(step[-1])
    signs = dict(zip(axes, np.sign(step).astype(int).tolist(), strict=True))
    return positions, float(abs(step[0] / step[-1])), (signs.get(0, 0), signs.get(1, 0))


def _coordinates(slopes: npt.NDArray[np.floating[Any]]) -> list[int] | None:
    """Which coordinate runs along each axis of the grid, by its change per step; None where that is not clear."""
    sizes = np.abs(slopes)
    if len(sizes) == 1:
        return [int(sizes[0].argmax())] if sizes.any() else None
    as_given, exchanged = sizes[0, 0] * sizes[1, 1], sizes[0, 1] * sizes[1, 0]
    if max(as_given, exchanged) <= _CLEARLY * min(as_given, exchanged):
        return None
    return [0, 1] if as_given > exchanged else [1, 0]


def off_grid(positions: Positions, row_spacing: float, present: BoolMap) -> float:
    """Greatest distance along an axis of a view from its place in a regular grid, in view steps."""
    regular = np.indices(present.shape).transpose(1, 2, 0) * (row_spacing, 1.0)
    strays = (positions - regular)[present]
    return float(np.abs(strays - strays.mean(axis=0)).max())


def reordered(
    positions: Positions | None, row_spacing: float, order: str, numbers: npt.NDArray[np.int64]
) -> tuple[Positions | None, float]:
    """Positions and row spacing of a light field whose views are put in another order.

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
        A step between the new columns is 1, and positions grow along the new rows and columns.
    row_spacing : float
    """
    rows, columns = (ORDERS[order](axis.astype(np.int64)) for axis in np.indices((2, 2)))
    # the old axes along a step down and a step across
    down = (rows[1, 0] - rows[0, 0], columns[1, 0] - columns[0, 0])
    across = (rows[0, 1] - rows[0, 0], columns[0, 1] - columns[0, 0])
    transposed = not down[0]
    if positions is not None:
        turned = positions.reshape(-1, 2)[numbers] @ np.array([down, across], float).T
        positions = turned / row_spacing if transposed else turned
    return positions, 1.0 / row_spacing if transposed else row_spacing


def with_row_spacing(light_field: LightField, row_spacing: float) -> LightField:
    """The same light field with rows of views this far apart, in steps of columns; known positions are stretched."""
    positions = light_field.positions
    if positions is not None:
        positions = positions * (row_spacing / light_field.row_spacing, 1.0)
    return replace(light_field, row_spacing=row_spacing, positions=positions)
