"""Constants of the error model, fitted by ``python -m bench errors``.

Each way of smoothing has one set for all scenes and levels of noise. docs/method/error_bars.md lists the scenes of the
fit, and the results on scenes left out.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

CONSTANT = "constant"


@dataclass(frozen=True)
class Calibration:
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

    @property
    def parts(self) -> tuple[Mapping[str, float], ...]:
        """The four mappings."""
        return self.scale, self.outlier_scale, self.outlier, self.rim


SECOND_ORDER = Calibration(
    scale={
        CONSTANT: 0.629,
        "deviation": 0.131,
        "second_difference": 0.277,
        "disagreement": 0.119,
        "step": 0.151,
        "wide_step": 0.047,
        "misfit": 0.354,
        "smooth_confidence": 0.346,
        "wide_confidence": -0.774,
        "long_second_difference": 0.167,
        "range": 0.345,
        "agreement": -0.524,
        "sharpness": 0.533,
        "few_views": 1.095,
        "light_deviation": 0.288,
    },
    outlier_scale={
        CONSTANT: -1.23,
        "wide_confidence": 0.069,
        "plane": -0.656,
        "light_deviation": 0.101,
    },
    outlier={
        CONSTANT: -3.309,
        "confidence": -0.543,
        "second_difference": 0.041,
        "agreement": -1.958,
        "wide_deviation": 0.579,
        "detail_agreement": -1.288,
        "sharpness": 0.132,
    },
    rim={
        CONSTANT: -3.192,
        "point_second_difference": 0.112,
        "confidence": -0.486,
        "agreement": -1.255,
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
