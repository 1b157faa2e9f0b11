"""Compiled loops of the semi-global smoothing (:mod:`sepi.matching.semi_global`)."""

from __future__ import annotations

from typing import Any

import numpy as np

from sepi.compiled import fma, njit, prange

EXACT = {"nnan", "ninf", "nsz"}
"""Fast-math flags that keep every rounding as written: see :mod:`sepi.matching.plane_sweep_kernels`."""

PATHS_AT_ONCE = 32
"""Paths from row to row that a thread follows together: their costs lie side by side, and fit in its cache."""

CANDIDATES_AT_ONCE = 8
"""Candidates whose means over windows are taken together."""

_UNREACHABLE = np.float32(1e9)


@njit(cache=True, fastmath=EXACT, error_model="numpy")
def _window_weights(guide: Any, y: int, radius: int, variance: Any) -> Any:
    """Weights of the windows of row ``y``, of sum 1, by place in the window; zero outside the picture."""
    H, W, _ = guide.shape
    size = 2 * radius + 1
    weights, total = np.zeros((size, size, W), np.float32), np.zeros(W, np.float32)
    for i in range(max(0, radius - y), min(size, H - y + radius)):
        row = y + i - radius
        for j in range(size):
            dx = j - radius
            for x in range(max(0, -dx), min(W, W - dx)):
                distance = np.float32(0)
                for c in range(3):
                    distance += (guide[y, x, c] - guide[row, x + dx, c]) ** 2
                weights[i, j, x] = np.exp(-distance / (2 * variance))
                total[x] += weights[i, j, x]
    for i in range(size):
        for j in range(size):
            for x in range(W):
                weights[i, j, x] /= total[x]
    return weights


@njit(inline="always")
def _add_weighted(costs: Any, weights: Any, out: Any) -> None:
    for x in range(out.size):
        out[x] = fma(weights[x], costs[x], out[x])


@njit(parallel=True, cache=True, fastmath=EXACT, error_model="numpy")
def aggregate(cost: Any, guide: Any, radius: int, variance: Any) -> Any:
    """Mean over a window with weights ``exp(-|colour difference|^2 / (2 variance))``; (K, H, W) to (H, W, K)."""
    K, H, W = cost.shape
    size = 2 * radius + 1
    out = np.empty((H, W, K), np.float32)
    for y in prange(H):
        weights = _window_weights(guide, y, radius, variance)
        # a few candidates at a time: their sums stay in the first cache
        total = np.empty((CANDIDATES_AT_ONCE, W), np.float32)
        for begin in range(0, K, CANDIDATES_AT_ONCE):
            end = min(K, begin + CANDIDATES_AT_ONCE)
            total[:] = 0
            for k in range(begin, end):
                for i in range(max(0, radius - y), min(size, H - y + radius)):
                    for j in range(size):
                        dx = j - radius
                        # none where the window is wider than the picture: an end below 0 would count from the right
                        first, last = max(0, -dx), max(0, min(W, W - dx))
                        source = cost[k, y + i - radius, first + dx : last + dx]
                        _add_weighted(source, weights[i, j, first:last], total[k - begin, first:last])
            for x in range(W):
                for k in range(begin, end):
                    out[y, x, k] = total[k - begin, x]
    return out


@njit(inline="always")
def _next(before: Any, least: Any, cost: Any, small: Any, large: Any, path: Any) -> Any:
    """One pixel further along a path; ``before`` and ``path`` have an unreachable candidate at either end."""
    for k in range(cost.size):
        best = min(before[k + 1], least + large)
        best = min(best, min(before[k], before[k + 2]) + small)
        path[k + 1] = cost[k] + best - least
    least_here = path[1]
    for k in range(1, cost.size):
        least_here = min(least_here, path[k + 1])
    return least_here


@njit(inline="always")
def _large_penalty(guide: Any, y: int, x: int, row: int, column: int, small: Any, large: Any, weakening: Any) -> Any:
    change = np.float32(0)
    for c in range(3):
        change += abs(guide[y, x, c] - guide[row, column, c])
    return max(small * np.float32(1.5), large / (np.float32(1) + change * weakening))


@njit(inline="always")
def _start(cost: Any, path: Any) -> Any:
    least = cost[0]
    for k in range(cost.size):
        path[k + 1] = cost[k]
        least = min(least, cost[k])
    return least


@njit(inline="always")
def _add(path: Any, out: Any) -> None:
    for k in range(out.size):
        out[k] += path[k + 1]


@njit(cache=True, fastmath=EXACT)
def _along_row(cost: Any, guide: Any, y: int, dx: int, penalties: Any, out: Any) -> None:
    """Add the smoothed costs of the path along row ``y``."""
    small, large, weakening = penalties
    W, K = cost.shape[1:]
    before, path = np.full(K + 2, _UNREACHABLE, np.float32), np.full(K + 2, _UNREACHABLE, np.float32)
    least = np.float32(0)
    for i in range(W):
        x = i if dx > 0 else W - 1 - i
        if i == 0:
            least = _start(cost[y, x], path)
        else:
            p = _large_penalty(guide, y, x, y, x - dx, small, large, weakening)
            least = _next(before, least, cost[y, x], small, p, path)
        _add(path, out[y, x])
        before, path = path, before


@njit(cache=True, fastmath=EXACT)
def _along_lines(cost: Any, guide: Any, first: int, last: int, dy: int, dx: int, penalties: Any, out: Any) -> None:
    """Add the smoothed costs of paths from row to row: those that begin in columns ``first..last``.

    One that leaves the picture at a side goes on, as a new one, at the other: all have a pixel in each row.
    """
    small, large, weakening = penalties
    H, W, K = cost.shape
    paths = np.full((2, last - first, K + 2), _UNREACHABLE, np.float32)
    least = np.zeros(last - first, np.float32)
    for i in range(H):
        y = i if dy > 0 else H - 1 - i
        before, path = paths[(i + 1) % 2], paths[i % 2]
        for line in range(last - first):
            x = (first + line + dx * i) % W
            if i == 0 or x - dx < 0 or x - dx >= W:
                least[line] = _start(cost[y, x], path[line])
            else:
                p = _large_penalty(guide, y, x, y - dy, x - dx, small, large, weakening)
                least[line] = _next(before[line], least[line], cost[y, x], small, p, path[line])
            _add(path[line], out[y, x])


@njit(parallel=True, cache=True, fastmath=EXACT)
def semi_global(cost: Any, guide: Any, small: Any, large: Any, weakening: Any) -> Any:
    """Sum of the smoothed costs along eight paths; shapes (H, W, K), float32.

    Paths of one direction do not meet, so a thread goes through many of them by itself, from border to border: waiting
    for each other in every row takes ten times as long where another program has one of the cores.
    """
    H, W, K = cost.shape
    out = np.zeros((H, W, K), np.float32)
    penalties = small, large, weakening
    for y in prange(H):
        _along_row(cost, guide, y, 1, penalties, out)
        _along_row(cost, guide, y, -1, penalties, out)
    pieces = -(-W // PATHS_AT_ONCE)
    for dy in (1, -1):
        for dx in (0, 1, -1):
            for piece in prange(pieces):
                first = piece * PATHS_AT_ONCE
                _along_lines(cost, guide, first, min(W, first + PATHS_AT_ONCE), dy, dx, penalties, out)
    return out


@njit(parallel=True, cache=True)
def choose(smoothed: Any, averaged: Any, disparities: Any, same: Any) -> Any:
    """Winner of each pixel, refined by a parabola, and by how much the averaged cost of other minima exceeds its own.

    Parameters
    ----------
    smoothed, averaged : ndarray, shape (H, W, K), float32
    disparities : ndarray, shape (K,), float32
    same : float32
        Candidates closer to the winner belong to its minimum, pixels per view step.

    Returns
    -------
    disparity, margin : ndarray, shape (H, W), float32
        The margin is negative where another minimum is lower before smoothing, 0 where there is no other.
    """
    H, W, K = smoothed.shape
    disparity, margin = np.empty((H, W), np.float32), np.empty((H, W), np.float32)
    spacing = (disparities[K - 1] - disparities[0]) / (K - 1)
    for y in prange(H):
        for x in range(W):
            best = np.argmin(smoothed[y, x])
            offset = np.float32(0)
            if 0 < best < K - 1:
                a, b, c = smoothed[y, x, best - 1], smoothed[y, x, best], smoothed[y, x, best + 1]
                curvature = a - 2 * b + c
                if curvature > 1e-9:
                    offset = np.float32(0.5) * (a - c) / curvature
            disparity[y, x] = disparities[best] + offset * spacing
            own, other = _UNREACHABLE, _UNREACHABLE
            for k in range(K):
                if abs(disparities[k] - disparity[y, x]) <= same or k == best:
                    own = min(own, averaged[y, x, k])
                else:
                    other = min(other, averaged[y, x, k])
            margin[y, x] = other - own if other < _UNREACHABLE else np.float32(0)
    return disparity, margin
