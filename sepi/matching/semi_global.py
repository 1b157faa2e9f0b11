"""Semi-global smoothing of a cost volume [1]_, after averaging over pixels of like colour.

The volume is averaged over a small window with weights that fall quickly with the difference of colour, so that edges
stay where the colours change, and then smoothed along eight paths: a change by one candidate costs ``small_penalty``,
a larger one ``large_penalty``, which is weakened where the colours change. Averaged and smoothed costs are whole
numbers of 16 bits. The compiled loops are in ``kernels/semi_global.cpp``.

References
----------
.. [1] Hirschmuller: Stereo processing by semiglobal matching and mutual information. IEEE TPAMI 30(2), 2008.
   doi:10.1109/TPAMI.2007.1166
"""

from typing import Annotated, NamedTuple, Self

import cv2
import numpy as np
import numpy.typing as npt
from pydantic import Field

from sepi.kernels import semi_global as kernels
from sepi.lightfield import FloatMap
from sepi.stage import Parameters, StageMaps

SAME_MINIMUM = 0.25
"""Candidates this close to the winner belong to the same minimum, pixels per view step..."""

SAME_SHARE = 0.1
"""...but no more than this share of the range."""

HALF_CONFIDENT = 0.05
"""Margin of cost at which the confidence is one half."""

ENOUGH_VIEWS = 25
"""Number of views beyond which a mean cost does not improve: its remaining errors are common to all views."""

ROWS_AT_ONCE = 64
"""Rows of costs that are averaged together."""

# largest factor of the window's radius, for few views
_MOST_WIDENED = 2

SmallPenalty = Annotated[float, Field(ge=0, description="cost of a change by one candidate; more below 25 views")]
LargePenalty = Annotated[float, Field(ge=0, description="cost of larger changes within a colour; more below 25 views")]
"""Parameters whose default is not the same for every sweep."""


class SmoothingParameters(Parameters):
    """Parameters of aggregation and semi-global smoothing."""

    window_radius: int = Field(2, ge=0, le=10, description="cost window of 2 r + 1 pixels; wider below 25 views")
    window_sigma: float = Field(
        0.01, ge=1e-6, le=10, description="colour distance at which a window pixel's weight falls, colours in 0..1"
    )
    small_penalty: SmallPenalty = 0.03
    large_penalty: LargePenalty = 1.0
    colour_weakening: float = Field(65.0, ge=0, description="by how much RGB differences weaken the larger penalty")

    def for_views(self, views: int, compared: int) -> Self:
        """These parameters for few views: as given from :data:`ENOUGH_VIEWS` on.

        Costs are means over the views, and each view counts once as evidence against a smooth map. With a third of the
        views, a mean weighs a third as much, so penalties weigh three times as much. The window grows while it holds no
        more samples of all views than with enough views, also where not all of them are compared: repeated texture
        needs narrow ones.

        Parameters
        ----------
        views : int
            Of the light field, at least 1.
        compared : int
            Of these, at least 1.

        Returns
        -------
        SmoothingParameters
        """
        radius, samples = self.window_radius, ENOUGH_VIEWS * (2 * self.window_radius + 1) ** 2
        while radius < _MOST_WIDENED * self.window_radius and views * (2 * radius + 3) ** 2 <= samples:
            radius += 1
        penalties = {
            name: getattr(self, name) * max(1.0, ENOUGH_VIEWS / compared) for name in ("small_penalty", "large_penalty")
        }
        return self.model_copy(update={"window_radius": radius, **penalties})


class Places(NamedTuple):
    """Places in a volume of the costs of each pixel's candidates, which lie side by side and fill whole vectors.

    Attributes
    ----------
    first, beyond : ndarray, shape (H, W), int32
        First candidate of a pixel, and the one after its last.
    origin : ndarray, shape (H, W), int64
        Index of its candidate 0, even if it has none.
    candidates : int
        Number of all candidates.
    """

    first: npt.NDArray[np.int32]
    beyond: npt.NDArray[np.int32]
    origin: npt.NDArray[np.int64]
    candidates: int

    @classmethod
    def of_candidates(cls, first: npt.NDArray[np.int32], last: npt.NDArray[np.int32], candidates: int) -> Self:
        """Places of at least the candidates ``first`` to ``last``, (H, W), of each pixel."""
        step = kernels.AT_ONCE
        begin, beyond, count = first // step * step, (last // step + 1) * step, -(-candidates // step) * step
        number = beyond - begin
        return cls(begin, beyond, (np.cumsum(number) - number.ravel()).reshape(number.shape) - begin, count)

    @property
    def size(self) -> int:
        """Number of costs in the volume."""
        return int((self.beyond - self.first).sum())


class CostVolumes:
    """Memory for averaged and for smoothed costs, which the next sweep reuses, since new memory is slower."""

    def __init__(self) -> None:
        self._rooms = np.empty((2, 0), np.uint16)

    def averaged_and_smoothed(self, size: int) -> npt.NDArray[np.uint16]:
        """Room for ``size`` averaged costs and for as many smoothed ones, (2, size)."""
        if size > self._rooms.shape[1]:
            # free the old memory first
            del self._rooms
            self._rooms = np.empty((2, size), np.uint16)
        return self._rooms[:, :size]


class AveragedCosts:
    """Costs of a sweep, averaged over pixels of like colour, a few rows at a time.

    Parameters
    ----------
    volumes : CostVolumes
    disparities : ndarray, shape (K,), float32
        Uniform, pixels per view step.
    guide : ndarray, shape (H, W, 3), float32
        Reference view, 0..1.
    contrast : ndarray, shape (H, W), float32
        Expected squared difference of two pixels of one surface, summed over RGB; widens the window's colour weights.
    parameters : SmoothingParameters
    likely : ndarray, shape (2, H, W), int32, optional
        First and last candidate of each pixel that are used; default: all. Others cost 1.
    """

    def __init__(
        self,
        volumes: CostVolumes,
        disparities: FloatMap,
        guide: FloatMap,
        contrast: FloatMap,
        parameters: SmoothingParameters,
        likely: npt.NDArray[np.int32] | None = None,
    ) -> None:
        self._disparities, self._parameters = disparities, parameters
        self._height, width = guide.shape[:2]
        if likely is None:
            likely = np.zeros((2, self._height, width), np.int32)
            likely[1] = len(disparities) - 1
        self._places = Places.of_candidates(likely[0], likely[1], len(disparities))
        self._colours = np.stack(cv2.split(guide), dtype=np.float32)
        self._variance = parameters.window_sigma**2 + contrast
        self._averaged, self._smoothed = volumes.averaged_and_smoothed(self._places.size)
        rows = min(self._height, ROWS_AT_ONCE) + 2 * parameters.window_radius
        # zeros, so that costs not yet set are finite
        self._costs = np.zeros((len(disparities), rows, width), np.float32)
        # rows of the view: the first with costs, the first without, the first that is not averaged
        self._top = self._next = self._done = 0

    def room(self, rows: int) -> FloatMap:
        """Array for the costs of the next rows, at most :data:`ROWS_AT_ONCE`; shape (K, rows, W), 0..1."""
        first = self._next - self._top
        return self._costs[:, first : first + rows]

    def add(self, rows: int) -> None:
        """Add the costs of ``rows`` more rows, and average all rows that are ready."""
        radius = self._parameters.window_radius
        self._next += rows
        begin, end = self._done, self._next if self._next == self._height else max(self._done, self._next - radius)
        window = radius, self._variance
        kernels.aggregate(self._costs, self._top, self._colours, self._places, *window, begin, end, self._averaged)
        # windows of the next rows reach back
        kept = slice(max(0, end - radius - self._top), self._next - self._top)
        self._costs[:, : kept.stop - kept.start] = self._costs[:, kept].copy()
        self._top, self._done = self._top + kept.start, end

    def smoothed(self) -> StageMaps:
        """Smooth the averaged costs, and take the best candidate of each pixel, refined by a parabola.

        The confidence is ``m / (m + HALF_CONFIDENT)`` of the margin ``m`` by which the averaged cost of every other
        minimum exceeds that of the winner's; 0 where it does not.
        """
        parameters, disparities = self._parameters, self._disparities
        penalties = parameters.small_penalty, parameters.large_penalty, parameters.colour_weakening
        kernels.semi_global(self._averaged, self._colours, self._places, *penalties, self._smoothed)
        same = min(SAME_MINIMUM, SAME_SHARE * float(disparities[-1] - disparities[0]))
        disparity, margin = np.empty((2, *self._colours.shape[1:]), np.float32)
        kernels.choose(self._smoothed, self._averaged, disparities, self._places, same, disparity, margin)
        margin = np.maximum(margin, 0)
        return StageMaps(disparity, (margin / (margin + np.float32(HALF_CONFIDENT))).astype(np.float32))
