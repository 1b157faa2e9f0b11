"""Compiled loops of sums over windows that hold one surface (:mod:`sepi.matching.surface_windows`)."""

from __future__ import annotations

from typing import Any

import numpy as np

from sepi.compiled import njit, prange

EXACT = {"nnan", "ninf", "nsz"}
"""Fast-math flags that keep every rounding as written: see :mod:`sepi.matching.plane_sweep_kernels`."""


@njit(forceinline=True, borrows=True)
def _add_alike(own: Any, other: Any, width: Any, gradient: Any, curvature: Any, sums: Any, weights: Any) -> None:
    """Add what pixels of a row have to others, as far as both are of one surface."""
    one, most = np.float32(1), np.float32(1.5)
    for x in range(own.size):
        alike = min(max(most - abs(other[x] - own[x]) / width, np.float32(0)), one)
        sums[x] += alike * gradient[x]
        weights[x] += alike * curvature[x]


@njit(parallel=True, cache=True, fastmath=EXACT, borrows=True)
def sums_of_surface(gradient: Any, curvature: Any, disparity: Any, radius: int, width: Any, sums: Any) -> None:
    """Sums over those pixels of a window that are of the surface of its middle.

    Parameters
    ----------
    gradient, curvature : ndarray, shape (H, W), float32
        What is summed.
    disparity : ndarray, shape (H, W), float32
        Pixels per view step.
    radius : int
        Windows are of ``2 radius + 1`` pixels, as far as the picture goes.
    width : float32
        Difference of disparity over which pixels count less and less, from half of it on, pixels per view step.
    sums : ndarray, shape (2, H, W), float32
        Zero; filled, of both.
    """
    H, W = disparity.shape
    for y in prange(H):
        for row in range(max(0, y - radius), min(H, y + radius + 1)):
            for step in range(max(-radius, 1 - W), min(radius, W - 1) + 1):
                # pixels x, and those beside them at x + step
                begin, end = max(0, -step), W - max(0, step)
                first, last = begin + step, end + step
                _add_alike(
                    disparity[y, begin:end], disparity[row, first:last], width, gradient[row, first:last],
                    curvature[row, first:last], sums[0, y, begin:end], sums[1, y, begin:end],
                )  # fmt: skip
