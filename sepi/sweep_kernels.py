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

SHORTEST_GAP = 32
"""Columns between wanted pixels that are done rather than skipped: short runs do not pay."""

TILE_WIDTH = 512
"""Columns done at a time: bounds what a thread holds, whatever the width of the picture, and keeps it in the cache."""


@njit(inline="always")
def _add_robust_gray(out: Any, a: Any, b: Any, g: Any, w: Any, scale2: Any) -> None:
    """Add the robust residual of one run of pixels, one channel; ``a``, ``b``: rows above and below the samples."""
    for x in range(out.size):
        r = w[0] * a[x] + w[1] * a[x + 1] + w[2] * b[x] + w[3] * b[x + 1] - g[x]
        r2 = r * r
        out[x] += r2 / (r2 + scale2)


@njit(inline="always")
def _add_robust_rgb(
    out: Any, a0: Any, b0: Any, a1: Any, b1: Any, a2: Any, b2: Any, g0: Any, g1: Any, g2: Any, w: Any, scale2: Any
) -> None:
    """Add the robust residual of one run of pixels, three channels."""
    for x in range(out.size):
        r0 = w[0] * a0[x] + w[1] * a0[x + 1] + w[2] * b0[x] + w[3] * b0[x + 1] - g0[x]
        r1 = w[0] * a1[x] + w[1] * a1[x + 1] + w[2] * b1[x] + w[3] * b1[x + 1] - g1[x]
        r2 = w[0] * a2[x] + w[1] * a2[x + 1] + w[2] * b2[x] + w[3] * b2[x + 1] - g2[x]
        z = r0 * r0 + r1 * r1 + r2 * r2
        out[x] += z / (z + scale2)


@njit(cache=True, fastmath=True, error_model="numpy")
def cost_row(
    views: Any, t0: int, s0: int, groups: Any, y: int, begin: int, end: int, origin: int, disparities: Any, scale2: Any,
    cost: Any, count: Any,
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
    origin : int
        Column of the picture that the first column of ``cost`` and ``count`` stands for.
    disparities : ndarray, shape (K,), float32
    scale2 : float32
        Square of the robust scale, in the views' units.
    cost, count : ndarray, shape (G, K, n), float32
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
                # a plain 1 is a 64-bit number, and would make all that follows 64 bits wide
                ry, rx = np.float32(1) - wy, np.float32(1) - wx
                w = (ry * rx, ry * wx, wy * rx, wy * wx)
                if C == 3:
                    _add_robust_rgb(
                        cost[g, k, first - origin : last - origin],
                        band[0, n, i : j + 1], band[0, n + 1, i : j + 1], band[1, n, i : j + 1],
                        band[1, n + 1, i : j + 1], band[2, n, i : j + 1], band[2, n + 1, i : j + 1],
                        centre[0, first:last], centre[1, first:last], centre[2, first:last], w, scale2,
                    )  # fmt: skip
                else:
                    _add_robust_gray(
                        cost[g, k, first - origin : last - origin],
                        band[0, n, i : j + 1], band[0, n + 1, i : j + 1], centre[0, first:last], w, scale2,
                    )  # fmt: skip
                # how many views see a pixel: ends of the runs, summed up below
                count[g, k, first - origin] += 1
                if last < end:
                    count[g, k, last - origin] -= 1
    for g in range(G):
        for k in range(K):
            n = np.float32(0)
            for x in range(begin - origin, end - origin):
                n += count[g, k, x]
                count[g, k, x] = n


@njit(cache=True, fastmath=True, error_model="numpy")
def window_weights(guide: Any, y: int, begin: int, end: int, radius: int, variance: Any, weights: Any) -> None:
    """Weights of the aggregation windows of columns ``begin..end`` of row ``y``: narrow in colour, summing to one.

    Parameters
    ----------
    guide : ndarray, shape (C, H, W), float32
        Reference view.
    y, begin, end, radius : int
    variance : float32
        Squared colour distance of the fall-off.
    weights : ndarray, shape (2 radius + 1, 2 radius + 1, end - begin), float32
        Filled; zero outside the image.
    """
    C, H, W = guide.shape
    weights[:] = 0
    total = np.zeros(end - begin, np.float32)
    falloff = np.float32(-0.5) / variance
    for i in range(2 * radius + 1):
        row = y + i - radius
        if row < 0 or row >= H:
            continue
        for j in range(2 * radius + 1):
            dx = j - radius
            first, last = max(begin, -dx), min(end, W - dx)
            weight = weights[i, j, first - begin : last - begin]
            for c in range(C):
                here, there = guide[c, y, first:last], guide[c, row, first + dx : last + dx]
                for x in range(last - first):
                    e = here[x] - there[x]
                    weight[x] += e * e
            sums = total[first - begin : last - begin]
            for x in range(last - first):
                weight[x] = np.exp(falloff * weight[x])
                sums[x] += weight[x]
    for i in range(2 * radius + 1):
        for j in range(2 * radius + 1):
            for x in range(end - begin):
                weights[i, j, x] /= total[x]


@njit(inline="always")
def _add_seven(
    target: Any, w0: Any, w1: Any, w2: Any, w3: Any, w4: Any, w5: Any, w6: Any,
    a0: Any, a1: Any, a2: Any, a3: Any, a4: Any, a5: Any, a6: Any,
) -> None:  # fmt: skip
    """Add a row of the usual window, seven columns wide, at once: the target is loaded and stored once only."""
    for x in range(target.size):
        target[x] += (
            (w0[x] * a0[x] + w1[x] * a1[x]) + (w2[x] * a2[x] + w3[x] * a3[x]) + (w4[x] * a4[x] + w5[x] * a5[x])
            + w6[x] * a6[x]
        )  # fmt: skip


@njit(cache=True, fastmath=True, error_model="numpy")
def _aggregate_row(ring: Any, y: int, H: int, weights: Any, first: int, last: int, out: Any) -> None:
    """Weighted sum of the rows round row ``y`` at columns ``first..last``; ``ring`` holds row ``r`` at ``r % size``.

    ``ring`` has ``size - 1`` columns more than ``out``: those of the windows at both ends.
    """
    G, K, _ = out.shape
    size = weights.shape[0]
    radius = size // 2
    n = last - first
    for g in range(G):
        for k in range(K):
            target = out[g, k, first:last]
            target[:] = 0
            for i in range(size):
                row = y + i - radius
                if row < 0 or row >= H:
                    continue
                a = ring[row % size, g, k, first : last + size - 1]
                if size == 7:
                    _add_seven(
                        target,
                        weights[i, 0, first:last], weights[i, 1, first:last], weights[i, 2, first:last],
                        weights[i, 3, first:last], weights[i, 4, first:last], weights[i, 5, first:last],
                        weights[i, 6, first:last],
                        a[0:n], a[1 : n + 1], a[2 : n + 2], a[3 : n + 3], a[4 : n + 4], a[5 : n + 5], a[6 : n + 6],
                    )  # fmt: skip
                else:
                    for j in range(size):
                        weight, source = weights[i, j, first:last], a[j : j + n]
                        for x in range(n):
                            target[x] += weight[x] * source[x]


@njit(cache=True, error_model="numpy")
def _best_of_run(
    sums: Any, counts: Any, first: int, last: int, subset: Any, known: bool, wanted: Any, disparities: Any, total: Any,
    disparity: Any, cost: Any, mean: Any,
) -> None:  # fmt: skip
    """Minimum over the candidates, at the wanted columns of ``first..last``, of the costs of the groups of one subset.

    Parameters
    ----------
    sums, counts : ndarray, shape (G, K, W), float32
        Costs and numbers of samples of each group.
    first, last : int
    subset : ndarray, shape (G,), bool
    known : bool
        Whether every candidate has the numbers of samples of the first.
    wanted : ndarray, shape (last - first,), bool
    disparities : ndarray, shape (K,), float32
    total : ndarray, shape (K, W), float32
        Scratch.
    disparity, cost, mean : ndarray, shape (last - first,), float32
        Filled where wanted.
    """
    G, K, _ = sums.shape
    n = last - first
    lowest = np.full(n, np.inf, np.float32)
    best = np.zeros(n, np.int32)
    over_candidates = np.zeros(n, np.float32)
    number = np.empty(n, np.float32)
    for k in range(K):
        row = total[k, 0:n]
        row[:] = 0
        if k == 0 or not known:
            number[:] = 0
        for g in range(G):
            if subset[g]:
                source = sums[g, k, first:last]
                for x in range(n):
                    row[x] += source[x]
                if k == 0 or not known:
                    source = counts[g, k, first:last]
                    for x in range(n):
                        number[x] += source[x]
        for x in range(n):
            # a candidate that no view of the subset sees is no match
            value = row[x] / number[x] if number[x] > 0 else np.float32(1)
            row[x] = value
            over_candidates[x] += value
            better = value < lowest[x]
            lowest[x] = value if better else lowest[x]
            best[x] = np.int32(k) if better else best[x]
    step = (disparities[K - 1] - disparities[0]) / np.float32(K - 1)
    for x in range(n):
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


@njit(cache=True)
def _wanted_runs(wanted: Any, runs: Any) -> int:
    """Runs of columns that hold all wanted ones, into ``runs (N, 2)``, and how many; a short gap does not end a run."""
    number = 0
    for x in range(wanted.size):
        if not wanted[x]:
            continue
        if number and x - runs[number - 1, 1] < SHORTEST_GAP:
            runs[number - 1, 1] = x + 1
        else:
            runs[number] = x, x + 1
            number += 1
    return number


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
    width = end - begin
    # a row's costs, with those of the windows at both ends; zero outside the picture
    ring = np.zeros((size, G, K, width + 2 * radius), np.float32)
    counts = np.zeros((size, G, K, width + 2 * radius), np.float32)
    weights = np.empty((size, size, width), np.float32)
    window_costs = np.empty((G, K, width), np.float32)
    window_counts = np.empty((G, K, width), np.float32)
    known_counts = np.empty((G, 1, width), np.float32)
    for g in range(G):
        known_counts[g] = group_sizes[g]
    total = np.empty((K, width), np.float32)
    runs = np.empty((width // SHORTEST_GAP + 1, 2), np.int64)
    done = -1  # last row whose costs are in the ring
    for y in range(top, bottom):
        number = _wanted_runs(wanted[y, begin:end], runs)
        if number == 0:
            continue
        for row in range(max(0, y - radius, done + 1), min(H, y + radius + 1)):
            cost_row(
                views, t0, s0, groups, row, max(0, begin - radius), min(W, end + radius), begin - radius, disparities,
                scale2, ring[row % size], counts[row % size],
            )  # fmt: skip
            done = row
        window_weights(guide, y, begin, end, radius, window_variance, weights)
        # away from the border every view sees every pixel of the window: nothing to count
        known_from, known_to = end, end
        if margin <= y < H - margin:
            known_from = min(end, max(begin, margin))
            known_to = max(known_from, min(end, W - margin))
        for r in range(number):
            _aggregate_row(ring, y, H, weights, runs[r, 0], runs[r, 1], window_costs)
            for part in range(3):
                # left of what is known, known, right of it
                a = max(begin + runs[r, 0], (begin, known_from, known_to)[part])
                b = min(begin + runs[r, 1], (known_from, known_to, end)[part])
                if a >= b:
                    continue
                known = part == 1
                if not known:
                    _aggregate_row(counts, y, H, weights, a - begin, b - begin, window_counts)
                numbers = known_counts if known else window_counts
                for n in range(N):
                    _best_of_run(
                        window_costs, numbers, a - begin, b - begin, subsets[n], known, wanted[y, a:b],
                        disparities, total, disparity[n, y, a:b], cost[n, y, a:b], mean[n, y, a:b],
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
