"""Compiled loop of the search for planes (:mod:`sepi.regularization.plane_search`)."""

from __future__ import annotations

from typing import Any

import numpy as np

from sepi.compiled import njit, prange


@njit(forceinline=True, borrows=True)
def _counts(positions: Any, values: Any, a: Any, b: Any, c: Any, tolerance: float) -> Any:
    """How many values are within the tolerance of a plane, and how many below that."""
    agreeing, behind = 0, 0
    for i in range(values.size):
        # as residuals of single planes are rounded
        residual = values[i] - (a + b * positions[1, i] + c * positions[2, i])
        agreeing += abs(residual) < tolerance
        behind += residual < -tolerance
    return agreeing, behind


@njit(parallel=True, cache=True)
def support_of(positions: Any, values: Any, planes: Any, tolerance: float, behind_penalty: float) -> Any:
    """How many pixels agree with each plane, less a weight for each that lies behind it.

    Parameters
    ----------
    positions : ndarray, shape (3, N), float64
        1, x and y of pixels.
    values : ndarray, shape (N,), float64
        Their disparities.
    planes : ndarray, shape (P, 3), float64
    tolerance : float
        Pixels per view step.
    behind_penalty : float

    Returns
    -------
    ndarray, shape (P,), float64
    """
    found = np.empty(len(planes))
    for p in prange(len(planes)):
        agreeing, behind = _counts(positions, values, planes[p, 0], planes[p, 1], planes[p, 2], tolerance)
        found[p] = agreeing - behind_penalty * behind
    return found
