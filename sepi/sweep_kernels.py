"""Compiled loops of the plane sweep.

No cost volume is ever held: a thread keeps the cost rows of one aggregation window, and the minimum is taken as soon as
a row is aggregated. Each row is summed by one thread in a fixed order: results do not depend on the number of threads.

Functions work on one image row, or a part of it; only :func:`sweep_rows` runs in parallel.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numba import njit, prange

ROWS_PER_TASK = 64
"""Rows that a thread does at a stretch; the rows of the window above and below are done again by its neighbours."""

TILE_WIDTH = 512
"""Columns done at a time: bounds what a thread holds, whatever the width of the picture, and keeps it in the cache."""


@njit(inline="always")
def _add_robust_gray(out: Any, a: Any, b: Any, c: Any, d: Any, g: Any, w: Any, scale2: Any) -> None:
    """Add the robust residual of one run of pixels, one channel."""
    for x in range(out.size):
        r = w[0] * a[x] + w[1] * b[x] + w[2] * c[x] + w[3] * d[x] - g[x]
        r2 = r * r
        out[x] += r2 / (r2 + scale2)


@njit(inline="always")
def _add_robust_rgb(
    out: Any,
    a0: Any, b0: Any, c0: Any, d0: Any, a1: Any, b1: Any, c1: Any, d1: Any, a2: Any, b2: Any, c2: Any, d2: Any,
    g0: Any, g1: Any, g2: Any, w: Any, scale2: Any,
) -> None:  # fmt: skip
    """Add the robust residual of one run of pixels, three channels."""
    for x in range(out.size):
        r0 = w[0] * a0[x] + w[1] * b0[x] + w[2] * c0[x] + w[3] * d0[x] - g0[x]
        r1 = w[0] * a1[x] + w[1] * b1[x] + w[2] * c1[x] + w[3] * d1[x] - g1[x]
        r2 = w[0] * a2[x] + w[1] * b2[x] + w[2] * c2[x] + w[3] * d2[x] - g2[x]
        z = r0 * r0 + r1 * r1 + r2 * r2
        out[x] += z / (z + scale2)


@njit(cache=True, fastmath=True, error_model="numpy")
def cost_row(
    views: Any, t0: int, s0: int, groups: Any, y: int, begin: int, end: int, disparities: Any, scale2: Any, cost: Any,
    count: Any,
) -> None:  # fmt: skip
    """Photo-consistency of columns ``begin..end`` of row ``y``, summed over each group of views, for every candidate.

    Parameters
    ----------
    views : ndarray, shape (T, S, C, H, W)
        C is 1 or 3.
    t0, s0 : int
        Place of the reference view.
    groups : ndarray, shape (T, S), int
    y, begin, end : int
    disparities : ndarray, shape (K,), float32
    scale2 : float32
        Square of the robust scale, in the views' units.
    cost, count : ndarray, shape (G, K, end - begin), float32
        Filled with the sum of the robust residuals (each 0..1) and the number of views that see the pixel.
    """
    T, S, C, H, W = views.shape
    K = disparities.size
    G = cost.shape[0]
    cost[:] = 0
    count[:] = 0
    centre = views[t0, s0, :, y].astype(np.float32)
    reach = max(abs(disparities[0]), abs(disparities[K - 1]))
    band = np.empty((C, min(H, int(2 * reach * max(t0, T - 1 - t0)) + 4), W), np.float32)
    # columns that any view and candidate touches
    side = math.ceil(reach * max(s0, S - 1 - s0)) + 1
    leftmost, rightmost = max(0, begin - side), min(W, end + side)
    for t in range(T):
        # rows of this view row that any candidate touches, converted once for all candidates
        shift = -disparities * (t - t0)
        low = max(0, min(H - 2, math.floor(y + shift.min())))
        high = max(0, min(H - 2, math.floor(y + shift.max()))) + 1
        for s in range(S):
            g = groups[t, s]
            if g < 0:
                continue
            for c in range(C):
                for row in range(low, high + 1):
                    band[c, row - low, leftmost:rightmost] = views[t, s, c, row, leftmost:rightmost]
            for k in range(K):
                v = y - disparities[k] * (t - t0)
                if v < 0 or v > H - 1:
                    continue
                top = min(int(v), H - 2)
                wy = np.float32(v - top)
                u = -disparities[k] * (s - s0)
                left = math.floor(u)
                wx = np.float32(u - left)
                # run of pixels whose sample lies inside the view
                first = max(begin, -left)
                last = min(end, W - 1 - left)
                if last <= first:
                    continue
                i = first + left
                j = last + left
                n = top - low
                w = ((1 - wy) * (1 - wx), (1 - wy) * wx, wy * (1 - wx), wy * wx)
                if C == 3:
                    _add_robust_rgb(
                        cost[g, k, first - begin : last - begin],
                        band[0, n, i:j], band[0, n, i + 1 : j + 1], band[0, n + 1, i:j], band[0, n + 1, i + 1 : j + 1],
                        band[1, n, i:j], band[1, n, i + 1 : j + 1], band[1, n + 1, i:j], band[1, n + 1, i + 1 : j + 1],
                        band[2, n, i:j], band[2, n, i + 1 : j + 1], band[2, n + 1, i:j], band[2, n + 1, i + 1 : j + 1],
                        centre[0, first:last], centre[1, first:last], centre[2, first:last], w, scale2,
                    )  # fmt: skip
                else:
                    _add_robust_gray(
                        cost[g, k, first - begin : last - begin],
                        band[0, n, i:j], band[0, n, i + 1 : j + 1], band[0, n + 1, i:j], band[0, n + 1, i + 1 : j + 1],
                        centre[0, first:last], w, scale2,
                    )  # fmt: skip
                # how many views see a pixel: ends of the runs, summed up below
                count[g, k, first - begin] += 1
                if last < end:
                    count[g, k, last - begin] -= 1
    for g in range(G):
        for k in range(K):
            n = np.float32(0)
            for x in range(end - begin):
                n += count[g, k, x]
                count[g, k, x] = n


@njit(cache=True, fastmath=True, error_model="numpy")
def window_weights(guide: Any, y: int, radius: int, variance: Any, weights: Any) -> None:
    """Weights of the aggregation window of each pixel of row ``y``: narrow in colour, summing to one.

    Parameters
    ----------
    guide : ndarray, shape (C, H, W), float32
        Reference view.
    y, radius : int
    variance : float32
        Squared colour distance of the fall-off.
    weights : ndarray, shape (2 radius + 1, 2 radius + 1, W), float32
        Filled; zero outside the image.
    """
    C, H, W = guide.shape
    weights[:] = 0
    total = np.zeros(W, np.float32)
    falloff = np.float32(-0.5) / variance
    for i in range(2 * radius + 1):
        row = y + i - radius
        if row < 0 or row >= H:
            continue
        for j in range(2 * radius + 1):
            dx = j - radius
            for x in range(max(0, -dx), min(W, W - dx)):
                difference = np.float32(0)
                for c in range(C):
                    e = guide[c, y, x] - guide[c, row, x + dx]
                    difference += e * e
                weight = np.exp(falloff * difference)
                weights[i, j, x] = weight
                total[x] += weight
    for i in range(2 * radius + 1):
        for j in range(2 * radius + 1):
            for x in range(W):
                weights[i, j, x] /= total[x]


@njit(cache=True, fastmath=True, error_model="numpy")
def _aggregate_row(ring: Any, y: int, H: int, weights: Any, first: int, last: int, out: Any) -> None:
    """Weighted sum of the rows round row ``y`` at columns ``first..last``; ``ring`` holds row ``r`` at ``r % size``."""
    G, K, W = out.shape
    size = weights.shape[0]
    radius = size // 2
    for g in range(G):
        for k in range(K):
            out[g, k, first:last] = 0
            for i in range(size):
                row = y + i - radius
                if row < 0 or row >= H:
                    continue
                for j in range(size):
                    dx = j - radius
                    begin = max(first, -dx)
                    end = min(last, W - dx)
                    source = ring[row % size, g, k, begin + dx : end + dx]
                    weight = weights[i, j, begin:end]
                    target = out[g, k, begin:end]
                    for x in range(end - begin):
                        target[x] += weight[x] * source[x]


@njit(cache=True, error_model="numpy")
def _count_window(counts: Any, y: int, H: int, weights: Any, first: int, last: int, group_sizes: Any, out: Any) -> None:
    """Weighted number of samples in the windows of row ``y``; between columns ``first`` and ``last`` it is known."""
    G, K, W = out.shape
    _aggregate_row(counts, y, H, weights, 0, first, out)
    _aggregate_row(counts, y, H, weights, last, W, out)
    for g in range(G):
        for k in range(K):
            out[g, k, first:last] = group_sizes[g]


@njit(cache=True, error_model="numpy")
def _best_of_row(
    sums: Any, counts: Any, subset: Any, wanted: Any, first: int, last: int, disparities: Any,
    disparity: Any, cost: Any, mean: Any,
) -> None:  # fmt: skip
    """Minimum over the candidates, at wanted columns ``first..last``, of the costs of the groups of one subset."""
    G, K, W = sums.shape
    total = np.empty((K, W), np.float32)
    lowest = np.full(W, np.inf, np.float32)
    best = np.zeros(W, np.int64)
    over_candidates = np.zeros(W, np.float32)
    for k in range(K):
        number = np.zeros(W, np.float32)
        row = total[k]
        row[:] = 0
        for g in range(G):
            if subset[g]:
                for x in range(W):
                    row[x] += sums[g, k, x]
                    number[x] += counts[g, k, x]
        for x in range(W):
            # a candidate that no view of the subset sees is no match
            row[x] = row[x] / number[x] if number[x] > 0 else np.float32(1)
            over_candidates[x] += row[x]
            if row[x] < lowest[x]:
                lowest[x] = row[x]
                best[x] = k
    step = (disparities[K - 1] - disparities[0]) / np.float32(K - 1)
    for x in range(first, last):
        if not wanted[x]:
            continue
        k = best[x]
        offset = np.float32(0)
        # a perfect match needs no parabola, and the ends of the range allow none
        if lowest[x] > 0 and 0 < k < K - 1:
            before, after = total[k - 1, x], total[k + 1, x]
            curvature = before - 2 * lowest[x] + after
            if curvature > 0:
                offset = np.float32(0.5) * (before - after) / curvature
        disparity[x] = disparities[k] + offset * step
        cost[x] = lowest[x]
        mean[x] = over_candidates[x] / K


@njit(cache=True, error_model="numpy")
def _sweep_tile(
    views: Any, t0: int, s0: int, guide: Any, groups: Any, subsets: Any, wanted: Any,
    top: int, bottom: int, begin: int, end: int, disparities: Any, scale2: Any, radius: int, window_variance: Any,
    group_sizes: Any, margin: int,
    disparity: Any, cost: Any, mean: Any,
) -> None:  # fmt: skip
    """Sweep rows ``top..bottom``, columns ``begin..end``; nearer than ``margin`` to the border, views are counted."""
    H, W = views.shape[3:]
    N, G = subsets.shape
    K = disparities.size
    size = 2 * radius + 1
    # columns with those of the windows at both ends
    left, right = max(0, begin - radius), min(W, end + radius)
    width = right - left
    ring = np.empty((size, G, K, width), np.float32)
    counts = np.empty((size, G, K, width), np.float32)
    weights = np.empty((size, size, width), np.float32)
    window_costs = np.empty((G, K, width), np.float32)
    window_counts = np.empty((G, K, width), np.float32)
    tile_guide = guide[:, :, left:right].copy()
    done = -1  # last row whose costs are in the ring
    for y in range(top, bottom):
        if not wanted[y, begin:end].any():
            continue
        for row in range(max(0, y - radius, done + 1), min(H, y + radius + 1)):
            cost_row(
                views, t0, s0, groups, row, left, right, disparities, scale2, ring[row % size], counts[row % size]
            )  # fmt: skip
            done = row
        window_weights(tile_guide, y, radius, window_variance, weights)
        _aggregate_row(ring, y, H, weights, 0, width, window_costs)
        # away from the border every view sees every pixel of the window: nothing to count
        known_from, known_to = width, width
        if margin <= y < H - margin:
            known_from = min(width, max(0, margin - left))
            known_to = max(known_from, min(width, W - margin - left))
        _count_window(counts, y, H, weights, known_from, known_to, group_sizes, window_counts)
        for n in range(N):
            _best_of_row(
                window_costs, window_counts, subsets[n], wanted[y, left:right], begin - left, end - left, disparities,
                disparity[n, y, left:right], cost[n, y, left:right], mean[n, y, left:right],
            )  # fmt: skip


@njit(cache=True, parallel=True)
def sweep_rows(
    views: Any, t0: int, s0: int, guide: Any, groups: Any, subsets: Any, wanted: Any,
    first: int, last: int, disparities: Any,
    scale2: Any, radius: int, window_variance: Any, disparity: Any, cost: Any, mean: Any,
) -> None:  # fmt: skip
    """Sweep rows ``first..last``, a run of them per thread."""
    W = views.shape[4]
    G = subsets.shape[1]
    group_sizes = np.array([(groups == g).sum() for g in range(G)], np.float32)
    reach = max(abs(disparities[0]), abs(disparities[-1]))
    farthest = max(t0, views.shape[0] - 1 - t0, s0, views.shape[1] - 1 - s0)
    margin = math.ceil(reach * farthest) + radius + 1
    tasks = max(1, (last - first + ROWS_PER_TASK - 1) // ROWS_PER_TASK)
    rows = (last - first + tasks - 1) // tasks
    for task in prange(tasks):
        for begin in range(0, W, TILE_WIDTH):
            _sweep_tile(
                views, t0, s0, guide, groups, subsets, wanted,
                first + task * rows, min(last, first + (task + 1) * rows), begin, min(W, begin + TILE_WIDTH),
                disparities, scale2, radius, window_variance, group_sizes, margin,
                disparity, cost, mean,
            )  # fmt: skip
