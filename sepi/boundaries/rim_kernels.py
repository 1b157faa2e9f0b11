"""Compiled loop that finds the pixels beside depth steps, and the surfaces on both sides."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from sepi.compiled import njit, prange
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


@njit(parallel=True, cache=True)
def rim_of(disparity: Any, radius: int, step: Any) -> Any:
    """Surfaces on both sides of each depth step, means over a window by nearness; ``Rim`` of ``disparity (H, W)``.

    A pixel lies beside a step where the disparities within ``radius`` pixels differ by ``step``.
    """
    H, W = disparity.shape
    near, far = disparity.copy(), disparity.copy()
    inside, is_near = np.zeros((H, W), np.bool_), np.zeros((H, W), np.bool_)
    for y in prange(H):
        for x in range(W):
            top, bottom = max(0, y - radius), min(H, y + radius + 1)
            left, right = max(0, x - radius), min(W, x + radius + 1)
            lowest = highest = disparity[y, x]
            for i in range(top, bottom):
                for j in range(left, right):
                    lowest, highest = min(lowest, disparity[i, j]), max(highest, disparity[i, j])
            if highest - lowest < step:
                continue
            middle = (lowest + highest) / 2
            sums = np.zeros((2, 2))
            for i in range(top, bottom):
                for j in range(left, right):
                    weight = 1 / (1 + (i - y) ** 2 + (j - x) ** 2)
                    side = 1 if disparity[i, j] > middle else 0
                    sums[side, 0] += weight
                    sums[side, 1] += weight * disparity[i, j]
            inside[y, x] = True
            far[y, x], near[y, x] = sums[0, 1] / sums[0, 0], sums[1, 1] / sums[1, 0]
            is_near[y, x] = disparity[y, x] > (near[y, x] + far[y, x]) / 2
    return Rim(near, far, inside, is_near)
