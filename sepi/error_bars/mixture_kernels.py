"""Compiled loops of the error distribution (:mod:`sepi.error_bars.mixture`)."""

from __future__ import annotations

from typing import Any

import numpy as np

from sepi.compiled import njit, prange

NORMAL = np.sqrt(np.pi / 2)
"""Standard deviation of a normal distribution, over its mean absolute value."""

RIM_WIDTH = 0.2
"""Mean absolute deviation of the other surface's disparity, as part of its distance."""

LEAST_RIM = 0.01
"""The least of it, pixels per view step."""

_EVALUATIONS = 40
_FARTHEST = 1e12
"""No bound is farther away, pixels."""
_PRECISION = 1e-3
"""Of the bounds, relative; of the probability beyond them, too."""


@njit(forceinline=True)
def _beyond(x: float, width: float) -> tuple[float, float]:
    """Share of a Laplace distribution about 0 that lies above ``x``, and its density there."""
    half = float(0.5 * np.exp(-abs(x) / width))
    return half if x > 0 else 1 - half, half / width


@njit(forceinline=True)
def _share_above(above: float, below: float) -> float:
    """Part of the probability of the other surface that the nearer one has: the farther away, the likelier."""
    return float((above * above + 1e-6) / (above * above + below * below + 2e-6))


@njit(forceinline=True)
def _above(x: float, p: Any) -> tuple[float, float]:
    """Probability that the true disparity is more than ``x >= 0`` above the map's, and its density there."""
    scale, outlier_scale, outlier, rim, above, below = p
    core = (1 - outlier - rim) * 0.5 * np.exp(-x / scale)
    outliers = outlier * 0.5 * np.exp(-x / outlier_scale)
    share = _share_above(above, below)
    beyond, density = _beyond(x - above, RIM_WIDTH * above + LEAST_RIM)
    opposite, there = _beyond(x + below, RIM_WIDTH * below + LEAST_RIM)
    tail = core + outliers + rim * (share * beyond + (1 - share) * opposite)
    slope = core / scale + outliers / outlier_scale + rim * (share * density + (1 - share) * there)
    return float(tail), float(slope)


@njit(forceinline=True)
def _bound(tail: float, p: Any) -> float:
    """Distance above the map beyond which the truth lies with probability ``tail``.

    Newton's method for the logarithm, nearly a line, from where the heavier part alone would have its bound; halving
    what is left where it leads astray.
    """
    if _above(0.0, p)[0] <= tail:
        return 0.0
    scale, outlier_scale, outlier, rim = p[:4]
    x = scale * np.log(max((1 - outlier - rim) * 0.5 / tail, 1.1))
    x = max(x, outlier_scale * np.log(max(outlier * 0.5 / tail, 1e-9)))
    low, high = 0.0, _FARTHEST
    for _ in range(_EVALUATIONS):
        beyond, density = _above(x, p)
        f = np.log(beyond / tail)
        if abs(f) < _PRECISION:
            break
        if f > 0:
            low = x
        else:
            high = x
        if high - low <= _PRECISION * high:
            break
        x += f * beyond / density
        if not low < x < high:
            x = 2 * low if high == _FARTHEST else 0.5 * (low + high)
    return float(x)


@njit(forceinline=True)
def _expected(p: Any) -> float:
    """Expected absolute error."""
    scale, outlier_scale, outlier, rim, above, below = p
    share = _share_above(above, below)
    wide, deep = RIM_WIDTH * above + LEAST_RIM, RIM_WIDTH * below + LEAST_RIM
    other = share * (above + wide * np.exp(-above / wide)) + (1 - share) * (below + deep * np.exp(-below / deep))
    return float((1 - outlier - rim) * scale + outlier * outlier_scale + rim * other)


@njit(parallel=True, cache=True, error_model="numpy")
def describe(parameters: Any, tail: float, close: float, out: Any) -> None:
    """Standard deviation, bounds and probability of each pixel's error.

    Parameters
    ----------
    parameters : tuple of ndarray, shape (H, W), float32
        Those of :class:`sepi.error_bars.mixture.Mixture`.
    tail : float
        Probability beyond each bound.
    close : float
        Error that the probability is about.
    out : ndarray, shape (4, H, W), float32
        Filled: standard deviation, distance of the lower and of the upper bound, probability.
    """
    scale, outlier_scale, outlier, rim, above, below = parameters
    H, W = scale.shape
    for y in prange(H):
        for x in range(W):
            a, b = float(above[y, x]), float(below[y, x])
            same = float(scale[y, x]), float(outlier_scale[y, x]), float(outlier[y, x]), float(rim[y, x])
            upwards, downwards = (*same, a, b), (*same, b, a)
            out[0, y, x] = NORMAL * _expected(upwards)
            out[1, y, x] = _bound(tail, downwards)
            out[2, y, x] = _bound(tail, upwards)
            out[3, y, x] = max(0.0, 1 - _above(close, upwards)[0] - _above(close, downwards)[0])
