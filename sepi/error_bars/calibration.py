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


def _unfitted(*signs: str) -> dict[str, float]:
    return dict.fromkeys((CONSTANT, *signs), 0.0)


SECOND_ORDER = Calibration(
    scale=_unfitted(
        "deviation", "bend", "disagreement", "step", "wide_step", "misfit", "steadiness", "wide_confidence", "long_bend"
    ),
    reach=_unfitted("wide_deviation", "range", "plane"),
    stray=_unfitted("confidence", "bend", "agreement", "wide_deviation", "detail_agreement"),
    rim=_unfitted("point_bend", "confidence"),
    tail=0.05,
)
"""Of Gauss-Newton steps and second-order smoothing: 'best', 'fast', and those that switch parts of them off."""

WLS = SECOND_ORDER
"""Of weighted least squares: variant 'paper' and its like."""
