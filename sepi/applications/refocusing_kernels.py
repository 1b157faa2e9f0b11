"""Compiled loop of the picture in focus everywhere: what one view shows of each pixel of the reference view."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from sepi.compiled import njit, prange

WIDEST = np.float32(17)
"""Pixels of a box at most: views whose pictures of a point are farther apart show it more than once."""


@njit(inline="always")
def _cubic_weights(f: Any, out: Any) -> None:
    """Weights of the pixels at -1, 0, 1 and 2 for a sample at fraction ``f``: Keys' cubic convolution."""
    out[0] = np.float32(((-0.5 * f + 1.0) * f - 0.5) * f)
    out[1] = np.float32((1.5 * f - 2.5) * f * f + 1.0)
    out[2] = np.float32(((-1.5 * f + 2.0) * f + 0.5) * f)
    out[3] = np.float32((0.5 * f - 0.5) * f * f)


@njit(inline="always")
def _difference(view: Any, top: int, left: int, wy: Any, wx: Any, c: int, own: Any) -> Any:
    """Sample of channel ``c``, less ``own``: exactly 0 where all pixels equal it. Beyond its border a view goes on as
    it ends.
    """
    H, W, _ = view.shape
    total = np.float32(0)
    for i in range(4):
        row = view[min(max(top + i - 1, 0), H - 1)]
        part = np.float32(0)
        for j in range(4):
            part += wx[j] * (row[min(max(left + j - 1, 0), W - 1), c] - own)
        total += wy[i] * part
    return total


@njit(parallel=True, cache=True)
def add_view(
    view: Any, baseline: Any, disparity: Any, nearest: Any, margin: Any, centre: Any, scale2: Any, sums: Any,
    weights: Any,
) -> None:  # fmt: skip
    """Add what a view shows of each pixel that it sees, colours unlike ``centre`` counting less.

    Parameters
    ----------
    view : ndarray, shape (H, W, C), float32
    baseline : ndarray, shape (2,), float64
        Down and across from the reference view, in view steps.
    disparity : ndarray, shape (H, W), float32
        Pixels per view step; pixels where it is NaN get nothing.
    nearest : ndarray, shape (H, W), float32
        What is nearest in the view (:func:`sepi.matching.nearest_surfaces.nearest_surfaces`).
    margin : float32
        By how much an occluder must be nearer, pixels per view step.
    centre : ndarray, shape (H, W, C), float32
        The colour that is expected.
    scale2 : float32
        Squared difference, summed over the channels, at which a colour counts a quarter.
    sums : ndarray, shape (H, W, C), float32
        Weighted differences from ``centre`` are added.
    weights : ndarray, shape (H, W), float32
        Weights are added.
    """
    H, W, C = view.shape
    for y in prange(H):
        wy, wx, found = np.empty(4, np.float32), np.empty(4, np.float32), np.empty(C, np.float32)
        for x in range(W):
            d = disparity[y, x]
            down, across = y - d * baseline[0], x - d * baseline[1]
            # also false for NaN
            if not (0 <= down <= H - 1 and 0 <= across <= W - 1):
                continue
            if nearest[int(down + 0.5), int(across + 0.5)] > d + margin:
                continue
            top, left = math.floor(down), math.floor(across)
            _cubic_weights(down - top, wy)
            _cubic_weights(across - left, wx)
            z = np.float32(0)
            for c in range(C):
                found[c] = _difference(view, top, left, wy, wx, c, centre[y, x, c])
                z += found[c] * found[c]
            weight = scale2 / (scale2 + z)
            weight *= weight
            for c in range(C):
                sums[y, x, c] += weight * found[c]
            weights[y, x] += weight


@njit(inline="always")
def _covered(dy: int, dx: int, height: Any, width: Any) -> Any:
    """Share that falls on a pixel this far away of a box that is at least a pixel high and wide."""
    half, zero, one = np.float32(0.5), np.float32(0), np.float32(1)
    down = min(one, max(zero, half * height + half - abs(dy)))
    across = min(one, max(zero, half * width + half - abs(dx)))
    return down * across / (height * width)


@njit(inline="always")
def _box(disparity: Any, focus: Any, cell: Any) -> Any:
    """Height and width of the box over which a point moves while the camera moves through its cell."""
    one, off = np.float32(1), abs(disparity - focus)
    return min(WIDEST, max(one, off * cell[0])), min(WIDEST, max(one, off * cell[1]))


@njit(inline="always")
def _add_box(sheared: Any, surfaces: Any, focus: Any, cell: Any, margin: Any, place: Any, sums: Any) -> None:
    """Sums over the pixels whose light falls on one pixel; ``place``: its row and column, and how far boxes reach.

    ``sums (2, C + 1)``: colours and shares of what is nearer, and of all else.
    """
    C, H, W = sheared.shape
    y, x, rows, columns = place
    own = surfaces[y, x]
    height, width = _box(own, focus, cell)
    for i in range(max(0, y - rows), min(H, y + rows + 1)):
        for j in range(max(0, x - columns), min(W, x + columns + 1)):
            other = surfaces[i, j]
            a, b = _box(other, focus, cell)
            if other < own - margin:
                # what is behind shows where the pixel's own surface moves away
                a, b = height, width
            share = _covered(i - y, j - x, a, b)
            if share > 0:
                total = sums[0] if other > own + margin else sums[1]
                for c in range(C):
                    total[c] += share * sheared[c, i, j]
                total[C] += share


@njit(parallel=True, cache=True)
def fill_between(sheared: Any, surfaces: Any, focus: Any, cell: Any, margin: Any, out: Any) -> None:
    """One sheared view as the mean of all the views that could be taken in its cell of the aperture.

    While the camera moves through the cell, each point moves over a box: its disparity's distance from the focus, times
    the cell. Nearer points cover a pixel for the share of the cell in which they are before it.

    Parameters
    ----------
    sheared : ndarray, shape (C, H, W), float32
        The view, sheared by the disparity ``focus``.
    surfaces : ndarray, shape (H, W), float32
        Disparities of what it shows, finite, pixels per view step.
    focus : float32
        Pixels per view step.
    cell : ndarray, shape (2,), float32
        Height and width of the cell in view steps.
    margin : float32
        By how much one surface must be nearer to stand before another, pixels per view step.
    out : ndarray, shape (C, H, W), float32
        Filled.
    """
    C, H, W = sheared.shape
    one, half = np.float32(1), np.float32(0.5)
    tallest, widest = one, one
    for y in range(H):
        for x in range(W):
            height, width = _box(surfaces[y, x], focus, cell)
            tallest, widest = max(tallest, height), max(widest, width)
    rows, columns = math.ceil(half * tallest - half), math.ceil(half * widest - half)
    for y in prange(H):
        sums = np.empty((2, C + 1), np.float32)
        for x in range(W):
            sums[:] = 0
            _add_box(sheared, surfaces, focus, cell, margin, (y, x, rows, columns), sums)
            near, rest = sums[0], sums[1]
            hidden = min(one, near[C])
            for c in range(C):
                out[c, y, x] = (one - hidden) * rest[c] / rest[C]
                if near[C] > 0:
                    out[c, y, x] += hidden * near[c] / near[C]
