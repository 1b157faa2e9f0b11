"""Variance of a smoothed disparity map: the diagonal of the inverse of its system, approximated locally.

Second-order smoothing (:mod:`sepi.regularization.second_order`) solves ``(W + C) d = W z``. If ``W`` is the information
on each pixel, the inverse of the matrix is the posterior covariance. With equal weights everywhere, a Fourier transform
makes the matrix diagonal, and the diagonal of its inverse is ``f(c / w) / w`` with

    f(r) = mean over frequencies of 1 / (1 + r (a^2 + b^2 + a b)),   a, b = 2 - 2 cos

for the second differences along x, along y and mixed. Real weights change slowly over the few pixels that affect a
pixel, so means over windows of that size replace the equal weights.
"""

from __future__ import annotations

from functools import cache

import cv2
import numpy as np
import numpy.typing as npt

from sepi.lightfield import FloatMap

_DATA_WINDOW, _SMOOTHNESS_WINDOW = 5, 3
"""Pixels over which weights are averaged; chosen by comparison with exact inverses."""

_FREQUENCIES = 128
_LEAST = 1e-8


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
def _shares() -> tuple[npt.NDArray[np.float64], npt.NDArray[np.float64]]:
    """Table of ``log r`` and ``f(r)``."""
    one = 2 - 2 * np.cos(np.pi * (np.arange(_FREQUENCIES) + 0.5) / _FREQUENCIES)
    a, b = one[:, None], one[None]
    differences = a**2 + b**2 + a * b
    ratios = np.linspace(np.log(1e-4), np.log(1e8), 49)
    return ratios, np.array([np.mean(1 / (1 + ratio * differences)) for ratio in np.exp(ratios)])
