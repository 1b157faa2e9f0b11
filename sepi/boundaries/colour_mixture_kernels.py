"""Compiled loops of the evidence by colour mixture (:mod:`sepi.boundaries.colour_mixture`)."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from sepi.boundaries.surroundings import Surroundings
from sepi.compiled import njit, prange

_WIDTH = 1.0  # of the window's weights, pixels
_APART = 0.019  # squared distance of a colour from all mixtures at which it counts 1/e, in units of their variance
_RAMP = 0.07  # share below the threshold from which on there is no doubt
_LEAST_WEIGHT = 0.05  # of clean pixels of each side, in pixels right beside


@njit(parallel=True, cache=True)
def mixture_evidence(
    disparity: Any, around: Surroundings, guide: Any, discontinuity: Any, radius: int, contrast: Any, threshold: Any,
    least_variance: Any,
) -> Any:  # fmt: skip
    """How surely little of the nearer surface is in a pixel, 0..1; shapes (H, W) and (H, W, 3)."""
    H, W = disparity.shape
    out = np.zeros((H, W), np.float32)
    for y in prange(H):
        sums = np.empty((2, 5))  # for each side: weight, RGB, squared RGB
        for x in range(W):
            lowest, highest = around.farthest[y, x], around.nearest[y, x]
            middle = (lowest + highest) / 2
            if highest - lowest < discontinuity or disparity[y, x] <= middle:
                continue
            sums[:] = 0
            for row in range(max(0, y - radius), min(H, y + radius + 1)):
                for column in range(max(0, x - radius), min(W, x + radius + 1)):
                    q = disparity[row, column]
                    clean = around.farthest[row, column] > middle or around.nearest[row, column] <= middle
                    # surfaces beyond the two do not count
                    if q > highest + discontinuity or q < lowest - discontinuity or not clean:
                        continue
                    w = math.exp(-((row - y) ** 2 + (column - x) ** 2) / (2 * _WIDTH**2))
                    own = sums[1 if q > middle else 0]
                    own[0] += w
                    for c in range(3):
                        own[1 + c] += w * guide[row, column, c]
                        own[4] += w * guide[row, column, c] ** 2
            if sums[0, 0] < _LEAST_WEIGHT or sums[1, 0] < _LEAST_WEIGHT:
                continue
            distance, projection, variance, apart = 0.0, 0.0, least_variance, 0.0
            for side in range(2):
                variance += sums[side, 4] / sums[side, 0]
            for c in range(3):
                far, near = sums[0, 1 + c] / sums[0, 0], sums[1, 1 + c] / sums[1, 0]
                distance += (near - far) ** 2
                projection += (guide[y, x, c] - far) * (near - far)
                apart += (guide[y, x, c] - far) ** 2
                variance -= far * far + near * near
            # what is left of the colour beside both: a surface darker towards its edge is no mixture
            distance = max(distance, 1e-12)
            apart -= max(projection, 0.0) ** 2 / distance
            little = min(max(threshold - projection / distance, 0.0) / _RAMP, 1.0)
            out[y, x] = little * distance / (distance + contrast * variance) * math.exp(-apart / (_APART * variance))
    return out
