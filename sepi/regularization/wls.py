"""Weighted least squares on the 4-connected grid: the energy of the global optimisation (Eq. 8-12 of [1]_).

References
----------
.. [1] Zhou, Shi, Liu, Jin, Zhang, Hou: Light Field Depth Estimation via Stitched Epipolar Plane Images.
"""

from __future__ import annotations

import cv2
import numpy as np
from pydantic import Field

from sepi.lightfield import BoolMap, FloatArray, FloatMap
from sepi.regularization.multilevel import MARGIN, solve_smooth
from sepi.stage import Parameters, relative_confidence

LEAST_CONFIDENCE = 0.01
"""Least confidence, which keeps the system solvable."""

MOST_ITERATIONS = 1000
"""Most steps of the solver, which hardly ever takes more than a hundred."""


class WlsParameters(Parameters):
    """Parameters of the weighted least squares."""

    alpha: float = Field(
        3e-6, ge=0, description="weight of smoothness against data; for gradients of values 0..1 per px"
    )
    gradient_floor: float = Field(
        0.002, gt=0, description="image gradient below which smoothness no longer grows, 0..1 per px"
    )
    tau_0: float = Field(1000.0, ge=0, description="how sharply the data weight falls beyond tau_1")
    tau_1: float = Field(
        0.2, ge=0, description="standard deviation of the depth in 3x3 pixels that marks a discontinuity"
    )
    discontinuity_weight: float = Field(
        0.1, gt=0, le=1, description="share of its weight that data keeps at a discontinuity; Eq. 9: 0"
    )
    tau_2: float = Field(1.5, ge=0, description="how strongly confidence weakens smoothness")
    textureless_confidence: float = Field(0.8, ge=0, le=1, description="c_tl, confidence of textureless regions")
    confidence_power: float = Field(4.0, gt=0, le=10, description="exponent on the confidence as data weight")
    rtol: float = Field(
        1e-12, gt=0, lt=1, description="relative residual at which the solver stops; small for pixels of low weight"
    )


def rectified_confidence(confidence: FloatMap, textureless: BoolMap, parameters: WlsParameters) -> FloatMap:
    """Confidence c' of Eq. 10: a constant in textureless regions, else the confidence of the stage before."""
    own = relative_confidence(confidence)
    return np.where(textureless, parameters.textureless_confidence, own).astype(np.float32)


def data_weight(disparity: FloatMap, confidence: FloatMap, parameters: WlsParameters) -> FloatMap:
    """Weight w of Eq. 9: a power of the confidence, reduced at depth discontinuities; shape (H, W), float32."""
    mean = cv2.blur(disparity, (3, 3))
    deviation = np.sqrt(np.maximum(cv2.blur((disparity - mean) ** 2, (3, 3)), 0))
    cut = np.exp(-np.minimum(parameters.tau_0 * np.maximum(deviation - parameters.tau_1, 0), 80))
    trust = np.maximum(confidence, LEAST_CONFIDENCE) ** parameters.confidence_power
    return (trust * np.maximum(cut, parameters.discontinuity_weight)).astype(np.float32)


def smoothness_coefficient(reference_view: FloatMap, confidence: FloatMap, parameters: WlsParameters) -> FloatMap:
    """S = s_c s_t of Eq. 11-12; shape (H, W), float32."""
    dx, dy = (cv2.Sobel(reference_view, cv2.CV_32F, *order, ksize=3, scale=1 / 8) for order in ((1, 0), (0, 1)))
    squared = np.sum(cv2.split(np.atleast_3d(dx) ** 2 + np.atleast_3d(dy) ** 2), axis=0)
    return np.asarray(np.exp(-parameters.tau_2 * confidence) / (squared + parameters.gradient_floor**2), np.float32)


def solve(disparity: FloatMap, weight: FloatMap, smoothness: FloatMap, alpha: float, rtol: float) -> FloatMap:
    """Disparity of least energy, Eq. 8; shape (H, W), float32.

    The solver stops at a residual of ``rtol``, relative to the data's weighted deviations from their mean.
    """
    stencil = _smoothness_stencil(smoothness, alpha)
    return solve_smooth(stencil, weight, disparity, disparity, rtol, MOST_ITERATIONS)


def _smoothness_stencil(smoothness: FloatMap, alpha: float) -> FloatArray:
    """Matrix of the smoothness on the 4-connected grid; shape (4, H + 2 MARGIN, W + 2 MARGIN), float64.

    The sum of Eq. 8 holds each pair of neighbours twice, with the coefficient of either pixel.
    """
    s = alpha * np.pad(smoothness.astype(np.float64), MARGIN)
    inside = np.pad(np.ones(smoothness.shape, bool), MARGIN)
    stencil = np.zeros((4, *s.shape))
    for entry, axis in ((1, 1), (3, 0)):
        pair = np.where(inside & np.roll(inside, -1, axis), s + np.roll(s, -1, axis), 0)
        stencil[entry] = -pair
        stencil[0] += pair + np.roll(pair, 1, axis)
    return stencil
