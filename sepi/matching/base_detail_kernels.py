"""Compiled loop of the base-detail decomposition: a bilateral filter whose result is taken away at once.

The weight ``exp(-q)`` of a difference is computed as ``(1 - q / 32)^32``, which differs from it by 0.01 at most, ends
at zero, and is made of multiplications, so that the loop over a row vectorises.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from sepi.compiled import njit, prange

EXACT = {"nnan", "ninf", "nsz"}
"""Fast-math flags that keep every rounding as written: see :mod:`sepi.matching.plane_sweep_kernels`."""

ROWS_AT_ONCE = 32
"""Rows that a thread does at a stretch: those of the windows are converted once for all of them."""


@njit(inline="always")
def _mirrored(i: int, n: int) -> int:
    """Index in a line of ``n`` that is mirrored at its ends, for ever."""
    period = max(1, 2 * n - 2)
    i = abs(i) % period
    return min(i, period - i)


@njit(inline="always")
def _weights_between(here: Any, there: Any, falloff: Any, nearness: Any, out: Any) -> None:
    """Weights of the pixels of a row with those of another."""
    a0, a1, a2 = here
    b0, b1, b2 = there
    one, zero = np.float32(1), np.float32(0)
    for x in range(out.size):
        difference = abs(a0[x] - b0[x]) + abs(a1[x] - b1[x]) + abs(a2[x] - b2[x])
        w = max(zero, one - falloff * difference * difference)
        w *= w
        w *= w
        w *= w
        w *= w
        out[x] = w * (w * nearness)


@njit(inline="always")
def _add_weighted(w: Any, mean: Any, total: Any, weights: Any) -> None:
    """Add pixels of the window, one to every pixel of a row."""
    for x in range(w.size):
        total[x] += w[x] * mean[x]
        weights[x] += w[x]


@njit(inline="always")
def _load_row(pixels: Any, unit: Any, radius: int, out: Any) -> None:
    """A row of a view, its channels and their mean, mirrored at both ends, into ``out (4, W + 2 radius)``."""
    W = pixels.shape[0]
    r, g, b = out[0, radius : radius + W], out[1, radius : radius + W], out[2, radius : radius + W]
    # three channels at once: so the loop vectorises
    for x in range(W):
        r[x] = np.float32(pixels[x, 0]) * unit
        g[x] = np.float32(pixels[x, 1]) * unit
        b[x] = np.float32(pixels[x, 2]) * unit
    for c in range(3):
        row = out[c]
        for x in range(radius):
            row[x] = row[radius + _mirrored(x - radius, W)]
            row[radius + W + x] = row[radius + _mirrored(W + x, W)]
    third = np.float32(1 / 3)
    for x in range(out.shape[1]):
        out[3, x] = (out[0, x] + out[1, x] + out[2, x]) * third


@njit(parallel=True, cache=True, fastmath=EXACT, error_model="numpy")
def detail_of_views(
    colours: Any, unit: Any, present: Any, low: int, radius: int, edge: float, width: float, detail_unit: Any, out: Any
) -> None:
    """Mean of the channels without its edge-preserving mean, of some rows of every view.

    Parameters
    ----------
    colours : ndarray, shape (T, S, H, W, 3)
    unit : float32
        What the colours are multiplied with to span 0..1.
    present : ndarray, shape (T, S), bool
        Other views are left as they are.
    low : int
        First of the rows.
    radius : int
        The window is a disc.
    edge, width : float
        Standard deviations of the weights: of the sum of the RGB differences, colours in 0..1, and in pixels.
    detail_unit : float32
        Unit of the result.
    out : ndarray, shape (T, S, n, W), int16
        Filled.
    """
    T, S, H, W, _ = colours.shape
    n = out.shape[2]
    pieces = (n + ROWS_AT_ONCE - 1) // ROWS_AT_ONCE
    falloff = np.float32(1 / (64 * edge * edge))
    for task in prange(T * S * pieces):
        view, first = task // pieces, (task % pieces) * ROWS_AT_ONCE
        t, s = view // S, view % S
        if not present[t, s]:
            continue
        last = min(n, first + ROWS_AT_ONCE)
        rows = np.empty((ROWS_AT_ONCE + 2 * radius, 4, W + 2 * radius), np.float32)
        for i in range(last - first + 2 * radius):
            _load_row(colours[t, s, _mirrored(low + first + i - radius, H)], unit, radius, rows[i])
        P = W + 2 * radius
        total, weights = np.empty((last - first, P), np.float32), np.ones((last - first, P), np.float32)
        w = np.empty(P, np.float32)
        for y in range(last - first):
            # the pixel itself
            total[y] = rows[y + radius, 3]
        # each pair of pixels once, for both
        for y in range(-radius, last - first):
            a = rows[y + radius]
            for dy in range(radius + 1):
                b = rows[y + radius + dy]
                of_a, of_b = y >= 0, 0 <= y + dy < last - first
                for dx in range(-radius, radius + 1):
                    if dy * dy + dx * dx > radius * radius or (dy == 0 and dx <= 0) or not (of_a or of_b):
                        continue
                    nearness = np.float32(math.exp(-0.5 * (dy * dy + dx * dx) / (width * width)))
                    begin, end = max(0, -dx), P - max(0, dx)
                    i, j = begin + dx, end + dx
                    here, there = (a[0, begin:end], a[1, begin:end], a[2, begin:end]), (b[0, i:j], b[1, i:j], b[2, i:j])
                    _weights_between(here, there, falloff, nearness, w[begin:end])
                    if of_a:
                        _add_weighted(w[begin:end], b[3, i:j], total[y, begin:end], weights[y, begin:end])
                    if of_b:
                        _add_weighted(w[begin:end], a[3, begin:end], total[y + dy, i:j], weights[y + dy, i:j])
        for y in range(last - first):
            own = rows[y + radius, 3]
            for x in range(W):
                value = (own[radius + x] - total[y, radius + x] / weights[y, radius + x]) / detail_unit
                out[t, s, first + y, x] = np.int32(np.rint(value))
