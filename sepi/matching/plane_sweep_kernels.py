"""Compiled loops of the plane sweep: photo-consistency, its aggregation over windows, and the best candidate.

One ``(candidate, view)`` has one sub-pixel weight for the whole picture, so a row is a run of contiguous multiply-adds.
Candidates next to each other mostly have their samples between the same four pixels. What lies between these is a
polynomial of the disparity: eight pixels' coefficients stay in registers while the candidates are gone through.

No cost volume is ever held: a thread keeps the cost rows of one aggregation window, and the minimum is taken as soon as
a pixel is aggregated. There the candidates of all groups of a pixel lie side by side: a window's weight is loaded once
for all of them, and a pixel's costs stay in the first cache until its minima are found. Each pixel is summed by one
thread in a fixed order: results do not depend on the number of threads.

Only :func:`sweep_plane_rows` runs in parallel.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from sepi.compiled import fma, njit, prange
from sepi.lightfield import FloatMap
from sepi.matching.sample_polynomials import between_same_pixels, difference, from_origin, of_first, upper_row, value
from sepi.matching.sweep_arrays import BestMaps, Candidates, ExpectedCosts, ViewStack, Window
from sepi.vectors import (
    at_most,
    first_elements,
    least_of,
    load,
    smaller,
    spread,
    spread_from,
    store,
    store_columns,
    sum_of,
)

EXACT = {"nnan", "ninf", "nsz"}
"""Fast-math flags that keep every rounding as written.

Code that was just compiled is not optimised as the same code loaded from disk: with sums reordered or fused at will,
the first run would give other last digits than later ones.
"""

VECTOR = 8
"""Pixels that are done together: see :mod:`sepi.vectors`."""

SHORTEST_GAP = 128
"""Columns between pixels of the mask that are done rather than skipped: starting anew costs as much."""


class Run(NamedTuple):
    """Columns ``begin..end`` of row ``y``."""

    y: int
    begin: int
    end: int


class Tile(NamedTuple):
    """Rows ``top..bottom`` of columns ``begin..end``; views are counted nearer than ``margin`` to the border."""

    top: int
    bottom: int
    begin: int
    end: int
    margin: int


class Rows(NamedTuple):
    """Costs and numbers of samples of the rows of one window, and what is needed to fill them.

    Attributes
    ----------
    ring, counts : ndarray, shape (size, n + VECTOR, G K'), float32
        Row ``r`` at ``r % size``, column ``x - radius`` of the tile at ``x``; zero outside the picture. ``K'`` is the
        number of candidates, rounded up to whole vectors; those beyond cost nothing.
    costs : ndarray, shape (G, K', n + VECTOR), float32
    runs : ndarray, shape (N, 2), int64
    """

    ring: FloatMap
    counts: FloatMap
    costs: FloatMap
    runs: npt.NDArray[np.int64]


@njit(forceinline=True)
def _seen_run(shown: Any, W: int, run: Run, top: int, left: int, fx: Any) -> Any:
    """Columns of a run whose samples, below row ``top`` and ``left`` columns on, are in ``shown (H or 0, 2)``."""
    low, high = 0, W
    if shown.shape[0] > 0 and 0 <= top <= shown.shape[0] - 2:
        low, high = max(shown[top, 0], shown[top + 1, 0]), min(shown[top, 1], shown[top + 1, 1])
    # on the last column nothing beyond it has a weight
    return max(run.begin, low - left), min(run.end, (high if fx == 0 else high - 1) - left)


@njit(cache=True, fastmath=EXACT, error_model="numpy", borrows=True)
def _add_view(views: ViewStack, candidates: Candidates, t: int, s: int, run: Run, distances: Any, cost: Any) -> None:
    """Add the residuals of one view to ``cost (K, n)``; ``distances (K,)`` is scratch."""
    H, W = views.colours.shape[3], views.colours.shape[4] - VECTOR
    colours, reference, shown = views.colours[t, s], views.colours[views.t0, views.s0, :, run.y], views.shown[t, s]
    r, c = candidates.row[t, s], candidates.column[t, s]
    down, fy, across, fx = candidates.down[r], candidates.fy[r], candidates.across[c], candidates.fx[c]
    moves, disparities, scale2 = (candidates.sy[r], candidates.sx[c]), candidates.disparities, spread(views.scale2)
    k = 0
    while k < disparities.size:
        here = k
        k += 1
        top, below = upper_row(run.y, down[here], fy[here], H)
        first, last = _seen_run(shown, W, run, top, across[here], fx[here])
        if top < 0 or top > H - 2 or last <= first:
            continue
        while k < disparities.size and between_same_pixels(k, down, fy, across, fx):
            k += 1
        origin = from_origin(disparities, here, k, distances)
        place, at = (top, across[here]), (below if fy[here] == 0 else fy[origin], fx[origin])
        for x in range(first, last, VECTOR):
            red = difference(colours, reference, 0, place, x, at, moves)
            green = difference(colours, reference, 1, place, x, at, moves)
            blue = difference(colours, reference, 2, place, x, at, moves)
            if last - x < VECTOR:
                # differences of 0 add nothing to what others have added
                red, green, blue = of_first(red, last - x), of_first(green, last - x), of_first(blue, last - x)
            for n in range(here, k):
                e = spread_from(distances, n)
                r0, r1, r2 = value(red, e), value(green, e), value(blue, e)
                z = fma(r2, r2, fma(r1, r1, r0 * r0))
                store(cost, (n, x - run.begin), load(cost, (n, x - run.begin)) + z / (z + scale2))


@njit(cache=True, fastmath=EXACT, error_model="numpy")
def cost_row(views: ViewStack, candidates: Candidates, run: Run, cost: Any) -> None:
    """Photo-consistency of a run of pixels, summed over each group of views, for every candidate.

    Parameters
    ----------
    views : ViewStack
    candidates : Candidates
    run : Run
    cost : ndarray, shape (G, K or more, n + VECTOR), float32
        The first columns are filled with the sum of the robust residuals (each 0..1), those after them with 0.
    """
    T, S = views.groups.shape
    cost[:, :, : run.end - run.begin + VECTOR] = 0
    distances = np.empty(candidates.disparities.size, np.float32)
    for t in range(T):
        for s in range(S):
            if views.groups[t, s] >= 0:
                _add_view(views, candidates, t, s, run, distances, cost[views.groups[t, s]])


@njit(cache=True, error_model="numpy")
def _count_views(views: ViewStack, candidates: Candidates, run: Run, counts: Any) -> None:
    """Number of views of each group that see each pixel of a run at each candidate, into ``counts (n, G K')``."""
    T, S, _, H, _ = views.colours.shape
    W = views.colours.shape[4] - VECTOR
    K = candidates.disparities.size
    U = candidates.across.shape[0]
    G = views.subsets.shape[1]
    width = counts.shape[1] // G
    # views of each group, and equally far across, that have the row, at each candidate
    having = np.zeros((G, U, K), np.float32)
    some = np.zeros((G, U), np.bool_)
    for t in range(T):
        for s in range(S):
            g, r, u = views.groups[t, s], candidates.row[t, s], candidates.column[t, s]
            if g < 0:
                continue
            some[g, u] = True
            for k in range(K):
                top = run.y + candidates.down[r, k]
                if top >= 0 and (top < H - 1 or (top == H - 1 and candidates.fy[r, k] == 0)):
                    having[g, u, k] += np.float32(1)
    for x in range(run.begin, run.end):
        counts[x - run.begin] = 0
        for g in range(G):
            number = counts[x - run.begin, g * width : g * width + K]
            for u in range(U):
                if some[g, u]:
                    left, fx, of_column = candidates.across[u], candidates.fx[u], having[g, u]
                    for k in range(K):
                        inside = x + left[k] >= 0 and x + left[k] < (W if fx[k] == 0 else W - 1)
                        number[k] += of_column[k] if inside else np.float32(0)


@njit(cache=True, error_model="numpy")
def _count_shown(views: ViewStack, candidates: Candidates, run: Run, counts: Any) -> None:
    """:func:`_count_views` of views that do not show all of the picture."""
    T, S = views.groups.shape
    H, W = views.colours.shape[3], views.colours.shape[4] - VECTOR
    K, width = candidates.disparities.size, counts.shape[1] // views.subsets.shape[1]
    counts[: run.end - run.begin] = 0
    for t in range(T):
        for s in range(S):
            g = views.groups[t, s]
            if g < 0:
                continue
            r, c, shown = candidates.row[t, s], candidates.column[t, s], views.shown[t, s]
            for k in range(K):
                top, _ = upper_row(run.y, candidates.down[r, k], candidates.fy[r, k], H)
                first, last = _seen_run(shown, W, run, top, candidates.across[c, k], candidates.fx[c, k])
                if 0 <= top <= H - 2:
                    for x in range(first - run.begin, last - run.begin):
                        counts[x, g * width + k] += np.float32(1)


@njit(cache=True, fastmath=EXACT, error_model="numpy")
def _window_weights(window: Window, run: Run, weights: Any) -> None:
    """Weights of the windows of a run of pixels, summing to one, into ``weights (size, size, n)``; zero outside."""
    _, H, W = window.guide.shape
    y, begin, end = run
    weights[:] = 0
    total = np.zeros(end - begin, np.float32)
    falloff = np.float32(-0.5) / window.variance
    for i in range(weights.shape[0]):
        row = y + i - window.radius
        if row < 0 or row >= H:
            continue
        for j in range(weights.shape[1]):
            dx = j - window.radius
            first, last = max(begin, -dx), min(end, W - dx)
            weight = weights[i, j, first - begin : last - begin]
            for c in range(3):
                here, there = window.guide[c, y, first:last], window.guide[c, row, first + dx : last + dx]
                for x in range(last - first):
                    e = here[x] - there[x]
                    weight[x] += e * e
            sums = total[first - begin : last - begin]
            for x in range(last - first):
                weight[x] = np.exp(falloff * weight[x])
                sums[x] += weight[x]
    for i in range(weights.shape[0]):
        for j in range(weights.shape[1]):
            for x in range(end - begin):
                weights[i, j, x] /= total[x]


@njit(inline="always")
def _add_seven(target: Any, w: Any, a0: Any, a1: Any, a2: Any, a3: Any, a4: Any, a5: Any, a6: Any) -> None:
    """Add a row of the usual window, seven pixels wide, at once: the target is loaded and stored once only."""
    for k in range(target.size):
        target[k] += (
            (w[0] * a0[k] + w[1] * a1[k]) + (w[2] * a2[k] + w[3] * a3[k]) + (w[4] * a4[k] + w[5] * a5[k]) + w[6] * a6[k]
        )


@njit(cache=True, fastmath=EXACT, error_model="numpy", borrows=True)
def _aggregate(ring: Any, y: int, x: int, H: int, weights: Any, sums: Any) -> None:
    """Weighted sum over the window of pixel ``(y, x)``, of all groups and candidates at once, into ``sums (G K')``.

    ``ring (size, n, G K')`` is one of :class:`Rows`, ``weights (size, size, n)`` are those of :func:`_window_weights`.
    """
    size = weights.shape[0]
    sums[:] = 0
    for i in range(size):
        row = y + i - size // 2
        if row < 0 or row >= H:
            continue
        a = ring[row % size]
        w = weights[i, :, x]
        if size == 7:
            _add_seven(
                sums, (w[0], w[1], w[2], w[3], w[4], w[5], w[6]),
                a[x], a[x + 1], a[x + 2], a[x + 3], a[x + 4], a[x + 5], a[x + 6],
            )  # fmt: skip
        else:
            for j in range(size):
                weight, source = w[j], a[x + j]
                for k in range(sums.size):
                    sums[k] += weight * source[k]


@njit(forceinline=True, borrows=True)
def _mean_costs(sums: Any, counts: Any, all_seen: bool, subset: Any, k: int) -> Any:
    """Mean cost of the candidates from ``k`` on over the views of one subset of groups.

    ``sums``, ``counts (G, K')`` are of each group; where ``all_seen``, all candidates have the samples of the first.
    """
    total = number = spread(np.float32(0))
    for g in range(subset.size):
        if subset[g]:
            total = total + load(sums, (g, k))
            number = number + (spread_from(counts, (g, 0)) if all_seen else load(counts, (g, k)))
    # a candidate that no view of the subset sees is no match
    return at_most(number, spread(np.float32(0)), spread(np.float32(1)), total / number)


@njit(cache=True, fastmath=EXACT, error_model="numpy", borrows=True)
def _best_candidate(
    sums: Any, counts: Any, all_seen: bool, subset: Any, expected: Any, weights: Any, disparities: Any, costs: Any
) -> Any:
    """Disparity at the lowest of the costs, refined below the disparity sampling; that cost; the mean of all.

    Parameters
    ----------
    sums, counts, all_seen, subset
        As in :func:`_mean_costs`.
    expected : ndarray, shape (2, K'), float32
        Moments of :class:`sepi.matching.sweep_arrays.ExpectedCosts`, of the subset.
    weights : tuple of float32
        Of the same, of the pixel.
    disparities : ndarray, shape (K,), float32
    costs : ndarray, shape (K',), float32
        Filled.
    """
    K, none, most = disparities.size, np.float32(0), np.float32(1e9)
    all_least, sums_of_all = spread(most), spread(none)
    first, second, one = spread(weights[0]), spread(weights[1]), spread(np.float32(1))
    for k in range(0, K, VECTOR):
        mean = _mean_costs(sums, counts, all_seen, subset, k)
        taken = fma(second, load(expected, (1, k)), first * load(expected, (0, k)))
        mean = fma(mean - one, taken / (one - taken), mean)
        store(costs, k, mean)
        all_least = smaller(all_least, first_elements(mean, K - k, most))
        sums_of_all = sums_of_all + first_elements(mean, K - k, none)
    lowest = least_of(all_least)
    best = 0
    while best < K - 1 and costs[best] != lowest:
        best += 1
    offset = none
    # a perfect match needs no parabola, and the ends of the range allow none
    if lowest != 0 and 0 < best < K - 1:
        before, after = costs[best - 1], costs[best + 1]
        curvature = before - 2 * lowest + after
        if curvature > 0:
            offset = np.float32(0.5) * (before - after) / curvature
    sampling = (disparities[K - 1] - disparities[0]) / np.float32(K - 1)
    return disparities[best] + offset * sampling, lowest, sum_of(sums_of_all) / np.float32(K)


@njit(cache=True)
def _needed_runs(mask: Any, row: int, tile: Tile, radius: int, runs: Any) -> int:
    """Runs of columns of a row that windows of the mask's pixels touch, into ``runs (N, 2)``, and how many.

    A short gap does not end a run.
    """
    H, W = mask.shape
    number = 0
    for x in range(tile.begin, tile.end):
        needed = False
        for y in range(max(0, row - radius), min(H, row + radius + 1)):
            needed |= mask[y, x]
        if not needed:
            continue
        first, last = max(0, x - radius), min(W, x + radius + 1)
        if number and first - runs[number - 1, 1] < SHORTEST_GAP:
            runs[number - 1, 1] = last
        else:
            runs[number] = first, last
            number += 1
    return number


@njit(cache=True, borrows=True)
def _transpose(costs: Any, columns: int, target: Any) -> None:
    """The first columns of ``costs (G, K', n)``, and some zeros after them, as ``target (n, G K')``."""
    G, K, _ = costs.shape
    for x in range(0, columns, VECTOR):
        for g in range(G):
            for k in range(0, K, VECTOR):
                rows = (
                    load(costs, (g, k, x)), load(costs, (g, k + 1, x)), load(costs, (g, k + 2, x)),
                    load(costs, (g, k + 3, x)), load(costs, (g, k + 4, x)), load(costs, (g, k + 5, x)),
                    load(costs, (g, k + 6, x)), load(costs, (g, k + 7, x)),
                )  # fmt: skip
                store_columns(target, (x, g * K + k), rows)


@njit(cache=True, error_model="numpy")
def _fill_row(
    views: ViewStack, candidates: Candidates, mask: Any, row: int, tile: Tile, radius: int, rows: Rows
) -> None:
    """Costs of one row where they are needed, and near the border the number of views that see it."""
    H, W = mask.shape
    origin = tile.begin - radius
    ring, counts = rows.ring[row % rows.ring.shape[0]], rows.counts[row % rows.ring.shape[0]]
    for r in range(_needed_runs(mask, row, tile, radius, rows.runs)):
        first, last = rows.runs[r]
        cost_row(views, candidates, Run(row, first, last), rows.costs)
        _transpose(rows.costs, last - first, ring[first - origin :])
        # windows of pixels near the border reach this far
        inner = tile.margin + radius
        left, right = last, last
        if inner <= row < H - inner:
            left = min(last, inner)
            right = max(first, left, W - inner)
        for begin, end in ((first, left), (right, last)):
            if begin < end and views.shown.shape[2] > 0:
                _count_shown(views, candidates, Run(row, begin, end), counts[begin - origin :])
            elif begin < end:
                _count_views(views, candidates, Run(row, begin, end), counts[begin - origin :])


@njit(cache=True, error_model="numpy", borrows=True)
def _sweep_row(
    views: ViewStack, candidates: Candidates, expected: ExpectedCosts, mask: Any, y: int, tile: Tile, rows: Rows,
    weights: Any, maps: BestMaps, sums: Any, all_of_group: Any, costs: Any,
) -> None:  # fmt: skip
    """Best candidates of the pixels of a row that are in the mask; ``sums (2, G, K')``, ``costs (K',)`` are scratch."""
    H, W = mask.shape
    cost, number = sums[0], sums[1]
    for x in range(tile.begin, tile.end):
        if not mask[y, x]:
            continue
        _aggregate(rows.ring, y, x - tile.begin, H, weights, cost.reshape(cost.size))
        # away from the border every view sees every pixel of the window: nothing to count
        all_seen = tile.margin <= y < H - tile.margin and tile.margin <= x < W - tile.margin
        if not all_seen:
            _aggregate(rows.counts, y, x - tile.begin, H, weights, number.reshape(number.size))
        seen = all_of_group if all_seen else number
        for n in range(views.subsets.shape[0]):
            moments, of_pixel = expected.moments[:, n], (expected.weights[0, y, x], expected.weights[1, y, x])
            best = _best_candidate(
                cost, seen, all_seen, views.subsets[n], moments, of_pixel, candidates.disparities, costs
            )
            maps.disparity[n, y, x], maps.cost[n, y, x], maps.mean[n, y, x] = best


@njit(cache=True, error_model="numpy")
def _sweep_tile(
    views: ViewStack, candidates: Candidates, window: Window, expected: ExpectedCosts, mask: Any, tile: Tile,
    maps: BestMaps,
) -> None:  # fmt: skip
    """Sweep the pixels of a tile that are in the mask."""
    H = mask.shape[0]
    G = views.subsets.shape[1]
    K = (candidates.disparities.size + VECTOR - 1) // VECTOR * VECTOR
    radius = window.radius
    size, width = 2 * radius + 1, tile.end - tile.begin
    # with the columns of the windows at both ends
    columns = width + 2 * radius + VECTOR
    rows = Rows(
        np.zeros((size, columns, G * K), np.float32),
        np.zeros((size, columns, G * K), np.float32),
        np.empty((G, K, columns), np.float32),
        np.empty((width // SHORTEST_GAP + 2, 2), np.int64),
    )
    weights = np.empty((size, size, width), np.float32)
    sums, costs = np.empty((2, G, K), np.float32), np.empty(K, np.float32)
    all_of_group = np.zeros((G, K), np.float32)
    for group in views.groups.flat:
        if group >= 0:
            all_of_group[group] += 1
    done = -1  # last row whose costs are in the ring
    for y in range(tile.top, tile.bottom):
        wanted = False
        for x in range(tile.begin, tile.end):
            wanted |= mask[y, x]
        if not wanted:
            continue
        for row in range(max(0, y - radius, done + 1), min(H, y + radius + 1)):
            _fill_row(views, candidates, mask, row, tile, radius, rows)
            done = row
        _window_weights(window, Run(y, tile.begin, tile.end), weights)
        _sweep_row(views, candidates, expected, mask, y, tile, rows, weights, maps, sums, all_of_group, costs)


@njit(cache=True, borrows=True)
def _add_planes(view: Any, planes: Any) -> None:
    H, W, _ = view.shape
    for y in range(H):
        for x in range(W):
            for c in range(3):
                planes[c, y, x] = view[y, x, c]


@njit(cache=True, parallel=True)
def planes_of(views: Any, planes: Any) -> None:
    """Fill ``planes (T, S, 3, H, W or more)`` with views ``(T, S, H, W, 3)``."""
    T, S = views.shape[:2]
    for view in prange(T * S):
        _add_planes(views[view // S, view % S], planes[view // S, view % S])


@njit(cache=True, parallel=True)
def sweep_plane_rows(
    views: ViewStack, candidates: Candidates, window: Window, expected: ExpectedCosts, mask: Any, begin: int, end: int,
    height: int, width: int, maps: BestMaps,
) -> None:  # fmt: skip
    """Sweep the rows ``begin..end`` of the ``mask (H, W)`` in tiles of at most ``height`` rows, ``width`` columns."""
    H, W = mask.shape
    # where a view may show less than the picture, all pixels are as those near its border
    margin = H + W if views.shown.shape[2] > 0 else math.ceil(candidates.reach) + window.radius + 1
    for task in prange((end - begin + height - 1) // height):
        top = begin + task * height
        for left in range(0, W, width):
            tile = Tile(top, min(end, top + height), left, min(W, left + width), margin)
            _sweep_tile(views, candidates, window, expected, mask, tile, maps)
