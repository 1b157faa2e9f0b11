"""Number of candidate disparities of a sweep, unless the user sets it.

The sampling must be fine in the farthest view: from one candidate to the next, a pixel moves there by the disparity
sampling times that view's distance. A sweep has a *usual* number of candidates. It takes fewer where these would be
finer than is of use, and more where they would be coarser than its optimisation can bridge.
"""

import math
from typing import TYPE_CHECKING, Any, ClassVar, NamedTuple, Self

from pydantic import Field

from sepi.lightfield import FloatMap, LightField
from sepi.stage import Parameters

LEAST_CANDIDATES = 25
"""However narrow the range is."""

MOST_CANDIDATES = 4001
"""However wide it is."""


class CandidateRule(NamedTuple):
    """The number of candidates of a sweep, from the disparity range and the distance of the farthest view.

    Attributes
    ----------
    usual : int
        Number for ranges that are neither narrow nor wide.
    finest, coarsest : float
        Least and largest sampling in the farthest view with the usual number, pixels.
    volume_bytes : int or None
        Limit on a float32 cost volume with more than the usual number; None for a sweep without a cost volume.
    """

    usual: int
    finest: float
    coarsest: float
    volume_bytes: int | None = None

    def number(self, width: float, reach: float, pixels: int) -> int:
        """Number of candidates.

        Parameters
        ----------
        width : float
            Of the disparity range, pixels per view step.
        reach : float
            Distance of the farthest view, view steps.
        pixels : int
            Of a view.
        """
        moved = width * reach
        sampling = moved / (self.usual - 1)
        if self.finest <= sampling <= self.coarsest:
            return self.usual
        if sampling < self.finest:
            return max(LEAST_CANDIDATES, _intervals(moved, self.finest) + 1)
        most = MOST_CANDIDATES
        if self.volume_bytes is not None:
            most = min(most, max(self.usual, self.volume_bytes // (4 * pixels)))
        return min(most, _intervals(moved, self.coarsest) + 1)


def number_field(rule: CandidateRule, document: str) -> Any:
    """The parameter ``num_disparities`` of a sweep whose rule ``document`` explains."""
    return Field(
        None,
        ge=3,
        le=MOST_CANDIDATES,
        description=f"number of candidate disparities, uniform over the range; null: {rule.usual}, or fewer for a "
        f"narrow range and more for a wide one ({document})",
    )


def _intervals(moved: float, sampling: float) -> int:
    # half a millionth of an interval is rounding
    return math.ceil(moved / sampling - 5e-7)


class CandidateParameters(Parameters):
    """Parameters of a sweep over candidate disparities, derived from the two that each sweep declares."""

    rule: ClassVar[CandidateRule]

    if TYPE_CHECKING:
        num_disparities: int | None

    def number(self, light_field: LightField) -> int:
        """Number of candidates: as set, else by the rule.

        Raises
        ------
        SepiError
            If the disparity range is unknown.
        """
        known = light_field.require_disparity_range()
        if self.num_disparities is not None:
            return self.num_disparities
        height, width = light_field.shape
        return self.rule.number(known.maximum - known.minimum, light_field.reach, height * width)

    def candidates(self, light_field: LightField) -> FloatMap:
        """The candidates, uniform over the range, both ends included; shape (K,), float32.

        Raises
        ------
        SepiError
            If the disparity range is unknown.
        """
        return light_field.require_disparity_range().candidates(self.number(light_field))

    def settled(self, light_field: LightField) -> Self:
        """These parameters with the number of candidates that a light field gets."""
        return self.model_copy(update={"num_disparities": self.number(light_field)})
