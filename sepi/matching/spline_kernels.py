"""Compiled loops that make cubic splines of the views.

Spline coefficients are a convolution with ``sqrt(3) (sqrt(3) - 2)^|k|`` along each axis, mirrored at the ends [1]_; cut
off where it is below single precision, so that a row's coefficients do not depend on rows far away.

References
----------
.. [1] Unser: Splines, a perfect fit for signal and image processing. IEEE Signal Processing Magazine 16(6), 1999.
   doi:10.1109/79.799930
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.lib.stride_tricks import as_strided

from sepi.compiled import njit, prange

EXACT = {"nnan", "ninf", "nsz"}
"""Fast-math flags that keep every rounding as written: see :mod:`sepi.matching.plane_sweep_kernels`."""

SPLINE_UNIT = np.float32(1 / 3400)
"""Unit of the spline coefficients, stored as int16; a checkerboard of -0.5 and 1.5 has some of +-9.5."""

REACH = 8
"""How far the convolution of the views' coefficients reaches; beyond it is a tenth of what rounding to int16 does."""

_FULL_REACH = 12
"""The same where nothing is rounded: beyond it is less than 1e-6."""

_FILTER = np.array(
    [math.sqrt(3) * (math.sqrt(3) - 2) ** abs(k) for k in range(-_FULL_REACH, _FULL_REACH + 1)], np.float32
)

MARGIN = 2
"""Coefficients beyond each side of a view."""

ROWS_AT_ONCE = 64
"""Rows of a view that a thread does at a stretch."""


@njit(inline="always")
def _mirrored(i: int, n: int) -> int:
    """Index in a line of ``n`` that is mirrored at its ends, for ever."""
    period = max(1, 2 * n - 2)
    i = abs(i) % period
    return min(i, period - i)


@njit(forceinline=True)
def _weighted(lines: Any, out: Any, reach: int) -> None:
    """The convolution across lines, by their numbers: ``lines[k, x]`` weighted with the filter, summed over ``k``."""
    for x in range(out.size):
        total = _FILTER[_FULL_REACH - reach] * lines[0, x]
        # how many is known when this is compiled, and all of it becomes one loop over vectors
        for k in range(1, 2 * reach + 1):
            total += _FILTER[_FULL_REACH - reach + k] * lines[k, x]
        out[x] = total


@njit(forceinline=True)
def _coefficient_row(rows: Any, padded: Any, out: Any, reach: int) -> None:
    """Coefficients of one row.

    Parameters
    ----------
    rows : ndarray, shape (2 reach + 1, W), float32
        The row in the middle, and those round it, as far as the convolution reaches.
    padded : ndarray, shape (W + 2 MARGIN + 2 reach,), float32
        Scratch.
    out : ndarray, shape (W + 2 MARGIN,), float32
        Filled.
    reach : int
        A number that is known when this is compiled.
    """
    W = rows.shape[1]
    side = MARGIN + reach
    inner = padded[side : side + W]
    _weighted(rows, inner, reach)
    for x in range(side):
        padded[side - 1 - x] = inner[_mirrored(-1 - x, W)]
        padded[side + W + x] = inner[_mirrored(W + x, W)]
    shifted = as_strided(padded, (2 * reach + 1, out.size), (padded.itemsize, padded.itemsize))
    _weighted(shifted, out, reach)


@njit(inline="always")
def _load_colours(pixels: Any, unit: Any, r: Any, g: Any, b: Any) -> None:
    """A row of a view ``(W, 3)``."""
    for x in range(r.size):
        r[x] = np.float32(pixels[x, 0]) * unit
        g[x] = np.float32(pixels[x, 1]) * unit
        b[x] = np.float32(pixels[x, 2]) * unit


@njit(inline="always")
def _load(row: Any, unit: Any, out: Any) -> None:
    for x in range(out.size):
        out[x] = np.float32(row[x]) * unit


@njit(parallel=True, cache=True, fastmath=EXACT)
def spline_coefficients(image: Any) -> Any:
    """Cubic spline coefficients ``(C, H, W)`` of an image ``(H, W, C)``, float32."""
    H, W, C = image.shape
    out = np.empty((C, H, W), np.float32)
    for piece in prange((H + ROWS_AT_ONCE - 1) // ROWS_AT_ONCE):
        begin = piece * ROWS_AT_ONCE
        end = min(H, begin + ROWS_AT_ONCE)
        rows = np.empty((end - begin + 2 * _FULL_REACH, W), np.float32)
        padded, row = np.empty(W + 2 * (MARGIN + _FULL_REACH), np.float32), np.empty(W + 2 * MARGIN, np.float32)
        for c in range(C):
            for i in range(len(rows)):
                rows[i] = image[_mirrored(begin + i - _FULL_REACH, H), :, c]
            for y in range(begin, end):
                _coefficient_row(rows[y - begin : y - begin + 2 * _FULL_REACH + 1], padded, row, _FULL_REACH)
                out[c, y] = row[MARGIN : MARGIN + W]
    return out


@njit(parallel=True, cache=True, fastmath=EXACT)
def view_splines(
    colours: Any, colour_unit: Any, detail: Any, detail_unit: Any, detail_low: int, of_colours: Any, of_detail: Any,
    low: int, out: Any,
) -> None:  # fmt: skip
    """Coefficients of views' colours and detail.

    Parameters
    ----------
    colours : ndarray, shape (T, S, H, W, 3)
    colour_unit : float32
        What the colours are multiplied with.
    detail : ndarray, shape (T, S, n or 0, W), int16
        Rows from ``detail_low`` on, which reach ``REACH`` farther than those that are wanted, or to the picture's end.
    detail_unit : float32
    detail_low : int
    of_colours, of_detail : ndarray, shape (T, S), bool
        The views whose colours, and whose detail, are wanted; what ``out`` has of others stays.
    low : int
        The row after the first ``MARGIN`` ones.
    out : ndarray, shape (T, S, n + 2 MARGIN, W + 2 MARGIN, 4), int16
        Mirrored in the margins.
    """
    T, S, H, W, _ = colours.shape
    n = out.shape[2]
    pieces = (n + ROWS_AT_ONCE - 1) // ROWS_AT_ONCE
    for task in prange(T * S * pieces):
        view, first = task // pieces, (task % pieces) * ROWS_AT_ONCE
        t, s = view // S, view % S
        begin, end = 0 if of_colours[t, s] else 3, 4 if of_detail[t, s] else 3
        if begin == end:
            continue
        last = min(n, first + ROWS_AT_ONCE)
        rows = np.empty((4, ROWS_AT_ONCE + 2 * REACH, W), np.float32)
        for i in range(last - first + 2 * REACH):
            y = _mirrored(low - MARGIN + first + i - REACH, H)
            if begin == 0:
                _load_colours(colours[t, s, y], colour_unit / SPLINE_UNIT, rows[0, i], rows[1, i], rows[2, i])
            if end == 4:
                _load(detail[t, s, y - detail_low], detail_unit / SPLINE_UNIT, rows[3, i])
        padded, lines = np.empty(W + 2 * (MARGIN + REACH), np.float32), np.zeros((4, W + 2 * MARGIN), np.float32)
        for i in range(first, last):
            for c in range(begin, end):
                _coefficient_row(rows[c, i - first : i - first + 2 * REACH + 1], padded, lines[c], REACH)
            if begin == 3:
                for x in range(W + 2 * MARGIN):
                    out[t, s, i, x, 3] = np.int32(np.rint(lines[3, x]))
                continue
            for x in range(W + 2 * MARGIN):
                for c in range(4):
                    out[t, s, i, x, c] = np.int32(np.rint(lines[c, x]))
