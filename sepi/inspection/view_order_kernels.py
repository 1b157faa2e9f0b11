"""Compiled loops of the check of the views' order."""

from __future__ import annotations

import math

import numba
import numpy as np
import numpy.typing as npt

from sepi.lightfield import BoolMap, FloatMap

# difference of two patches that counts one half, as part of the patch's own variation
_HALF = np.float32(0.25)

# Two surfaces count as two where they are this far apart in a view, pixels; they meet in it within this distance
_LEAST_SHIFT = 1.5
_MEETING = 0.75


@numba.njit(parallel=True, cache=True)  # type: ignore[untyped-decorator, unused-ignore]
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
        Steps ``(t - t0, s - s0)`` of each view under each layout.
    candidates : ndarray, shape (K,), float32
        Disparities in pixels per view step.
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
    for p in numba.prange(len(points)):
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
                if 2 * seen >= V and total < cost[p, n] * seen:
                    cost[p, n] = total / np.float32(seen)
                    disparity[p, n] = candidates[k]
    return cost, disparity


@numba.njit(parallel=True, cache=True)  # type: ignore[untyped-decorator, unused-ignore]
def residuals(
    reference: FloatMap, view: FloatMap, down: float, across: float, disparity: FloatMap, radius: int
) -> FloatMap:
    """Mean squared difference, shape (H, W) float32, of each pixel's window and where it should be seen in a view.

    The view lies ``down`` and ``across`` views from the reference. Infinite where the window leaves either picture.
    """
    H, W = reference.shape
    side = 2 * radius + 1
    out = np.full((H, W), np.inf, np.float32)
    for y in numba.prange(H - side + 1):
        for x in range(W - side + 1):
            d = disparity[y + radius, x + radius]
            v, u = y - d * down, x - d * across
            row, column = math.floor(v), math.floor(u)
            if row >= 0 and column >= 0 and row + side < H and column + side < W:
                patch = reference[y : y + side, x : x + side]
                squares = _squares(patch, view, row, column, np.float32(v - row), np.float32(u - column))
                out[y + radius, x + radius] = squares / np.float32(side * side)
    return out


@numba.njit(parallel=True, cache=True)  # type: ignore[untyped-decorator, unused-ignore]
def count_occlusions(
    residual: FloatMap,
    opposite: FloatMap,
    everywhere: FloatMap,
    down: float,
    across: float,
    disparity: FloatMap,
    trusted: BoolMap,
    good: float,
    bad: float,
    factor: float,
    reach: int,
) -> tuple[int, int]:
    """Which of two surfaces hides the other where they meet in a view.

    A pixel that is plainly not seen in the view, though it is seen from the other side, is hidden there. What hides it
    is a pixel of the reference that the disparities bring to the same position and that is seen in all views.

    Parameters
    ----------
    residual : ndarray, shape (H, W), float32
        Of the view, as by :func:`residuals`.
    opposite, everywhere : ndarrays, shape (H, W), float32
        Worst residual of the views on the other side, and of the views on both sides.
    down, across : float
        Steps from the reference to the view.
    disparity, trusted : ndarrays, shape (H, W)
    good, bad : float
        Residuals up to and from which a pixel is seen, and is not.
    factor : float
        Least ratio of ``residual`` to ``opposite`` of a hidden pixel.
    reach : int
        Farthest that two pixels that meet can be apart, pixels.

    Returns
    -------
    greater, lesser : int
        How often the surface of the greater, and of the lesser disparity was the one seen.
    """
    H, W = disparity.shape
    length = math.sqrt(down * down + across * across)
    greater, lesser = 0, 0
    for y in numba.prange(H):
        for x in range(W):
            if not (trusted[y, x] and opposite[y, x] <= good and bad <= residual[y, x] < np.inf):
                continue
            if residual[y, x] < factor * opposite[y, x]:
                continue
            best, winner = np.inf, 0
            for k in range(-reach, reach + 1):
                v, u = round(y + k * down / length), round(x + k * across / length)
                if v < 0 or u < 0 or v >= H or u >= W or not trusted[v, u] or everywhere[v, u] > good:
                    continue
                shift = (disparity[v, u] - disparity[y, x]) * length
                if abs(shift) >= _LEAST_SHIFT and abs(shift - k) <= _MEETING and residual[v, u] < best:
                    best, winner = residual[v, u], 1 if shift > 0 else -1
            if winner > 0:
                greater += 1
            elif winner < 0:
                lesser += 1
    return greater, lesser


@numba.njit(cache=True, inline="always")  # type: ignore[untyped-decorator, unused-ignore]
def _squares(patch, view, row, column, fy, fx):  # type: ignore[no-untyped-def]
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
