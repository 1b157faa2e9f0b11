"""Samples between four pixels of a view, as polynomials of the disparity: what plane sweeps spend their time with.

Successive candidates mostly have their samples between the same four pixels, and along them the sample moves on a
straight line. Interpolated bilinearly, it is a polynomial of degree two of the distance from one of them, the origin.
Its coefficients, of eight pixels at once (:mod:`sepi.vectors`), stay in registers while the candidates are gone
through: two multiply-adds give the sample of each.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from sepi.compiled import fma, njit
from sepi.vectors import first_elements, load, spread


@njit(inline="always")
def difference(colours: Any, reference: Any, channel: int, place: Any, x: int, at: Any, moves: Any) -> Any:
    """Coefficients, of the distance from the origin, of how sample and reference pixel differ.

    Parameters
    ----------
    colours : ndarray, shape (C, rows, W + margin)
        Of a view.
    reference : ndarray, shape (C, W + margin)
        Row of the reference view.
    channel : int
    place : tuple of int
        Row above the samples, and columns from a reference pixel to the one left of its samples.
    x : int
        First of the eight pixels.
    at : tuple of float32
        Fractional pixels down and across from there to the sample at the origin.
    moves : tuple of float32
        By how many pixels the sample moves down and across as the disparity rises by one.

    Returns
    -------
    constant, linear, quadratic : vector
    """
    (row, shift), (fy, fx), (sy, sx) = place, at, moves
    left, lower_left = load(colours, (channel, row, x + shift)), load(colours, (channel, row + 1, x + shift))
    across = load(colours, (channel, row, x + shift + 1)) - left
    lower_across = load(colours, (channel, row + 1, x + shift + 1)) - lower_left
    down, both = lower_left - left, lower_across - across
    constant = fma(spread(fx), across, left - load(reference, (channel, x)))
    constant = fma(spread(fy), fma(spread(fx), both, down), constant)
    linear = fma(both, spread(fx * sy + fy * sx), fma(down, spread(sy), across * spread(sx)))
    return constant, linear, both * spread(sy * sx)


@njit(inline="always")
def value(coefficients: Any, distance: Any) -> Any:
    """The polynomial so far from the origin."""
    constant, linear, quadratic = coefficients
    return fma(distance, fma(distance, quadratic, linear), constant)


@njit(inline="always")
def of_first(coefficients: Any, number: int) -> Any:
    """Coefficients of so many of the eight pixels; 0, for those of the others."""
    a, b, c = coefficients
    none = np.float32(0)
    return first_elements(a, number, none), first_elements(b, number, none), first_elements(c, number, none)


@njit(inline="always")
def between_same_pixels(k: int, down: Any, fy: Any, across: Any, fx: Any) -> Any:
    """Whether the samples of candidates ``k - 1`` and ``k`` are between the same four pixels, or the same of them."""
    same = down[k - 1] == down[k] and across[k - 1] == across[k]
    return same and (fy[k - 1] == 0) == (fy[k] == 0) and (fx[k - 1] == 0) == (fx[k] == 0)


@njit(inline="always")
def from_origin(disparities: Any, begin: int, end: int, distances: Any) -> int:
    """Number of the candidate that is the origin of ``begin..end``; ``distances`` of these from it are filled."""
    # a disparity of 0, which can only be at an end, is one: nothing is rounded there
    origin = begin if disparities[begin] >= 0 else end - 1
    for k in range(begin, end):
        distances[k] = disparities[k] - disparities[origin]
    return origin


@njit(inline="always")
def upper_row(y: int, down: int, fy: Any, height: int) -> Any:
    """Row above the samples of row ``y``, and how far below it they are."""
    # the last row has none below: seen from the one above
    return (height - 2, np.float32(1)) if y + down == height - 1 and fy == 0 else (y + down, fy)
