"""The numbers of the error model, as ``python -m bench errors`` fits them.

One set for all scenes and levels of noise, for each way of smoothing: docs/method/error_bars.md has the scenes that
they are fitted on, and what they are worth on scenes that are left out.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

CONSTANT = "constant"


@dataclass(frozen=True)
class Calibration:
    """Powers of the signs (:mod:`sepi.error_bars.signs`) in the error distribution (:mod:`sepi.error_bars.mixture`).

    Attributes
    ----------
    scale, reach, stray, rim : mapping of str to float
        Sign to its power, in two scales, and in the odds of two probabilities against all being about right; of
        ``constant`` the logarithm itself.
    """

    scale: Mapping[str, float]
    reach: Mapping[str, float]
    stray: Mapping[str, float]
    rim: Mapping[str, float]

    @property
    def parts(self) -> tuple[Mapping[str, float], ...]:
        """The four mappings."""
        return self.scale, self.reach, self.stray, self.rim


SECOND_ORDER = Calibration(
    scale={
        CONSTANT: 0.792,
        "deviation": 0.286,
        "bend": 0.325,
        "disagreement": 0.213,
        "step": 0.152,
        "wide_step": 0.037,
        "misfit": 0.338,
        "steadiness": 0.361,
        "wide_confidence": -0.723,
        "long_bend": 0.196,
        "range": 0.33,
    },
    reach={
        CONSTANT: -1.734,
        "wide_confidence": -0.102,
        "plane": -0.441,
    },
    stray={
        CONSTANT: -3.117,
        "confidence": -0.405,
        "bend": 0.041,
        "agreement": -2.327,
        "wide_deviation": 0.958,
        "detail_agreement": -3.764,
    },
    rim={
        CONSTANT: -3.384,
        "point_bend": 0.14,
        "confidence": -0.53,
        "agreement": -0.977,
    },
)
"""Of Gauss-Newton steps and second-order smoothing: 'best', 'fast', and those that switch parts of them off."""

WLS = Calibration(
    scale={
        CONSTANT: -1.794,
        "deviation": 0.382,
        "bend": 0.013,
        "disagreement": -0.008,
        "step": 0.173,
        "wide_step": 0.158,
        "misfit": 0.596,
        "steadiness": -0.164,
        "wide_confidence": -0.627,
        "long_bend": 0.154,
        "range": 0.213,
    },
    reach={
        CONSTANT: -0.006,
        "wide_confidence": 0.013,
        "plane": 0.111,
    },
    stray={
        CONSTANT: -5.256,
        "confidence": -1.684,
        "bend": -0.05,
        "agreement": -2.178,
        "wide_deviation": 1.38,
        "detail_agreement": -11.029,
    },
    rim={
        CONSTANT: -2.612,
        "point_bend": 0.362,
        "confidence": -1.086,
        "agreement": -0.424,
    },
)
"""Of weighted least squares: variant 'paper' and its like."""
