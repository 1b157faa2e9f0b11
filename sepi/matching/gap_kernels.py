"""Compiled loops of what is seen through gaps: farther surfaces of a like colour, and how well both depths fit."""

from __future__ import annotations

from typing import Any

import numpy as np

from sepi.compiled import njit, prange

EXACT = {"nnan", "ninf", "nsz"}
"""Fast-math flags that keep every rounding as written: see :mod:`sepi.matching.plane_sweep_kernels`."""


@njit(parallel=True, cache=True, fastmath=EXACT)
def farther_alike(disparity: Any, lowest: Any, colours: Any, reach: int, least_step: Any, distance2: Any) -> Any:
    """Disparity of the closest farther pixel of a like colour, straight or at 45 degrees from each; its own if none.

    Parameters
    ----------
    disparity : ndarray, shape (H, W), float32
        Pixels per view step.
    lowest : ndarray, shape (H, W), float32
        The least within ``reach`` pixels across and down.
    colours : ndarray, shape (H, W, 3), float32
        0..1.
    reach : int
        Pixels.
    least_step : float32
        By how much it is farther at least, pixels per view step.
    distance2 : float32
        Squared RGB distance below which colours are alike.

    Returns
    -------
    ndarray, shape (H, W), float32
        Of two that are as close the farther.
    """
    H, W = disparity.shape
    farther = disparity.copy()
    for y in prange(H):
        for x in range(W):
            limit = disparity[y, x] - least_step
            if lowest[y, x] >= limit:
                continue
            closest = reach
            for direction in range(9):
                dy, dx = direction // 3 - 1, direction % 3 - 1
                if direction == 4:
                    continue
                for step in range(1, closest + 1):
                    row, column = y + step * dy, x + step * dx
                    if row < 0 or column < 0 or row >= H or column >= W:
                        break
                    d = disparity[row, column]
                    if d >= limit:
                        continue
                    apart = np.float32(0)
                    for c in range(3):
                        apart += (colours[row, column, c] - colours[y, x, c]) ** 2
                    if apart < distance2:
                        farther[y, x] = min(d, farther[y, x]) if step == closest else d
                        closest = step
                        break
    return farther


@njit(inline="always")
def _squared_residual(colours: Any, unit: Any, row: Any, column: Any, reference: Any) -> Any:
    """Of a bilinear sample of a view ``(3, H, W)``."""
    top, left = int(row), int(column)
    fy, fx = np.float32(row - top), np.float32(column - left)
    one, total = np.float32(1), np.float32(0)
    for c in range(3):
        above = (one - fx) * colours[c, top, left] + fx * colours[c, top, left + 1]
        below = (one - fx) * colours[c, top + 1, left] + fx * colours[c, top + 1, left + 1]
        total += (((one - fy) * above + fy * below) * unit - reference[c]) ** 2
    return total


@njit(parallel=True, cache=True, fastmath=EXACT)
def compare_depths(
    views: Any, unit: Any, reference: Any, disparity: Any, farther: Any, nearest: Any, low: int, begin: int, end: int,
    positions: Any, baselines: Any, margin: Any, sums: Any,
) -> None:  # fmt: skip
    """Squared residuals at two depths, of the views in which nothing hides the farther one.

    Parameters
    ----------
    views : ndarray, shape (T, S, 3, H, W)
        Colours, in units of ``unit``.
    unit : float32
    reference : ndarray, shape (H, W, 3), float32
        Colours of the reference view, 0..1.
    disparity, farther : ndarray, shape (H, W), float32
        Pixels per view step; where they are equal nothing is compared.
    nearest : ndarray, shape (T, S, n, W), float32
        From :func:`sepi.matching.nearest_surfaces.nearest_surfaces`, of the map ``farther``, rows from ``low`` on.
    low : int
    begin, end : int
        Rows that are compared.
    positions : ndarray, shape (N, 2), int64
        Row and column of each view in the grid.
    baselines : ndarray, shape (N, 2), float64
        Down and across from the reference view, in view steps.
    margin : float32
        By how much an occluder must be nearer, pixels per view step.
    sums : ndarray, shape (3, H, W), float32
        Filled: residuals at ``farther``, at ``disparity``, and how many views they are of.
    """
    H, W = disparity.shape
    for y in prange(begin, end):
        for x in range(W):
            d, f = disparity[y, x], farther[y, x]
            if d == f:
                continue
            for n in range(len(positions)):
                t, s = positions[n, 0], positions[n, 1]
                v, u = baselines[n, 0], baselines[n, 1]
                row, column, own_row, own_column = y - f * v, x - f * u, y - d * v, x - d * u
                first, last = min(row, own_row), max(row, own_row)
                left, right = min(column, own_column), max(column, own_column)
                if first < 0 or left < 0 or last >= H - 1 or right >= W - 1:
                    continue
                i, j, limit = int(row) - low, int(column), f + margin
                before = max(
                    max(nearest[t, s, i, j], nearest[t, s, i, j + 1]),
                    max(nearest[t, s, i + 1, j], nearest[t, s, i + 1, j + 1]),
                )
                if before > limit:
                    continue
                sums[0, y, x] += _squared_residual(views[t, s], unit, row, column, reference[y, x])
                sums[1, y, x] += _squared_residual(views[t, s], unit, own_row, own_column, reference[y, x])
                sums[2, y, x] += 1
