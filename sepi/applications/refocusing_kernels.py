"""Compiled loop of the picture in focus everywhere: what one view shows of each pixel of the reference view."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numba import njit, prange


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
        z-buffer of the map in the view (:func:`sepi.matching.visibility_kernels.z_buffers`).
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
