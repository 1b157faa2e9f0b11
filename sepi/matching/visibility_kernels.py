"""Compiled loops of the visibility sweep: z-buffers of every view, and costs over the views that see a pixel."""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np

from sepi.compiled import fma, njit, prange
from sepi.lightfield import FloatMap
from sepi.matching.base_detail import BaseDetail

EXACT = {"nnan", "ninf", "nsz"}
"""Fast-math flags that keep every rounding as written: see :mod:`sepi.matching.plane_sweep_kernels`."""

EMPTY = np.float32(-1e9)
"""Disparity in a z-buffer where no pixel of the reference view falls: nothing is nearer."""

MISSING = np.float32(1e9)
"""The same where the view shows nothing: not even a view that hides a pixel counts less."""


class Visibility(NamedTuple):
    """In which views a pixel is seen.

    Attributes
    ----------
    nearest : ndarray, shape (T, S, n, W) or (T, S, n, 0), float32
        From :func:`sepi.matching.nearest_surfaces.nearest_surfaces`; empty: all views see all pixels.
    low : int
        First row of ``nearest``.
    occlusion_margin : float32
        By how much an occluder must be nearer, pixels per view step.
    occluded_view_weight : float32
        Weight of a view in which the pixel is occluded; none where the view has no pixel.
    """

    nearest: FloatMap
    low: int
    occlusion_margin: np.float32
    occluded_view_weight: np.float32


class RobustCost(NamedTuple):
    """Square of the robust scale, and share in the cost, of colours and of detail; shape (2,), float32."""

    scales2: FloatMap
    shares: FloatMap


class _View(NamedTuple):
    """A view of baseline ``(v, u)``, and the row ``y`` of the reference view whose costs are computed.

    ``band (3 or 4, rows, W + 1)`` holds the rows from ``low`` on of its colours and detail.
    """

    v: float
    u: float
    y: int
    low: int
    band: FloatMap


class _Sums(NamedTuple):
    """Weighted sums of the residuals, and of the weights, of one row; (K, W), float32. ``seen (W,)`` is scratch."""

    cost: FloatMap
    weight: FloatMap
    seen: FloatMap


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
    nearest = np.empty((T, S, high - low, W), np.float32)
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
        top, left = np.empty(W, np.int32), np.empty(W, np.int32)
        for y in range(first, last):
            for x in range(W):
                d = disparity[y, x]
                top[x] = np.int32(np.floor(y + 1 - low - d * v))
                left[x] = np.int32(np.floor(x + 1 - d * u))
            for x in range(W):
                if 0 <= top[x] <= high - low and 0 <= left[x] <= W:
                    begun[top[x], left[x]] = max(begun[top[x], left[x]], disparity[y, x])
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


@njit(inline="always")
def _residual(a: Any, b: Any, reference: Any, w: Any, x: int) -> Any:
    """Difference of a bilinear sample and its reference pixel; ``a``, ``b``: rows above and below the samples."""
    return fma(w[3], b[x + 1], fma(w[2], b[x], fma(w[1], a[x + 1], fma(w[0], a[x], -reference[x]))))


@njit(inline="always")
def _add_colours(out: Any, a: Any, b: Any, reference: Any, seen: Any, w: Any, scale2: Any, share: Any) -> None:
    """Add the robust residuals of one run of pixels; ``a``, ``b``, ``reference``: a row for each channel."""
    a0, a1, a2 = a
    b0, b1, b2 = b
    g0, g1, g2 = reference
    for x in range(out.size):
        r0, r1, r2 = _residual(a0, b0, g0, w, x), _residual(a1, b1, g1, w, x), _residual(a2, b2, g2, w, x)
        z = fma(r2, r2, fma(r1, r1, r0 * r0))
        out[x] += share * seen[x] * z / (z + scale2)


@njit(inline="always")
def _add_detail(out: Any, a: Any, b: Any, reference: Any, seen: Any, w: Any, scale2: Any, share: Any) -> None:
    """:func:`_add_colours` of the detail, which is one channel that counts as three equal ones."""
    for x in range(out.size):
        r = _residual(a, b, reference, w, x)
        z = np.float32(3) * r * r
        out[x] += share * seen[x] * z / (z + scale2)


@njit(inline="always")
def _channels(rows: Any, row: int, begin: int, end: int) -> Any:
    """Columns ``begin..end`` of a row of ``rows (3, n, W)``, for each channel."""
    return rows[0, row, begin:end], rows[1, row, begin:end], rows[2, row, begin:end]


@njit(cache=True, fastmath=EXACT, error_model="numpy")
def _add_view(
    view: _View, H: int, reference: Any, disparities: Any, nearest: Any, visibility: Visibility, robust: RobustCost,
    sums: _Sums,
) -> None:  # fmt: skip
    """Add one view at every candidate; ``reference (3 or 4, W)``, ``nearest``: the view's own z-buffer."""
    W = reference.shape[1]
    v, u, y, low, band = view
    cost, weight, scratch = sums
    margin, hidden = visibility.occlusion_margin, visibility.occluded_view_weight
    one, none = np.float32(1), np.float32(0)
    for k in range(disparities.size):
        d = disparities[k]
        down, across = y - d * v, -d * u
        if down < 0 or down > H - 1:
            continue
        top, left = min(int(down), H - 2), math.floor(across)
        fy, fx = np.float32(down - top), np.float32(across - left)
        # on the last column itself nothing beyond it is read with any weight
        first, last = max(0, -left), min(W, W - left if fx == 0 else W - 1 - left)
        if last <= first:
            continue
        n, i, j = top - low, first + left, last + left + 1
        seen = scratch[first:last]
        if nearest.shape[1] == 0:
            seen[:] = one
        else:
            right = 1 if fx > 0.5 else 0
            before = nearest[top - visibility.low + (1 if fy > 0.5 else 0), i + right : last + left + right]
            limit = np.float32(d + margin)
            for x in range(seen.size):
                seen[x] = one if before[x] <= limit else (hidden if before[x] < MISSING else none)
        count = weight[k, first:last]
        for x in range(seen.size):
            count[x] += seen[x]
        w = ((one - fy) * (one - fx), (one - fy) * fx, fy * (one - fx), fy * fx)
        _add_colours(
            cost[k, first:last], _channels(band, n, i, j), _channels(band, n + 1, i, j),
            (reference[0, first:last], reference[1, first:last], reference[2, first:last]),
            seen, w, robust.scales2[0], robust.shares[0],
        )  # fmt: skip
        if reference.shape[0] > 3:
            _add_detail(
                cost[k, first:last], band[3, n, i:j], band[3, n + 1, i:j], reference[3, first:last],
                seen, w, robust.scales2[1], robust.shares[1],
            )  # fmt: skip


@njit(inline="always")
def _load_colours(pixels: Any, unit: Any, r: Any, g: Any, b: Any) -> None:
    """A row of a view ``(W, 3)``; three channels at once, so that the loop vectorises."""
    for x in range(r.size):
        r[x] = np.float32(pixels[x, 0]) * unit
        g[x] = np.float32(pixels[x, 1]) * unit
        b[x] = np.float32(pixels[x, 2]) * unit


@njit(inline="always")
def _load(row: Any, unit: Any, out: Any) -> None:
    for x in range(out.size):
        out[x] = np.float32(row[x]) * unit


@njit(parallel=True, cache=True, fastmath=EXACT, error_model="numpy")
def sweep_visible_rows(
    views: BaseDetail, visibility: Visibility, robust: RobustCost, disparities: Any, begin: int, end: int, cost: Any
) -> None:
    """Cost of every candidate for rows ``begin..end``, over the views in which nothing nearer occludes the pixel.

    Parameters
    ----------
    views : BaseDetail
    visibility : Visibility
    robust : RobustCost
    disparities : ndarray, shape (K,), float32
    begin, end : int
    cost : ndarray, shape (K, H, W), float32
        Rows ``begin..end`` are filled with costs of 0..1; 1 where no view is left.
    """
    T, S, H, W, _ = views.colours.shape
    t0, s0 = views.t0, views.s0
    K = disparities.size
    with_detail = views.detail.shape[2] > 0
    channels = 4 if with_detail else 3
    reach = max(abs(disparities[0]), abs(disparities[K - 1])) * np.abs(views.baselines[:, :, 0]).max()
    rows = min(H, 2 * math.ceil(reach) + 3)
    for y in prange(begin, end):
        sums = _Sums(np.zeros((K, W), np.float32), np.zeros((K, W), np.float32), np.empty(W, np.float32))
        reference = np.empty((channels, W), np.float32)
        # one column more, which is read but weighs nothing
        band = np.zeros((channels, rows, W + 1), np.float32)
        _load_colours(views.colours[t0, s0, y], views.colour_unit, reference[0], reference[1], reference[2])
        if with_detail:
            _load(views.detail[t0, s0, y - views.low], views.detail_unit, reference[3])
        for t in range(T):
            for s in range(S):
                if not views.present[t, s] or (t == t0 and s == s0):
                    continue
                v, u = views.baselines[t, s, 0], views.baselines[t, s, 1]
                ends = (y - disparities[0] * v, y - disparities[K - 1] * v)
                low = max(0, min(H - 2, math.floor(min(ends))))
                high = max(0, min(H - 2, math.floor(max(ends)))) + 1
                for row in range(low, high + 1):
                    r, g, b = band[0, row - low, :W], band[1, row - low, :W], band[2, row - low, :W]
                    _load_colours(views.colours[t, s, row], views.colour_unit, r, g, b)
                    if with_detail:
                        _load(views.detail[t, s, row - views.low], views.detail_unit, band[3, row - low, :W])
                view = _View(v, u, y, low, band)
                _add_view(view, H, reference, disparities, visibility.nearest[t, s], visibility, robust, sums)
        for k in range(K):
            for x in range(W):
                cost[k, y, x] = sums.cost[k, x] / sums.weight[k, x] if sums.weight[k, x] > 0 else np.float32(1)
