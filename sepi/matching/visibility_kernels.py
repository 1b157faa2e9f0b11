"""Compiled loops of the layered plane sweep: z-buffers of every view, and costs over the views that see a pixel."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numba import njit, prange

from sepi.matching.fastmath import EXACT

EMPTY = np.float32(-1e9)
"""Disparity in a z-buffer where no pixel of the reference view falls: nothing is nearer."""


@njit(parallel=True, cache=True)
def z_buffers(disparity: Any, present: Any, t0: int, s0: int) -> Any:
    """Disparity map of the reference view as each view sees it: the nearest of the pixels that touch a place.

    Parameters
    ----------
    disparity : ndarray, shape (H, W), float32
        Pixels per view step.
    present : ndarray, shape (T, S), bool
    t0, s0 : int
        Place of the reference view.

    Returns
    -------
    ndarray, shape (T, S, H, W), float32
        ``EMPTY`` where no pixel falls. A pixel covers the up to four places that its square touches, since a bilinear
        sample beside it reads its colour too.
    """
    T, S = present.shape
    H, W = disparity.shape
    nearest = np.empty((T, S, H, W), np.float32)
    for view in prange(T * S):
        t, s = view // S, view % S
        buffer = nearest[t, s]
        buffer[:] = EMPTY
        if not present[t, s]:
            continue
        for y in range(H):
            for x in range(W):
                d = disparity[y, x]
                top, left = math.floor(y - d * (t - t0)), math.floor(x - d * (s - s0))
                for row in range(max(top, 0), min(top + 2, H)):
                    for column in range(max(left, 0), min(left + 2, W)):
                        buffer[row, column] = max(buffer[row, column], d)
    return nearest


@njit(parallel=True, cache=True)
def occluded_in_any_view(disparity: Any, present: Any, t0: int, s0: int, occlusion_margin: Any) -> Any:
    """Pixels that something nearer covers in one of the views that could see them; shape (H, W), bool.

    Parameters
    ----------
    disparity, present, t0, s0
        As in :func:`z_buffers`.
    occlusion_margin : float32
        By how much a cover must be nearer, pixels per view step.
    """
    nearest = z_buffers(disparity, present, t0, s0)
    T, S, H, W = nearest.shape
    covered = np.zeros((H, W), np.bool_)
    for y in prange(H):
        for x in range(W):
            d = disparity[y, x]
            for t in range(T):
                for s in range(S):
                    row, column = y - d * (t - t0) + 0.5, x - d * (s - s0) + 0.5
                    if row >= 0 and column >= 0 and row < H and column < W:
                        covered[y, x] |= nearest[t, s, int(row), int(column)] > d + occlusion_margin
    return covered


@njit(inline="always")
def _add_layer(
    total: Any, a0: Any, b0: Any, a1: Any, b1: Any, a2: Any, b2: Any, g0: Any, g1: Any, g2: Any, seen: Any, w: Any,
    scale2: Any, share: Any,
) -> None:  # fmt: skip
    """Add the robust residual of one run of pixels in one layer; ``a``, ``b``: rows above and below the samples."""
    for x in range(total.size):
        r0 = w[0] * a0[x] + w[1] * a0[x + 1] + w[2] * b0[x] + w[3] * b0[x + 1] - g0[x]
        r1 = w[0] * a1[x] + w[1] * a1[x + 1] + w[2] * b1[x] + w[3] * b1[x + 1] - g1[x]
        r2 = w[0] * a2[x] + w[1] * a2[x + 1] + w[2] * b2[x] + w[3] * b2[x + 1] - g2[x]
        z = r0 * r0 + r1 * r1 + r2 * r2
        total[x] += share * seen[x] * z / (z + scale2)


@njit(cache=True, fastmath=EXACT, error_model="numpy")
def _add_view(
    band: Any, low: int, reference_view: Any, y: int, dt: int, ds: int, disparities: Any, nearest: Any, tolerance: Any,
    hidden: Any, scales: Any, shares: Any, seen: Any, total: Any, weight: Any,
) -> None:  # fmt: skip
    """Add one view, whose rows from ``low`` on are in ``band (layers, 3, rows, W + 1)``, at every candidate."""
    layers, W = band.shape[0], band.shape[3] - 1
    H = nearest.shape[0]
    one = np.float32(1)
    for k in range(disparities.size):
        d = disparities[k]
        down, across = y - d * dt, -d * ds
        if down < 0 or down > H - 1:
            continue
        top, left = min(int(down), H - 2), math.floor(across)
        fy, fx = np.float32(down - top), np.float32(across - left)
        # on the last column itself nothing beyond it is read with any weight
        first, last = max(0, -left), min(W, W - left if fx == 0 else W - 1 - left)
        if last <= first:
            continue
        n, i, j = top - low, first + left, last + left + 1
        run = seen[first:last]
        if nearest.shape[1] == 0:
            run[:] = one
        else:
            right = 1 if fx > 0.5 else 0
            before = nearest[top + (1 if fy > 0.5 else 0), i + right : last + left + right]
            limit = np.float32(d + tolerance)
            for x in range(run.size):
                run[x] = one if before[x] <= limit else hidden
        count = weight[k, first:last]
        for x in range(run.size):
            count[x] += run[x]
        w = ((one - fy) * (one - fx), (one - fy) * fx, fy * (one - fx), fy * fx)
        for layer in range(layers):
            b, g = band[layer], reference_view[layer]
            _add_layer(
                total[k, first:last], b[0, n, i:j], b[0, n + 1, i:j], b[1, n, i:j], b[1, n + 1, i:j], b[2, n, i:j],
                b[2, n + 1, i:j], g[0, first:last], g[1, first:last], g[2, first:last], run, w, scales[layer],
                shares[layer],
            )  # fmt: skip


@njit(inline="always")
def _load(row: Any, unit: Any, out: Any) -> None:
    for x in range(out.size):
        out[x] = np.float32(row[x]) * unit


@njit(parallel=True, cache=True, fastmath=EXACT, error_model="numpy")
def sweep_rows(
    colours: Any, colour_unit: Any, detail: Any, detail_unit: Any, present: Any, t0: int, s0: int, nearest: Any,
    disparities: Any, tolerance: Any, hidden: Any, scales: Any, shares: Any, begin: int, end: int, cost: Any,
) -> None:  # fmt: skip
    """Cost of every candidate for rows ``begin..end``, over the views in which nothing nearer covers the pixel.

    Parameters
    ----------
    colours : ndarray, shape (T, S, 3, H, W)
    colour_unit, detail_unit : float32
        What the layers' values are multiplied with.
    detail : ndarray, shape (T, S, 3 or 0, H, W)
    present : ndarray, shape (T, S), bool
        Views that count.
    t0, s0 : int
        Place of the reference view.
    nearest : ndarray, shape (T, S, H, W) or (T, S, H, 0), float32
        From :func:`z_buffers`; empty: all views see all pixels.
    disparities : ndarray, shape (K,), float32
    tolerance : float32
        By how much a cover must be nearer, pixels per view step.
    hidden : float32
        Weight of a view in which the pixel is covered.
    scales, shares : ndarray, shape (2,), float32
        Square of the robust scale, and share in the cost, of colours and detail.
    begin, end : int
    cost : ndarray, shape (K, H, W), float32
        Rows ``begin..end`` are filled with costs of 0..1; 1 where no view is left.
    """
    T, S, _, H, W = colours.shape
    K = disparities.size
    layers = 2 if detail.shape[2] else 1
    reach = max(abs(disparities[0]), abs(disparities[K - 1])) * max(t0, T - 1 - t0)
    rows = min(H, 2 * math.ceil(reach) + 3)
    for y in prange(begin, end):
        total, weight = np.zeros((K, W), np.float32), np.zeros((K, W), np.float32)
        seen = np.empty(W, np.float32)
        reference_view = np.empty((layers, 3, W), np.float32)
        # one column more, which is read but weighs nothing
        band = np.zeros((layers, 3, rows, W + 1), np.float32)
        for c in range(3):
            _load(colours[t0, s0, c, y], colour_unit, reference_view[0, c])
            if layers == 2:
                _load(detail[t0, s0, c, y], detail_unit, reference_view[1, c])
        for t in range(T):
            ends = (y - disparities[0] * (t - t0), y - disparities[K - 1] * (t - t0))
            low = max(0, min(H - 2, math.floor(min(ends))))
            high = max(0, min(H - 2, math.floor(max(ends)))) + 1
            for s in range(S):
                if not present[t, s] or (t == t0 and s == s0):
                    continue
                for c in range(3):
                    for row in range(low, high + 1):
                        _load(colours[t, s, c, row], colour_unit, band[0, c, row - low, :W])
                        if layers == 2:
                            _load(detail[t, s, c, row], detail_unit, band[1, c, row - low, :W])
                _add_view(
                    band, low, reference_view, y, t - t0, s - s0, disparities, nearest[t, s], tolerance, hidden, scales,
                    shares, seen, total, weight,
                )  # fmt: skip
        for k in range(K):
            for x in range(W):
                cost[k, y, x] = total[k, x] / weight[k, x] if weight[k, x] > 0 else np.float32(1)
