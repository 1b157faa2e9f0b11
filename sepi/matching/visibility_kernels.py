"""Compiled loops of the visibility sweep: z-buffers of every view, and costs over the views that see a pixel."""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from sepi.compiled import fma, njit, prange
from sepi.lightfield import FloatMap
from sepi.matching.base_detail import BaseDetail
from sepi.matching.sample_polynomials import upper_row
from sepi.matching.sweep_arrays import Candidates
from sepi.vectors import (
    at_most,
    first_elements,
    larger,
    least_of,
    load,
    load_colours,
    smaller,
    spread,
    store,
    store_rounded,
    weighted_pairs,
    weights,
)

EXACT = {"nnan", "ninf", "nsz"}
"""Fast-math flags that keep every rounding as written: see :mod:`sepi.matching.plane_sweep_kernels`."""

EMPTY = np.float32(-1e9)
"""Disparity in a z-buffer where no pixel of the reference view falls: nothing is nearer."""

MISSING = np.float32(1e9)
"""The same where the view shows nothing: not even a view that hides a pixel counts less."""

MARGIN = 8
"""Columns beyond a run that vectors reach into: see :mod:`sepi.vectors`."""

ROUNDING = np.float32(1 / 512)
"""How far a pixel's position in a view is from the same in single precision, at most, pixels."""

COLOUR_STEPS = 20_000
"""Steps from black to white of colours as whole numbers; of 16 bits, with room for what float views have beyond."""

ONE = 1 << 14
"""The sum of a sample's weights, which are whole numbers of 16 bits."""


class Visibility(NamedTuple):
    """In which views a pixel is seen.

    Attributes
    ----------
    nearest : ndarray, shape (T, S, n, W) or (T, S, n, 0), float32
        From :func:`sepi.matching.nearest_surfaces.nearest_surfaces`; empty: all views see all pixels. In memory there
        are ``MARGIN`` numbers more behind it.
    low : int
        First row of ``nearest``.
    occlusion_margin : float32
        By how much an occluder must be nearer, pixels per view step.
    occluded_view_weight : float32
        Weight of a view in which the pixel is occluded; none where the view has no pixel.
    some_missing : bool
        Whether there are such places.
    """

    nearest: FloatMap
    low: int
    occlusion_margin: np.float32
    occluded_view_weight: np.float32
    some_missing: bool


class RobustCost(NamedTuple):
    """Square of the robust scale, and share in the cost, of colours and of detail; shape (2,), float32."""

    scales2: FloatMap
    shares: FloatMap


class _Rows(NamedTuple):
    """Rows of a view, and one of the reference view: colours and detail, as whole numbers.

    Attributes
    ----------
    pairs : ndarray, shape (4, n, W + margin), int32
        Of the view: neighbours, for :func:`sepi.vectors.weighted_pairs`.
    reference : ndarray, shape (4, W + margin), float32
        Times ``ONE``.
    channels : ndarray, shape (3, W + margin), int32
        Scratch; 0 in the margin.
    """

    pairs: npt.NDArray[np.int32]
    reference: FloatMap
    channels: npt.NDArray[np.int32]


class _Sums(NamedTuple):
    """Weighted sums of the residuals, and of the weights, of one row; (K, W + margin), float32."""

    cost: FloatMap
    weight: FloatMap


@njit(forceinline=True, borrows=True)
def _add_pixels(disparity: Any, y: int, begin: int, end: int, low: int, v: float, u: float, begun: Any) -> None:
    """Add pixels ``begin..end`` of row ``y`` of the reference view, one by one, as :func:`_add_row` does."""
    for x in range(begin, end):
        d = disparity[y, x]
        top, left = math.floor(y + 1 - low - d * v), math.floor(x + 1 - d * u)
        if 0 <= top < begun.shape[0] and 0 <= left < begun.shape[1]:
            begun[top, left] = max(begun[top, left], d)


@njit(cache=True, borrows=True)
def _add_row(disparity: Any, y: int, low: int, v: float, u: float, begun: Any) -> None:
    """Add a row of the reference view to what is nearest of the pixels whose square begins at a position of a view.

    Those of a smooth surface lie side by side in the view, too: eight are added at once.
    """
    W = disparity.shape[1]
    down, across, one = spread(np.float32(v)), spread(np.float32(u)), spread(np.float32(1))
    x = 0
    while x <= W - MARGIN:
        d = load(disparity, (y, x))
        top, left = math.floor(y + 1 - low - disparity[y, x] * v), math.floor(x + 1 - disparity[y, x] * u)
        # how far beyond where the first begins, of 0..1 if they lie side by side
        dy = spread(np.float32(y + 1 - low - top)) - d * down
        dx = spread(np.float32(x + 1 - left)) - d * across
        clear = least_of(smaller(smaller(dy, one - dy), smaller(dx, one - dx))) > ROUNDING
        if clear and 0 <= top < begun.shape[0] and left >= 0 and left + MARGIN <= begun.shape[1]:
            store(begun, (top, left), larger(load(begun, (top, left)), d))
        else:
            _add_pixels(disparity, y, x, x + MARGIN, low, v, u, begun)
        x += MARGIN
    _add_pixels(disparity, y, x, W, low, v, u, begun)


@njit(parallel=True, cache=True)
def z_buffers(disparity: Any, present: Any, baselines: Any, low: int, high: int) -> Any:
    """Disparity map of the reference view as each view sees it: the nearest of the pixels that touch a position.

    Parameters
    ----------
    disparity : ndarray, shape (H, W), float32
        Pixels per view step.
    present : ndarray, shape (T, S), bool
        Other views are left empty: their values are undefined.
    baselines : ndarray, shape (T, S, 2), float64
        Down and across from the reference view, in view steps.
    low, high : int
        The rows of the views that are wanted.

    Returns
    -------
    ndarray, shape (T, S, high - low, W), float32
        ``EMPTY`` where no pixel falls. A pixel occludes the up to four positions that its square touches, since a
        bilinear sample beside it reads its colour too.
    """
    T, S = present.shape
    H, W = disparity.shape
    # pixels side by side are loaded at once; vectors reach beyond the last
    disparity = np.ascontiguousarray(disparity)
    size = T * S * (high - low) * W
    nearest = np.empty(size + MARGIN, np.float32)[:size].reshape(T, S, high - low, W)
    least, most = float(disparity.min()), float(disparity.max())
    for view in prange(T * S):
        t, s = view // S, view % S
        if not present[t, s]:
            continue
        v, u = baselines[t, s, 0], baselines[t, s, 1]
        # rows farther away do not get here
        first = max(0, math.floor(low - 1 + min(least * v, most * v)))
        last = min(H, math.ceil(high + max(least * v, most * v)) + 1)
        # what is nearest of the pixels whose square begins here; of those that begin outside, too
        begun = np.full((high - low + 1, W + 1), EMPTY)
        for y in range(first, last):
            _add_row(disparity, y, low, v, u, begun)
        for row in range(high - low):
            above, here, out = begun[row], begun[row + 1], nearest[t, s, row]
            for x in range(W):
                out[x] = max(max(above[x], above[x + 1]), max(here[x], here[x + 1]))
    return nearest


@njit(parallel=True, cache=True)
def occluded_in_any_view(
    disparity: Any, present: Any, baselines: Any, nearest: Any, low: int, occlusion_margin: Any, begin: int, end: int
) -> Any:
    """Pixels that something nearer occludes in one of the views that could see them.

    Parameters
    ----------
    disparity, present, baselines
        As in :func:`z_buffers`.
    nearest : ndarray, shape (T, S, n, W), float32
        From :func:`z_buffers`, rows from ``low`` on.
    low : int
    occlusion_margin : float32
        By how much an occluder must be nearer, pixels per view step.
    begin, end : int
        The rows that are wanted.

    Returns
    -------
    ndarray, shape (end - begin, W), bool
    """
    T, S = present.shape
    H, W = disparity.shape
    occluded = np.zeros((end - begin, W), np.bool_)
    for y in prange(begin, end):
        for x in range(W):
            d = disparity[y, x]
            for t in range(T):
                for s in range(S):
                    row, column = y - d * baselines[t, s, 0] + 0.5, x - d * baselines[t, s, 1] + 0.5
                    if present[t, s] and row >= 0 and column >= 0 and row < H and column < W:
                        occluded[y - begin, x] |= nearest[t, s, int(row) - low, int(column)] > d + occlusion_margin
    return occluded


@njit(forceinline=True)
def _bilinear_weights(fy: Any, fx: Any) -> Any:
    """Weights of the pixel and its right neighbour, and of the two below; of sum ``ONE``."""
    below = int(fy * ONE + np.float32(0.5))
    right, lower_right = int((ONE - below) * fx + np.float32(0.5)), int(below * fx + np.float32(0.5))
    return weights(ONE - below - right, right), weights(below - lower_right, lower_right)


@njit(cache=True, fastmath=EXACT, error_model="numpy", borrows=True)
def _add_view(
    rows: _Rows, low: int, H: int, y: int, candidates: Candidates, r: int, c: int, nearest: Any,
    visibility: Visibility, robust: RobustCost, sums: _Sums,
) -> None:  # fmt: skip
    """Add one view, whose rows from ``low`` on are loaded, at every candidate of row ``y``.

    ``r``, ``c`` are the view's entries of the candidates, ``nearest`` is its z-buffer.
    """
    pairs, reference = rows.pairs, rows.reference
    W, one = reference.shape[1] - MARGIN, np.float32(1)
    scale_of_colours, scale_of_detail = spread(robust.scales2[0]), spread(robust.scales2[1])
    share_of_colours, share_of_detail = spread(robust.shares[0]), spread(robust.shares[1])
    for k in range(candidates.disparities.size):
        top, fy = upper_row(y, candidates.down[r, k], candidates.fy[r, k], H)
        left, fx = candidates.across[c, k], candidates.fx[c, k]
        # on the last column itself nothing beyond it is read with any weight
        first, last = max(0, -left), min(W, W - left if fx == 0 else W - 1 - left)
        if top < 0 or top > H - 2 or last <= first:
            continue
        upper, lower = _bilinear_weights(fy, fx)
        limit = spread(candidates.disparities[k] + visibility.occlusion_margin)
        row, column = top - visibility.low + (1 if fy > 0.5 else 0), left + (1 if fx > 0.5 else 0)
        whole, hidden, n = spread(one), spread(visibility.occluded_view_weight), top - low
        for x in range(first, last, MARGIN):
            if last - x < MARGIN:
                # pixels beyond the last add nothing to what others have added
                whole = first_elements(whole, last - x, np.float32(0))
                hidden = first_elements(hidden, last - x, np.float32(0))
            seen = whole
            if nearest.shape[1] > 0:
                before = load(nearest, (row, x + column))
                seen = at_most(before, limit, whole, hidden)
                if visibility.some_missing:
                    seen = at_most(spread(MISSING), before, spread(np.float32(0)), seen)
            i = x + left
            red = weighted_pairs(pairs, (0, n, i), (0, n + 1, i), upper, lower) - load(reference, (0, x))
            green = weighted_pairs(pairs, (1, n, i), (1, n + 1, i), upper, lower) - load(reference, (1, x))
            blue = weighted_pairs(pairs, (2, n, i), (2, n + 1, i), upper, lower) - load(reference, (2, x))
            detail = weighted_pairs(pairs, (3, n, i), (3, n + 1, i), upper, lower) - load(reference, (3, x))
            colours2, detail2 = fma(blue, blue, fma(green, green, red * red)), detail * detail
            # z / (z + scale) of either, by one division
            of_colours, of_detail = colours2 + scale_of_colours, detail2 + scale_of_detail
            both = fma(share_of_colours * colours2, of_detail, share_of_detail * detail2 * of_colours)
            store(sums.cost, (k, x), fma(seen, both / (of_colours * of_detail), load(sums.cost, (k, x))))
            store(sums.weight, (k, x), load(sums.weight, (k, x)) + seen)


@njit(forceinline=True, borrows=True)
def _load_colours(pixels: Any, t: int, s: int, row: int, scale: Any, channels: Any) -> None:
    """Row of a view as whole numbers, each channel by itself: ``channels (3, W + margin)``, int32."""
    W, factor = pixels.shape[3], spread(scale)
    for x in range(0, W - MARGIN + 1, MARGIN):
        red, green, blue = load_colours(pixels, (t, s, row, x, 0))
        store_rounded(channels, (0, x), red * factor)
        store_rounded(channels, (1, x), green * factor)
        store_rounded(channels, (2, x), blue * factor)
    for x in range(W - W % MARGIN, W):
        for c in range(3):
            channels[c, x] = np.rint(np.float32(pixels[t, s, row, x, c]) * scale)


@njit(inline="always")
def _pair(values: Any, out: Any) -> None:
    """Each value and its right neighbour in one number: what :func:`sepi.vectors.weighted_pairs` takes."""
    for x in range(out.size):
        out[x] = (np.int32(values[x]) & np.int32(0xFFFF)) | (np.int32(values[x + 1]) << np.int32(16))


@njit(cache=True, borrows=True)
def _load_view(views: BaseDetail, t: int, s: int, begin: int, end: int, rows: _Rows) -> None:
    """Rows ``begin..end`` of a view, colours and detail."""
    W = views.colours.shape[3]
    for row in range(begin, end):
        n = row - begin
        _load_colours(views.colours, t, s, row, views.colour_unit * np.float32(COLOUR_STEPS), rows.channels)
        for c in range(3):
            _pair(rows.channels[c], rows.pairs[c, n, :W])
        if views.detail.shape[2] > 0:
            detail = views.detail[t, s, row - views.low]
            _pair(detail, rows.pairs[3, n, : W - 1])
            rows.pairs[3, n, W - 1] = detail[W - 1]


@njit(cache=True, borrows=True)
def _load_reference(views: BaseDetail, y: int, rows: _Rows) -> None:
    """Row ``y`` of the reference view, times what the weights of samples sum to."""
    for x in range(views.guide.shape[1]):
        for c in range(3):
            rows.reference[c, x] = np.rint(views.guide[y, x, c] * np.float32(COLOUR_STEPS)) * np.float32(ONE)
        if views.reference_detail.shape[0] > 0:
            rows.reference[3, x] = np.int32(views.reference_detail[y - views.low, x]) * ONE


@njit(cache=True, fastmath=EXACT, error_model="numpy", borrows=True)
def _add_views(
    views: BaseDetail, visibility: Visibility, robust: RobustCost, candidates: Candidates, y: int, rows: _Rows,
    sums: _Sums,
) -> None:  # fmt: skip
    """Add all views to the sums of row ``y``."""
    T, S, H, _, _ = views.colours.shape
    _load_reference(views, y, rows)
    for t in range(T):
        for s in range(S):
            if not views.present[t, s] or (t == views.t0 and s == views.s0):
                continue
            r, c = candidates.row[t, s], candidates.column[t, s]
            one, other = y + candidates.down[r, 0], y + candidates.down[r, -1]
            low, high = max(0, min(H - 2, min(one, other))), max(0, min(H - 2, max(one, other))) + 2
            _load_view(views, t, s, low, high, rows)
            _add_view(rows, low, H, y, candidates, r, c, visibility.nearest[t, s], visibility, robust, sums)


@njit(parallel=True, cache=True, fastmath=EXACT, error_model="numpy")
def sweep_visible_rows(
    views: BaseDetail,
    visibility: Visibility,
    robust: RobustCost,
    candidates: Candidates,
    begin: int,
    end: int,
    cost: Any,
) -> None:
    """Cost of every candidate for rows ``begin..end``, over the views in which nothing nearer occludes the pixel.

    Parameters
    ----------
    views : BaseDetail
    visibility : Visibility
    robust : RobustCost
    candidates : Candidates
    begin, end : int
    cost : ndarray, shape (K, H, W), float32
        Rows ``begin..end`` are filled with costs of 0..1; 1 where no view is left.
    """
    H, W = views.colours.shape[2:4]
    K = candidates.disparities.size
    height = 2
    for r in range(candidates.down.shape[0]):
        height = min(H, max(height, abs(candidates.down[r, K - 1] - candidates.down[r, 0]) + 2))
    # in steps of the whole numbers; the detail counts as three equal channels
    scales2 = np.empty(2, np.float32)
    scales2[0] = robust.scales2[0] * (COLOUR_STEPS * ONE) ** 2
    scales2[1] = robust.scales2[1] * (ONE / views.detail_unit) ** 2 / 3
    scaled = RobustCost(scales2, robust.shares)
    for y in prange(begin, end):
        sums = _Sums(np.zeros((K, W + MARGIN), np.float32), np.zeros((K, W + MARGIN), np.float32))
        # where there is no detail it is 0, and fits
        rows = _Rows(
            np.zeros((4, height, W + MARGIN), np.int32),
            np.zeros((4, W + MARGIN), np.float32),
            np.zeros((3, W + MARGIN), np.int32),
        )
        _add_views(views, visibility, scaled, candidates, y, rows, sums)
        for k in range(K):
            for x in range(W):
                cost[k, y, x] = sums.cost[k, x] / sums.weight[k, x] if sums.weight[k, x] > 0 else np.float32(1)
