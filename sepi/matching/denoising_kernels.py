"""Compiled loop of the denoising: the detail of each view, kept as far as it exceeds the noise."""

from __future__ import annotations

from typing import Any

import numpy as np

from sepi.compiled import njit, prange

EXACT = {"nnan", "ninf", "nsz"}
"""Fast-math flags that keep every rounding as written: see :mod:`sepi.matching.plane_sweep_kernels`."""

ROWS_AT_ONCE = 32
"""Rows of a view that a thread does at a stretch."""

SHARE = 0.640625
"""Of white noise's variance, what the binomial mean takes away."""

_REACH = 2
"""Of the window over which the detail's energy is averaged, pixels."""

_SIDE = 1 + _REACH
"""Rows beyond a stretch that it needs."""


@njit(inline="always")
def _mirrored(i: int, n: int) -> int:
    period = max(1, 2 * n - 2)
    i = abs(i) % period
    return min(i, period - i)


@njit(cache=True, fastmath=EXACT)
def _binomial(rows: Any, out: Any) -> None:
    """Mean ``1 2 1`` along both axes of ``rows (n, W)``, mirrored at the sides; the first and last row repeated."""
    n, W = rows.shape
    across = np.empty((n, W), np.float32)
    half, quarter = np.float32(0.5), np.float32(0.25)
    for i in range(n):
        row, target = rows[i], across[i]
        for x in range(1, W - 1):
            target[x] = half * row[x] + quarter * (row[x - 1] + row[x + 1])
        for x in (0, W - 1):
            target[x] = half * row[x] + quarter * (row[_mirrored(x - 1, W)] + row[_mirrored(x + 1, W)])
    for i in range(n):
        above, here, below, target = across[max(0, i - 1)], across[i], across[min(n - 1, i + 1)], out[i]
        for x in range(W):
            target[x] = half * here[x] + quarter * (above[x] + below[x])


@njit(cache=True, fastmath=EXACT, error_model="numpy")
def _gain(detail: Any, noise: Any, i: int, out: Any) -> None:
    """Part of row ``i`` of ``detail (C, n, W)`` that is kept: what its energy round a pixel has beyond that of noise.

    ``noise (W,)`` is the energy of one value of one channel.
    """
    C, _, W = detail.shape
    column = np.zeros(W + 2 * _REACH, np.float32)
    inner = column[_REACH : _REACH + W]
    for k in range(i - _REACH, i + _REACH + 1):
        for c in range(3):
            # grey as three equal channels, to the last bit
            values = detail[min(c, C - 1), k]
            for x in range(W):
                inner[x] += values[x] * values[x]
    for x in range(_REACH):
        column[x] = inner[_mirrored(x - _REACH, W)]
        column[_REACH + W + x] = inner[_mirrored(W + x, W)]
    size = 2 * _REACH + 1
    number = np.float32(size * size * 3)
    for x in range(W):
        total = np.float32(0)
        for k in range(size):
            total += column[x + k]
        of_noise = noise[x] * number
        out[x] = (total - of_noise) / total if total > of_noise else np.float32(0)


@njit(inline="always")
def _at(levels: Any, variances: Any, level: Any) -> Any:
    """Variance at a brightness, linear between those that are given; beyond the ends, theirs."""
    last = levels.size - 1
    if level <= levels[0]:
        return variances[0]
    for i in range(last):
        if level < levels[i + 1]:
            f = (level - levels[i]) / (levels[i + 1] - levels[i])
            return variances[i] + f * (variances[i + 1] - variances[i])
    return variances[last]


@njit(parallel=True, cache=True, fastmath=EXACT, error_model="numpy")
def denoise_views(
    views: Any, present: Any, full: Any, levels: Any, variances: Any, least: Any, whole: bool, out: Any
) -> None:
    """Views without what noise alone explains.

    Parameters
    ----------
    views : ndarray, shape (T, S, H, W, C)
    present : ndarray, shape (T, S), bool
        Other views are left alone.
    full : float32
        Value of white.
    levels, variances : ndarray, shape (N,), float32
        Brightnesses, rising, and the noise of one channel there.
    least : ndarray, shape (H, W), float32
        Detail is kept as far as its energy exceeds so many times that of this noise.
    whole : bool
        Whether values are rounded and cut off at black and white.
    out : ndarray, shape (T, S, H, W, C)
        Filled; of the views' type.
    """
    T, S, H, W, C = views.shape
    pieces = (H + ROWS_AT_ONCE - 1) // ROWS_AT_ONCE
    for task in prange(T * S * pieces):
        view, begin = task // pieces, (task % pieces) * ROWS_AT_ONCE
        t, s = view // S, view % S
        if not present[t, s]:
            continue
        n = min(H, begin + ROWS_AT_ONCE) - begin + 2 * _SIDE
        detail, mean = np.empty((C, n, W), np.float32), np.empty((C, n, W), np.float32)
        for i in range(n):
            values = views[t, s, _mirrored(begin - _SIDE + i, H)]
            for c in range(C):
                for x in range(W):
                    detail[c, i, x] = np.float32(values[x, c]) / full
        for c in range(C):
            _binomial(detail[c], mean[c])
            for i in range(n):
                for x in range(W):
                    detail[c, i, x] -= mean[c, i, x]
        noise, gain = np.empty(W, np.float32), np.empty(W, np.float32)
        for i in range(_SIDE, n - _SIDE):
            y = begin - _SIDE + i
            for x in range(W):
                level = np.float32(0)
                for c in range(3):
                    level += mean[min(c, C - 1), i, x]
                noise[x] = least[y, x] * np.float32(SHARE) * _at(levels, variances, level / np.float32(3))
            _gain(detail, noise, i, gain)
            target = out[t, s, y]
            for c in range(C):
                for x in range(W):
                    value = mean[c, i, x] + gain[x] * detail[c, i, x]
                    if whole:
                        value = np.rint(min(max(value, np.float32(0)), np.float32(1)) * full)
                    target[x, c] = value
