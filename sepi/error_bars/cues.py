"""Cues of error of a disparity map: from the map, from the views, and from the stage before.

A pixel without texture matches a border beside it at the border's disparity, since nothing changes there. That is no
evidence, so that wide windows about a bare pixel hold bare pixels alone.

Their unit is the stages' view step, with the farthest view four view steps away.
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
"""Amount added to the second difference for an information of 1 / (pixels per view step)^2; pixels per view step."""

BARE_DEVIATION = 0.15
"""Standard deviation by the information of 3x3 pixels from which a pixel is bare, pixels per view step."""

LEAST_DEVIATION = 0.004
"""Standard deviation that errors of the texture are compared with at least, pixels per view step."""

STEP_REACH = 2
"""Distance within which a pixel may belong to a neighbour's surface, pixels."""

_LONG = 8
"""Distance over which smoothing flattens a curved surface, pixels."""

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
    "few_views": 1.125,
    "interpolation": 0.4,
    "conflict": 60.0,
    "light_deviation": 0.03,
}
"""Cue to its least value; smaller values count as this one."""


def cues_of_map(disparity: FloatMap, curvature: FloatMap, known: DisparityRange) -> dict[str, FloatMap]:
    """Cues from the map itself.

    Parameters
    ----------
    disparity : ndarray, shape (H, W), float32
    curvature : ndarray, shape (H, W), float32
        Information of the views on each pixel's disparity, 1 / (pixels per view step)^2.
    known : DisparityRange

    Returns
    -------
    dict of str to ndarray, shape (H, W), float32
        ``second_difference`` and ``point_second_difference``: absolute second difference, mean over 5x5 pixels and of
        the pixel; ``long_second_difference``: over distances of eight pixels, the lesser of the two axes;
        ``smooth_confidence``: 1 on a plane with information, 0 beside steps; ``above`` and ``below``: how much nearer
        the nearest neighbour is, and how much farther the farthest; ``range``: width of the disparity range.
    """
    difference = np.abs(cv2.Laplacian(disparity, cv2.CV_32F))
    bare = bare_pixels(curvature)
    mean = np.maximum(_mean(difference, 5, bare), 0)
    unknown = mean + IGNORANCE / np.sqrt(np.maximum(_mean(curvature, 3, bare), 0) + np.float32(1e-3))
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
    """Cues from the comparison of the views at the map's disparities.

    Parameters
    ----------
    gradient, curvature : ndarray, shape (H, W), float32
        From :meth:`sepi.matching.gauss_newton.GaussNewton.gradient_and_hessian`.
    evidence : Evidence
    noise : float
        Standard deviation of the noise in one channel of a view, colours in 0..1.

    Returns
    -------
    dict of str to ndarray, shape (H, W), float32
        ``deviation`` and ``wide_deviation``: standard deviation by the information over 3x3 and 7x7 pixels; ``step``
        and ``wide_step``: change of disparity that the cost asks for, over 3x3 and 15x15 pixels; ``disagreement``:
        difference of this change between views on opposite sides; ``misfit``: residuals in units of the noise;
        ``agreement`` and ``detail_agreement``: mean robust weight of the views by colours and by detail;
        ``few_views``: number of views that see the pixel over that of their differences.
    """
    seeing, bare = _mean(evidence.seeing, 3) + _LEAST, bare_pixels(curvature)
    step = np.abs(_mean(gradient, 3) / (_mean(curvature, 3) + _LEAST))
    residual = np.maximum(_mean(evidence.misfit, 3) / (_mean(evidence.agreement, 3) + _LEAST), 0)
    return {
        "deviation": _deviation(_mean(curvature, 3)),
        "wide_deviation": _deviation(_mean(curvature, 7, bare)),
        "step": step,
        "wide_step": np.abs(_mean(gradient, 15, bare) / (_mean(curvature, 15, bare) + _LEAST)),
        "disagreement": _disagreement(evidence, curvature, step),
        "misfit": np.sqrt(residual / 3) / np.float32(max(noise, _LEAST_NOISE)),
        "agreement": _mean(evidence.agreement, 3) / seeing,
        "detail_agreement": _mean(evidence.detail_agreement, 3) / seeing,
        "few_views": 1 + 1 / np.maximum(seeing, 1),
    }


def cues_of_stage_before(
    confidence: FloatMap, plane: BoolMap, light_deviation: FloatMap | None, curvature: FloatMap
) -> dict[str, FloatMap]:
    """Cues from the stage before: ``confidence``, ``wide_confidence`` over 15x15 pixels, and ``plane``, 1 on planes;
    ``light_deviation``, standard deviation of planes by a region's light, 0 elsewhere.
    """
    return {
        "confidence": confidence,
        "wide_confidence": _mean(confidence, 15, bare_pixels(curvature)),
        "plane": plane.astype(np.float32),
        "light_deviation": np.zeros_like(confidence) if light_deviation is None else light_deviation,
    }


def cues_of_texture(sharpness: FloatMap, agreement: FloatMap, deviation: FloatMap) -> dict[str, FloatMap]:
    """Cues of errors that more information does not make less, in units of the ``deviation`` that it promises.

    Returns
    -------
    dict of str to ndarray, shape (H, W), float32
        ``interpolation``: error of cubic splines, which grows with the fourth power of the frequency, by the
        :func:`sepi.matching.softening.sharpness`; ``conflict``: share of the views that the colours do not fit.
    """
    information = np.asarray(1 / np.maximum(deviation, np.float32(LEAST_DEVIATION)), np.float32)
    return {"interpolation": sharpness**4 * information, "conflict": (1 - agreement) * information}


def bare_pixels(curvature: FloatMap) -> BoolMap:
    """Pixels whose own texture hardly tells a disparity, by the views' information; shape (H, W), bool."""
    return np.asarray(_deviation(_mean(curvature, 3)) > BARE_DEVIATION)


def _deviation(information: FloatMap) -> FloatMap:
    """Standard deviation by an information, to which a small constant is added."""
    return np.asarray(1 / np.sqrt(np.maximum(information, 0) + np.float32(1e-2)), np.float32)


def _disagreement(evidence: Evidence, curvature: FloatMap, step: FloatMap) -> FloatMap:
    """Standard deviation by the difference between the changes that opposite halves of the views ask for.

    Without views on opposite sides it is unknown, and the step takes its place: where both are known, they are alike.
    """
    halves = [[_mean(values, 3) for values in half] for half in evidence.halves]
    whole = _mean(curvature, 3)
    least = np.float32(1e-3) * whole + np.float32(1e-2)
    total, pairs = np.zeros_like(whole), 0
    for one, other in (halves[:2], halves[2:]):
        if not (one[1].any() and other[1].any()):
            continue
        difference = one[0] / (one[1] + least) - other[0] / (other[1] + least)
        total += one[1] * other[1] / (one[1] + other[1] + _LEAST) * difference**2
        pairs += 1
    return np.asarray(np.sqrt(np.maximum(total, 0) / (pairs * (whole + _LEAST))), np.float32) if pairs else step


def _mean(values: FloatMap, size: int, bare: BoolMap | None = None) -> FloatMap:
    """Mean over a window; that of a bare pixel over the bare ones, if these are given."""
    mean = np.asarray(cv2.blur(values, (size, size)), np.float32)
    if bare is not None and bare.any():
        inside = bare.astype(np.float32)
        share = cv2.blur(inside, (size, size))
        mean[bare] = (cv2.blur(values * inside, (size, size))[bare] / share[bare]).astype(np.float32)
    return mean
