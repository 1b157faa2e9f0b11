"""The pixels beside depth steps, and the surfaces on both sides."""

from __future__ import annotations

from typing import NamedTuple

import cv2
import numpy as np

from sepi.lightfield import BoolMap, FloatMap


class Rim(NamedTuple):
    """The pixels beside a depth step, and the two surfaces that they may belong to.

    Attributes
    ----------
    near, far : ndarray, shape (H, W), float32
        Disparities of both surfaces; the map's own elsewhere.
    inside : ndarray, shape (H, W), bool
        Whether a pixel lies beside a step.
    is_near : ndarray, shape (H, W), bool
        Whether the map has the nearer one.
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
    window = np.ones((2 * radius + 1, 2 * radius + 1), np.uint8)
    lowest, highest = cv2.erode(disparity, window), cv2.dilate(disparity, window)
    inside = np.asarray(highest - lowest >= np.float64(step))
    y, x = np.nonzero(inside)
    middle = (lowest + highest)[inside] / 2
    # beyond the border is nothing, which is on neither side
    padded = np.pad(disparity.astype(np.float64), radius, constant_values=np.nan)
    weights, sums = np.zeros((2, 2, len(y)))
    for dy, dx in np.ndindex(window.shape):
        there, weight = padded[y + dy, x + dx], 1 / (1 + (dy - radius) ** 2 + (dx - radius) ** 2)
        for side, belongs in enumerate((there <= middle, there > middle)):
            weights[side] += weight * belongs
            sums[side] += np.where(belongs, weight * there, 0)
    near, far = disparity.copy(), disparity.copy()
    far[inside], near[inside] = sums / weights
    return Rim(near, far, inside, inside & (disparity > (near + far) / 2))
