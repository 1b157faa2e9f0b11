"""Compiled loops that find what views show beside the nearer surface: how bright they are, and what is behind it."""

from __future__ import annotations

from typing import Any

import numpy as np

from sepi.boundaries.arrays import RimViews, Sides
from sepi.boundaries.view_samples import sample, sees
from sepi.compiled import njit, prange

FEWEST_VIEWS = 3
"""That see a piece of background, before its colour counts."""

UNSEEN = np.float32(-1)
"""In place of the variance of a background that fewer see; negative."""

EXACT = {"nnan", "ninf", "nsz"}
"""Fast-math flags that keep every rounding as written: see :mod:`sepi.matching.plane_sweep_kernels`."""

_MOST_DEVIATION2 = 0.01  # squared residual that one view counts at most in the background's variance
_STRIDE = 4  # pixels from one to the next that tell the brightness of a view
_MOST_DIFFERENCE = 0.1  # of one channel, that counts in a view's residual
VECTOR = 8  # numbers in a vector


@njit(parallel=True, cache=True)
def brightness_of_views(views: RimViews, sides: Sides, missing: Any) -> Any:
    """How bright each view is beside the reference, and how badly it shows the same.

    Parameters
    ----------
    views : RimViews
        Its z-buffers are not looked at.
    sides : Sides
        Some of its clean pixels are looked at.
    missing : ndarray, shape (T, S, H, W) or (T, S, 0, 0), bool
        Pixels that a view does not show; empty: none.

    Returns
    -------
    brightness, residual : ndarray, shape (N,), float64
        Ratio of the sums of the colours; mean absolute difference of one channel, 0..1, that is left, NaN of views that
        show none of the pixels.
    """
    disparity, guide, clean = sides.disparity, sides.guide, sides.clean
    H, W = disparity.shape
    N = len(views.places)
    brightness, residual = np.ones(N), np.zeros(N)
    for view in prange(N):
        # of each pixel that the view shows: its colours there, and the reference's
        shown = np.empty((((H - 1) // _STRIDE + 1) * ((W - 1) // _STRIDE + 1), 2, 3))
        sums = np.empty(4 + VECTOR, np.float32)
        of_view = missing[views.places[view, 0], views.places[view, 1]]
        own, other, rest, n = 1e-9, 1e-9, 0.0, 0
        for y in range(0, H, _STRIDE):
            for x in range(0, W, _STRIDE):
                down = y - disparity[y, x] * views.baselines[view, 0]
                across = x - disparity[y, x] * views.baselines[view, 1]
                if not clean[y, x] or down < 0 or across < 0 or down >= H - 1 or across >= W - 1:
                    continue
                row, column = int(down), int(across)
                if of_view.size > 0 and (
                    of_view[row, column]
                    or of_view[row, column + 1]
                    or of_view[row + 1, column]
                    or of_view[row + 1, column + 1]
                ):
                    continue
                sample(views, view, row, column, down - row, across - column, sums, shown[n, 0])
                for c in range(3):
                    shown[n, 1, c] = guide[y, x, c]
                    own += shown[n, 1, c]
                    other += shown[n, 0, c]
                n += 1
        brightness[view] = other / own
        for k in range(n):
            for c in range(3):
                rest += min(abs(shown[k, 0, c] / brightness[view] - shown[k, 1, c]), _MOST_DIFFERENCE)
        residual[view] = rest / (3 * n + 1) if n > 0 else np.nan
    return brightness, residual


@njit(forceinline=True, fastmath=EXACT)
def _median(values: Any) -> Any:
    """Median of values, by halving the interval that it lies in: counting vectorises, and sorting does not.

    NumPy's, compiled, would have every process load SciPy's linear algebra.
    """
    n, middle = values.size, values.size // 2
    low = high = values[0]
    for v in range(1, n):
        low, high = min(low, values[v]), max(high, values[v])
    least, below = low, 0
    while below != middle:
        # as many or fewer lie below ``low``
        half = low + (high - low) * np.float32(0.5)
        if half <= low or half >= high:
            break
        below = 0
        for v in range(n):
            below += values[v] < half
        if below <= middle:
            low = half
        else:
            high = half
    after, before, below = high, least, 0
    for v in range(n):
        if values[v] >= low:
            after = min(after, values[v])
    for v in range(n):
        below += values[v] < after
        if values[v] < after:
            before = max(before, values[v])
    # of an even number, the mean of both in the middle
    return after if n % 2 == 1 or below < middle else (before + after) * np.float32(0.5)


@njit(parallel=True, cache=True)
def background_of(views: RimViews, layer: Any, wanted: Any, begin: int, end: int) -> Any:
    """Colours of the more distant surfaces, medians over the views that see them.

    Parameters
    ----------
    views : RimViews
    layer : ndarray, shape (H, W), float32
        Disparity of the more distant surface, also where a nearer one hides it.
    wanted : ndarray, shape (H, W), bool
    begin, end : int
        Rows that are made; others are left undefined.

    Returns
    -------
    ndarray, shape (H, W, 4), float32
        Colours, and the variance of the views' colours, mean of the channels; where fewer than ``FEWEST_VIEWS`` see it,
        ``UNSEEN`` in its place.
    """
    H, W = layer.shape
    N = len(views.places)
    background = np.empty((H, W, 4), np.float32)
    for y in prange(begin, end):
        # not NumPy's: where it is compiled, every process loads SciPy
        columns, few = np.empty(W, np.int64), 0
        for x in range(W):
            if wanted[y, x]:
                columns[few] = x
                few += 1
        samples, ordered = np.empty((few, 3, N), np.float32), np.empty(N, np.float32)
        colour_there, sums, count = np.empty(3, np.float32), np.empty(4 + VECTOR, np.float32), np.zeros(few, np.int64)
        background[y, :, 3] = UNSEEN
        # view by view: neighbours are near each other in its memory
        for view in range(N):
            for i in range(few):
                x = columns[i]
                seen, row, column, fy, fx = sees(views, view, layer[y, x], y, x)
                if seen:
                    sample(views, view, row, column, fy, fx, sums, colour_there)
                    for c in range(3):
                        samples[i, c, count[i]] = colour_there[c]
                    count[i] += 1
        for i in range(few):
            x = columns[i]
            n = count[i]
            if n < FEWEST_VIEWS:
                continue
            total = 0.0
            for c in range(3):
                for v in range(n):
                    ordered[v] = samples[i, c, v]
                middle = _median(ordered[:n])
                background[y, x, c] = middle
                for v in range(n):
                    total += min((samples[i, c, v] - middle) ** 2, _MOST_DEVIATION2)
            background[y, x, 3] = total / (3 * n)
    return background
