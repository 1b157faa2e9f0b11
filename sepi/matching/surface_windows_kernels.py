"""Compiled loops of sums over windows that hold one surface (:mod:`sepi.matching.surface_windows`)."""

from __future__ import annotations

from typing import Any

import numpy as np

from sepi.compiled import njit, prange

EXACT = {"nnan", "ninf", "nsz"}
"""Fast-math flags that keep every rounding as written: see :mod:`sepi.matching.plane_sweep_kernels`."""


@njit(forceinline=True, borrows=True)
def _alike(apart: Any, width: Any) -> Any:
    """How far two things are alike, 1 up to half a width from each other, 0 from one and a half on."""
    return min(max(np.float32(1.5) - apart / width, np.float32(0)), np.float32(1))


@njit(forceinline=True, borrows=True)
def _add_alike(own: Any, other: Any, width: Any, gradient: Any, curvature: Any, sums: Any, weights: Any) -> None:
    """Add what pixels of a row have to others, as far as both are of one surface."""
    for x in range(own.size):
        alike = _alike(abs(other[x] - own[x]), width)
        sums[x] += alike * gradient[x]
        weights[x] += alike * curvature[x]


@njit(forceinline=True, borrows=True)
def _add_coloured_alike(
    own: Any, other: Any, width: Any, red: Any, green: Any, blue: Any, colour_width: Any, least: Any,
    gradient: Any, curvature: Any, sums: Any, weights: Any,
) -> None:  # fmt: skip
    """The same, as far as they are of one colour, too; colours are of both rows."""
    for x in range(own.size):
        apart2 = (red[1][x] - red[0][x]) ** 2 + (green[1][x] - green[0][x]) ** 2 + (blue[1][x] - blue[0][x]) ** 2
        of_colour = least + (np.float32(1) - least) * _alike(np.sqrt(apart2), colour_width)
        share = _alike(abs(other[x] - own[x]), width) * of_colour
        sums[x] += share * gradient[x]
        weights[x] += share * curvature[x]


@njit(parallel=True, cache=True, fastmath=EXACT, borrows=True)
def sums_of_surface(
    gradient: Any, curvature: Any, disparity: Any, colours: Any, radius: int, width: Any, colour_width: Any, least: Any,
    sums: Any,
) -> None:  # fmt: skip
    """Sums over those pixels of a window that are of the surface of its middle.

    Parameters
    ----------
    gradient, curvature : ndarray, shape (H, W), float32
        What is summed.
    disparity : ndarray, shape (H, W), float32
        Pixels per view step.
    colours : ndarray, shape (3, H, W), float32
        Or (3, 0, 0): they are not asked.
    radius : int
        Windows are of ``2 radius + 1`` pixels, as far as the picture goes.
    width, colour_width : float32
        Differences of disparity, and of colour, over which pixels count less and less, from half of it on.
    least : float32
        What a pixel of the same disparity counts, whatever its colour.
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
                if colours.shape[1] == 0:
                    _add_alike(
                        disparity[y, begin:end], disparity[row, first:last], width, gradient[row, first:last],
                        curvature[row, first:last], sums[0, y, begin:end], sums[1, y, begin:end],
                    )  # fmt: skip
                else:
                    _add_coloured_alike(
                        disparity[y, begin:end], disparity[row, first:last], width,
                        (colours[0, y, begin:end], colours[0, row, first:last]),
                        (colours[1, y, begin:end], colours[1, row, first:last]),
                        (colours[2, y, begin:end], colours[2, row, first:last]),
                        colour_width, least, gradient[row, first:last], curvature[row, first:last],
                        sums[0, y, begin:end], sums[1, y, begin:end],
                    )  # fmt: skip
