"""Compiled loops of the semi-global smoothing (:mod:`sepi.matching.semi_global`).

Smoothed are volumes of the shape (H, W, K'): candidates lie side by side, as many as fill vectors, and those too many
are out of reach. One pixel further along a path is a loop over vectors, which :func:`_next` writes down as such: the
compiler would go through the candidates three times, and take as long to begin as it then takes.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from llvmlite import ir
from numba import types
from numba.core import cgutils
from numba.extending import intrinsic

from sepi.compiled import fma, njit, prange

EXACT = {"nnan", "ninf", "nsz"}
"""Fast-math flags that keep every rounding as written: see :mod:`sepi.matching.plane_sweep_kernels`."""

PATHS_AT_ONCE = 32
"""Paths from row to row that a thread follows together: their costs lie side by side, and fit in its cache."""

VECTOR = 8
"""Candidates whose means over windows are taken together, and that are one vector."""

_UNREACHABLE = np.float32(1e9)

_cgutils: Any = cgutils


@njit(forceinline=True)
def _exp(x: Any) -> Any:
    """``exp(x)`` of a number up to 0, rounded to single precision; 0 below -87. Of what there is for vectors, too."""
    n = np.floor(x * 1.4426950408889634 + 0.5)
    f = (x - n * 0.693145751953125) - n * 1.42860682030941723212e-6
    p = 1 + f * (1 / 8) * (1 + f * (1 / 9) * (1 + f * (1 / 10)))
    p = 1 + f * (1 / 5) * (1 + f * (1 / 6) * (1 + f * (1 / 7) * p))
    p = 1 + f * (1 + f * (1 / 2) * (1 + f * (1 / 3) * (1 + f * (1 / 4) * p)))
    # 2^n by its bits
    power = np.int32((np.int32(max(n, -126.0)) + np.int32(127)) << np.int32(23)).view(np.float32)
    return np.float32(p * np.float64(power)) if x > -87 else np.float32(0)


@njit(cache=True, fastmath=EXACT, error_model="numpy")
def _window_weights(guide: Any, y: int, radius: int, variance: Any, weights: Any, total: Any) -> None:
    """Weights of the windows of row ``y``, of sum 1, into ``weights ((2 radius + 1)^2, W)``; zero outside the picture.

    ``guide (3, H, W)``, ``total (W,)`` is scratch.
    """
    _, H, W = guide.shape
    size = 2 * radius + 1
    width = 2 * np.float64(variance)
    weights[:] = 0
    total[:] = 0
    for i in range(max(0, radius - y), min(size, H - y + radius)):
        row = y + i - radius
        for j in range(size):
            dx = j - radius
            first, last = max(0, -dx), max(0, min(W, W - dx))
            r, g, b = guide[0, y, first:last], guide[1, y, first:last], guide[2, y, first:last]
            begin, end = first + dx, last + dx
            r2, g2, b2 = guide[0, row, begin:end], guide[1, row, begin:end], guide[2, row, begin:end]
            out, part = weights[i * size + j, first:last], total[first:last]
            for x in range(out.size):
                distance = (r[x] - r2[x]) ** 2 + (g[x] - g2[x]) ** 2 + (b[x] - b2[x]) ** 2
                out[x] = _exp(-np.float64(distance) / width)
                part[x] += out[x]
    for n in range(size * size):
        for x in range(W):
            weights[n, x] /= total[x]


@njit(forceinline=True)
def _window_sum(rows: Any, weights: Any, out: Any, radius: int) -> None:
    """Weighted sums over windows; ``rows (2 radius + 1, W + 2 radius)``, with a margin."""
    size = 2 * radius + 1
    for x in range(out.size):
        total = np.float32(0)
        # how many is known when this is compiled, and all of it becomes one loop over vectors
        for i in range(size):
            for j in range(size):
                total = fma(weights[i * size + j, x], rows[i, x + j], total)
        out[x] = total


@njit(forceinline=True)
def _add_weighted(costs: Any, weights: Any, out: Any) -> None:
    for x in range(out.size):
        out[x] = fma(weights[x], costs[x], out[x])


@njit(forceinline=True)
def _any_window_sum(rows: Any, weights: Any, out: Any, radius: int) -> None:
    """:func:`_window_sum` of any radius."""
    size = 2 * radius + 1
    out[:] = 0
    for i in range(size):
        for j in range(size):
            _add_weighted(rows[i, j : j + out.size], weights[i * size + j], out)


@njit(parallel=True, cache=True, fastmath=EXACT, error_model="numpy")
def aggregate(cost: Any, guide: Any, radius: int, variance: Any, out: Any) -> None:
    """Mean over a window with weights ``exp(-|colour difference|^2 / (2 variance))``; (K, H, W) to (H, W, K')."""
    K, H, W = cost.shape
    size = 2 * radius + 1
    colours = np.ascontiguousarray(guide.transpose(2, 0, 1))
    for y in prange(H):
        weights, sums = np.empty((size * size, W), np.float32), np.empty(W, np.float32)
        _window_weights(colours, y, radius, variance, weights, sums)
        # what lies beyond the picture weighs nothing
        rows = np.zeros((size, W + 2 * radius), np.float32)
        # a few candidates at a time: each pixel's are written together
        total = np.empty((VECTOR, W), np.float32)
        for begin in range(0, K, VECTOR):
            for k in range(begin, min(K, begin + VECTOR)):
                for i in range(max(0, radius - y), min(size, H - y + radius)):
                    rows[i, radius : radius + W] = cost[k, y + i - radius]
                if radius == 2:
                    _window_sum(rows, weights, total[k - begin], 2)
                else:
                    _any_window_sum(rows, weights, total[k - begin], radius)
            total[K - begin :] = _UNREACHABLE
            for x in range(W):
                for k in range(VECTOR):
                    out[y, x, begin + k] = total[k, x]


def _vector_next(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
    """LLVM code of :func:`_next`."""
    before, least, cost, small, large, path, out = arguments
    arrays = {0: before, 2: cost, 5: path, 6: out}
    data = {n: context.make_array(signature.args[n])(context, builder, array).data for n, array in arrays.items()}
    number, lane, vector = ir.FloatType(), ir.IntType(32), ir.VectorType(ir.FloatType(), VECTOR)
    flags = ("nnan", "ninf", "nsz")

    def spread(value: Any) -> Any:
        one = builder.insert_element(ir.Constant(vector, ir.Undefined), value, lane(0))
        return builder.shuffle_vector(one, one, ir.Constant(ir.VectorType(lane, VECTOR), [lane(0)] * VECTOR))

    def place(n: int, k: Any) -> Any:
        return builder.bitcast(builder.gep(data[n], [k]), vector.as_pointer())

    def least_of(a: Any, b: Any) -> Any:
        return builder.select(builder.fcmp_ordered("<", a, b, flags=flags), a, b)

    whole, jump, step = spread(least), spread(builder.fadd(least, large)), spread(small)
    lowest = _cgutils.alloca_once_value(builder, spread(ir.Constant(number, float(_UNREACHABLE))))
    count = _cgutils.unpack_tuple(builder, context.make_array(signature.args[2])(context, builder, cost).shape)[0]
    zero, width = (ir.Constant(count.type, value) for value in (0, VECTOR))
    with _cgutils.for_range_slice(builder, zero, count, width, inc=True) as (k, _):
        following, beyond = (builder.add(k, ir.Constant(k.type, n)) for n in (1, 2))
        lower, same, higher = (builder.load(place(0, at), align=4) for at in (k, following, beyond))
        best = least_of(least_of(same, jump), builder.fadd(least_of(lower, higher), step))
        value = builder.fsub(builder.fadd(builder.load(place(2, k), align=4), best), whole)
        builder.store(value, place(5, following), align=4)
        builder.store(builder.fadd(builder.load(place(6, k), align=4), value), place(6, k), align=4)
        builder.store(least_of(value, builder.load(lowest)), lowest)
    found = builder.load(lowest)
    half = VECTOR
    while half > 1:
        half //= 2
        parts = (
            builder.shuffle_vector(
                found, found, ir.Constant(ir.VectorType(lane, half), [lane(i + first) for i in range(half)])
            )
            for first in (0, half)
        )
        found = least_of(*parts)
    return builder.extract_element(found, lane(0))


def _typed_next(_context: Any, before: Any, least: Any, cost: Any, small: Any, large: Any, path: Any, out: Any) -> Any:
    number = types.float32
    return number(before, number, cost, number, number, path, out), _vector_next


_next: Any = intrinsic(_typed_next)
"""One pixel further along a path: ``path[1:-1] = cost + best - least``, which is added to ``out``; the least of it.

The best of: ``before`` of the same candidate, of one beside it plus ``small``, and the least of all plus ``large``.
``before`` and ``path`` have an unreachable candidate at either end. All arrays are contiguous.
"""


@njit(forceinline=True)
def _large_penalty(guide: Any, y: int, x: int, row: int, column: int, penalties: Any) -> Any:
    small, large, weakening = penalties
    change = np.float32(0)
    for c in range(3):
        change += abs(guide[y, x, c] - guide[row, column, c])
    return max(small * np.float32(1.5), large / (np.float32(1) + change * weakening))


@njit(cache=True, fastmath=EXACT)
def _along_row(cost: Any, guide: Any, y: int, dx: int, penalties: Any, out: Any) -> None:
    """Add the smoothed costs of the path along row ``y``."""
    W, K = cost.shape[1:]
    before, path = np.full(K + 2, _UNREACHABLE), np.full(K + 2, _UNREACHABLE)
    least = np.float32(0)
    for i in range(W):
        x = i if dx > 0 else W - 1 - i
        large = np.float32(0)
        if i == 0:
            # after a pixel whose candidates all cost nothing their costs are its own
            before[1:-1] = 0
        else:
            large = _large_penalty(guide, y, x, y, x - dx, penalties)
        least = _next(before, least, cost[y, x], penalties[0], large, path, out[y, x])
        before, path = path, before


@njit(cache=True, fastmath=EXACT)
def _along_lines(
    paths: Any, least: Any, first: int, cost: Any, guide: Any, rows: Any, dy: int, dx: int, penalties: Any, out: Any
) -> None:
    """Add the smoothed costs of paths from row to row in some rows: those that began in columns from ``first`` on.

    One that leaves the picture at a side goes on, as a new one, at the other: all have a pixel in each row. ``paths
    (2, n, K' + 2)`` are their costs in the row before and here, in turn, ``least (n,)`` the least of the row before.
    """
    H, W, _ = cost.shape
    for i in range(rows[0], rows[1]):
        y = i if dy > 0 else H - 1 - i
        before, path = paths[(i + 1) % 2], paths[i % 2]
        for line in range(min(len(least), W - first)):
            x, large = (first + line + dx * i) % W, np.float32(0)
            if i == 0 or x - dx < 0 or x - dx >= W:
                before[line, 1:-1] = 0
                least[line] = 0
            else:
                large = _large_penalty(guide, y, x, y - dy, x - dx, penalties)
            least[line] = _next(before[line], least[line], cost[y, x], penalties[0], large, path[line], out[y, x])


@njit(parallel=True, cache=True, fastmath=EXACT)
def semi_global(cost: Any, guide: Any, small: Any, large: Any, weakening: Any, band: int, out: Any) -> None:
    """Sum of the smoothed costs along eight paths, into ``out``; shapes (H, W, K'), float32.

    Paths of one direction do not meet, so a thread goes through many of them by itself. All go through ``band`` rows
    before any goes on, so that costs and sums come from memory once for the paths down and once for those up.
    """
    H, W, K = cost.shape
    penalties = small, large, weakening
    pieces = -(-W // PATHS_AT_ONCE)
    for dy in (1, -1):
        paths = np.full((3, pieces, 2, PATHS_AT_ONCE, K + 2), _UNREACHABLE)
        least = np.zeros((3, pieces, PATHS_AT_ONCE), np.float32)
        for begin in range(0, H, band):
            rows = begin, min(H, begin + band)
            if dy > 0:
                for y in prange(rows[0], rows[1]):
                    out[y] = 0
                    _along_row(cost, guide, y, 1, penalties, out)
                    _along_row(cost, guide, y, -1, penalties, out)
            for direction in range(3):
                dx = (0, 1, -1)[direction]
                for piece in prange(pieces):
                    _along_lines(
                        paths[direction, piece], least[direction, piece], piece * PATHS_AT_ONCE,
                        cost, guide, rows, dy, dx, penalties, out,
                    )  # fmt: skip


@njit(forceinline=True)
def _first_least(costs: Any) -> int:
    """Number of the least cost, of the first of equal ones."""
    least = costs[0]
    for k in range(costs.size):
        least = min(least, costs[k])
    first = 0
    while costs[first] != least:
        first += 1
    return first


@njit(forceinline=True)
def _own_and_other(costs: Any, disparities: Any, found: Any, best: int, same: Any) -> Any:
    """Least cost of the candidates that belong to a winner's minimum, and of the others."""
    own, other = _UNREACHABLE, _UNREACHABLE
    for k in range(costs.size):
        is_own = (abs(disparities[k] - found) <= same) | (k == best)
        own = min(own, costs[k] if is_own else _UNREACHABLE)
        other = min(other, _UNREACHABLE if is_own else costs[k])
    return own, other


@njit(parallel=True, cache=True, fastmath=EXACT)
def choose(smoothed: Any, averaged: Any, disparities: Any, same: Any) -> Any:
    """Winner of each pixel, refined by a parabola, and by how much the averaged cost of other minima exceeds its own.

    Parameters
    ----------
    smoothed, averaged : ndarray, shape (H, W, K'), float32
    disparities : ndarray, shape (K,), float32
    same : float32
        Candidates closer to the winner belong to its minimum, pixels per view step.

    Returns
    -------
    disparity, margin : ndarray, shape (H, W), float32
        The margin is negative where another minimum is lower before smoothing, 0 where there is no other.
    """
    H, W, _ = smoothed.shape
    K = disparities.size
    disparity, margin = np.empty((H, W), np.float32), np.empty((H, W), np.float32)
    spacing = (disparities[K - 1] - disparities[0]) / (K - 1)
    for y in prange(H):
        for x in range(W):
            best = _first_least(smoothed[y, x, :K])
            offset = np.float32(0)
            if 0 < best < K - 1:
                a, b, c = smoothed[y, x, best - 1], smoothed[y, x, best], smoothed[y, x, best + 1]
                curvature = a - 2 * b + c
                if curvature > 1e-9:
                    offset = np.float32(0.5) * (a - c) / curvature
            disparity[y, x] = disparities[best] + offset * spacing
            own, other = _own_and_other(averaged[y, x, :K], disparities, disparity[y, x], best, same)
            margin[y, x] = other - own if other < _UNREACHABLE else np.float32(0)
    return disparity, margin
