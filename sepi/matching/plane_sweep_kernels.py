"""Compiled loops of the plane sweep.

No cost volume is ever held: a thread keeps the cost rows of one aggregation window, and the minimum is taken as soon as
a pixel is aggregated. There the candidates of all groups of a pixel lie side by side: a window's weight is loaded once
for all of them, and a pixel's costs stay in the first cache until its minima are found. Each pixel is summed by one
thread in a fixed order: results do not depend on the number of threads.

Only :func:`sweep_rows` runs in parallel.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numba import njit, prange

from sepi.matching.photo_consistency import cost_row, count_views

SHORTEST_GAP = 128
"""Columns between wanted pixels that are done rather than skipped: starting anew costs as much."""

TILE_WIDTH = 512
"""Columns done at a time: bounds what a thread holds, whatever the width of the picture, and keeps it in the cache."""


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
def _add_seven(target: Any, w: Any, a0: Any, a1: Any, a2: Any, a3: Any, a4: Any, a5: Any, a6: Any) -> None:
    """Add a row of the usual window, seven pixels wide, at once: the target is loaded and stored once only."""
    for k in range(target.size):
        target[k] += (
            (w[0] * a0[k] + w[1] * a1[k]) + (w[2] * a2[k] + w[3] * a3[k]) + (w[4] * a4[k] + w[5] * a5[k]) + w[6] * a6[k]
        )


@njit(cache=True, fastmath=True, error_model="numpy")
def _aggregate(ring: Any, y: int, x: int, H: int, weights: Any, window: Any) -> None:
    """Weighted sum over the window of pixel ``(y, x)``, of all groups and candidates at once.

    Parameters
    ----------
    ring : ndarray, shape (size, n, G K), float32
        Rows of costs, row ``r`` at ``r % size``, column ``x - radius`` at ``x``.
    y, x, H : int
    weights : ndarray, shape (size, size, n), float32
    window : ndarray, shape (G K,), float32
        Filled.
    """
    size = weights.shape[0]
    window[:] = 0
    for i in range(size):
        row = y + i - size // 2
        if row < 0 or row >= H:
            continue
        a = ring[row % size]
        w = weights[i, :, x]
        if size == 7:
            _add_seven(
                window, (w[0], w[1], w[2], w[3], w[4], w[5], w[6]),
                a[x], a[x + 1], a[x + 2], a[x + 3], a[x + 4], a[x + 5], a[x + 6],
            )  # fmt: skip
        else:
            for j in range(size):
                weight, source = w[j], a[x + j]
                for k in range(window.size):
                    window[k] += weight * source[k]


@njit(cache=True, fastmath=True, error_model="numpy")
def _mean_costs(sums: Any, counts: Any, known: bool, subset: Any, total: Any) -> None:
    """Mean cost of each candidate over the views of one subset of groups.

    Parameters
    ----------
    sums : ndarray, shape (G, K), float32
    counts : ndarray, shape (G, K), float32
        Numbers of samples; of all candidates those of the first, where ``known``.
    known : bool
    subset : ndarray, shape (G,), bool
    total : ndarray, shape (K,), float32
        Filled.
    """
    G, K = sums.shape
    total[:] = 0
    number = np.float32(0)
    for g in range(G):
        if subset[g]:
            number += counts[g, 0]
            source = sums[g]
            for k in range(K):
                total[k] += source[k]
    if known:
        for k in range(K):
            # a subset without views matches nothing
            total[k] = total[k] / number if number > 0 else np.float32(1)
        return
    for k in range(K):
        number = np.float32(0)
        for g in range(G):
            if subset[g]:
                number += counts[g, k]
        # a candidate that no view of the subset sees is no match
        total[k] = total[k] / number if number > 0 else np.float32(1)


@njit(cache=True, fastmath=True, error_model="numpy")
def _best_candidate(costs: Any, disparities: Any) -> Any:
    """Disparity at the lowest of the costs, refined below the candidate step; that cost; the mean of all."""
    K = disparities.size
    lowest, total = costs[0], np.float32(0)
    for k in range(K):
        lowest = min(lowest, costs[k])
        total += costs[k]
    best = 0
    while best < K - 1 and costs[best] != lowest:
        best += 1
    offset = np.float32(0)
    # a perfect match needs no parabola, and the ends of the range allow none
    if lowest > 0 and 0 < best < K - 1:
        before, after = costs[best - 1], costs[best + 1]
        curvature = before - 2 * lowest + after
        if curvature > 0:
            offset = np.float32(0.5) * (before - after) / curvature
    step = (disparities[K - 1] - disparities[0]) / np.float32(K - 1)
    return disparities[best] + offset * step, lowest, total / np.float32(K)


@njit(cache=True)
def _needed_runs(mask: Any, y: int, begin: int, end: int, radius: int, runs: Any) -> int:
    """Runs of columns of row ``y`` that windows of wanted pixels touch, into ``runs (N, 2)``, and how many.

    A short gap does not end a run. Rows of all tasks count, lest a run, and with it the way a compiler sums it up,
    depend on how the rows are shared out.
    """
    H, W = mask.shape
    number = 0
    for x in range(begin, end):
        needed = False
        for row in range(max(0, y - radius), min(H, y + radius + 1)):
            needed |= mask[row, x]
        if not needed:
            continue
        first, last = max(0, x - radius), min(W, x + radius + 1)
        if number and first - runs[number - 1, 1] < SHORTEST_GAP:
            runs[number - 1, 1] = last
        else:
            runs[number] = first, last
            number += 1
    return number


@njit(cache=True)
def _transpose(costs: Any, columns: int, target: Any) -> None:
    """The first columns of ``costs (G, K, N)`` as ``target (n, G K)``."""
    G, K, _ = costs.shape
    # a few columns at a time: their pixels of the target stay in the first cache
    for begin in range(0, columns, 16):
        end = min(columns, begin + 16)
        for g in range(G):
            for k in range(K):
                source = costs[g, k]
                for x in range(begin, end):
                    target[x, g * K + k] = source[x]


@njit(cache=True, error_model="numpy")
def _fill_row(
    views: Any, t0: int, s0: int, groups: Any, mask: Any, row: int, begin: int, end: int, margin: int, radius: int,
    down: Any, fy: Any, across: Any, fx: Any, scale2: Any, costs: Any, runs: Any, ring_row: Any, counts_row: Any,
) -> None:  # fmt: skip
    """Costs of one row into ``ring_row (n, G K)`` where they are needed, and near the border the views that see it."""
    H, W = mask.shape
    origin = begin - radius
    for r in range(_needed_runs(mask, row, begin, end, radius, runs)):
        first, last = runs[r]
        cost_row(views, t0, s0, groups, row, first, last, down, fy, across, fx, scale2, costs)
        _transpose(costs, last - first, ring_row[first - origin :])
        # windows of pixels near the border reach this far
        inner = margin + radius
        left, right = last, last
        if inner <= row < H - inner:
            left = min(last, inner)
            right = max(first, left, W - inner)
        for begin_counted, end_counted in ((first, left), (right, last)):
            if begin_counted < end_counted:
                count_views(
                    groups, H, W, row, begin_counted, end_counted, down, fy, across,
                    counts_row[begin_counted - origin :],
                )  # fmt: skip


@njit(cache=True, error_model="numpy")
def _sweep_tile(
    views: Any, t0: int, s0: int, guide: Any, groups: Any, subsets: Any, mask: Any,
    top: int, bottom: int, begin: int, end: int, disparities: Any, down: Any, fy: Any, across: Any, fx: Any,
    scale2: Any, radius: int, window_variance: Any, margin: int,
    disparity: Any, cost: Any, mean: Any,
) -> None:  # fmt: skip
    """Sweep rows ``top..bottom``, columns ``begin..end``; nearer than ``margin`` to the border, views are counted."""
    H, W = mask.shape
    N, G = subsets.shape
    K = disparities.size
    size = 2 * radius + 1
    width = end - begin
    # costs of the rows of a window, with the columns of the windows at both ends; zero outside the picture
    ring = np.zeros((size, width + 2 * radius, G * K), np.float32)
    counts = np.zeros((size, width + 2 * radius, G * K), np.float32)
    costs = np.empty((G, K, width + 2 * radius), np.float32)
    runs = np.empty((width // SHORTEST_GAP + 2, 2), np.int64)
    weights = np.empty((size, size, width), np.float32)
    sums = np.empty(G * K, np.float32)
    numbers = np.empty(G * K, np.float32)
    group_sizes = np.empty((G, K), np.float32)
    for g in range(G):
        group_sizes[g] = (groups == g).sum()
    total = np.empty(K, np.float32)
    done = -1  # last row whose costs are in the ring
    for y in range(top, bottom):
        if not mask[y, begin:end].any():
            continue
        for row in range(max(0, y - radius, done + 1), min(H, y + radius + 1)):
            _fill_row(
                views, t0, s0, groups, mask, row, begin, end, margin, radius, down, fy, across, fx, scale2, costs,
                runs, ring[row % size], counts[row % size],
            )  # fmt: skip
            done = row
        window_weights(guide, y, begin, end, radius, window_variance, weights)
        for x in range(begin, end):
            if not mask[y, x]:
                continue
            _aggregate(ring, y, x - begin, H, weights, sums)
            # away from the border every view sees every pixel of the window: nothing to count
            known = margin <= y < H - margin and margin <= x < W - margin
            if not known:
                _aggregate(counts, y, x - begin, H, weights, numbers)
            seen = group_sizes if known else numbers.reshape(G, K)
            for n in range(N):
                _mean_costs(sums.reshape(G, K), seen, known, subsets[n], total)
                disparity[n, y, x], cost[n, y, x], mean[n, y, x] = _best_candidate(total, disparities)


@njit(cache=True, parallel=True)
def sweep_rows(
    views: Any, t0: int, s0: int, guide: Any, groups: Any, subsets: Any, mask: Any,
    first: int, last: int, rows: int, disparities: Any, down: Any, fy: Any, across: Any, fx: Any,
    scale2: Any, radius: int, window_variance: Any, disparity: Any, cost: Any, mean: Any,
) -> None:  # fmt: skip
    """Sweep rows ``first..last``, so many ``rows`` of them at a stretch."""
    W = views.shape[4]
    reach = max(abs(disparities[0]), abs(disparities[-1]))
    farthest = max(t0, views.shape[0] - 1 - t0, s0, views.shape[1] - 1 - s0)
    margin = math.ceil(reach * farthest) + radius + 1
    for task in prange((last - first + rows - 1) // rows):
        for begin in range(0, W, TILE_WIDTH):
            _sweep_tile(
                views, t0, s0, guide, groups, subsets, mask,
                first + task * rows, min(last, first + (task + 1) * rows), begin, min(W, begin + TILE_WIDTH),
                disparities, down, fy, across, fx, scale2, radius, window_variance, margin,
                disparity, cost, mean,
            )  # fmt: skip
