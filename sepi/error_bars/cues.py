"""Cues of how far a disparity map may be wrong: in the map, in what the views say of it, of the stage before.

All are in view steps of which the farthest view is four away, as stages have them.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

import cv2
import numpy as np

from sepi.lightfield import BoolMap, DisparityRange, FloatMap

if TYPE_CHECKING:
    from sepi.matching.gauss_newton import Evidence

HALF_CONFIDENT_DIFFERENCE = 0.01
"""Second difference that halves the smooth confidence, pixels per view step."""

IGNORANCE = 0.01
"""What a view's information of 1 / px^2 adds to the second difference there; pixels per view step."""

STEP_REACH = 2
"""Distance within which a neighbour's surface may be the pixel's own, pixels."""

_LONG = 8
"""Distance of pixels between which smoothing flattens what curves, pixels."""

_LEAST_NOISE = 3e-4
_LEAST = np.float32(1e-6)

Cues = Mapping[str, FloatMap]
"""Name to map (H, W)."""

FLOORS: Mapping[str, float] = {
    "deviation": 1e-4,
    "wide_deviation": 1e-4,
    "step": 1e-4,
    "wide_step": 1e-4,
    "disagreement": 1e-4,
    "misfit": 0.1,
    "second_difference": 1e-4,
    "point_second_difference": 1e-4,
    "long_second_difference": 1e-3,
    "smooth_confidence": 0.01,
    "confidence": 0.01,
    "wide_confidence": 0.01,
    "agreement": 0.01,
    "detail_agreement": 0.01,
    "range": 1e-3,
    "plane": 0.1,
}
"""Cue to the value below which it says no more."""


def cues_of_map(disparity: FloatMap, curvature: FloatMap, known: DisparityRange) -> dict[str, FloatMap]:
    """Cues in the map itself.

    Parameters
    ----------
    disparity : ndarray, shape (H, W), float32
    curvature : ndarray, shape (H, W), float32
        Information on the disparity by the views, before any window, 1 / (pixels per view step)^2.
    known : DisparityRange

    Returns
    -------
    dict of str to ndarray, shape (H, W), float32
        ``second_difference`` and ``point_second_difference``, absolute ones about the pixel and of it;
        ``long_second_difference``, over distances of eight pixels, along the axis along which it is less;
        ``smooth_confidence``, 1 for a plane that the views know and 0 beside steps; ``above`` and ``below``, how much
        nearer and farther the nearest and the farthest neighbour are; ``range``, the width of the disparity range.
    """
    difference = np.abs(cv2.Laplacian(disparity, cv2.CV_32F))
    mean = np.maximum(_mean(difference, 5), 0)
    unknown = mean + IGNORANCE / np.sqrt(np.maximum(_mean(curvature, 3), 0) + np.float32(1e-3))
    wide = cv2.copyMakeBorder(disparity, *(_LONG,) * 4, cv2.BORDER_REFLECT_101)
    inner, twice = np.s_[_LONG:-_LONG], 2 * disparity
    across = np.abs(wide[inner, 2 * _LONG :] + wide[inner, : -2 * _LONG] - twice)
    down = np.abs(wide[2 * _LONG :, inner] + wide[: -2 * _LONG, inner] - twice)
    box = np.ones((2 * STEP_REACH + 1,) * 2, np.uint8)
    return {
        "second_difference": mean,
        "point_second_difference": difference,
        "long_second_difference": np.minimum(across, down),
        "smooth_confidence": np.asarray(HALF_CONFIDENT_DIFFERENCE / (HALF_CONFIDENT_DIFFERENCE + unknown), np.float32),
        "above": cv2.dilate(disparity, box) - disparity,
        "below": disparity - cv2.erode(disparity, box),
        "range": np.full_like(disparity, known.maximum - known.minimum),
    }


def cues_of_views(gradient: FloatMap, curvature: FloatMap, evidence: Evidence, noise: float) -> dict[str, FloatMap]:
    """Cues in what the views say about a map.

    Parameters
    ----------
    gradient, curvature : ndarray, shape (H, W), float32
        Of the cost of each pixel, before any window.
    evidence : Evidence
    noise : float
        Standard deviation in one channel of a view, colours in 0..1.

    Returns
    -------
    dict of str to ndarray, shape (H, W), float32
        ``deviation`` and ``wide_deviation``, the standard deviation that the information over 3x3 and 7x7 pixels
        leaves; ``step`` and
        ``wide_step``, by how much the cost would have the map move, over 3x3 and 15x15 pixels; ``disagreement``,
        between the views on opposite sides about that; ``misfit``, residuals in units of the noise; ``agreement`` and
        ``detail_agreement``, the mean robust weight of the views.
    """
    seeing = _mean(evidence.seeing, 3) + _LEAST
    residual = np.maximum(_mean(evidence.misfit, 3) / (_mean(evidence.agreement, 3) + _LEAST), 0)
    return {
        "deviation": _deviation(_mean(curvature, 3)),
        "wide_deviation": _deviation(_mean(curvature, 7)),
        "step": np.abs(_mean(gradient, 3) / (_mean(curvature, 3) + _LEAST)),
        "wide_step": np.abs(_mean(gradient, 15) / (_mean(curvature, 15) + _LEAST)),
        "disagreement": _disagreement(evidence, curvature),
        "misfit": np.sqrt(residual / 3) / np.float32(max(noise, _LEAST_NOISE)),
        "agreement": _mean(evidence.agreement, 3) / seeing,
        "detail_agreement": _mean(evidence.detail_agreement, 3) / seeing,
    }


def cues_of_stage_before(confidence: FloatMap, plane: BoolMap) -> dict[str, FloatMap]:
    """Cues of the stage before: its ``confidence``, the same over 15x15 pixels, and where a ``plane`` was put in."""
    return {
        "confidence": confidence,
        "wide_confidence": _mean(confidence, 15),
        "plane": plane.astype(np.float32),
    }


def _deviation(information: FloatMap) -> FloatMap:
    """Standard deviation that an information leaves, of which a little is always there."""
    return np.asarray(1 / np.sqrt(np.maximum(information, 0) + np.float32(1e-2)), np.float32)


def _disagreement(evidence: Evidence, curvature: FloatMap) -> FloatMap:
    """Standard deviation by how the updates of opposite halves of the views differ."""
    halves = [[_mean(values, 3) for values in half] for half in evidence.halves]
    whole = _mean(curvature, 3)
    least = np.float32(1e-3) * whole + np.float32(1e-2)
    total, pairs = np.zeros_like(whole), 0
    for one, other in (halves[:2], halves[2:]):
        if not (one[1].any() and other[1].any()):
            # views of one row say nothing of up and down
            continue
        difference = one[0] / (one[1] + least) - other[0] / (other[1] + least)
        total += one[1] * other[1] / (one[1] + other[1] + _LEAST) * difference**2
        pairs += 1
    return np.asarray(np.sqrt(np.maximum(total, 0) / (max(pairs, 1) * (whole + _LEAST))), np.float32)


def _mean(values: FloatMap, size: int) -> FloatMap:
    return np.asarray(cv2.blur(values, (size, size)), np.float32)
