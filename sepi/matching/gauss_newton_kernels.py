"""Compiled loops of the Gauss-Newton refinement: sums over the views that see a pixel.

Samples of splines are made pixel by pixel, in vectors of four channels (:mod:`sepi.matching.spline_sums`). All else is
done for many pixels of a row at once, in loops that the compiler makes vectors of: what they read and write are lines
of one array, since only then it knows that these do not overlap.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from sepi.compiled import njit, prange
from sepi.lightfield import FloatMap
from sepi.matching.spline_sums import weighted_sum

EXACT = {"nnan", "ninf", "nsz"}
"""Fast-math flags that keep every rounding as written: see :mod:`sepi.matching.plane_sweep_kernels`."""


class SplineViews(NamedTuple):
    """What a Gauss-Newton iteration needs of the views, and of some of their rows.

    Attributes
    ----------
    splines : ndarray, shape (T, S, n + 4, W + 4, 4), int16
        Spline coefficients of colours and detail (:mod:`sepi.matching.spline_kernels`), with a margin of 2; zero where
        the detail has no share.
    unit : float32
        What they are multiplied with.
    low : int
        The row after the margin.
    reference : ndarray, shape (H, W, 4), float32
        Colours and detail of the reference view.
    places : ndarray, shape (N, 2), int64
        Row and column in the grid of each view that is compared, but for the reference view.
    baselines : ndarray, shape (N, 2), float32
        Theirs, down and across, in view steps.
    scales2, shares : ndarray, shape (2,), float32
        Square of the robust scale, and share in the cost, of colours and of detail.
    """

    splines: npt.NDArray[np.int16]
    unit: np.float32
    low: int
    reference: FloatMap
    places: npt.NDArray[np.int64]
    baselines: FloatMap
    scales2: FloatMap
    shares: FloatMap


class Seeing(NamedTuple):
    """Where views are hidden.

    Attributes
    ----------
    nearest : ndarray, shape (T, S, n, W), float32
        What is nearest in the views (:func:`sepi.matching.nearest_surfaces.nearest_surfaces`), rows from the splines'
        ``low`` on.
    occlusion_margin : float32
        By how much an occluder must be nearer, pixels per view step.
    """

    nearest: FloatMap
    occlusion_margin: np.float32


ONE = 1 << 15
"""The sum of the weights of coefficients, along either axis."""

AT_ONCE = 128
"""Pixels of a row that are done together; all that is known of them stays in the first cache."""

# Lines of the scratch array, each a number of every pixel: where a view sees it, the four channels there, and whether
# the view sees it...
_Y, _X, _VALUES, _SEEN = 0, 1, 2, 6
# (and, in another, of whole numbers, after six lines of weights: where its coefficients, and what hides it, are)
_COEFFICIENT, _NEAREST = 6, 7
# ...what the channels are compared with, and its derivatives...
_OWN, _SLOPE_DOWN, _SLOPE_ACROSS = 7, 11, 15
# ...and sums over the views: of the weighted channels and the weights, or of the equations and the evidence
_SUMS = 19
_HALVES = _SUMS + 4
_REST = _HALVES + 8
_LINES = _REST + 4


@njit(forceinline=True)
def _whole_weights(position: Any) -> Any:
    """Weights of the four coefficients round a position, whole numbers of sum ``ONE``."""
    scale, half = np.float32(ONE), np.float32(0.5)
    f = position - np.float32(np.int32(position))
    g = np.float32(1) - f
    before = np.int32(g * g * g * (scale / np.float32(6)) + half)
    after = np.int32(f * f * f * (scale / np.float32(6)) + half)
    left = np.int32((np.float32(2 / 3) - f * f * (np.float32(1) - f * half)) * scale + half)
    right = np.int32((np.float32(2 / 3) - g * g * (np.float32(1) - g * half)) * scale + half)
    # what rounding leaves belongs to the larger, so that a mirrored picture is sampled alike
    rest = np.int32(ONE) - before - left - right - after
    nearer = left >= right
    return before, left + (rest if nearer else np.int32(0)), right + (np.int32(0) if nearer else rest), after


@njit(forceinline=True)
def _spline_weights(s: Any, weights: Any, count: int) -> None:
    """Lines of the weights, in pairs of 16-bit numbers.

    Of the four rows each twice, and of the columns the first two and the other two.
    """
    low = np.int32(0xFFFF)
    for i in range(count):
        a, b, c, d = _whole_weights(s[_Y * AT_ONCE + i])
        weights[i] = (a & low) | (a << np.int32(16))
        weights[AT_ONCE + i] = (b & low) | (b << np.int32(16))
        weights[2 * AT_ONCE + i] = (c & low) | (c << np.int32(16))
        weights[3 * AT_ONCE + i] = (d & low) | (d << np.int32(16))
        a, b, c, d = _whole_weights(s[_X * AT_ONCE + i])
        weights[4 * AT_ONCE + i] = (a & low) | (b << np.int32(16))
        weights[5 * AT_ONCE + i] = (c & low) | (d << np.int32(16))


@njit(forceinline=True)
def _find_places(s: Any, whole: Any, H: int, W: int, stride: Any, count: int) -> None:
    """Lines of where each position is in a view's coefficients and z-buffer; there -1 outside the picture."""
    half, four, width = np.float32(0.5), np.int32(4), np.int32(W)
    bottom, right = np.float32(H - 1), np.float32(W - 1)
    for i in range(count):
        fy, fx = s[_Y * AT_ONCE + i], s[_X * AT_ONCE + i]
        whole[_COEFFICIENT * AT_ONCE + i] = np.int32(fy) * stride + np.int32(fx) * four
        inside = (fy >= 0) & (fy <= bottom) & (fx >= 0) & (fx <= right)
        whole[_NEAREST * AT_ONCE + i] = np.int32(fy + half) * width + np.int32(fx + half) if inside else np.int32(-1)


@njit(forceinline=True)
def _four(s: Any, first: int, i: int) -> Any:
    at = first * AT_ONCE + i
    return s[at], s[at + AT_ONCE], s[at + 2 * AT_ONCE], s[at + 3 * AT_ONCE]


@njit(cache=True, fastmath=EXACT, error_model="numpy", borrows=True)
def _sample(
    views: SplineViews, n: int, y: int, x: int, seeing: Seeing, disparity: Any, s: Any, whole: Any, count: int
) -> None:
    """Where view ``n`` sees each pixel of a piece of row ``y``, its four channels there, and whether nothing hides it.

    Zero where it does not see it. The piece begins at column ``x``.
    """
    H, W = disparity.shape
    _, S, rows, columns, _ = views.splines.shape
    v, u = views.baselines[n]
    t, c = views.places[n, 0], views.places[n, 1]
    for i in range(count):
        s[_Y * AT_ONCE + i] = np.float32(y) - disparity[y, x + i] * v
        s[_X * AT_ONCE + i] = np.float32(x + i) - disparity[y, x + i] * u
    _spline_weights(s, whole, count)
    _find_places(s, whole, H, W, np.int32(4 * columns), count)
    nearest: Any = seeing.nearest.reshape(seeing.nearest.size)
    # the first row of the picture, and the margin, less the one coefficient before
    above = ((t * S + c) * seeing.nearest.shape[2] - views.low) * W
    start = ((t * S + c) * rows + 1 - views.low) * 4 * columns + 4
    for i in range(count):
        values = np.float32(0), np.float32(0), np.float32(0), np.float32(0)
        place = whole[_NEAREST * AT_ONCE + i]
        seen = np.float32(0)
        # without a sign it is not looked for from the end
        if place >= 0 and nearest[np.uint64(above + place)] <= disparity[y, x + i] + seeing.occlusion_margin:
            at = start + whole[_COEFFICIENT * AT_ONCE + i]
            values = weighted_sum(views.splines, at, 4 * columns, whole, i, AT_ONCE, views.unit / np.float32(ONE))
            seen = np.float32(1)
        s[_SEEN * AT_ONCE + i] = seen
        for c in range(4):
            s[(_VALUES + c) * AT_ONCE + i] = values[c]


@njit(forceinline=True)
def _robust_weight(z: Any, scale2: Any) -> Any:
    """Derivative of ``z / (z + scale2)`` with respect to ``z``, times ``scale2``: 1 for 0."""
    w = scale2 / (scale2 + z)
    return w * w


@njit(forceinline=True)
def _residual(s: Any, c: int, i: int) -> Any:
    return s[(_VALUES + c) * AT_ONCE + i] - s[(_OWN + c) * AT_ONCE + i]


@njit(forceinline=True)
def _load(image: Any, y: int, x: int, s: Any, first: int, count: int) -> None:
    """The four channels of a piece of row ``y`` of an image (H, W, 4), as lines from ``first`` on."""
    for i in range(count):
        for c in range(4):
            s[(first + c) * AT_ONCE + i] = image[y, x + i, c]


@njit(cache=True, fastmath=EXACT, error_model="numpy")
def _add_to_mean(s: Any, scales2: Any, count: int) -> None:
    """Add the samples of a view to the sums: of the four channels, of the colours' weights, and of the detail's."""
    colour, detail, three = scales2[0], scales2[1], np.float32(3)
    for i in range(count):
        r0, r1, r2, r3 = _residual(s, 0, i), _residual(s, 1, i), _residual(s, 2, i), _residual(s, 3, i)
        seen = s[_SEEN * AT_ONCE + i]
        w = seen * _robust_weight(r0 * r0 + r1 * r1 + r2 * r2, colour)
        s[_SUMS * AT_ONCE + i] += w * s[_VALUES * AT_ONCE + i]
        s[(_SUMS + 1) * AT_ONCE + i] += w * s[(_VALUES + 1) * AT_ONCE + i]
        s[(_SUMS + 2) * AT_ONCE + i] += w * s[(_VALUES + 2) * AT_ONCE + i]
        s[(_SUMS + 4) * AT_ONCE + i] += w
        w = seen * _robust_weight(three * (r3 * r3), detail)
        s[(_SUMS + 3) * AT_ONCE + i] += w * s[(_VALUES + 3) * AT_ONCE + i]
        s[(_SUMS + 5) * AT_ONCE + i] += w


@njit(parallel=True, cache=True, fastmath=EXACT, error_model="numpy")
def mean_of_views(views: SplineViews, seeing: Seeing, disparity: Any, begin: int, end: int, out: Any) -> None:
    """Mean of the views that see each pixel, those unlike the reference view counting less.

    Parameters
    ----------
    views : SplineViews
    seeing : Seeing
    disparity : ndarray, shape (H, W), float32
        Pixels per view step.
    begin, end : int
        The rows that are done.
    out : ndarray, shape (H, W, 4), float32
        Filled in these rows.
    """
    W = disparity.shape[1]
    for y in prange(begin, end):
        s, whole = np.empty(_LINES * AT_ONCE, np.float32), np.empty(8 * AT_ONCE, np.int32)
        for x in range(0, W, AT_ONCE):
            count = min(AT_ONCE, W - x)
            _load(views.reference, y, x, s, _OWN, count)
            # the reference view itself counts in full
            s[_SUMS * AT_ONCE : (_SUMS + 4) * AT_ONCE] = s[_OWN * AT_ONCE : (_OWN + 4) * AT_ONCE]
            s[(_SUMS + 4) * AT_ONCE : (_SUMS + 6) * AT_ONCE] = np.float32(1)
            for n in range(len(views.places)):
                _sample(views, n, y, x, seeing, disparity, s, whole, count)
                _add_to_mean(s, views.scales2, count)
            for i in range(count):
                for c in range(4):
                    out[y, x + i, c] = s[(_SUMS + c) * AT_ONCE + i] / s[(_SUMS + (4 if c < 3 else 5)) * AT_ONCE + i]


@njit(forceinline=True)
def _slope(s: Any, c: int, i: int, v: Any, u: Any) -> Any:
    return s[(_SLOPE_DOWN + c) * AT_ONCE + i] * v + s[(_SLOPE_ACROSS + c) * AT_ONCE + i] * u


@njit(forceinline=True)
def _terms(s: Any, i: int, v: Any, u: Any, scales2: Any) -> Any:
    """What a view of baseline ``(v, u)`` adds for a pixel.

    Slope, curvature, squared residual and weight of colours; slope, curvature and weight of detail.
    """
    three, seen = np.float32(3), s[_SEEN * AT_ONCE + i]
    r0, r1, r2, r3 = _residual(s, 0, i), _residual(s, 1, i), _residual(s, 2, i), _residual(s, 3, i)
    g0, g1, g2, g3 = _slope(s, 0, i, v, u), _slope(s, 1, i, v, u), _slope(s, 2, i, v, u), _slope(s, 3, i, v, u)
    z = r0 * r0 + r1 * r1 + r2 * r2
    w, w3 = seen * _robust_weight(z, scales2[0]), seen * (three * _robust_weight(three * r3 * r3, scales2[1]))
    slope, curve = w * (r0 * g0 + r1 * g1 + r2 * g2), w * (g0 * g0 + g1 * g1 + g2 * g2)
    return slope, curve, z, w, w3 * r3 * g3, w3 * g3 * g3, w3


@njit(cache=True, fastmath=EXACT, error_model="numpy")
def _add_to_equations(s: Any, v: Any, u: Any, scales2: Any, count: int) -> None:
    """Add the samples of a view to the sums: slope and curvature of colours and of detail."""
    for i in range(count):
        slope, curve, _, _, slope3, curve3, _ = _terms(s, i, v, u, scales2)
        s[_SUMS * AT_ONCE + i] += slope
        s[(_SUMS + 1) * AT_ONCE + i] += curve
        s[(_SUMS + 2) * AT_ONCE + i] += slope3
        s[(_SUMS + 3) * AT_ONCE + i] += curve3


@njit(forceinline=True)
def _begin_equations(image: Any, y: int, x: int, s: Any, count: int) -> None:
    """The mean of the views and its derivatives in a piece of row ``y``, and sums of nothing."""
    mean, down, across = image
    _load(mean, y, x, s, _OWN, count)
    _load(down, y, x, s, _SLOPE_DOWN, count)
    _load(across, y, x, s, _SLOPE_ACROSS, count)
    s[_SUMS * AT_ONCE :] = np.float32(0)


@njit(forceinline=True)
def _write_equations(s: Any, views: SplineViews, y: int, x: int, count: int, gradient: Any, curvature: Any) -> None:
    """The sums of a piece of row ``y``, colours and detail by their shares."""
    colour, detail = views.shares[0] / views.scales2[0], views.shares[1] / views.scales2[1]
    for i in range(count):
        slope, curve, slope3, curve3 = _four(s, _SUMS, i)
        gradient[y, x + i] = colour * slope + detail * slope3
        curvature[y, x + i] = colour * curve + detail * curve3


@njit(parallel=True, cache=True, fastmath=EXACT, error_model="numpy")
def normal_equations(
    views: SplineViews, seeing: Seeing, disparity: Any, image: Any, begin: int, end: int, gradient: Any, curvature: Any
) -> None:
    """Gauss-Newton sums of each pixel over the views that see it.

    Parameters
    ----------
    views, seeing, disparity, begin, end
        As in :func:`mean_of_views`.
    image : tuple of ndarray, shape (H, W, 4), float32
        Mean of the views and its derivatives along y and x.
    gradient, curvature : ndarray, shape (H, W), float32
        Filled in these rows. Their ratio is the update towards less cost, in pixels per view step.
    """
    W = disparity.shape[1]
    for y in prange(begin, end):
        s, whole = np.empty(_LINES * AT_ONCE, np.float32), np.empty(8 * AT_ONCE, np.int32)
        for x in range(0, W, AT_ONCE):
            count = min(AT_ONCE, W - x)
            _begin_equations(image, y, x, s, count)
            for n in range(len(views.places)):
                _sample(views, n, y, x, seeing, disparity, s, whole, count)
                _add_to_equations(s, views.baselines[n, 0], views.baselines[n, 1], views.scales2, count)
            _write_equations(s, views, y, x, count, gradient, curvature)


@njit(cache=True, fastmath=EXACT, error_model="numpy")
def _add_to_evidence(s: Any, v: Any, u: Any, scales2: Any, shares: Any, count: int) -> None:
    """As :func:`_add_to_equations`; and to those of each half of the views, and to the rest of the evidence."""
    three, colour, detail = np.float32(3), shares[0] / scales2[0], shares[1] / scales2[1]
    # to which of the halves the view belongs: where lines begin must not depend on it
    left, right, above, below = np.float32(u < 0), np.float32(u > 0), np.float32(v < 0), np.float32(v > 0)
    for i in range(count):
        slope, curve, z, w, slope3, curve3, w3 = _terms(s, i, v, u, scales2)
        s[_SUMS * AT_ONCE + i] += slope
        s[(_SUMS + 1) * AT_ONCE + i] += curve
        s[(_SUMS + 2) * AT_ONCE + i] += slope3
        s[(_SUMS + 3) * AT_ONCE + i] += curve3
        s[_REST * AT_ONCE + i] += w * z
        s[(_REST + 1) * AT_ONCE + i] += w
        s[(_REST + 2) * AT_ONCE + i] += w3 / three
        s[(_REST + 3) * AT_ONCE + i] += s[_SEEN * AT_ONCE + i]
        slope, curve = colour * slope + detail * slope3, colour * curve + detail * curve3
        s[_HALVES * AT_ONCE + i] += left * slope
        s[(_HALVES + 1) * AT_ONCE + i] += left * curve
        s[(_HALVES + 2) * AT_ONCE + i] += right * slope
        s[(_HALVES + 3) * AT_ONCE + i] += right * curve
        s[(_HALVES + 4) * AT_ONCE + i] += above * slope
        s[(_HALVES + 5) * AT_ONCE + i] += above * curve
        s[(_HALVES + 6) * AT_ONCE + i] += below * slope
        s[(_HALVES + 7) * AT_ONCE + i] += below * curve


@njit(parallel=True, cache=True, fastmath=EXACT, error_model="numpy")
def equations_and_evidence(
    views: SplineViews,
    seeing: Seeing,
    disparity: Any,
    image: Any,
    begin: int,
    end: int,
    gradient: Any,
    curvature: Any,
    all_halves: Any,
    rest: Any,
) -> None:
    """:func:`normal_equations`, and what else the views say, filled in these rows.

    Parameters
    ----------
    views, seeing, disparity, image, begin, end, gradient, curvature
        As there.
    all_halves : ndarray, shape (4, 2, H, W), float32
        Those of :class:`Evidence`.
    rest : ndarray, shape (4, H, W), float32
        The other maps of it.
    """
    W = disparity.shape[1]
    for y in prange(begin, end):
        s, whole = np.empty(_LINES * AT_ONCE, np.float32), np.empty(8 * AT_ONCE, np.int32)
        for x in range(0, W, AT_ONCE):
            count = min(AT_ONCE, W - x)
            _begin_equations(image, y, x, s, count)
            for n in range(len(views.places)):
                _sample(views, n, y, x, seeing, disparity, s, whole, count)
                _add_to_evidence(s, views.baselines[n, 0], views.baselines[n, 1], views.scales2, views.shares, count)
            _write_equations(s, views, y, x, count, gradient, curvature)
            for i in range(count):
                for k in range(4):
                    all_halves[k, 0, y, x + i] = s[(_HALVES + 2 * k) * AT_ONCE + i]
                    all_halves[k, 1, y, x + i] = s[(_HALVES + 2 * k + 1) * AT_ONCE + i]
                    rest[k, y, x + i] = s[(_REST + k) * AT_ONCE + i]
