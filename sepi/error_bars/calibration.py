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
    tail : float
        Probability that is left out beyond each bound, so that intervals hold nine of ten.
    """

    scale: Mapping[str, float]
    reach: Mapping[str, float]
    stray: Mapping[str, float]
    rim: Mapping[str, float]
    tail: float

    @property
    def parts(self) -> tuple[Mapping[str, float], ...]:
        """The four mappings."""
        return self.scale, self.reach, self.stray, self.rim


SECOND_ORDER = Calibration(
    scale={
        CONSTANT: 1.349,
        "deviation": 0.32,
        "bend": 0.306,
        "disagreement": 0.221,
        "step": 0.156,
        "wide_step": 0.04,
        "misfit": 0.377,
        "steadiness": 0.335,
        "wide_confidence": -0.678,
        "long_bend": 0.202,
    },
    reach={
        CONSTANT: -0.767,
        "wide_deviation": 0.009,
        "range": -0.606,
        "plane": -0.391,
    },
    stray={
        CONSTANT: -2.619,
        "confidence": -0.369,
        "bend": 0.056,
        "agreement": -2.194,
        "wide_deviation": 1.077,
        "detail_agreement": -3.911,
    },
    rim={
        CONSTANT: -2.612,
        "point_bend": 0.189,
        "confidence": -0.557,
    },
    tail=0.0598,
)
"""Of Gauss-Newton steps and second-order smoothing: 'best', 'fast', and those that switch parts of them off."""

WLS = Calibration(
    scale={
        CONSTANT: -1.094,
        "deviation": 0.361,
        "bend": 0.008,
        "disagreement": 0.009,
        "step": 0.223,
        "wide_step": 0.151,
        "misfit": 0.608,
        "steadiness": -0.186,
        "wide_confidence": -0.499,
        "long_bend": 0.151,
    },
    reach={
        CONSTANT: -0.892,
        "wide_deviation": 0.063,
        "range": 0.746,
        "plane": 0.081,
    },
    stray={
        CONSTANT: -6.052,
        "confidence": -1.855,
        "bend": -0.058,
        "agreement": -2.382,
        "wide_deviation": 0.882,
        "detail_agreement": -11.817,
    },
    rim={
        CONSTANT: -2.325,
        "point_bend": 0.386,
        "confidence": -1.134,
    },
    tail=0.0734,
)
"""Of weighted least squares: variant 'paper' and its like."""
