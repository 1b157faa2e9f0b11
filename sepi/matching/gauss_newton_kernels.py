"""Compiled loops of the Gauss-Newton refinement: cubic splines of the views, and sums over the views that see a pixel.

Spline coefficients are computed as in [1]_: a recursive filter along each axis, mirrored at the ends.

References
----------
.. [1] Unser: Splines, a perfect fit for signal and image processing. IEEE Signal Processing Magazine 16(6), 1999.
   doi:10.1109/79.799930
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt
from numba import njit, prange

from sepi.lightfield import FloatMap

EXACT = {"nnan", "ninf", "nsz"}
"""Fast-math flags that keep every rounding as written: see :mod:`sepi.matching.plane_sweep_kernels`."""

SPLINE_UNIT = np.float32(1 / 3400)
"""Unit of the spline coefficients, stored as int16; a checkerboard of -0.5 and 1.5 has some of +-9.5."""

_POLE = np.float32(math.sqrt(3) - 2)
_GAIN = np.float32((1 - (math.sqrt(3) - 2)) * (1 - 1 / (math.sqrt(3) - 2)))
_LAST = np.float32((math.sqrt(3) - 2) / ((math.sqrt(3) - 2) ** 2 - 1))
MARGIN = 2
"""Coefficients beyond each side of a view."""

_HORIZON = 16  # powers of the pole are below float32's precision from here on


class SplineViews(NamedTuple):
    """What a Gauss-Newton iteration needs of the views.

    Attributes
    ----------
    splines : ndarray, shape (T, S, H + 2 MARGIN, W + 2 MARGIN, C), int16
        Spline coefficients of colours and, where it has a share, detail: C is 3 or 6.
    reference : ndarray, shape (H, W, C), float32
        Colours, and detail, of the reference view.
    columns : ndarray, shape (N,), int64
        Column in the grid of each view that is present, but for the reference view.
    across : ndarray, shape (N,), float32
        Their baselines, in view steps.
    begins : ndarray, shape (R + 1,), int64
        Where among them each run of views begins that stand in one row and equally far down, and the end of the last
        one. What depends on the row of pixels alone is computed once for a run.
    rows : ndarray, shape (R,), int64
        Row in the grid of each run.
    down : ndarray, shape (R,), float32
        Their baselines, in view steps.
    scales2, shares : ndarray, shape (C / 3,), float32
        Square of the robust scale, and share in the cost, of colours and of detail.
    """

    splines: npt.NDArray[np.int16]
    reference: FloatMap
    columns: npt.NDArray[np.int64]
    across: FloatMap
    begins: npt.NDArray[np.int64]
    rows: npt.NDArray[np.int64]
    down: FloatMap
    scales2: FloatMap
    shares: FloatMap


@njit(inline="always")
def _weight_at_start(i: int, n: int) -> Any:
    """Weight of sample ``i`` of ``n`` in the first value of the causal filter; the line is mirrored for ever."""
    if n > _HORIZON:
        return _POLE**i if i < _HORIZON else np.float32(0)
    period = 2 * n - 2
    total = _POLE**i if i == 0 or i == n - 1 else _POLE**i + _POLE ** (period - i)
    return total / (np.float32(1) - _POLE**period)


@njit(cache=True)
def spline_coefficients(image: Any) -> Any:
    """Cubic spline coefficients of an image (H, W), float32; both at least 2."""
    H, W = image.shape
    out = image.astype(np.float32)
    for y in range(H):
        line = out[y]
        first = np.float32(0)
        for x in range(min(W, _HORIZON)):
            first += _weight_at_start(x, W) * line[x]
        line[0] = first * _GAIN
        for x in range(1, W):
            line[x] = _GAIN * line[x] + _POLE * line[x - 1]
        line[W - 1] = _LAST * (line[W - 1] + _POLE * line[W - 2])
        for x in range(W - 2, -1, -1):
            line[x] = _POLE * (line[x + 1] - line[x])
    # columns together: all rows are run through once forth and once back
    top = np.zeros(W, np.float32)
    for y in range(min(H, _HORIZON)):
        weight = np.float32(_weight_at_start(y, H))
        for x in range(W):
            top[x] += weight * out[y, x]
    for x in range(W):
        out[0, x] = top[x] * _GAIN
    for y in range(1, H):
        for x in range(W):
            out[y, x] = _GAIN * out[y, x] + _POLE * out[y - 1, x]
    for x in range(W):
        out[H - 1, x] = _LAST * (out[H - 1, x] + _POLE * out[H - 2, x])
    for y in range(H - 2, -1, -1):
        for x in range(W):
            out[y, x] = _POLE * (out[y + 1, x] - out[y, x])
    return out


@njit(inline="always")
def _mirrored(i: int, n: int) -> int:
    i = -i if i < 0 else i
    return max(0, 2 * (n - 1) - i) if i >= n else i


@njit(parallel=True, cache=True)
def view_splines(planes: Any, unit: Any, present: Any, first: int, out: Any) -> None:
    """Coefficients of every view's three channels, into channels ``first..first + 2`` of ``out``.

    Parameters
    ----------
    planes : ndarray, shape (T, S, 3, H, W)
    unit : float32
        What the values are multiplied with.
    present : ndarray, shape (T, S), bool
    first : int
    out : ndarray, shape (T, S, H + 2 MARGIN, W + 2 MARGIN, C), int16
        Mirrored in the margins.
    """
    T, S = present.shape
    for view in prange(T * S):
        t, s = view // S, view % S
        if present[t, s]:
            for c in range(3):
                plane = planes[t, s, c].astype(np.float32) * unit
                coefficients = spline_coefficients(plane)
                H, W = plane.shape
                for y in range(-MARGIN, H + MARGIN):
                    for x in range(-MARGIN, W + MARGIN):
                        value = coefficients[_mirrored(y, H), _mirrored(x, W)] / SPLINE_UNIT
                        out[t, s, y + MARGIN, x + MARGIN, first + c] = np.int16(math.floor(value + np.float32(0.5)))


@njit(inline="always")
def _spline_weights(f: Any) -> Any:
    """Weights of the four coefficients round a position, a fraction ``f`` after the second."""
    g = np.float32(1) - f
    sixth, half, two_thirds = np.float32(1 / 6), np.float32(0.5), np.float32(2 / 3)
    return (
        g * g * g * sixth,
        two_thirds - f * f * (np.float32(1) - f * half),
        two_thirds - g * g * (np.float32(1) - g * half),
        f * f * f * sixth,
    )


@njit(inline="always")
def _row(splines: Any, row: int, left: int, first: int, b: Any) -> Any:
    """Three channels at four coefficients of a row, weighted."""
    p, q, r, s = splines[row, left], splines[row, left + 1], splines[row, left + 2], splines[row, left + 3]
    return (
        b[0] * p[first] + b[1] * q[first] + b[2] * r[first] + b[3] * s[first],
        b[0] * p[first + 1] + b[1] * q[first + 1] + b[2] * r[first + 1] + b[3] * s[first + 1],
        b[0] * p[first + 2] + b[1] * q[first + 2] + b[2] * r[first + 2] + b[3] * s[first + 2],
    )


@njit(inline="always")
def _sample(splines: Any, first: int, top: int, left: int, a: Any, b: Any) -> Any:
    """Three channels of a view at a position inside it, by its whole pixels and the weights of its fractions."""
    # the margin of 2 and the one coefficient before
    p, q = _row(splines, top + 1, left + 1, first, b), _row(splines, top + 2, left + 1, first, b)
    r, s = _row(splines, top + 3, left + 1, first, b), _row(splines, top + 4, left + 1, first, b)
    return (
        (a[0] * p[0] + a[1] * q[0] + a[2] * r[0] + a[3] * s[0]) * SPLINE_UNIT,
        (a[0] * p[1] + a[1] * q[1] + a[2] * r[1] + a[3] * s[1]) * SPLINE_UNIT,
        (a[0] * p[2] + a[1] * q[2] + a[2] * r[2] + a[3] * s[2]) * SPLINE_UNIT,
    )


@njit(inline="always")
def _seen(y: Any, x: Any, nearest: Any, limit: Any) -> Any:
    """Whether a position lies in a view and nothing nearer occludes it."""
    H, W = nearest.shape
    return (
        y >= 0
        and x >= 0
        and y <= H - 1
        and x <= W - 1
        and nearest[int(y + np.float32(0.5)), int(x + np.float32(0.5))] <= limit
    )


@njit(inline="always")
def _three(values: Any, first: int) -> Any:
    return values[first], values[first + 1], values[first + 2]


@njit(inline="always")
def _add_to_mean(sample: Any, of: Any, scale2: Any, sums: Any) -> Any:
    """Sums of three channels and of the weights, with one more sample; ``of``: what it should be like."""
    v0, v1, v2 = sample
    m0, m1, m2 = of
    z = (v0 - m0) ** 2 + (v1 - m1) ** 2 + (v2 - m2) ** 2
    w = scale2 / (scale2 + z)
    w *= w
    return sums[0] + w * v0, sums[1] + w * v1, sums[2] + w * v2, sums[3] + w


@njit(parallel=True, cache=True, fastmath=EXACT, error_model="numpy")
def mean_of_views(views: SplineViews, disparity: Any, nearest: Any, occlusion_margin: Any) -> Any:
    """Mean of the views that see each pixel, those unlike the reference view counting less; shape (H, W, C), float32.

    Arguments as of :func:`sepi.matching.gauss_newton.view_mean`, the margin as float32.
    """
    H, W, C = views.reference.shape
    with_detail = C > 3
    second = 3 if with_detail else 0
    out = np.empty((H, W, C), np.float32)
    one = np.float32(1)
    for y in prange(H):
        for x in range(W):
            d, own = disparity[y, x], views.reference[y, x]
            limit = d + occlusion_margin
            colour, detail = _three(own, 0), _three(own, second)
            of_colour = colour[0], colour[1], colour[2], one
            of_detail = detail[0], detail[1], detail[2], one
            for r in range(views.down.size):
                t, fy = views.rows[r], np.float32(y) - d * views.down[r]
                top = int(fy)
                a = _spline_weights(np.float32(fy - top))
                for n in range(views.begins[r], views.begins[r + 1]):
                    s, fx = views.columns[n], np.float32(x) - d * views.across[n]
                    if not _seen(fy, fx, nearest[t, s], limit):
                        continue
                    left = int(fx)
                    b = _spline_weights(np.float32(fx - left))
                    splines = views.splines[t, s]
                    of_colour = _add_to_mean(_sample(splines, 0, top, left, a, b), colour, views.scales2[0], of_colour)
                    if with_detail:
                        of_detail = _add_to_mean(
                            _sample(splines, 3, top, left, a, b), detail, views.scales2[1], of_detail
                        )
            mean = out[y, x]
            mean[0], mean[1], mean[2] = (
                of_colour[0] / of_colour[3],
                of_colour[1] / of_colour[3],
                of_colour[2] / of_colour[3],
            )
            if with_detail:
                mean[3], mean[4], mean[5] = (
                    of_detail[0] / of_detail[3],
                    of_detail[1] / of_detail[3],
                    of_detail[2] / of_detail[3],
                )
    return out


@njit(inline="always")
def _add_to_equations(sample: Any, mean: Any, down: Any, across: Any, v: Any, u: Any, scale2: Any, sums: Any) -> Any:
    """Slope and curvature of the cost of three channels with one more sample, of a view of baseline ``(v, u)``."""
    r0, r1, r2 = sample[0] - mean[0], sample[1] - mean[1], sample[2] - mean[2]
    g0, g1, g2 = down[0] * v + across[0] * u, down[1] * v + across[1] * u, down[2] * v + across[2] * u
    # derivative of z / (z + scale2) with respect to z
    w = scale2 / (scale2 + r0 * r0 + r1 * r1 + r2 * r2)
    w *= w / scale2
    return sums[0] + w * (r0 * g0 + r1 * g1 + r2 * g2), sums[1] + w * (g0 * g0 + g1 * g1 + g2 * g2)


@njit(parallel=True, cache=True, fastmath=EXACT, error_model="numpy")
def normal_equations(
    views: SplineViews, disparity: Any, nearest: Any, occlusion_margin: Any, mean: Any, down: Any, across: Any
) -> Any:
    """Gauss-Newton sums of each pixel over the views that see it.

    Parameters
    ----------
    views, disparity, nearest, occlusion_margin
        As in :func:`mean_of_views`.
    mean, down, across : ndarray, shape (H, W, C), float32
        Mean of the views and its derivatives along y and x.

    Returns
    -------
    gradient, curvature : ndarray, shape (H, W), float32
        Their ratio is the update towards less cost, in pixels per view step.
    """
    H, W, C = mean.shape
    with_detail = C > 3
    second = 3 if with_detail else 0
    gradient, curvature = np.zeros((H, W), np.float32), np.zeros((H, W), np.float32)
    zero = np.float32(0)
    for y in prange(H):
        for x in range(W):
            d = disparity[y, x]
            limit = d + occlusion_margin
            colour, colour_down, colour_across = _three(mean[y, x], 0), _three(down[y, x], 0), _three(across[y, x], 0)
            detail = _three(mean[y, x], second)
            detail_down, detail_across = _three(down[y, x], second), _three(across[y, x], second)
            of_colour, of_detail = (zero, zero), (zero, zero)
            for r in range(views.down.size):
                t, v = views.rows[r], views.down[r]
                fy = np.float32(y) - d * v
                top = int(fy)
                a = _spline_weights(np.float32(fy - top))
                for n in range(views.begins[r], views.begins[r + 1]):
                    s, u = views.columns[n], views.across[n]
                    fx = np.float32(x) - d * u
                    if not _seen(fy, fx, nearest[t, s], limit):
                        continue
                    left = int(fx)
                    b = _spline_weights(np.float32(fx - left))
                    splines = views.splines[t, s]
                    of_colour = _add_to_equations(
                        _sample(splines, 0, top, left, a, b), colour, colour_down, colour_across, v, u,
                        views.scales2[0], of_colour,
                    )  # fmt: skip
                    if with_detail:
                        of_detail = _add_to_equations(
                            _sample(splines, 3, top, left, a, b), detail, detail_down, detail_across, v, u,
                            views.scales2[1], of_detail,
                        )  # fmt: skip
            gradient[y, x] += views.shares[0] * of_colour[0]
            curvature[y, x] += views.shares[0] * of_colour[1]
            if with_detail:
                gradient[y, x] += views.shares[1] * of_detail[0]
                curvature[y, x] += views.shares[1] * of_detail[1]
    return gradient, curvature
