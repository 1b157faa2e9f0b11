"""Compiled loops of the Gauss-Newton refinement: sums over the views that see a pixel.

A sample is a sum of 4x4 spline coefficients of four channels. The channels of a coefficient lie side by side, so that a
row of four of them is one vector of sixteen numbers: :func:`_weighted_sum` writes it down as such, since the compiler
does not find it.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt
from llvmlite import ir
from numba import types
from numba.core import cgutils
from numba.extending import intrinsic

from sepi.compiled import njit, prange
from sepi.lightfield import FloatMap

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


_FOUR: Any = types.UniTuple(types.float32, 4)  # type: ignore[no-untyped-call]
_declared: Any = cgutils.get_or_insert_function


def _vector_sum(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
    """LLVM code of :func:`_weighted_sum`."""
    splines, start, stride, a, b = arguments
    number, sixteen = ir.FloatType(), ir.VectorType(ir.FloatType(), 16)
    lane = ir.IntType(32)
    data = context.make_array(signature.args[0])(context, builder, splines).data

    def spread(values: list[Any], times: int) -> Any:
        """A vector of the values, each so many times."""
        few = ir.Constant(ir.VectorType(number, len(values)), ir.Undefined)
        for i, value in enumerate(values):
            few = builder.insert_element(few, value, lane(i))
        mask = ir.Constant(ir.VectorType(lane, 16), [lane(i // times) for i in range(16)])
        return builder.shuffle_vector(few, few, mask)

    def row(i: int) -> Any:
        place = builder.gep(data, [builder.add(start, builder.mul(stride, stride.type(i)))])
        packed = builder.load(builder.bitcast(place, ir.VectorType(ir.IntType(16), 16).as_pointer()), align=2)
        return builder.sitofp(packed, sixteen)

    multiply_add = _declared(builder.module, ir.FunctionType(sixteen, [sixteen] * 3), "llvm.fma.v16f32")
    down = [builder.extract_value(a, i) for i in range(4)]
    total = builder.fmul(spread(down[:1], 16), row(0))
    for i in range(1, 4):
        total = builder.call(multiply_add, [spread(down[i : i + 1], 16), row(i), total])
    total = builder.fmul(total, spread([builder.extract_value(b, i) for i in range(4)], 4))
    for half in (8, 4):
        parts = [
            builder.shuffle_vector(
                total, total, ir.Constant(ir.VectorType(lane, half), [lane(i + first) for i in range(half)])
            )
            for first in (0, half)
        ]
        total = builder.fadd(*parts)
    return context.make_tuple(
        builder, signature.return_type, [builder.extract_element(total, lane(i)) for i in range(4)]
    )


def _typed_sum(_context: Any, splines: Any, start: Any, stride: Any, a: Any, b: Any) -> Any:
    return _FOUR(splines, types.int64, types.int64, _FOUR, _FOUR), _vector_sum


_weighted_sum: Any = intrinsic(_typed_sum)
"""``sum_ij a[i] b[j] c[start + i stride + 4 j : ... + 4]`` over an array ``c`` of int16; four float32."""


@njit(forceinline=True)
def _spline_weights(f: Any, unit: Any) -> Any:
    """Weights of the four coefficients round a position, a fraction ``f`` after the second, times ``unit``."""
    g = np.float32(1) - f
    sixth, half, two_thirds = np.float32(1 / 6), np.float32(0.5), np.float32(2 / 3)
    return (
        g * g * g * sixth * unit,
        (two_thirds - f * f * (np.float32(1) - f * half)) * unit,
        (two_thirds - g * g * (np.float32(1) - g * half)) * unit,
        f * f * f * sixth * unit,
    )


@njit(forceinline=True)
def _is_seen(views: SplineViews, seeing: Seeing, n: int, shape: Any, fy: Any, fx: Any, d: Any) -> bool:
    """Whether position ``(fy, fx)`` lies in view ``n``, and nothing nearer than ``d`` occludes it."""
    H, W = shape
    half = np.float32(0.5)
    if fy < 0 or fy > H - 1 or fx < 0 or fx > W - 1:
        return False
    nearest: Any = seeing.nearest[views.places[n, 0], views.places[n, 1]]
    return bool(nearest[int(fy + half) - views.low, int(fx + half)] <= d + seeing.occlusion_margin)


@njit(forceinline=True)
def _sample(views: SplineViews, n: int, fy: Any, fx: Any) -> Any:
    """Four channels of view ``n`` at a position inside it."""
    _, S, rows, columns, _ = views.splines.shape
    top, left, stride = int(fy), int(fx), 4 * columns
    a = _spline_weights(fy - np.float32(top), views.unit)
    b = _spline_weights(fx - np.float32(left), np.float32(1))
    view = views.places[n, 0] * S + views.places[n, 1]
    # the margin, less the one coefficient before
    start = (view * rows + top - views.low + 1) * stride + 4 * (left + 1)
    return _weighted_sum(views.splines, start, stride, a, b)


@njit(forceinline=True)
def _robust_weight(z: Any, scale2: Any) -> Any:
    """Derivative of ``z / (z + scale2)`` with respect to ``z``, times ``scale2``: 1 for 0."""
    w = scale2 / (scale2 + z)
    return w * w


@njit(forceinline=True)
def _add_to_mean(views: SplineViews, n: int, y: int, seeing: Seeing, disparity: Any, sums: Any) -> None:
    """Add view ``n`` to a row of pixels; ``sums (W, 6)``: of the four channels, and of their weights."""
    v, u = views.baselines[n]
    for x in range(disparity.shape[1]):
        d = disparity[y, x]
        fy, fx = np.float32(y) - d * v, np.float32(x) - d * u
        if not _is_seen(views, seeing, n, disparity.shape, fy, fx, d):
            continue
        v0, v1, v2, v3 = _sample(views, n, fy, fx)
        own, total = views.reference[y, x], sums[x]
        w = _robust_weight((v0 - own[0]) ** 2 + (v1 - own[1]) ** 2 + (v2 - own[2]) ** 2, views.scales2[0])
        total[0] += w * v0
        total[1] += w * v1
        total[2] += w * v2
        total[4] += w
        w = _robust_weight(np.float32(3) * (v3 - own[3]) ** 2, views.scales2[1])
        total[3] += w * v3
        total[5] += w


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
        # a view after the other: its four rows stay in the first cache
        sums = np.ones((W, 6), np.float32)
        sums[:, :4] = views.reference[y]
        for n in range(len(views.places)):
            _add_to_mean(views, n, y, seeing, disparity, sums)
        for x in range(W):
            for c in range(4):
                out[y, x, c] = sums[x, c] / sums[x, 4 if c < 3 else 5]


@njit(forceinline=True)
def _terms(views: SplineViews, n: int, at: Any, v: Any, u: Any, m: Any, p: Any, q: Any) -> Any:
    """What view ``n`` of baseline ``(v, u)`` adds for a pixel that it sees at ``at``: by the mean and its derivatives.

    Slope, curvature, squared residual and weight of colours; slope, curvature and weight of detail.
    """
    three = np.float32(3)
    v0, v1, v2, v3 = _sample(views, n, at[0], at[1])
    r0, r1, r2, r3 = v0 - m[0], v1 - m[1], v2 - m[2], v3 - m[3]
    g0, g1, g2, g3 = p[0] * v + q[0] * u, p[1] * v + q[1] * u, p[2] * v + q[2] * u, p[3] * v + q[3] * u
    z = r0 * r0 + r1 * r1 + r2 * r2
    w, w3 = _robust_weight(z, views.scales2[0]), three * _robust_weight(three * r3 * r3, views.scales2[1])
    slope, curve = w * (r0 * g0 + r1 * g1 + r2 * g2), w * (g0 * g0 + g1 * g1 + g2 * g2)
    return slope, curve, z, w, w3 * r3 * g3, w3 * g3 * g3, w3


@njit(forceinline=True)
def _add_to_equations(
    views: SplineViews, n: int, y: int, seeing: Seeing, disparity: Any, image: Any, sums: Any
) -> None:
    """Add view ``n`` to a row of pixels; ``image``: the mean and its derivatives; ``sums (W, 4)``: slope and curvature
    of colours and of detail.
    """
    mean, down, across = image
    v, u = views.baselines[n]
    for x in range(disparity.shape[1]):
        d = disparity[y, x]
        at = np.float32(y) - d * v, np.float32(x) - d * u
        if not _is_seen(views, seeing, n, disparity.shape, at[0], at[1], d):
            continue
        slope, curve, _, _, slope3, curve3, _ = _terms(views, n, at, v, u, mean[y, x], down[y, x], across[y, x])
        total = sums[x]
        total[0] += slope
        total[1] += curve
        total[2] += slope3
        total[3] += curve3


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
    colour, detail = views.shares[0] / views.scales2[0], views.shares[1] / views.scales2[1]
    for y in prange(begin, end):
        sums = np.zeros((W, 4), np.float32)
        for n in range(len(views.places)):
            _add_to_equations(views, n, y, seeing, disparity, image, sums)
        for x in range(W):
            gradient[y, x] = colour * sums[x, 0] + detail * sums[x, 2]
            curvature[y, x] = colour * sums[x, 1] + detail * sums[x, 3]


@njit(forceinline=True)
def _add_to_evidence(
    views: SplineViews, n: int, y: int, seeing: Seeing, disparity: Any, image: Any, sums: Any, halves: Any, more: Any
) -> None:
    """As :func:`_add_to_equations`; and to a row of the halves ``(W, 4, 2)``, and ``more (W, 4)``."""
    mean, down, across = image
    v, u = views.baselines[n]
    zero, colour, detail = np.float32(0), views.shares[0] / views.scales2[0], views.shares[1] / views.scales2[1]
    # left or right, above or below
    side, end = 0 if u < zero else 1, 2 if v < zero else 3
    for x in range(disparity.shape[1]):
        d = disparity[y, x]
        at = np.float32(y) - d * v, np.float32(x) - d * u
        if not _is_seen(views, seeing, n, disparity.shape, at[0], at[1], d):
            continue
        slope, curve, z, w, slope3, curve3, w3 = _terms(views, n, at, v, u, mean[y, x], down[y, x], across[y, x])
        total, rest = sums[x], more[x]
        total[0] += slope
        total[1] += curve
        total[2] += slope3
        total[3] += curve3
        rest[0] += w * z
        rest[1] += w
        rest[2] += w3 / np.float32(3)
        rest[3] += np.float32(1)
        slope, curve = colour * slope + detail * slope3, colour * curve + detail * curve3
        if u != zero:
            halves[x, side, 0] += slope
            halves[x, side, 1] += curve
        if v != zero:
            halves[x, end, 0] += slope
            halves[x, end, 1] += curve


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
    colour, detail = views.shares[0] / views.scales2[0], views.shares[1] / views.scales2[1]
    for y in prange(begin, end):
        sums, halves = np.zeros((W, 4), np.float32), np.zeros((W, 4, 2), np.float32)
        more = np.zeros((W, 4), np.float32)
        for n in range(len(views.places)):
            _add_to_evidence(views, n, y, seeing, disparity, image, sums, halves, more)
        for x in range(W):
            gradient[y, x] = colour * sums[x, 0] + detail * sums[x, 2]
            curvature[y, x] = colour * sums[x, 1] + detail * sums[x, 3]
            for i in range(4):
                all_halves[i, 0, y, x], all_halves[i, 1, y, x] = halves[x, i, 0], halves[x, i, 1]
                rest[i, y, x] = more[x, i]
