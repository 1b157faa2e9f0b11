"""Compiled loops of the check of the views' order."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import numpy.typing as npt

from sepi.compiled import njit, prange
from sepi.lightfield import BoolMap, FloatMap

# difference of two patches that counts one half, as part of the patch's own variation
_HALF = np.float32(0.25)
# two surfaces count as two where they are this far apart in a view, pixels; they meet in it within this distance
_LEAST_SHIFT = np.float32(1.5)
_MEETING = np.float32(0.75)
# logarithm of the ratio of residuals that one pair counts at most; least that tells anything
_MOST_EVIDENCE = np.float32(2)
_LEAST_EVIDENCE = np.float32(1)


@njit(parallel=True, cache=True)
def layout_costs(
    reference: FloatMap,
    views: FloatMap,
    offsets: FloatMap,
    candidates: FloatMap,
    points: npt.NDArray[np.int64],
    radius: int,
) -> tuple[FloatMap, FloatMap]:
    """How badly points of the reference view match the other views under several layouts of the views.

    Parameters
    ----------
    reference : ndarray, shape (H, W), float32
    views : ndarray, shape (V, H, W), float32
    offsets : ndarray, shape (L, V, 2), float32
        Baseline ``(down, across)`` of each view under each layout.
    candidates : ndarray, shape (K,), float32
        Disparities in pixels per unit of the baselines.
    points : ndarray, shape (P, 2), int64
        Pixels ``(y, x)``, more than ``radius`` from the border.
    radius : int
        Half width of the patch in pixels.

    Returns
    -------
    cost, disparity : ndarrays, shape (P, L), float32
        Lowest mean over the views of ``r^2 / (r^2 + s^2)``, 0..1, where ``s^2`` is a part of the patch's own variation;
        1 where no candidate keeps half of the views in sight. The candidate of the lowest.
    """
    L, V, _ = offsets.shape
    H, W = reference.shape
    side = 2 * radius + 1
    cost = np.ones((len(points), L), np.float32)
    disparity = np.zeros((len(points), L), np.float32)
    for p in prange(len(points)):
        y, x = points[p, 0] - radius, points[p, 1] - radius
        patch = reference[y : y + side, x : x + side].copy()
        # never zero, so that nothing is divided by it
        variation = _HALF * (patch * patch).sum() + np.float32(1e-12)
        for n in range(L):
            for k in range(candidates.size):
                total, seen = np.float32(0), 0
                for v in range(V):
                    down = y - candidates[k] * offsets[n, v, 0]
                    across = x - candidates[k] * offsets[n, v, 1]
                    row, column = math.floor(down), math.floor(across)
                    if row < 0 or column < 0 or row + side >= H or column + side >= W:
                        continue
                    squares = _squares(
                        patch, views[v], row, column, np.float32(down - row), np.float32(across - column)
                    )
                    total += squares / (squares + variation)
                    seen += 1
                    # the mean stays above the lowest, whatever the views that are left say
                    if total >= cost[p, n] * (seen + V - 1 - v):
                        break
                if 2 * seen >= V and total < cost[p, n] * seen:
                    cost[p, n] = total / np.float32(seen)
                    disparity[p, n] = candidates[k]
    return cost, disparity


@njit(parallel=True, cache=True)
def residuals(
    reference: FloatMap, view: FloatMap, baseline: FloatMap, disparity: FloatMap, asked: BoolMap, radius: int
) -> FloatMap:
    """Mean squared difference, shape (H, W) float32, of each pixel's window and where it should be seen in a view.

    ``baseline`` leads down and across to the view, in view steps. Infinite where it is not asked for, and where the
    window leaves either picture.
    """
    H, W = reference.shape
    side = 2 * radius + 1
    out = np.full((H, W), np.inf, np.float32)
    for y in prange(H - side + 1):
        for x in range(W - side + 1):
            if not asked[y + radius, x + radius]:
                continue
            d = disparity[y + radius, x + radius]
            v, u = y - float(d) * float(baseline[0]), x - float(d) * float(baseline[1])
            row, column = math.floor(v), math.floor(u)
            if row >= 0 and column >= 0 and row + side < H and column + side < W:
                patch = reference[y : y + side, x : x + side]
                squares = _squares(patch, view, row, column, np.float32(v - row), np.float32(u - column))
                out[y + radius, x + radius] = squares / np.float32(side * side)
    return out


@njit(parallel=True, cache=True)
def add_pairs(
    rise: FloatMap,
    residual: FloatMap,
    disparity: FloatMap,
    usable: BoolMap,
    down: int,
    across: int,
    length: np.float32,
    hidden: np.float32,
    farthest: int,
    side: int,
    total: npt.NDArray[np.float64],
    count: npt.NDArray[np.float64],
) -> None:
    """Add what pairs of pixels that meet in a view say of which is in front, and their number, to those of regions.

    Parameters
    ----------
    rise : ndarray, shape (H, W), float32
        Logarithm of the residual in the view over the one on the other side.
    residual : ndarray, shape (H, W), float32
        That in the view.
    disparity : ndarray, shape (H, W), float32
        In pixels per view step.
    usable : ndarray, shape (H, W), bool
        Pixels that may be of a pair.
    down, across : int
        Direction to the view, -1, 0 or 1: the nearer pixel of a pair lies there from the other.
    length : float32
        Distance of the view, in view steps.
    hidden : float32
        Least residual of a pixel that is hidden.
    farthest : int
        Most pixels between those of a pair.
    side : int
        Side of a region, pixels.
    total, count : ndarrays, shape (R, C), float64
        Sums, and number of pairs, of each region; added to.
    """
    H, W = disparity.shape
    for region in prange(len(total)):
        for y in range(region * side, min(H, (region + 1) * side)):
            for x in range(W):
                if not usable[y, x]:
                    continue
                for distance in range(2, farthest + 1):
                    i, j = y + down * distance, x + across * distance
                    if i < 0 or i >= H or j < 0 or j >= W:
                        break
                    shift = (disparity[i, j] - disparity[y, x]) * length
                    if abs(shift - np.float32(distance)) > _MEETING or shift < _LEAST_SHIFT or not usable[i, j]:
                        continue
                    if max(residual[y, x], residual[i, j]) > hidden and max(rise[y, x], rise[i, j]) > _LEAST_EVIDENCE:
                        says = rise[y, x] - rise[i, j]
                        total[region, x // side] += min(max(says, -_MOST_EVIDENCE), _MOST_EVIDENCE)
                        count[region, x // side] += 1


@njit(cache=True, inline="always")
def _squares(patch: Any, view: Any, row: int, column: int, fy: Any, fx: Any) -> Any:
    """Sum of the squared differences of a patch and the samples of a view that begin at ``(row + fy, column + fx)``."""
    total = np.float32(0)
    one = np.float32(1)
    a, b, c, d = (one - fy) * (one - fx), (one - fy) * fx, fy * (one - fx), fy * fx
    for i in range(patch.shape[0]):
        for j in range(patch.shape[1]):
            y, x = row + i, column + j
            r = a * view[y, x] + b * view[y, x + 1] + c * view[y + 1, x] + d * view[y + 1, x + 1] - patch[i, j]
            total += r * r
    return total
