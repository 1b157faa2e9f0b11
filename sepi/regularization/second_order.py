"""Second-order smoothing of a disparity map: planes are free, second differences cost, and the data counts by what it
knows.

Minimises ``sum_p w_p (d_p - z_p)^2 + sum_q c_q (D_q d)^2`` over disparities ``d``, where ``z`` is the data, ``w`` its
weight, and ``D_q`` the second differences along x, along y and across; ``c_q`` is small where that of the data is
large, unless the data there is worth little, and where the colours change. The system has 13 entries a row, a stencil
that is never put into a sparse matrix, and is solved in :mod:`sepi.regularization.multilevel`.
"""

from __future__ import annotations

from itertools import combinations_with_replacement
from typing import Any

import numpy as np
import numpy.typing as npt

from sepi.kernels import second_order as kernels
from sepi.lightfield import FloatMap
from sepi.regularization.multilevel import conjugate_gradients, multilevel_inverse

FloatArray = npt.NDArray[np.float64]
Corner = tuple[slice, slice]

_ALL = slice(None)
# first, middle, last pixel of second differences along x and y; corners of the mixed difference
_ALONG_X = ((_ALL, slice(None, -2)), (_ALL, slice(1, -1)), (_ALL, slice(2, None)))
_ALONG_Y = ((slice(None, -2), _ALL), (slice(1, -1), _ALL), (slice(2, None), _ALL))
_BACK, _ON = slice(None, -1), slice(1, None)
_ACROSS = ((_BACK, _BACK), (_BACK, _ON), (_ON, _BACK), (_ON, _ON))

MARGIN: int = kernels.MARGIN
"""How far second differences reach, pixels: so wide are the zeros round the pictures of the solver."""

LEAST_SINGLE_RTOL = 1e-5
"""Residual down to which single precision is enough for the solver."""

# along x, along y and across: rows and columns of the pixels that make a difference, and their factors
_DIFFERENCES = (
    (((0, 0), (0, 1), (0, 2)), (1.0, -2.0, 1.0)),
    (((0, 0), (1, 0), (2, 0)), (1.0, -2.0, 1.0)),
    (((0, 0), (0, 1), (1, 0), (1, 1)), (1.0, -1.0, -1.0, 1.0)),
)
# of the stencil: rows and columns from a pixel to the other that an entry belongs to
_ENTRIES = ((0, 0), (0, 1), (0, 2), (1, 0), (2, 0), (1, 1), (1, -1))


def colour_changes(guide: FloatMap) -> list[FloatArray]:
    """Squared RGB distances within the second differences along x, along y and across.

    Parameters
    ----------
    guide : ndarray, shape (H, W, 3), float32
        Colours, 0..1.

    Returns
    -------
    list of ndarray
        Of shapes (H, W - 2), (H - 2, W) and (H - 1, W - 1).
    """

    def distance(one: Corner, other: Corner) -> FloatArray:
        difference = guide[one] - guide[other]
        return np.asarray(np.einsum("hwc,hwc->hw", difference, difference), np.float64)

    right, down = distance((_ALL, _BACK), (_ALL, _ON)), distance((_BACK, _ALL), (_ON, _ALL))
    return [
        right[:, :-1] + right[:, 1:],
        down[:-1] + down[1:],
        distance(_ACROSS[0], _ACROSS[3]) + distance(_ACROSS[1], _ACROSS[2]),
    ]


def upper_quartile(disparity: FloatMap) -> float:
    """That of the second differences of a map (H, W) along x and y, without their signs; 0 of a map of few pixels."""
    sizes = [
        np.abs(disparity[first] - 2 * disparity[middle] + disparity[last]).ravel()
        for first, middle, last in (_ALONG_X, _ALONG_Y)
    ]
    together = np.concatenate(sizes)
    place = 3 * together.size // 4
    return float(np.partition(together, place)[place]) if together.size else 0.0


def smoothness_weights(
    disparity: FloatMap, colours: list[FloatArray], reliability: FloatMap, threshold: float, colour_variance: float
) -> list[FloatArray]:
    """Weights of the second differences along x, along y and across, 0..1.

    Parameters
    ----------
    disparity : ndarray, shape (H, W), float32
        The data.
    colours : list of ndarray
        From :func:`colour_changes`.
    reliability : ndarray, shape (H, W), float32
        0..1: how far a second difference of the data is believed.
    threshold : float
        Second difference that counts as a discontinuity, pixels per view step.
    colour_variance : float
        Squared RGB distance at which smoothness falls.

    Returns
    -------
    list of ndarray
        Of shapes (H, W - 2), (H - 2, W) and (H - 1, W - 1).
    """
    disparity, reliability = (np.ascontiguousarray(each, np.float32) for each in (disparity, reliability))

    def weight(corners: tuple[tuple[int, int], ...], factors: tuple[float, ...], colour: FloatArray) -> FloatArray:
        out, apart = np.empty(colour.shape), np.ascontiguousarray(colour, np.float64)
        where, how = np.array(corners), np.array(factors)
        kernels.weights_of_differences(disparity, reliability, apart, where, how, threshold, colour_variance, out)
        return out

    return [weight(*of, colour) for of, colour in zip(_DIFFERENCES, colours, strict=True)]


def second_difference_stencil(weights: list[FloatArray], shape: tuple[int, int]) -> FloatArray:
    """Matrix of the smoothness term, ``A``: ``d^T A d`` is the weighted sum of squared second differences.

    Parameters
    ----------
    weights : list of ndarray
        From :func:`smoothness_weights`.
    shape : tuple of int
        ``(H, W)``.

    Returns
    -------
    ndarray, shape (7, H + 2 MARGIN, W + 2 MARGIN), float64
        Entries of each pixel with itself and with those to the right by 1 and 2, below by 1 and 2, below to the right,
        and below to the left; the matrix is symmetric. With a margin of zeros of :data:`MARGIN` pixels.
    """
    stencil = np.zeros((7, shape[0] + 2 * MARGIN, shape[1] + 2 * MARGIN))
    for (corners, factors), weight in zip(_DIFFERENCES, weights, strict=True):
        height, width = weight.shape
        pairs = combinations_with_replacement(zip(corners, factors, strict=True), 2)
        for ((y, x), of_one), ((below, right), of_other) in pairs:
            entry = stencil[_ENTRIES.index((below - y, right - x)), MARGIN + y :, MARGIN + x :]
            entry[:height, :width] += of_one * of_other * weight
    return stencil


def solve_smooth(
    smoothness: FloatArray, weight: FloatMap, data: FloatMap, start: FloatMap, rtol: float, max_iterations: int
) -> FloatMap:
    """Disparities of least energy.

    Parameters
    ----------
    smoothness : ndarray, shape (7, H + 2 MARGIN, W + 2 MARGIN), float64
        From :func:`second_difference_stencil`, times the strength; the data's weights are added to it.
    weight, data : ndarray, shape (H, W), float32
        ``w`` and ``z``.
    start : ndarray, shape (H, W), float32
        Where the solver starts.
    rtol : float
        Residual, relative to the data's deviations from their mean, at which the solver stops.
    max_iterations : int
        Steps after which it stops anyway.

    Returns
    -------
    ndarray, shape (H, W), float32
    """
    if not weight.any():
        # nothing holds any surface
        return data
    w = weight.astype(np.float64) + 1e-9
    # smoothness does not know constants: without the mean, the rtol does not depend on where zero lies
    mean = np.average(data, weights=w)
    inside = np.s_[MARGIN:-MARGIN, MARGIN:-MARGIN]
    # half the memory to go through, a third of the time; the solution is the same to a hundredth of its own error
    dtype: Any = np.float32 if rtol >= LEAST_SINGLE_RTOL else np.float64
    smoothness[0][inside] += w
    packed = smoothness.astype(dtype)
    inverse = multilevel_inverse(smoothness, dtype)
    # it is large, and goes unless the caller holds it
    del smoothness
    right, first = np.zeros((2, *packed.shape[1:]), dtype)
    right[inside], first[inside] = w * (data - mean), start - mean
    solution = conjugate_gradients(packed, inverse, right, first, rtol, max_iterations)
    return np.asarray(solution[inside] + mean, np.float32)
