"""Compiled loops of the decision by shares of the views (:mod:`sepi.boundaries.surface_shares`)."""

from __future__ import annotations

from typing import Any

import numpy as np

from sepi.boundaries.arrays import RimViews, Sides
from sepi.boundaries.rim_kernels import Rim
from sepi.boundaries.view_samples import sample, sees
from sepi.compiled import fma, njit, prange
from sepi.vectors import first_elements, load, spread, store, sum_of

FEWEST_SAMPLES = 8
"""Views from which a share is told."""

FEWEST_ALONE = 3
"""Views from which it is told whether a pixel moves with the more distant surface alone."""

SHARES = 12
"""That are tried, from 0 to 1; none is one half."""

_LITTLE = 3  # of them that a pixel may have which moves with the more distant surface

_SAME_SURFACE = 0.25  # difference of disparity, pixels per view step
# standard deviation of a surface's colour from what its clean neighbours say, beyond what they differ by; the same
# where the colour is free, and where no clean one is known; colours in 0..1
_CLEAN_DEVIATION = 0.02
_FREE_DEVIATION = 0.2
_UNKNOWN_DEVIATION = 1.0
# of a change of colour towards the edge: what its slope is held by, square of pixels; the part of its square that adds
# to the colour's variance; the least deviation of one channel about it
_LEAST_EXTENT, _DOUBT, _LEAST_DEVIATION = 0.1, 0.1, 0.004
_UNKNOWN = np.float32(1e3)  # cost where nothing tells
VECTOR = 8  # numbers in a vector
_AT_ONCE = 64  # pixels that a thread does at a stretch

# rows of what the views show of a pixel (7, N + VECTOR): its colours, those behind it, and the variance of the latter
_BEHIND, _NOISE = 3, 6
# rows of the nearer surface beside a pixel (4, 3): its colour, the least and the most that it shows, what fits best
_OWN, _LEAST, _MOST, _FIT = 0, 1, 2, 3


@njit(forceinline=True, borrows=True)
def _behind(background: Any, row: int, column: int, fy: Any, fx: Any, sums: Any) -> Any:
    """Colour between pixels of the background, and its variance, into ``sums[:4]``; whether it is known."""
    for i in range(row, row + 2):
        for j in range(column, column + 2):
            if background[i, j, 3] < 0:
                return False
    # two pixels side by side
    upper, lower = load(background, (row, column, 0)), load(background, (row + 1, column, 0))
    store(sums, 0, fma(spread(fy), lower - upper, upper))
    for k in range(4):
        sums[k] += fx * (sums[k + 4] - sums[k])
    return True


@njit(forceinline=True, borrows=True)
def _moments(sides: Sides, near: Any, middle: Any, y: int, x: int, surface: Any, moments: Any) -> Any:
    """Weighted sums over the nearer surface's clean pixels about a pixel, and the limits of all that it shows there.

    Returns the sums of the weights, of their squares, of the weights times ``(dy, dx)``, and times their products;
    ``moments (3, 4)`` gets, for each channel, those times the colour, the colour and ``(dy, dx)``, and its square.
    """
    H, W = sides.disparity.shape
    radius = sides.clean_radius
    surface[_LEAST], surface[_MOST] = 1.0, 0.0
    moments[:] = 0
    n, squares, at_y, at_x, yy, yx, xx = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    for i in range(max(0, y - radius), min(H, y + radius + 1)):
        for j in range(max(0, x - radius), min(W, x + radius + 1)):
            if sides.disparity[i, j] > middle:
                for c in range(3):
                    surface[_LEAST, c] = min(surface[_LEAST, c], sides.guide[i, j, c])
                    surface[_MOST, c] = max(surface[_MOST, c], sides.guide[i, j, c])
            if sides.clean[i, j] and abs(sides.disparity[i, j] - near) < _SAME_SURFACE:
                dy, dx = i - y, j - x
                weight = 1 / (1 + dy**2 + dx**2) ** 2
                n, squares = n + weight, squares + weight * weight
                at_y, at_x = at_y + weight * dy, at_x + weight * dx
                yy, yx, xx = yy + weight * dy * dy, yx + weight * dy * dx, xx + weight * dx * dx
                for c in range(3):
                    colour = weight * sides.guide[i, j, c]
                    moments[c, 0] += colour
                    moments[c, 1] += colour * dy
                    moments[c, 2] += colour * dx
                    moments[c, 3] += colour * sides.guide[i, j, c]
    return n, squares, at_y, at_x, yy, yx, xx


@njit(forceinline=True, borrows=True)
def _nearer_colour(sides: Sides, near: Any, middle: Any, y: int, x: int, surface: Any, moments: Any) -> Any:
    """Fill in the nearer surface at a pixel: what clean pixels' colours go on as, or else its own; its variance.

    Surfaces get darker or brighter towards their edge. The colour is linear in the place as far as that is more than
    its own doubt (James and Stein's estimate): texture has no slope that goes on.
    """
    out = surface[_OWN]
    n, squares, at_y, at_x, yy, yx, xx = _moments(sides, near, middle, y, x, surface, moments)
    if n == 0:
        for c in range(3):
            out[c] = sides.guide[y, x, c]
        return _UNKNOWN_DEVIATION**2
    at_y, at_x = at_y / n, at_x / n
    yy, xx = yy / n - at_y * at_y + _LEAST_EXTENT, xx / n - at_x * at_x + _LEAST_EXTENT
    yx = yx / n - at_y * at_x
    determinant = yy * xx - yx * yx
    plain, rest, change2 = 0.0, 0.0, 0.0
    for c in range(3):
        mean = moments[c, 0] / n
        down, across = moments[c, 1] / n - mean * at_y, moments[c, 2] / n - mean * at_x
        slope_y, slope_x = (xx * down - yx * across) / determinant, (yy * across - yx * down) / determinant
        variance = max(moments[c, 3] / n - mean * mean, 0.0)
        plain += variance
        rest += max(variance - slope_y * down - slope_x * across, 0.0)
        out[c], moments[c, 0] = mean, -slope_y * at_y - slope_x * at_x
        change2 += moments[c, 0] ** 2
    # variance of the change, by what is left beside it and where the clean pixels lie
    lever = (xx * at_y * at_y - 2 * yx * at_y * at_x + yy * at_x * at_x) / determinant
    doubt = (rest + 3 * _LEAST_DEVIATION**2) / max(n * n / squares - 3, 1.0) * lever
    kept = max(0.0, 1 - doubt / (change2 + 1e-12))
    for c in range(3):
        out[c] += kept * moments[c, 0]
    return (kept * (rest + _DOUBT * kept * change2) + (1 - kept) * plain) / 3 + _CLEAN_DEVIATION**2


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
    if n < FEWEST_ALONE:
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
def costs_of_shares(
    views: RimViews, rim: Rim, background: Any, sides: Sides, scales2: Any, pixels: Any, costs: Any, told: Any
) -> None:
    """How badly each share of the nearer surface explains what the views show of a pixel beside a depth step.

    Along the nearer surface's disparity each view shows the same share of that surface before another piece of
    background.

    Parameters
    ----------
    views : RimViews
    rim : Rim
    background : ndarray, shape (H, W, 4), float32
        From :func:`sepi.boundaries.background_kernels.background_of`.
    sides : Sides
    scales2 : tuple of float
        Square of the residual at which a view counts half: the least, and what the squared difference of both surfaces'
        colours adds to it, times this; errors of samples grow with it.
    pixels : ndarray, shape (n,), int64
        Places in the map, row after row, of pixels of the rim.
    costs : ndarray, shape (n, SHARES), float32
        Filled with mean robust residuals, 0..1, of shares from 0 to 1; left alone where the views do not tell.
    told : ndarray, shape (n,), bool
        Set where they do.
    """
    W = sides.disparity.shape[1]
    N, count = len(views.places), len(pixels)
    for task in prange((count + _AT_ONCE - 1) // _AT_ONCE):
        samples, surface, moments = np.zeros((7, N + VECTOR), np.float32), np.empty((4, 3)), np.empty((3, 4))
        sums, colour, summed = np.empty(4 + VECTOR, np.float32), np.empty(3, np.float32), np.empty(6, np.float32)
        for i in range(task * _AT_ONCE, min(count, (task + 1) * _AT_ONCE)):
            y, x = pixels[i] // W, pixels[i] % W
            near, far = rim.near[y, x], rim.far[y, x]
            n = _along_near(views, background, near, far, y, x, sums, colour, samples)
            if n < FEWEST_SAMPLES:
                continue
            told[i] = True
            variance = _nearer_colour(sides, near, (near + far) / 2, y, x, surface, moments)
            if rim.is_near[y, x]:
                # to be far, a pixel must be so whatever its colour. To be near it must have the surface's colour:
                # before a bare background, any is a share of another
                variance = _FREE_DEVIATION**2
            scale2 = np.float32(scales2[0] + scales2[1] * _apart2(samples, n, surface))
            held = np.float32(scale2 / variance)
            for c in range(6):
                summed[c] = _summed(samples, c, n)
            for k in range(SHARES):
                share = np.float32(k / (SHARES - 1))
                costs[i, k] = _cost_of_share(share, samples, n, summed, surface, held, scale2)
            if not rim.is_near[y, x]:
                alone = _cost_alone(views, sides.guide[y, x], far, y, x, scale2, sums, colour, samples)
                for k in range(_LITTLE):
                    costs[i, k] = min(costs[i, k], alone)
