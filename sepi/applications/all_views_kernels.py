"""Compiled loops of the maps of all views (:mod:`sepi.applications.all_views`).

A pixel of a map is a square of a surface: its middle has the pixel's disparity, each corner what the pixels that meet
there, and belong together, agree on. Where they do not, the corner comes apart, each pixel going on by its own slope.
Seen from another view, a square becomes four triangles round its middle; disparity is linear on each of them, since a
plane in one view is a plane in all.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from sepi.compiled import njit, prange
from sepi.lightfield import BoolMap, FloatMap

EXACT = {"nnan", "ninf", "nsz"}
"""Fast-math flags that keep every rounding as written: see :mod:`sepi.matching.plane_sweep_kernels`."""

EMPTY = np.float32(-1e9)
"""Disparity where no surface is seen: nothing is nearer."""

_TOUCHING = -1e-3  # part of a triangle by which a pixel may miss it: no cracks between neighbours
_EDGE_ON = 1e-3  # part of its area in its own view below which a triangle is seen from its edge, or from behind


class Sources(NamedTuple):
    """The maps that are carried.

    Attributes
    ----------
    disparity, confidence : ndarray, shape (N, H, W), float32
        Pixels per view step; 0..1.
    bars : ndarray, shape (N, H, W, 3), float32
        Standard deviation of the disparity, and how far the bounds of its interval lie below and above it; of no maps
        where there are none.
    corners : ndarray, shape (N, H, W, 4), float32
        Disparity at the corners of each pixel, from :func:`corner_disparities`.
    baselines : ndarray, shape (N, 2), float64
        Of the views that the maps belong to, down and across, in view steps.
    """

    disparity: FloatMap
    confidence: FloatMap
    bars: FloatMap
    corners: FloatMap
    baselines: npt.NDArray[np.float64]


class Rules(NamedTuple):
    """When maps agree.

    Attributes
    ----------
    most_stretched : float
        A surface seen more than so many times larger than in its map's view is not carried.
    tolerance : float32
        Disparities that differ by no more are of one surface, pixels per view step.
    least_weight : float32
        Of a map where its confidence is 0.
    """

    most_stretched: float
    tolerance: np.float32
    least_weight: np.float32


@njit(inline="always")
def _slope(before: Any, here: Any, after: Any, has_before: bool, has_after: bool) -> Any:
    """Slope at a pixel by the neighbour that is nearer in disparity: the other may be across a step."""
    if has_before and has_after:
        return here - before if abs(here - before) <= abs(after - here) else after - here
    if has_before:
        return here - before
    return after - here


@njit(parallel=True, cache=True, fastmath=EXACT, error_model="numpy")
def corner_disparities(disparity: Any, tolerance: Any) -> Any:
    """Disparity at the corners of each pixel.

    Parameters
    ----------
    disparity : ndarray, shape (H, W), float32
        Pixels per view step; H and W at least 2.
    tolerance : float32
        Pixels that meet in a corner belong together where what they say of it differs by no more.

    Returns
    -------
    ndarray, shape (H, W, 4), float32
        Top left, top right, bottom right, bottom left.
    """
    H, W = disparity.shape
    slopes = np.empty((H, W, 2), np.float32)
    for y in prange(H):
        up, down = max(y - 1, 0), min(y + 1, H - 1)
        for x in range(W):
            left, right = max(x - 1, 0), min(x + 1, W - 1)
            d = disparity[y, x]
            slopes[y, x, 0] = _slope(disparity[up, x], d, disparity[down, x], y > 0, y < H - 1)
            slopes[y, x, 1] = _slope(disparity[y, left], d, disparity[y, right], x > 0, x < W - 1)
    corners = np.empty((H, W, 4), np.float32)
    half = np.float32(0.5)
    for y in prange(H):
        for x in range(W):
            for corner in range(4):
                below, beside = corner // 2, 1 if corner in (1, 2) else 0
                own = disparity[y, x] + slopes[y, x, 0] * (below - half) + slopes[y, x, 1] * (beside - half)
                total, count = np.float32(0), 0
                # the four pixels round the corner, by their rows: all that share it add up alike
                for row in range(y + below - 1, y + below + 1):
                    for column in range(x + beside - 1, x + beside + 1):
                        if 0 <= row < H and 0 <= column < W:
                            down, across = y + below - row - half, x + beside - column - half
                            value = disparity[row, column] + slopes[row, column, 0] * np.float32(down)
                            value += slopes[row, column, 1] * np.float32(across)
                            if abs(value - own) <= tolerance:
                                total += value
                                count += 1
                corners[y, x, corner] = total / np.float32(count) if count else own
    return corners


@njit(inline="always")
def _draw_triangle(a: Any, b: Any, c: Any, most_area: float, pixel: Any, nearest: Any, origin: Any) -> None:
    """Draw a triangle of a pixel, of corners ``(y, x, disparity)``, clockwise in its own view, into a view's maps."""
    H, W = nearest.shape
    area = (b[1] - a[1]) * (c[0] - a[0]) - (b[0] - a[0]) * (c[1] - a[1])
    if not 0.5 * _EDGE_ON < area <= most_area:
        return
    first, last = max(0, math.ceil(min(a[0], b[0], c[0]) - 1e-3)), min(H - 1, math.floor(max(a[0], b[0], c[0]) + 1e-3))
    left, right = max(0, math.ceil(min(a[1], b[1], c[1]) - 1e-3)), min(W - 1, math.floor(max(a[1], b[1], c[1]) + 1e-3))
    for y in range(first, last + 1):
        for x in range(left, right + 1):
            of_b = ((x - a[1]) * (c[0] - a[0]) - (y - a[0]) * (c[1] - a[1])) / area
            of_c = ((b[1] - a[1]) * (y - a[0]) - (b[0] - a[0]) * (x - a[1])) / area
            if of_b >= _TOUCHING and of_c >= _TOUCHING and of_b + of_c <= 1 - _TOUCHING:
                d = np.float32(a[2] + of_b * (b[2] - a[2]) + of_c * (c[2] - a[2]))
                if d > nearest[y, x]:
                    nearest[y, x], origin[y, x] = d, pixel


@njit(cache=True, fastmath=EXACT, error_model="numpy")
def carry(
    disparity: Any,
    corners: Any,
    v: float,
    u: float,
    most_stretched: float,
    nearest: Any,
    origin: Any,
) -> None:
    """Draw the surfaces of a map as another view sees them; the nearest wins.

    Parameters
    ----------
    disparity : ndarray, shape (H, W), float32
    corners : ndarray, shape (H, W, 4), float32
        From :func:`corner_disparities`.
    v, u : float
        Baseline from the map's view to the other, in view steps.
    most_stretched : float
        See :class:`Rules`.
    nearest : ndarray, shape (H, W), float32
        Filled: disparity in the other view, ``EMPTY`` where no surface of the map is seen.
    origin : ndarray, shape (H, W), int32
        Filled: number of the map's pixel, row by row, that is seen there; -1 where none is.
    """
    H, W = disparity.shape
    nearest[:], origin[:] = EMPTY, np.int32(-1)
    # twice the area of a quarter of a pixel
    most_area = 0.5 * most_stretched
    for y in range(H):
        for x in range(W):
            d = np.float64(disparity[y, x])
            if y - d * v < -1 or y - d * v > H or x - d * u < -1 or x - d * u > W:
                continue
            middle = (y - d * v, x - d * u, d)
            e = np.float64(corners[y, x, 3])
            before = (y + 0.5 - e * v, x - 0.5 - e * u, e)
            for corner in range(4):
                e = np.float64(corners[y, x, corner])
                down, across = -0.5 + corner // 2, 0.5 if corner in (1, 2) else -0.5
                here = (y + down - e * v, x + across - e * u, e)
                _draw_triangle(middle, before, here, most_area, np.int32(y * W + x), nearest, origin)
                before = here


@njit(inline="always")
def _is_open(disparity: Any, y: float, x: float, d: Any, tolerance: Any) -> bool:
    """Whether a map shows only what is behind a surface of disparity ``d`` at a position where it would show it."""
    H, W = disparity.shape
    if y < 0 or x < 0 or y > H - 1 or x > W - 1:
        return False
    top, left = int(y), int(x)
    for row in range(top, min(top + 2, H)):
        for column in range(left, min(left + 2, W)):
            if disparity[row, column] >= d - tolerance:
                return False
    return True


@njit(inline="always")
def _score(
    sources: Sources, carried: Any, weights: Any, rules: Rules, y: int, x: int, v: float, u: float, d: Any
) -> Any:
    """Sum of the weights of the maps that show a surface, less that of those that see through it."""
    score = np.float32(0)
    for n in range(len(weights)):
        if abs(carried[n, y, x] - d) <= rules.tolerance:
            score += weights[n]
        elif carried[n, y, x] < d:
            down, across = v - sources.baselines[n, 0], u - sources.baselines[n, 1]
            if _is_open(sources.disparity[n], y + d * down, x + d * across, d, rules.tolerance):
                score -= weights[n]
    return score


@njit(cache=True, fastmath=EXACT, error_model="numpy")
def _fuse(
    sources: Sources,
    carried: Any,
    origin: Any,
    rules: Rules,
    v: float,
    u: float,
    disparity: Any,
    confidence: Any,
    bars: Any,
) -> None:
    """One map of a view out of the carried ones; ``EMPTY`` where none shows anything."""
    N, H, W = carried.shape
    closeness, weights, believed = np.empty(N, np.float32), np.empty(N, np.float32), np.empty(N, np.float32)
    for n in range(N):
        closeness[n] = 1 / (1 + math.hypot(v - sources.baselines[n, 0], u - sources.baselines[n, 1]))
    for y in range(H):
        for x in range(W):
            low, high = np.float32(1e9), EMPTY
            for n in range(N):
                d = carried[n, y, x]
                pixel = origin[n, y, x]
                believed[n] = sources.confidence[n, pixel // W, pixel % W] if pixel >= 0 else np.float32(0)
                weights[n] = closeness[n] * (rules.least_weight + believed[n])
                if d > EMPTY:
                    low, high = min(low, d), max(high, d)
            best, most = high, np.float32(-1e9)
            if high > low + rules.tolerance:
                for n in range(N):
                    d = carried[n, y, x]
                    if d > EMPTY:
                        score = _score(sources, carried, weights, rules, y, x, v, u, d)
                        if score > most:
                            best, most = d, score
            # of the maps that agree with the best, the mean
            total, belief, weight = np.float32(0), np.float32(0), np.float32(0)
            if len(sources.bars) > 0:
                bars[y, x] = np.float32(0)
            for n in range(N):
                d = carried[n, y, x]
                if d > EMPTY and abs(d - best) <= rules.tolerance:
                    total += weights[n] * (d - best)
                    belief += weights[n] * believed[n]
                    weight += weights[n]
                    if len(sources.bars) > 0:
                        # maps of one light field are wrong together: their mean is no surer than they are
                        for k in range(3):
                            bars[y, x, k] += weights[n] * sources.bars[n, origin[n, y, x] // W, origin[n, y, x] % W, k]
            disparity[y, x] = best + total / weight if weight > 0 else EMPTY
            confidence[y, x] = belief / weight if weight > 0 else np.float32(0)
            if len(sources.bars) > 0 and weight > 0:
                for k in range(3):
                    bars[y, x, k] /= weight


@njit(inline="always")
def _walk(disparity: Any, y: int, x: int, down: float, across: float) -> Any:
    """The first known disparity on the way from a pixel, and how many steps away it is; -1 where there is none."""
    H, W = disparity.shape
    steps = 0
    while True:
        steps += 1
        row, column = round(y + steps * down), round(x + steps * across)
        if row < 0 or column < 0 or row >= H or column >= W:
            return EMPTY, -1
        if disparity[row, column] > EMPTY:
            return disparity[row, column], steps


@njit(cache=True, fastmath=EXACT, error_model="numpy")
def extend_background(disparity: Any, v: float, u: float, extended: Any) -> None:
    """Fill what is ``EMPTY`` with the farther of the two surfaces beside it, along the way that the view has moved.

    Parameters
    ----------
    disparity : ndarray, shape (H, W), float32
        Filled in place.
    v, u : float
        Baseline of the view, in view steps; gaps open along it.
    extended : ndarray, shape (H, W), bool
        Set where something was filled.
    """
    H, W = disparity.shape
    longest = max(abs(v), abs(u))
    down, across = (v / longest, u / longest) if longest > 0 else (0.0, 1.0)
    filled = disparity.copy()
    for y in range(H):
        for x in range(W):
            if disparity[y, x] > EMPTY:
                continue
            extended[y, x] = True
            best, found = np.float32(1e9), False
            for way in range(4):
                # across it only where nothing lies along it
                if way == 2 and found:
                    break
                sign = 1.0 if way % 2 == 0 else -1.0
                d, steps = (
                    _walk(disparity, y, x, sign * down, sign * across)
                    if way < 2
                    else _walk(disparity, y, x, sign * across, -sign * down)
                )
                if steps > 0:
                    best, found = min(best, d), True
            filled[y, x] = best if found else np.float32(0)
    disparity[:] = filled


@njit(parallel=True, cache=True, fastmath=EXACT, error_model="numpy")
def maps_of_views(
    sources: Sources,
    rules: Rules,
    baselines: Any,
    disparity: FloatMap,
    confidence: FloatMap,
    bars: FloatMap,
    extended: BoolMap,
) -> None:
    """The maps of some views.

    Parameters
    ----------
    sources : Sources
    rules : Rules
    baselines : ndarray, shape (V, 2), float64
        Of the views, down and across, in view steps, from where those of the sources are counted.
    disparity, confidence : ndarray, shape (V, H, W), float32
        Filled.
    bars : ndarray, shape (V, H, W, 3), float32
        Filled, as those of the sources; without pixels where they have none.
    extended : ndarray, shape (V, H, W), bool
        Filled: no source shows anything there, and the background was extended.
    """
    N, H, W = sources.disparity.shape
    for view in prange(len(baselines)):
        v, u = baselines[view, 0], baselines[view, 1]
        carried, origin = np.empty((N, H, W), np.float32), np.empty((N, H, W), np.int32)
        for n in range(N):
            carry(
                sources.disparity[n], sources.corners[n],
                v - sources.baselines[n, 0], u - sources.baselines[n, 1], rules.most_stretched,
                carried[n], origin[n],
            )  # fmt: skip
        _fuse(sources, carried, origin, rules, v, u, disparity[view], confidence[view], bars[view])
        extended[view] = False
        # gaps open beside the reference view's surfaces, for it is those that most of the maps are made of
        extend_background(disparity[view], v, u, extended[view])
