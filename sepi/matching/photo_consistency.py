"""Compiled photo-consistency: how well each candidate disparity fits the views, for one row of the picture.

One ``(candidate, view)`` has one sub-pixel weight for the whole picture, so a row is a run of contiguous multiply-adds
that vectorises. Candidates next to each other mostly read the same pixels with other weights; of colour pictures, two
are done at once.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt
from numba import njit


def sample_offsets(
    disparities: npt.NDArray[np.float32], steps: npt.NDArray[np.int64]
) -> tuple[npt.NDArray[np.int64], npt.NDArray[np.float32]]:
    """Whole and fractional pixels from a reference pixel to its sample, along one axis: ``-d`` times the view step.

    Parameters
    ----------
    disparities : ndarray, shape (K,), float32
    steps : ndarray, shape (N,), int
        Views from the reference view, along the axis.

    Returns
    -------
    whole : ndarray, shape (N, K), int64
    fraction : ndarray, shape (N, K), float32
        0..1.
    """
    offset = -disparities.astype(np.float64) * steps[:, None]
    whole = np.floor(offset)
    return whole.astype(np.int64), (offset - whole).astype(np.float32)


@njit(inline="always")
def _weights(fy: Any, fx: Any) -> Any:
    """Bilinear weights of the pixel, its right neighbour, and the two below."""
    # a plain 1 is a 64-bit number, and would make all that follows 64 bits wide
    ry, rx = np.float32(1) - fy, np.float32(1) - fx
    return ry * rx, ry * fx, fy * rx, fy * fx


@njit(inline="always")
def _add_gray(out: Any, a: Any, b: Any, g: Any, w: Any, scale2: Any) -> None:
    """Add the robust residual of one run of pixels, one channel; ``a``, ``b``: rows above and below the samples."""
    for x in range(out.size):
        r = w[0] * a[x] + w[1] * a[x + 1] + w[2] * b[x] + w[3] * b[x + 1] - g[x]
        r2 = r * r
        out[x] += r2 / (r2 + scale2)


@njit(inline="always")
def _add_rgb(out: Any, a0: Any, b0: Any, a1: Any, b1: Any, a2: Any, b2: Any, g: Any, w: Any, scale2: Any) -> None:
    """Add the robust residual of one run of pixels, three channels."""
    for x in range(out.size):
        r0 = w[0] * a0[x] + w[1] * a0[x + 1] + w[2] * b0[x] + w[3] * b0[x + 1] - g[0][x]
        r1 = w[0] * a1[x] + w[1] * a1[x + 1] + w[2] * b1[x] + w[3] * b1[x + 1] - g[1][x]
        r2 = w[0] * a2[x] + w[1] * a2[x + 1] + w[2] * b2[x] + w[3] * b2[x + 1] - g[2][x]
        z = r0 * r0 + r1 * r1 + r2 * r2
        out[x] += z / (z + scale2)


@njit(inline="always")
def _add_two_rgb(
    out: Any, other: Any, a0: Any, b0: Any, a1: Any, b1: Any, a2: Any, b2: Any, g: Any, w: Any, v: Any, scale2: Any
) -> None:
    """:func:`_add_rgb` of two candidates that read the same pixels: each is loaded once for both."""
    for x in range(out.size):
        r0 = w[0] * a0[x] + w[1] * a0[x + 1] + w[2] * b0[x] + w[3] * b0[x + 1] - g[0][x]
        r1 = w[0] * a1[x] + w[1] * a1[x + 1] + w[2] * b1[x] + w[3] * b1[x + 1] - g[1][x]
        r2 = w[0] * a2[x] + w[1] * a2[x + 1] + w[2] * b2[x] + w[3] * b2[x + 1] - g[2][x]
        q0 = v[0] * a0[x] + v[1] * a0[x + 1] + v[2] * b0[x] + v[3] * b0[x + 1] - g[0][x]
        q1 = v[0] * a1[x] + v[1] * a1[x + 1] + v[2] * b1[x] + v[3] * b1[x + 1] - g[1][x]
        q2 = v[0] * a2[x] + v[1] * a2[x + 1] + v[2] * b2[x] + v[3] * b2[x + 1] - g[2][x]
        z = r0 * r0 + r1 * r1 + r2 * r2
        o = q0 * q0 + q1 * q1 + q2 * q2
        out[x] += z / (z + scale2)
        other[x] += o / (o + scale2)


@njit(cache=True, fastmath=True, error_model="numpy")
def _add_view(
    band: Any, low: int, reference_view: Any, y: int, begin: int, end: int, down: Any, fy: Any, across: Any, fx: Any, H:
    int, scale2: Any, cost: Any,
) -> None:  # fmt: skip
    """Add the residuals of one view, whose rows from ``low`` on are in ``band (C, rows, W)``, to ``cost (K, n)``."""
    C, _, W = band.shape
    K = down.size
    k = 0
    while k < K:
        here = k
        k += 1
        top, below = y + down[here], fy[here]
        if top == H - 1 and below == 0:
            # the last row has none below: seen from the one above
            top, below = H - 2, np.float32(1)
        left = across[here]
        # run of pixels whose sample lies inside the view
        first, last = max(begin, -left), min(end, W - 1 - left)
        if top < 0 or top > H - 2 or last <= first:
            continue
        n, i, j = top - low, first + left, last + left
        w = _weights(below, fx[here])
        out = cost[here, first - begin : last - begin]
        if C == 1:
            _add_gray(out, band[0, n, i : j + 1], band[0, n + 1, i : j + 1], reference_view[0, first:last], w, scale2)
            continue
        g = (reference_view[0, first:last], reference_view[1, first:last], reference_view[2, first:last])
        if k < K and across[k] == left and y + down[k] == top:
            v = _weights(fy[k], fx[k])
            _add_two_rgb(
                out, cost[k, first - begin : last - begin],
                band[0, n, i : j + 1], band[0, n + 1, i : j + 1], band[1, n, i : j + 1],
                band[1, n + 1, i : j + 1], band[2, n, i : j + 1], band[2, n + 1, i : j + 1], g, w, v, scale2,
            )  # fmt: skip
            k += 1
        else:
            _add_rgb(
                out, band[0, n, i : j + 1], band[0, n + 1, i : j + 1], band[1, n, i : j + 1],
                band[1, n + 1, i : j + 1], band[2, n, i : j + 1], band[2, n + 1, i : j + 1], g, w, scale2,
            )  # fmt: skip


@njit(cache=True, fastmath=True, error_model="numpy")
def cost_row(
    views: Any, t0: int, s0: int, groups: Any, y: int, begin: int, end: int, down: Any, fy: Any, across: Any, fx: Any,
    scale2: Any, cost: Any,
) -> None:  # fmt: skip
    """Photo-consistency of columns ``begin..end`` of row ``y``, summed over each group of views, for every candidate.

    Parameters
    ----------
    views : ndarray, shape (T, S, C, H, W)
        C is 1 or 3.
    t0, s0 : int
        Place of the reference view.
    groups : ndarray, shape (T, S), int
    y, begin, end : int
    down, across : ndarray, shape (T, K) and (S, K), int
        Whole pixels from a reference pixel to its sample, of each view row and each view column.
    fy, fx : ndarray, shape (T, K) and (S, K), float32
        Fractional pixels.
    scale2 : float32
        Square of the robust scale, in the views' units.
    cost : ndarray, shape (G, K, n), float32
        The first ``end - begin`` columns are filled with the sum of the robust residuals (each 0..1).
    """
    T, S, C, H, W = views.shape
    cost[:, :, : end - begin] = 0
    reference_view = views[t0, s0, :, y].astype(np.float32)
    # rows and columns that any candidate touches, converted once for all candidates
    rows = 2
    for t in range(T):
        rows = max(rows, down[t].max() - down[t].min() + 2)
    band = np.empty((C, min(H, rows), W), np.float32)
    for t in range(T):
        low = max(0, min(H - 2, y + down[t].min()))
        high = max(0, min(H - 2, y + down[t].max())) + 1
        for s in range(S):
            g = groups[t, s]
            if g < 0:
                continue
            leftmost, rightmost = max(0, begin + across[s].min()), min(W, end + across[s].max() + 1)
            for c in range(C):
                for row in range(low, high + 1):
                    band[c, row - low, leftmost:rightmost] = views[t, s, c, row, leftmost:rightmost]
            _add_view(band, low, reference_view, y, begin, end, down[t], fy[t], across[s], fx[s], H, scale2, cost[g])


@njit(cache=True, error_model="numpy")
def count_views(
    groups: Any, H: int, W: int, y: int, begin: int, end: int, down: Any, fy: Any, across: Any, counts: Any
) -> None:
    """Number of views of each group that see columns ``begin..end`` of row ``y`` at each candidate.

    Parameters
    ----------
    groups : ndarray, shape (T, S), int
    H, W : int
        Size of the picture.
    y, begin, end : int
    down, fy, across : ndarray
        As in :func:`cost_row`.
    counts : ndarray, shape (n, G K), float32
        The first ``end - begin`` pixels are filled.
    """
    T, S = groups.shape
    K = down.shape[1]
    G = counts.shape[1] // K
    # views of each group and view column that have the row, at each candidate
    having = np.zeros((G, S, K), np.float32)
    some = np.zeros((G, S), np.bool_)
    for t in range(T):
        for s in range(S):
            g = groups[t, s]
            if g < 0:
                continue
            some[g, s] = True
            for k in range(K):
                top = y + down[t, k]
                if top >= 0 and (top < H - 1 or (top == H - 1 and fy[t, k] == 0)):
                    having[g, s, k] += np.float32(1)
    for x in range(begin, end):
        counts[x - begin] = 0
        for g in range(G):
            number = counts[x - begin, g * K : (g + 1) * K]
            for s in range(S):
                if some[g, s]:
                    left, of_column = across[s], having[g, s]
                    for k in range(K):
                        inside = x + left[k] >= 0 and x + left[k] < W - 1
                        number[k] += of_column[k] if inside else np.float32(0)
