"""Second-order smoothing of a disparity map: second differences cost, so planes cost nothing.

Minimises ``sum_p w_p (d_p - z_p)^2 + sum_q c_q (D_q d)^2`` over disparities ``d``, where ``z`` is the data, ``w`` its
weight, and ``D_q`` the second differences along x, along y and mixed. ``c_q`` is small where the colours change, and
where reliable data has a large second difference. The system has 13 entries in a row, kept as a stencil instead of a
sparse matrix; :mod:`sepi.regularization.multilevel` solves it.

The variance of the map is the diagonal of the inverse of ``W + C``, the matrices of both sums: if ``W`` is the
information on each pixel, this inverse is the posterior covariance. With equal weights everywhere, a Fourier transform
makes the matrix diagonal, and the diagonal of its inverse is ``f(c / w) / w`` with

    f(r) = mean over frequencies of 1 / (1 + r (a^2 + b^2 + a b)),   a, b = 2 - 2 cos

for the second differences along x, along y and mixed. Real weights change slowly over the few pixels that affect a
pixel, so means over windows of that size replace the equal weights.
"""

from __future__ import annotations

from functools import cache
from itertools import combinations_with_replacement

import cv2
import numpy as np
import numpy.typing as npt

from sepi.image.noise import sum_of_channels
from sepi.kernels import second_order as kernels
from sepi.lightfield import FloatMap
from sepi.regularization.multilevel import MARGIN

FloatArray = npt.NDArray[np.floating]
# along x, along y and mixed: rows and columns of the pixels of a difference, and their factors
_DIFFERENCES = (
    (((0, 0), (0, 1), (0, 2)), (1.0, -2.0, 1.0)),
    (((0, 0), (1, 0), (2, 0)), (1.0, -2.0, 1.0)),
    (((0, 0), (0, 1), (1, 0), (1, 1)), (1.0, -1.0, -1.0, 1.0)),
)
# of the stencil's entries: rows and columns from one pixel to the other
_ENTRIES = ((0, 0), (0, 1), (0, 2), (1, 0), (2, 0), (1, 1), (1, -1))


# of the variance's approximation
_DATA_WINDOW, _SMOOTHNESS_WINDOW = 5, 3
"""Pixels over which weights are averaged; chosen by comparison with exact inverses."""

_FREQUENCIES = 128
_LEAST = 1e-8


def colour_changes(guide: FloatMap) -> list[FloatMap]:
    """Squared RGB distances within the second differences along x, along y and mixed.

    Parameters
    ----------
    guide : ndarray, shape (H, W, 3), float32
        Colours, 0..1.

    Returns
    -------
    list of ndarray, float32
        Of shapes (H, W - 2), (H - 2, W) and (H - 1, W - 1).
    """

    def squared(difference: FloatMap) -> FloatMap:
        return sum_of_channels(np.square(difference))

    right, down = (squared(np.diff(guide, axis=axis)) for axis in (1, 0))
    mixed = squared(guide[1:, 1:] - guide[:-1, :-1]) + squared(guide[:-1, 1:] - guide[1:, :-1])
    return [right[:, :-1] + right[:, 1:], down[:-1] + down[1:], mixed]


def upper_quartile(disparity: FloatMap) -> float:
    """Upper quartile of a map's absolute second differences along x and y; 0 for a map without any."""
    sizes = [np.abs(lines[:-2] - 2 * lines[1:-1] + lines[2:]).ravel() for lines in (disparity.T, disparity)]
    together = np.concatenate(sizes)
    place = 3 * together.size // 4
    return float(np.partition(together, place)[place]) if together.size else 0.0


def smoothness_weights(
    disparity: FloatMap, colours: list[FloatMap], reliability: FloatMap, threshold: float, colour_variance: float
) -> list[FloatMap]:
    """Weights of the second differences along x, along y and mixed, 0..1.

    Parameters
    ----------
    disparity : ndarray, shape (H, W), float32
        The data.
    colours : list of ndarray
        From :func:`colour_changes`.
    reliability : ndarray, shape (H, W), float32
        Trust in second differences of the data, 0..1.
    threshold : float
        Second difference of a discontinuity, pixels per view step.
    colour_variance : float
        Squared RGB distance that scales the weights.

    Returns
    -------
    list of ndarray, float32
        Of shapes (H, W - 2), (H - 2, W) and (H - 1, W - 1).
    """
    disparity, reliability = (np.ascontiguousarray(each, np.float32) for each in (disparity, reliability))

    def weight(corners: tuple[tuple[int, int], ...], factors: tuple[float, ...], colour: FloatMap) -> FloatMap:
        out, apart = np.empty(colour.shape, np.float32), np.ascontiguousarray(colour)
        where, how = np.array(corners), np.array(factors, np.float32)
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
    ndarray, shape (7, H + 2 MARGIN, W + 2 MARGIN), of the weights' type
        Entries of each pixel with itself and with the pixels to the right by 1 and 2, below by 1 and 2, below to the
        right, and below to the left; the matrix is symmetric. The margin is zero.
    """
    stencil = np.zeros((7, shape[0] + 2 * MARGIN, shape[1] + 2 * MARGIN), weights[0].dtype)
    for (corners, factors), weight in zip(_DIFFERENCES, weights, strict=True):
        height, width = weight.shape
        pairs = combinations_with_replacement(zip(corners, factors, strict=True), 2)
        for ((y, x), of_one), ((below, right), of_other) in pairs:
            entry = stencil[_ENTRIES.index((below - y, right - x)), MARGIN + y :, MARGIN + x :]
            entry[:height, :width] += of_one * of_other * weight
    return stencil


def inverse_diagonal(weight: FloatMap, smoothness: list[FloatMap]) -> FloatMap:
    """Diagonal of the inverse of the system of second-order smoothing, approximately.

    Parameters
    ----------
    weight : ndarray, shape (H, W), float32
        Weights of the data.
    smoothness : list of ndarray
        Weights of the second differences along x, along y and mixed, of shapes (H, W - 2), (H - 2, W) and
        (H - 1, W - 1).

    Returns
    -------
    ndarray, shape (H, W), float32
    """
    mean = np.zeros(weight.shape, np.float32)
    along_x, along_y, across = smoothness
    mean[:, 1:-1] += along_x
    mean[1:-1] += along_y
    mean[:-1, :-1] += across
    data = cv2.blur(weight, (_DATA_WINDOW,) * 2) + np.float32(_LEAST)
    smooth = cv2.blur(mean / 3, (_SMOOTHNESS_WINDOW,) * 2) + np.float32(_LEAST)
    ratios, share = _shares()
    return np.asarray(np.interp(np.log(smooth / data), ratios, share) / data, np.float32)


@cache
def _shares() -> tuple[FloatArray, FloatArray]:
    """Table of ``log r`` and ``f(r)``."""
    one = 2 - 2 * np.cos(np.pi * (np.arange(_FREQUENCIES) + 0.5) / _FREQUENCIES)
    a, b = one[:, None], one[None]
    differences = a**2 + b**2 + a * b
    ratios = np.linspace(np.log(1e-4), np.log(1e8), 49)
    return ratios, np.array([np.mean(1 / (1 + ratio * differences)) for ratio in np.exp(ratios)])
