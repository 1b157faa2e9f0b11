"""The pixels beside depth steps, and the surfaces on both sides."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from sepi.kernels import rim as kernels
from sepi.lightfield import BoolMap, FloatMap


class Rim(NamedTuple):
    """The pixels beside a depth step, and the two surfaces that may be theirs.

    Attributes
    ----------
    near, far : ndarray, shape (H, W), float32
        Disparities of both surfaces; the map's own elsewhere.
    inside : ndarray, shape (H, W), bool
        Whether a pixel lies beside a step.
    is_near : ndarray, shape (H, W), bool
        Which of the two the map has.
    """

    near: FloatMap
    far: FloatMap
    inside: BoolMap
    is_near: BoolMap


def rim_of(disparity: FloatMap, radius: int, step: float) -> Rim:
    """Surfaces on both sides of each depth step, means over a window by nearness.

    Parameters
    ----------
    disparity : ndarray, shape (H, W), float32
        Pixels per view step.
    radius : int
        Of the window, pixels.
    step : float
        By how much the disparities in the window of a pixel beside a step differ.

    Returns
    -------
    Rim
    """
    inside = np.zeros(disparity.shape, bool)
    rim = Rim(disparity.copy(), disparity.copy(), inside, inside.copy())
    kernels.rim_of(disparity, radius, step, rim)
    return rim
