"""Compiled loops of the fast method with one-bit features (:mod:`sepi.compared.mishiba`)."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from sepi.compiled import njit, prange


@njit(inline="always")
def _cubic(f: float, out: Any) -> None:
    """Weights of cubic convolution of the pixels at -1, 0, 1 and 2 for a sample at ``f``."""
    out[0] = np.float32(((-0.5 * f + 1.0) * f - 0.5) * f)
    out[1] = np.float32((1.5 * f - 2.5) * f * f + 1.0)
    out[2] = np.float32(((-1.5 * f + 2.0) * f + 0.5) * f)
    out[3] = np.float32((0.5 * f - 0.5) * f * f)


@njit(cache=True, parallel=True)
def pair_costs(details: Any, offsets: Any, step: int, out: Any) -> None:
    """Share of the pairs of views whose bits differ, at every ``step``-th row and column.

    Views that show a pixel beyond their border take no part.

    Parameters
    ----------
    details : ndarray, shape (N, H, W), float32
        Of each view; its sign is the bit.
    offsets : ndarray, shape (K, N, 2), float64
        Down and across from a reference pixel to its sample, for each candidate, in pixels.
    step : int
    out : ndarray, shape (K, ceil(H / step), ceil(W / step)), float32
        0..1: 1 is as many different pairs as there can be, and where there is no pair.
    """
    N, H, W = details.shape
    rows, columns = out.shape[1:]
    margin = math.ceil(np.abs(offsets).max()) + 3
    share = np.ones((N + 1, N + 1), np.float32)
    for seen in range(2, N + 1):
        for ones in range(seen + 1):
            share[seen, ones] = ones * (seen - ones) / ((seen // 2) * (seen - seen // 2))
    for i in prange(rows):
        y = i * step
        wy, wx = np.empty(4, np.float32), np.empty(4, np.float32)
        # a row that is interpolated down, and goes on as it ends
        row = np.empty(W + 2 * margin, np.float32)
        ones_at, seen_at = np.empty(columns, np.int32), np.empty(columns, np.int32)
        for k in range(offsets.shape[0]):
            ones_at[:], seen_at[:] = 0, 0
            for n in range(N):
                if not 0 <= y + offsets[k, n, 0] <= H - 1:
                    continue
                down, across = math.floor(offsets[k, n, 0]), math.floor(offsets[k, n, 1])
                _cubic(offsets[k, n, 0] - down, wy)
                _cubic(offsets[k, n, 1] - across, wx)
                a = details[n, min(max(y + down - 1, 0), H - 1)]
                b = details[n, min(max(y + down, 0), H - 1)]
                c = details[n, min(max(y + down + 1, 0), H - 1)]
                d = details[n, min(max(y + down + 2, 0), H - 1)]
                for x in range(W):
                    row[margin + x] = wy[0] * a[x] + wy[1] * b[x] + wy[2] * c[x] + wy[3] * d[x]
                row[:margin] = row[margin]
                row[margin + W :] = row[margin + W - 1]
                first = margin + across - 1
                low = max(0, math.ceil(-offsets[k, n, 1] / step))
                high = min(columns, math.floor((W - 1 - offsets[k, n, 1]) / step) + 1)
                for j in range(low, high):
                    at = first + j * step
                    value = wx[0] * row[at] + wx[1] * row[at + 1] + wx[2] * row[at + 2] + wx[3] * row[at + 3]
                    ones_at[j] += value > 0
                    seen_at[j] += 1
            for j in range(columns):
                out[k, i, j] = share[seen_at[j], ones_at[j]]


@njit(cache=True, parallel=True)
def keep_least(k: int, slopes: Any, constants: Any, guide: Any, step: int, labels: Any, kept: Any) -> None:
    """Interpolate the costs of candidate ``k`` to all pixels, and keep what each pixel's least cost needs.

    Parameters
    ----------
    k : int
        The candidates come in rising order from 0 on.
    slopes, constants : ndarray, shape (h, w, 3) and (h, w), float32
        Costs as a linear function of the guide's colours, at every ``step``-th row and column.
    guide : ndarray, shape (H, W, 3), float32
    step : int
    labels : ndarray, shape (H, W), int64
        Candidate of least cost so far.
    kept : ndarray, shape (H, W, 5), float32
        Least cost so far, cost of the candidate before it, of that after it, of candidate ``k - 1``, and the sum.
    """
    H, W = labels.shape
    last_row, last_column = constants.shape[0] - 1, constants.shape[1] - 1
    for y in prange(H):
        i, fy = min(y // step, last_row), np.float32((y % step) / step)
        below = min(i + 1, last_row)
        for x in range(W):
            j, fx = min(x // step, last_column), np.float32((x % step) / step)
            right = min(j + 1, last_column)
            a, b = (np.float32(1) - fy) * (np.float32(1) - fx), (np.float32(1) - fy) * fx
            c, d = fy * (np.float32(1) - fx), fy * fx
            cost = a * constants[i, j] + b * constants[i, right] + c * constants[below, j] + d * constants[below, right]
            for m in range(3):
                slope = a * slopes[i, j, m] + b * slopes[i, right, m]
                slope += c * slopes[below, j, m] + d * slopes[below, right, m]
                cost += slope * guide[y, x, m]
            if k == 0 or cost < kept[y, x, 0]:
                labels[y, x] = k
                kept[y, x, 0], kept[y, x, 1], kept[y, x, 2] = cost, kept[y, x, 3], cost
            elif labels[y, x] == k - 1:
                kept[y, x, 2] = cost
            kept[y, x, 3] = cost
            kept[y, x, 4] += cost


@njit(inline="always")
def _weighted_median(values: Any, weights: Any, count: int) -> Any:
    """Least of the integers ``values`` up to which half of the weight lies, by bisection."""
    low, high, total = values[0], values[0], 0
    for n in range(count):
        low, high = min(low, values[n]), max(high, values[n])
        total += weights[n]
    while low < high:
        middle = (low + high) // 2
        up_to = 0
        for n in range(count):
            up_to += weights[n] if values[n] <= middle else 0
        if 2 * up_to >= total:
            high = middle
        else:
            low = middle + 1
    return low


@njit(cache=True, parallel=True)
def median_pass(
    current: Any, data: Any, data_weights: Any, guide: Any, radius: int, gap: int, table: Any, per_entry: float
) -> Any:
    """For each pixel, the value of least absolute differences to its datum and to its neighbours as they are.

    Parameters
    ----------
    current, data : ndarray, shape (H, W), int32
    data_weights : ndarray, shape (H, W), int32
    guide : ndarray, shape (H, W, 3), float32
    radius, gap : int
        Neighbours are up to ``radius`` times ``gap`` pixels away, every ``gap``-th one.
    table : ndarray, shape (M,), int32
        Weight of a neighbour by the squared difference of colours, an entry for each ``per_entry``; 0 beyond.
    per_entry : float

    Returns
    -------
    ndarray, shape (H, W), int32
    """
    H, W = current.shape
    out = np.empty((H, W), np.int32)
    scale, entries = np.float32(1 / per_entry), len(table)
    most = (2 * radius + 1) ** 2
    for y in prange(H):
        values, weights = np.empty(most, np.int32), np.empty(most, np.int32)
        for x in range(W):
            values[0], weights[0] = data[y, x], data_weights[y, x]
            count = 1
            for v in range(max(y - radius * gap, y % gap), min(y + radius * gap + 1, H), gap):
                for u in range(max(x - radius * gap, x % gap), min(x + radius * gap + 1, W), gap):
                    r = guide[v, u, 0] - guide[y, x, 0]
                    g = guide[v, u, 1] - guide[y, x, 1]
                    b = guide[v, u, 2] - guide[y, x, 2]
                    entry = int((r * r + g * g + b * b) * scale)
                    if entry < entries and (v != y or u != x):
                        values[count], weights[count] = current[v, u], table[entry]
                        count += 1
            out[y, x] = _weighted_median(values, weights, count)
    return out
