"""Kernel of the range estimate: a coarse plane sweep that keeps each pixel's best candidate and how clear it is.

It differs from the sweep of the initial depth in what it must withstand: candidates far outside the scene's range,
light loss towards the outer views, noise. Truncated absolute differences of high-pass filtered views, averaged over a
window, do; sub-pixel accuracy does not matter.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from sepi.compiled import njit, prange
from sepi.lightfield import FloatMap

# infinite costs are there, and stay
EXACT = {"nnan", "nsz"}
"""Fast-math flags that keep every rounding as written: see :mod:`sepi.matching.plane_sweep_kernels`."""

# rows that one thread holds for all candidates: the volume of a block stays within a few MB
_BLOCK = 16
# columns whose costs are brought together
_COLUMNS = 16


@njit(parallel=True, cache=True)
def coarse_sweep(
    reference: FloatMap,
    views: FloatMap,
    offsets: FloatMap,
    candidates: FloatMap,
    truncation: np.float32,
    radius: int,
) -> tuple[FloatMap, FloatMap, FloatMap, FloatMap]:
    """Match the reference view against other views at each candidate disparity.

    Parameters
    ----------
    reference : ndarray, shape (H, W), float32
        The reference view.
    views : ndarray, shape (V, H, W), float32
        Other views.
    offsets : ndarray, shape (V, 2), float32
        Baseline ``(down, across)`` of each, view steps.
    candidates : ndarray, shape (N,), float32
        Disparities in pixels per view step, uniform, rising.
    truncation : float32
        Largest difference that one view can count for.
    radius : int
        Half width of the square window in pixels.

    Returns
    -------
    lowest, second, mean, disparity : ndarrays, shape (H, W), float32
        Lowest cost; lowest cost outside the valley round it (infinite if there is no other valley); mean cost; the
        candidate of the lowest cost, refined by a parabola. A candidate at which fewer than half of the views see a
        pixel of the window is left out; ``lowest`` is infinite where that leaves none, or where the lowest cost is at
        an end of the candidates and so may go on falling beyond.
    """
    H, W = reference.shape
    N = candidates.size
    lowest = np.empty((H, W), np.float32)
    second = np.empty((H, W), np.float32)
    mean = np.empty((H, W), np.float32)
    disparity = np.empty((H, W), np.float32)
    sampling = candidates[1] - candidates[0]
    for block in prange((H + _BLOCK - 1) // _BLOCK):
        top = block * _BLOCK
        bottom = min(H, top + _BLOCK)
        first = max(0, top - radius)
        last = min(H, bottom + radius)
        volume = np.empty((N, bottom - top, W), np.float32)
        costs, sums = np.empty((last - first, W), np.float32), np.empty((last - first, W), np.float32)
        seen = np.empty(W, np.float32)
        for n in range(N):
            for y in range(first, last):
                _row_costs(reference, views, offsets, candidates[n], truncation, y, seen, costs[y - first])
            _box_mean(costs, first, top, H, radius, sums, volume[n])
        columns = np.empty((_COLUMNS, N), np.float32)
        for y in range(top, bottom):
            for begin in range(0, W, _COLUMNS):
                # what lies side by side in memory is fetched together
                for n in range(N):
                    for x in range(begin, min(W, begin + _COLUMNS)):
                        columns[x - begin, n] = volume[n, y - top, x]
                for x in range(begin, min(W, begin + _COLUMNS)):
                    low, other, average, position = _valley(columns[x - begin])
                    lowest[y, x] = low
                    second[y, x] = other
                    mean[y, x] = average
                    disparity[y, x] = candidates[0] + position * sampling
    return lowest, second, mean, disparity


@njit(forceinline=True)
def _add_level(here: Any, a: Any, b: Any, fx: Any, truncation: Any, out: Any, seen: Any) -> None:
    """Add the differences of a run of pixels and samples on a row of a view; ``b`` begins one column after ``a``."""
    for i in range(out.size):
        out[i] += min(abs(here[i] - (a[i] + fx * (b[i] - a[i]))), truncation)
        seen[i] += np.float32(1)


@njit(forceinline=True)
def _add_between(
    here: Any, a: Any, b: Any, c: Any, d: Any, fy: Any, fx: Any, truncation: Any, out: Any, seen: Any
) -> None:
    """:func:`_add_level` of samples between two rows; ``c`` and ``d`` are below ``a`` and ``b``."""
    for i in range(out.size):
        upper = a[i] + fx * (b[i] - a[i])
        lower = c[i] + fx * (d[i] - c[i])
        out[i] += min(abs(here[i] - (upper + fy * (lower - upper))), truncation)
        seen[i] += np.float32(1)


@njit(cache=True, fastmath=EXACT, error_model="numpy")
def _row_costs(
    reference: Any, views: Any, offsets: Any, candidate: Any, truncation: Any, y: int, seen: Any, cost: Any
) -> None:
    """Mean difference of a row over the views that see it; infinite where fewer than half do. ``seen`` is scratch."""
    H, W = reference.shape
    seen[:] = 0
    cost[:] = 0
    for v in range(len(views)):
        down = y - candidate * offsets[v, 0]
        across = -candidate * offsets[v, 1]
        row = math.floor(down)
        shift = math.floor(across)
        # one column fewer than fit, for the right neighbour of the sample
        begin = max(0, -shift)
        end = min(W, W - 1 - shift)
        if row < 0 or row >= H - 1 or end <= begin:
            continue
        fy = np.float32(down - row)
        fx = np.float32(across - shift)
        here, i, j = reference[y, begin:end], begin + shift, end + shift
        part, number = cost[begin:end], seen[begin:end]
        if fy == 0:
            _add_level(here, views[v, row, i:j], views[v, row, i + 1 : j + 1], fx, truncation, part, number)
        elif fx == 0:
            _add_level(here, views[v, row, i:j], views[v, row + 1, i:j], fy, truncation, part, number)
        else:
            _add_between(
                here, views[v, row, i:j], views[v, row, i + 1 : j + 1],
                views[v, row + 1, i:j], views[v, row + 1, i + 1 : j + 1], fy, fx, truncation, part, number,
            )  # fmt: skip
    fewest, infinite = np.float32(len(views) / 2), np.float32(np.inf)
    for x in range(W):
        cost[x] = cost[x] / seen[x] if seen[x] >= fewest else infinite


@njit(forceinline=True)
def _add(row: Any, out: Any) -> None:
    for x in range(out.size):
        out[x] += row[x]


@njit(cache=True, fastmath=EXACT, error_model="numpy")
def _box_mean(costs: Any, first: int, top: int, H: int, radius: int, sums: Any, out: Any) -> None:
    """Mean of ``costs``, whose first row is row ``first`` of the picture, over the window; from row ``top`` on.

    ``sums``, of the shape of ``costs``, is scratch.
    """
    rows, W = out.shape
    for r in range(costs.shape[0]):
        total = sums[r]
        total[:] = costs[r]
        for j in range(1, min(radius, W - 1) + 1):
            _add(costs[r, : W - j], total[j:])
            _add(costs[r, j:], total[: W - j])
    for r in range(rows):
        above = max(top + r - radius, 0)
        below = min(top + r + radius, H - 1)
        mean = out[r]
        mean[:] = sums[above - first]
        for y in range(above + 1, below + 1):
            _add(sums[y - first], mean)
        for x in range(W):
            width = min(x + radius, W - 1) - max(x - radius, 0) + 1
            mean[x] /= np.float32((below - above + 1) * width)


@njit(cache=True)
def _valley(costs: Any) -> Any:
    """Lowest cost, lowest cost outside its valley, mean cost, and the position of the lowest among the candidates."""
    infinite = np.float32(np.inf)
    best, total, count = 0, np.float32(0), 0
    for n in range(costs.size):
        if costs[n] < infinite:
            total += costs[n]
            count += 1
        if costs[n] < costs[best]:
            best = n
    low = costs[best]
    if best == 0 or best == costs.size - 1 or not costs[best - 1] < infinite or not costs[best + 1] < infinite:
        return infinite, infinite, total / np.float32(max(count, 1)), np.float32(best)
    left = best
    while left > 0 and costs[left - 1] >= costs[left]:
        left -= 1
    right = best
    while right < costs.size - 1 and costs[right + 1] >= costs[right]:
        right += 1
    other = infinite
    for n in range(left):
        other = min(other, costs[n])
    for n in range(right + 1, costs.size):
        other = min(other, costs[n])
    before, after = costs[best - 1], costs[best + 1]
    curvature = before - 2 * low + after
    position = np.float32(best)
    if curvature > 0:
        position += np.float32(0.5) * (before - after) / curvature
    return low, other, total / np.float32(count), position
