"""Compiled loops over the pixels of superpixels (:mod:`sepi.regularization.planes`)."""

from __future__ import annotations

from typing import Any

import numpy as np

from sepi.compiled import njit, prange


@njit(cache=True, borrows=True)
def add_normal_equations(labels: Any, design: Any, weight: Any, disparity: Any, left: Any, right: Any) -> None:
    """Weighted least squares of each superpixel's data.

    Parameters
    ----------
    labels : ndarray, shape (H * W,), int64
    design : ndarray, shape (H * W, 3), float64
        Value of each of the three plane parameters at the pixel.
    weight, disparity : ndarray, shape (H * W,), float32
    left, right : ndarray, shapes (N, 3, 3) and (N, 3), float64
        Zero; filled, in the order of the pixels.
    """
    for i in range(labels.size):
        label, w, d = labels[i], np.float64(weight[i]), np.float64(disparity[i])
        for p in range(3):
            weighted = design[i, p] * w
            right[label, p] += weighted * d
            for q in range(p, 3):
                left[label, p, q] += weighted * design[i, q]
    for label in range(right.shape[0]):
        for p in range(3):
            for q in range(p):
                left[label, p, q] = left[label, q, p]


@njit(parallel=True, cache=True, borrows=True)
def values_of_planes(labels: Any, design: Any, planes: Any, values: Any) -> None:
    """Disparity of every pixel by the plane of its superpixel.

    Parameters
    ----------
    labels, design
        As in :func:`add_normal_equations`.
    planes : ndarray, shape (N, 3), float64
    values : ndarray, shape (H * W,), float32
        Filled.
    """
    for i in prange(labels.size):
        label = labels[i]
        values[i] = design[i, 0] * planes[label, 0] + design[i, 1] * planes[label, 1] + design[i, 2] * planes[label, 2]
