"""Compiled loops of the decision by shares of the views (:mod:`sepi.boundaries.surface_shares`)."""

from __future__ import annotations

from typing import Any

import numpy as np

from sepi.boundaries.arrays import RimViews, Sides
from sepi.boundaries.rim_kernels import Rim
from sepi.boundaries.view_samples import sample, sees
from sepi.compiled import fma, njit, prange
from sepi.vectors import first_elements, load, spread, store, sum_of

FEWEST_VIEWS = 3
"""That see a piece of background, before its colour counts."""

UNSEEN = np.float32(-1)
"""In place of the variance of a background that fewer see."""

FEWEST_SAMPLES = 8
"""Views from which a share is told."""

EXACT = {"nnan", "ninf", "nsz"}
"""Fast-math flags that keep every rounding as written: see :mod:`sepi.matching.plane_sweep_kernels`."""

SHARES = 12
"""That are tried, from 0 to 1; none is one half."""

_SAME_SURFACE = 0.25  # difference of disparity, pixels per view step
# standard deviation of a surface's colour from its clean neighbours', beyond theirs; by what its square is divided, as
# errors of views go together; the same where the colour is free, and where no clean one is known; colours in 0..1
_CLEAN_DEVIATION = 0.02
_HELD = 4.0
_FREE_DEVIATION = 0.3
_UNKNOWN_DEVIATION = 1.0
_MOST_DEVIATION2 = 0.01  # squared residual that one view counts at most in the background's variance
_STRIDE = 4  # pixels from one to the next that tell the brightness of a view
_MOST_DIFFERENCE = 0.1  # of one channel, that counts in a view's residual
_UNKNOWN = np.float32(1e3)  # cost where nothing tells
VECTOR = 8  # numbers in a vector
_AT_ONCE = 64  # pixels that a thread does at a stretch

# rows of what the views show of a pixel (7, N + VECTOR): its colours, those behind it, and the variance of the latter
_BEHIND, _NOISE = 3, 6
# rows of the nearer surface beside a pixel (4, 3): its colour, the least and the most that it shows, what fits best
_OWN, _LEAST, _MOST, _FIT = 0, 1, 2, 3


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


@njit(forceinline=True, borrows=True)
def _behind(background: Any, row: int, column: int, fy: Any, fx: Any, sums: Any) -> Any:
    """Colour between pixels of the background, and its variance, into ``sums[:4]``; whether it is known."""
    for i in range(row, row + 2):
        for j in range(column, column + 2):
            if background[i, j, 3] == UNSEEN:
                return False
    # two pixels side by side
    upper, lower = load(background, (row, column, 0)), load(background, (row + 1, column, 0))
    store(sums, 0, fma(spread(fy), lower - upper, upper))
    for k in range(4):
        sums[k] += fx * (sums[k + 4] - sums[k])
    return True


@njit(forceinline=True, borrows=True)
def _nearer_colour(sides: Sides, near: Any, middle: Any, y: int, x: int, surface: Any) -> Any:
    """Fill in the nearer surface beside a pixel: clean pixels' colour, or else the pixel's own; its variance."""
    H, W = sides.disparity.shape
    radius, out = sides.clean_radius, surface[_OWN]
    weights, squares = 0.0, 0.0
    out[:] = 0
    surface[_LEAST], surface[_MOST] = 1.0, 0.0
    for i in range(max(0, y - radius), min(H, y + radius + 1)):
        for j in range(max(0, x - radius), min(W, x + radius + 1)):
            if sides.disparity[i, j] > middle:
                for c in range(3):
                    surface[_LEAST, c] = min(surface[_LEAST, c], sides.guide[i, j, c])
                    surface[_MOST, c] = max(surface[_MOST, c], sides.guide[i, j, c])
            if sides.clean[i, j] and abs(sides.disparity[i, j] - near) < _SAME_SURFACE:
                weight = 1 / (1 + (i - y) ** 2 + (j - x) ** 2) ** 2
                weights += weight
                for c in range(3):
                    out[c] += weight * sides.guide[i, j, c]
                    squares += weight * sides.guide[i, j, c] ** 2
    if weights == 0:
        for c in range(3):
            out[c] = sides.guide[y, x, c]
        return _UNKNOWN_DEVIATION**2
    variance = squares / weights
    for c in range(3):
        out[c] /= weights
        variance -= out[c] ** 2
    return (max(variance, 0.0) / 3 + _CLEAN_DEVIATION**2) / _HELD


@njit(forceinline=True, borrows=True)
def _along_near(
    views: RimViews, background: Any, near: Any, far: Any, y: int, x: int, sums: Any, colour: Any, samples: Any
) -> int:
    """What the views show of a pixel that moves with ``near``, and what is behind it there; how many tell both."""
    H, W, _ = background.shape
    n = 0
    for view in range(len(views.places)):
        seen, row, column, fy, fx = sees(views, view, near, y, x)
        # where the background that is there in the view is in the reference view
        down = y - (near - far) * views.baselines[view, 0]
        across = x - (near - far) * views.baselines[view, 1]
        if not seen or down < 0 or across < 0 or down >= H - 1 or across >= W - 1:
            continue
        i, j = int(down), int(across)
        if _behind(background, i, j, np.float32(down - i), np.float32(across - j), sums):
            for k in range(4):
                samples[_BEHIND + k, n] = sums[k]
            sample(views, view, row, column, fy, fx, sums, colour)
            for c in range(3):
                samples[c, n] = colour[c]
            n += 1
    return n


@njit(forceinline=True, borrows=True)
def _summed(samples: Any, row: int, n: int) -> Any:
    """Sum of the first ``n`` of a row."""
    total = spread(np.float32(0))
    for v in range(0, n, VECTOR):
        total = total + first_elements(load(samples, (row, v)), n - v, np.float32(0))
    return sum_of(total)


@njit(forceinline=True, borrows=True)
def _residual2(samples: Any, c: int, v: int, colour: Any, rest: Any) -> Any:
    """Squared differences of eight views from ``colour``, and what is behind it with the weight ``rest``."""
    apart = load(samples, (c, v)) - spread(colour) - spread(rest) * load(samples, (_BEHIND + c, v))
    return apart * apart


@njit(forceinline=True, borrows=True)
def _robust(residual2: Any, half: Any) -> Any:
    return residual2 / (residual2 + half)


@njit(forceinline=True, borrows=True)
def _cost_of_share(share: Any, samples: Any, n: int, summed: Any, surface: Any, held: Any, scale2: Any) -> Any:
    """Mean robust residual of ``n`` views that show a share of one colour before the background, 0..1.

    The colour is that which fits best within the surface's limits, and is held near its own with the weight of
    ``held`` views. ``summed (6,)`` are the sums of the views' colours, and of those behind them.
    """
    rest = np.float32(1) - share
    total = np.float32(0)
    for c in range(3):
        along = summed[c] - rest * summed[_BEHIND + c]
        best = (share * along + held * surface[_OWN, c]) / (share * share * n + held)
        surface[_FIT, c] = min(max(best, surface[_LEAST, c]), surface[_MOST, c])
        total += np.float32(held * (surface[_FIT, c] - surface[_OWN, c]) ** 2 / scale2)
    fit = surface[_FIT]
    red, green, blue = np.float32(share * fit[0]), np.float32(share * fit[1]), np.float32(share * fit[2])
    over_views = spread(np.float32(0))
    for v in range(0, n, VECTOR):
        half = fma(spread(rest * rest), load(samples, (_NOISE, v)), spread(scale2))
        cost = _robust(_residual2(samples, 0, v, red, rest), half) + _robust(
            _residual2(samples, 1, v, green, rest), half
        )
        cost = cost + _robust(_residual2(samples, 2, v, blue, rest), half)
        over_views = over_views + first_elements(cost, n - v, np.float32(0))
    return (total + sum_of(over_views)) / np.float32(3 * n)


@njit(forceinline=True, borrows=True)
def _cost_alone(
    views: RimViews, own: Any, d: Any, y: int, x: int, scale2: Any, sums: Any, colour: Any, samples: Any
) -> Any:
    """Mean robust residual of a pixel of colour ``own (3,)`` that moves with ``d``, over views that see it."""
    n = 0
    for view in range(len(views.places)):
        if views.baselines[view, 0] == 0 and views.baselines[view, 1] == 0:
            # the reference view itself always fits
            continue
        seen, row, column, fy, fx = sees(views, view, d, y, x)
        if seen:
            sample(views, view, row, column, fy, fx, sums, colour)
            for c in range(3):
                samples[c, n] = colour[c]
            n += 1
    if n < FEWEST_VIEWS:
        return _UNKNOWN
    total, half = spread(np.float32(0)), spread(scale2)
    for v in range(0, n, VECTOR):
        for c in range(3):
            apart = load(samples, (c, v)) - spread(own[c])
            total = total + first_elements(_robust(apart * apart, half), n - v, np.float32(0))
    return sum_of(total) / np.float32(3 * n)


@njit(forceinline=True, borrows=True)
def _apart2(samples: Any, n: int, surface: Any) -> Any:
    """Mean squared difference of the nearer surface's colour from what is behind it."""
    total = spread(np.float32(0))
    for v in range(0, n, VECTOR):
        for c in range(3):
            apart = load(samples, (_BEHIND + c, v)) - spread(np.float32(surface[_OWN, c]))
            total = total + first_elements(apart * apart, n - v, np.float32(0))
    return sum_of(total) / np.float32(3 * n)


@njit(parallel=True, cache=True)
def evidence_of_shares(
    views: RimViews, rim: Rim, background: Any, sides: Sides, scales2: Any, begin: int, end: int, evidence: Any
) -> None:
    """By how much the other surface explains the views better than the one that a pixel has.

    Along the nearer surface's disparity each view shows the same share of that surface before another piece of
    background. More than half is near, less is far.

    Parameters
    ----------
    views : RimViews
    rim : Rim
    background : ndarray, shape (H, W, 4), float32
        From :func:`background_of`.
    sides : Sides
    scales2 : tuple of float
        Square of the residual at which a view counts half: the least, and what the squared difference of both surfaces'
        colours adds to it, times this; errors of samples grow with it.
    begin, end : int
        Rows that are made.
    evidence : ndarray, shape (H, W), float32
        Filled with differences of mean costs, -1..1; left alone where the views do not tell.
    """
    W = sides.disparity.shape[1]
    N = len(views.places)
    # they are not spread evenly over the rows; not NumPy's: where it is compiled, every process loads SciPy
    pixels, count = np.empty((end - begin) * W, np.int64), 0
    for y in range(begin, end):
        for x in range(W):
            if rim.inside[y, x]:
                pixels[count] = y * W + x
                count += 1
    for task in prange((count + _AT_ONCE - 1) // _AT_ONCE):
        samples, surface, summed = (
            np.zeros((7, N + VECTOR), np.float32),
            np.empty((4, 3)),
            np.empty(6, np.float32),
        )
        sums, colour = np.empty(4 + VECTOR, np.float32), np.empty(3, np.float32)
        for i in range(task * _AT_ONCE, min(count, (task + 1) * _AT_ONCE)):
            y, x = pixels[i] // W, pixels[i] % W
            near, far = rim.near[y, x], rim.far[y, x]
            n = _along_near(views, background, near, far, y, x, sums, colour, samples)
            if n < FEWEST_SAMPLES:
                continue
            variance = _nearer_colour(sides, near, (near + far) / 2, y, x, surface)
            if rim.is_near[y, x]:
                # surfaces get darker or brighter towards their edge: to be far, a pixel must be so whatever its colour.
                # To be near it must have the surface's colour: before a bare background, any is a share of another
                variance = _FREE_DEVIATION**2
            scale2 = np.float32(scales2[0] + scales2[1] * _apart2(samples, n, surface))
            held = np.float32(scale2 / variance)
            for c in range(6):
                summed[c] = _summed(samples, c, n)
            low = high = _UNKNOWN
            for k in range(SHARES):
                share = np.float32(k / (SHARES - 1))
                cost = _cost_of_share(share, samples, n, summed, surface, held, scale2)
                if 2 * k < SHARES - 1:
                    low = min(low, cost)
                else:
                    high = min(high, cost)
            if rim.is_near[y, x]:
                evidence[y, x] = high - low
            else:
                alone = _cost_alone(views, sides.guide[y, x], far, y, x, scale2, sums, colour, samples)
                evidence[y, x] = min(low, alone) - high
