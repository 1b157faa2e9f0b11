"""Constants of the error model, fitted by ``python -m bench errors``.

Each way of smoothing has one set for all scenes and levels of noise. docs/method/error_bars.md lists the scenes of the
fit, and the results on scenes left out.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple

CONSTANT = "constant"


class Calibration(NamedTuple):
    """Exponents of the cues (:mod:`sepi.error_bars.cues`) in the error distribution (:mod:`sepi.error_bars.mixture`).

    Attributes
    ----------
    scale, outlier_scale : mapping of str to float
        Cue to its exponent in a scale; ``constant`` is the logarithm of the factor.
    outlier, rim : mapping of str to float
        The same of the odds of outlier and rim, against the map being about right.
    """

    scale: Mapping[str, float]
    outlier_scale: Mapping[str, float]
    outlier: Mapping[str, float]
    rim: Mapping[str, float]


SECOND_ORDER = Calibration(
    scale={
        CONSTANT: -6.043,
        "deviation": 0.288,
        "second_difference": 0.346,
        "disagreement": 0.146,
        "step": 0.147,
        "wide_step": 0.041,
        "misfit": 0.349,
        "smooth_confidence": 0.443,
        "wide_confidence": -0.787,
        "long_second_difference": 0.185,
        "range": 0.371,
        "few_views": 0.73,
        "interpolation": 0.307,
        "conflict": 2.429,
        "light_deviation": 1.019,
    },
    outlier_scale={
        CONSTANT: -1.365,
        "wide_confidence": 0.01,
        "plane": -0.494,
    },
    outlier={
        CONSTANT: -3.203,
        "confidence": -0.429,
        "second_difference": 0.002,
        "agreement": -2.295,
        "wide_deviation": 0.886,
        "detail_agreement": -1.665,
        "interpolation": 1.103,
    },
    rim={
        CONSTANT: -3.36,
        "point_second_difference": 0.131,
        "confidence": -0.489,
        "agreement": -0.879,
    },
)
"""Of Gauss-Newton steps and second-order smoothing: 'best', 'fast', and those that switch parts of them off."""

WLS = Calibration(
    scale={
        CONSTANT: -1.864,
        "deviation": 0.421,
        "second_difference": -0.013,
        "disagreement": 0.027,
        "step": 0.148,
        "wide_step": 0.104,
        "misfit": 0.505,
        "smooth_confidence": -0.315,
        "wide_confidence": -0.486,
        "long_second_difference": 0.184,
        "range": 0.07,
    },
    outlier_scale={
        CONSTANT: -0.13,
        "wide_confidence": 0.054,
        "plane": -0.043,
    },
    outlier={
        CONSTANT: -3.975,
        "confidence": -1.58,
        "second_difference": -0.141,
        "agreement": -1.967,
        "wide_deviation": 1.517,
        "detail_agreement": -9.64,
    },
    rim={
        CONSTANT: -1.667,
        "point_second_difference": 0.387,
        "confidence": -1.071,
        "agreement": 0.026,
    },
)
"""Of weighted least squares: variant 'paper' and its like."""
