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
        CONSTANT: 4.655,
        "deviation": 0.459,
        "second_difference": 0.301,
        "disagreement": 0.141,
        "step": 0.096,
        "wide_step": 0.09,
        "misfit": 0.32,
        "smooth_confidence": 0.357,
        "wide_confidence": -0.603,
        "long_second_difference": 0.181,
        "range": 0.347,
        "few_views": 0.105,
        "interpolation": 0.3,
        "conflict": 2.033,
        "light_deviation": 3.372,
    },
    outlier_scale={
        CONSTANT: -0.826,
        "wide_confidence": 0.188,
        "plane": -0.31,
    },
    outlier={
        CONSTANT: -4.001,
        "confidence": -0.324,
        "second_difference": 0.107,
        "agreement": -1.987,
        "wide_deviation": 0.519,
        "detail_agreement": -1.487,
        "interpolation": 0.564,
        "plane": -0.307,
        "wide_confidence": -0.334,
    },
    rim={
        CONSTANT: -2.981,
        "point_second_difference": 0.109,
        "confidence": -0.4,
        "agreement": -1.077,
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
