"""Compiled loop of the spinning parallelogram operator: what lies on either side of a line, as histograms.

An EPI is worked off along its columns. The histograms of the columns in reach are held in a ring, so that each column
is counted once for all the parallelograms that it lies in.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from sepi.compiled import njit, prange

EXACT = {"nnan", "ninf", "nsz"}
"""What the compiler may assume of the numbers; it may not change the order of sums."""


@njit(inline="always")
def _quantise(lines: Any, y: int, bins: int, numbers: Any, shares: Any) -> None:
    """Bins of one EPI, those of all channels numbered through: ``numbers[x, n * C + c]`` of ``lines[n, c, y, x]``.

    It is the lower one of two; ``shares`` is what counts for the upper one.
    """
    N, C, _, W = lines.shape
    scale, most = np.float32(bins), np.float32(bins - 1)
    for n in range(N):
        for c in range(C):
            row, first = lines[n, c, y], np.int32(c * bins)
            for x in range(W):
                place = min(max(row[x] * scale - np.float32(0.5), np.float32(0)), most)
                lower = min(np.int32(place), np.int32(bins - 2))
                numbers[x, n * C + c] = first + lower
                shares[x, n * C + c] = place - np.float32(lower)


@njit(inline="always")
def _count(numbers: Any, shares: Any, previous: Any, column: Any) -> None:
    """Histogram of a column of these bins and shares, in place of one of the bins ``previous``."""
    for i in range(len(previous)):
        lower = np.uint64(previous[i])
        column[lower] = column[lower + np.uint64(1)] = np.float32(0)
    for i in range(len(numbers)):
        lower = np.uint64(numbers[i])
        column[lower] += np.float32(1) - shares[i]
        column[lower + np.uint64(1)] += shares[i]


@njit(inline="always")
def _halves(ring: Any, centre: int, shares: Any, left: Any, right: Any) -> None:
    """Histograms of both sides of a column."""
    size, bins = ring.shape
    for k in range(len(shares)):
        before, after, share = ring[(centre - 1 - k) % size], ring[(centre + 1 + k) % size], shares[k]
        if k == 0:
            for b in range(bins):
                left[b] = share * before[b]
                right[b] = share * after[b]
        else:
            for b in range(bins):
                left[b] += share * before[b]
                right[b] += share * after[b]


@njit(cache=True, fastmath=EXACT, error_model="numpy")
def _common(left: Any, right: Any, bins: int) -> Any:
    """Sum over the bins of all channels of ``g h / (g + h)``; what ``left`` held is lost."""
    for b in range(len(left)):
        left[b] = left[b] * right[b] / (left[b] + right[b] + np.float32(1e-20))
    # over the channels first, since a sum over bins is a chain of additions that cannot run side by side
    total = left[:bins]
    for first in range(bins, len(left), bins):
        for b in range(bins):
            total[b] += left[first + b]
    even = odd = np.float32(0)
    for b in range(0, bins - 1, 2):
        even += total[b]
        odd += total[b + 1]
    if bins % 2:
        even += total[bins - 1]
    return even + odd


@njit(cache=True, parallel=True)
def half_distances(lines: Any, weights: Any, bins: int, out: Any) -> None:
    """Distance between the halves of a parallelogram round every pixel.

    Parameters
    ----------
    lines : ndarray, shape (N, C, H, W), float32
        EPIs sheared by a candidate disparity, so that its lines are columns: row ``y`` of view ``n`` is row ``n`` of
        EPI ``y``. Colours in 0..1, each of which counts for the two bins between whose middles it lies; what lies
        beyond the middle of the first or last bin counts for that. Columns beyond the ends are
        like the last ones.
    weights : ndarray, shape (R,), float32
        Of the columns at distances 1..R from the line.
    bins : int
        Of each channel.
    out : ndarray, shape (H, W), float32
        0..1: chi-square distance of the two histograms, each of sum 1, mean over the channels.
    """
    N, C, H, W = lines.shape
    R = len(weights)
    size = 2 * R + 1
    shares = (weights / (weights.sum() * N)).astype(np.float32)
    for y in prange(H):
        numbers, upper = np.empty((W, N * C), np.int32), np.empty((W, N * C), np.float32)
        _quantise(lines, y, bins, numbers, upper)
        ring = np.zeros((size, C * bins), np.float32)
        left, right = np.empty(C * bins, np.float32), np.empty(C * bins, np.float32)
        for x in range(-R, W + R):
            here, left_behind = min(max(x, 0), W - 1), min(max(x - size, 0), W - 1)
            _count(numbers[here], upper[here], numbers[left_behind], ring[x % size])
            centre = x - R
            if centre >= 0:
                _halves(ring, centre, shares, left, right)
                # with sums of 1, half the sum of (g - h)^2 / (g + h) is 1 less twice that of g h / (g + h)
                common = _common(left, right, bins)
                out[y, centre] = max(np.float32(1) - np.float32(2) * common / np.float32(C), np.float32(0))
