"""Scores of error bars: coverage and width of the intervals, and how well uncertainty ranks the errors.

Coverage must be read together with the width: an interval as wide as the disparity range always contains the truth.
Sparsification curves [1]_ tell how well confidence ranks pixels by error.

References
----------
.. [1] Ilg et al.: Uncertainty estimates and multi-hypotheses networks for optical flow. ECCV 2018.
   doi:10.1007/978-3-030-01234-2_40
"""

from __future__ import annotations

from typing import NamedTuple, Self

import numpy as np
import numpy.typing as npt

from sepi.io.scores import Scores
from sepi.lightfield import BoolMap, FloatMap
from sepi.scoring.regions import in_frame
from sepi.stage import CLOSE, ERROR_BARS, REACH, StageMaps
from sepi.validation import require_type

STEPS = 100
"""Number of points of a sparsification curve."""

FloatArray = npt.NDArray[np.float64]


def sparsification(confidence: FloatMap, error: FloatMap) -> FloatArray:
    """Mean absolute error of the pixels that remain after the least confident ones are removed [1]_.

    Parameters
    ----------
    confidence, error : ndarray, shape (H, W), float32
        0..1; estimate minus ground truth in pixels per view step, ``error`` of
        :class:`sepi.io.scores.Evaluation`. Pixels whose error is not finite are left out.

    Returns
    -------
    ndarray, shape (100,), float64
        Times 100; with 0, 1, ... 99 % of the pixels taken away. NaN where no error is finite.

    References
    ----------
    .. [1] Ilg et al.: Uncertainty estimates and multi-hypotheses networks for optical flow. ECCV 2018.
       doi:10.1007/978-3-030-01234-2_40

    Examples
    --------
    The curve of a useful confidence falls:

    >>> import sepi
    >>> from sepi.evaluate import evaluation_of
    >>> from sepi.scoring.error_bars import sparsification
    >>> from sepi.scenes import render
    >>> light_field = render("curved_occluders", size=96, views=5)
    >>> maps = sepi.estimate_depth(light_field)
    >>> curve = sparsification(maps.confidence, evaluation_of(light_field, maps.disparity).error)
    >>> curve.shape, bool(curve[50] < 0.2 * curve[0])
    ((100,), True)
    """
    for name, values in (("confidence", confidence), ("error", error)):
        require_type(name, values, np.ndarray, "an array of numbers")
    known = np.isfinite(error)
    order = np.argsort(-confidence[known], kind="stable")
    sums = np.cumsum(np.abs(error[known][order].astype(np.float64)))
    if sums.size == 0:
        return np.full(STEPS, np.nan)
    kept = np.maximum(1, np.rint(sums.size * (1 - np.arange(STEPS) / STEPS))).astype(np.int64)
    return np.asarray(100 * sums[kept - 1] / kept)


def oracle(error: FloatMap) -> FloatArray:
    """The lowest possible curve of :func:`sparsification`: pixels are removed in order of their error.

    Parameters
    ----------
    error : ndarray, shape (H, W), float32
        Estimate minus ground truth in pixels per view step.

    Returns
    -------
    ndarray, shape (100,), float64
        Times 100; with 0, 1, ... 99 % of the pixels taken away. NaN where no error is finite.

    Examples
    --------
    >>> import numpy as np
    >>> from sepi.scoring.error_bars import oracle, sparsification
    >>> error = np.array([[0.0, 0.1], [0.2, 0.3]], np.float32)
    >>> [round(value, 3) for value in oracle(error)[[0, 25, 50, 75]].tolist()]
    [15.0, 10.0, 5.0, 0.0]
    >>> ignorant = sparsification(np.ones((2, 2), np.float32), error)  # in the order of the pixels
    >>> bool((oracle(error) <= ignorant).all())
    True
    """
    require_type("error", error, np.ndarray, "an array of numbers")
    return sparsification(-np.abs(error), error)


ERROR_BAR_SCORES: dict[str, str] = {
    "coverage": "coverage %",
    "width": "width",
    "nll": "NLL",
    "ause": "AUSE",
    "ause_confidence": "AUSE, confidence",
    "gap": "confidence's gap %",
}
"""Score of error bars to its name in tables; only for maps with error bars."""

# maps whose values are scored
_SCORED = ("disparity", "confidence", *ERROR_BARS)

BINS = 10
"""Number of equal bins of the stated probability, 0..1."""

ENOUGH = 0.01
"""Minimum share of the pixels in a bin for its gap to count."""


class Reliability(NamedTuple):
    """Observed against stated probability of small errors; arrays (10,), one entry per bin of the confidence.

    Attributes
    ----------
    pixels : ndarray
        Number of pixels in the bin.
    said : ndarray
        Their mean confidence; NaN without pixels.
    found : ndarray
        Share of the pixels whose error is within the bound; NaN without pixels.
    """

    pixels: FloatArray
    said: FloatArray
    found: FloatArray

    @property
    def enough(self) -> BoolMap:
        """Bins (10,) with enough pixels; the others are too noisy."""
        return np.asarray((self.pixels > 0) & (self.pixels >= ENOUGH * self.pixels.sum()))

    @property
    def gap(self) -> float:
        """Largest difference between ``said`` and ``found`` in percent, over bins with enough pixels."""
        gaps = np.abs(self.found - self.said)[self.enough]
        return 100 * float(gaps.max()) if gaps.size else float("nan")


class ErrorBars(NamedTuple):
    """Error bars of a disparity map, and the quantities needed to score them.

    Attributes
    ----------
    maps : StageMaps
        With ``sigma``, ``low``, ``high`` and a confidence.
    close : float or None
        Error bound of the confidence in pixels per view step; None if the views' distance is unknown.
    truth_step : float
        Rounding step of the ground truth in pixels per view step; 0 if it is not rounded.
    """

    maps: StageMaps
    close: float | None = None
    truth_step: float = 0.0

    @classmethod
    def of(cls, maps: StageMaps, reach: float | None = None, truth_step: float = 0.0) -> Self | None:
        """Error bars of final maps, or None without any; ``reach`` is the light field's."""
        if any(name not in maps.extra for name in ERROR_BARS):
            return None
        return cls(maps, CLOSE * REACH / reach if reach else None, truth_step)

    def in_frame(self, offset: tuple[int, int], shape: tuple[int, int]) -> Self:
        """Error bars of a crop, placed in the whole image as by :func:`sepi.scoring.regions.in_frame`."""
        maps = {name: in_frame(self.maps.all()[name], offset, shape)[0] for name in _SCORED}
        return self._replace(maps=self.maps.updated(**maps))

    def scores(self, estimate: FloatMap, ground_truth: FloatMap, chosen: BoolMap) -> Scores:
        """The :data:`ERROR_BAR_SCORES` over the chosen pixels (H, W) with finite ground truth."""
        sigma, low, high = (self.maps.extra[name][chosen] for name in ERROR_BARS)
        disparity, truth, confidence = (values[chosen] for values in (estimate, ground_truth, self.maps.confidence))
        error = np.abs(disparity.astype(np.float64) - truth)
        # without a finite estimate there is no interval
        low = np.where(np.isfinite(disparity), low, np.float32(np.nan))
        widths = high.astype(np.float64) - low
        widths = widths[np.isfinite(widths)]
        found = {
            "coverage": coverage(low, high, truth, self.truth_step),
            "width": float(np.median(widths)) if widths.size else float("nan"),
            "nll": normal_nll(error, sigma, self.truth_step),
            "ause": ause(sigma, error),
            "ause_confidence": ause(-confidence, error),
        }
        return found if self.close is None else found | {"gap": reliability(confidence, error, self.close).gap}


def coverage(low: FloatMap, high: FloatMap, truth: FloatMap, truth_step: float = 0.0) -> float:
    """Share of intervals that contain the truth.

    Parameters
    ----------
    low, high : ndarray of any shape, float32
        Bounds, pixels per view step; an interval with a non-finite bound contains nothing.
    truth : ndarray of the same shape, float32
        Pixels where it is not finite are left out.
    truth_step : float
        Rounding step of the truth, which counts as contained if the interval comes within half a step of it.

    Returns
    -------
    float
        Percentage; NaN without truth.

    Examples
    --------
    Two of three intervals contain the truth; the third does within the truth's rounding:

    >>> import numpy as np
    >>> from sepi.scoring.error_bars import coverage
    >>> truth = np.array([0.0, 0.5, 1.0, np.nan])
    >>> low = np.array([-0.1, 0.5, 1.1, 0.0])
    >>> round(coverage(low, low + 0.2, truth), 1), coverage(low, low + 0.2, truth, truth_step=0.25)
    (66.7, 100.0)
    """
    known, half = np.isfinite(truth), truth_step / 2
    held = (low[known] <= truth[known] + half) & (high[known] >= truth[known] - half)
    held &= np.isfinite(low[known]) & np.isfinite(high[known])
    return 100 * float(held.mean()) if held.size else float("nan")


def normal_nll(error: FloatMap, sigma: FloatMap, truth_step: float = 0.0) -> float:
    """Mean negative log likelihood of errors under normal distributions of these standard deviations [1]_.

    Its expectation is minimal for the true standard deviations; smaller and larger ones both increase it.

    Parameters
    ----------
    error, sigma : ndarray of the same shape
        Pixels per view step. Pixels where either is not finite are left out.
    truth_step : float
        Rounding step of the truth; the density is averaged over half a step on either side.

    Returns
    -------
    float
        Nats; NaN without pixels.

    References
    ----------
    .. [1] T. Gneiting, A. E. Raftery, "Strictly proper scoring rules, prediction, and estimation", Journal of the
           American Statistical Association, 102:359-378, 2007. doi:10.1198/016214506000001437

    Examples
    --------
    >>> import numpy as np
    >>> from sepi.scoring.error_bars import normal_nll
    >>> error = np.random.default_rng(0).normal(0, 0.1, 10000)
    >>> [round(normal_nll(error, np.full_like(error, sigma)), 1) for sigma in (0.05, 0.1, 0.2)]
    [-0.1, -0.9, -0.6]
    """
    known = np.isfinite(error) & np.isfinite(sigma)
    if not known.any():
        return float("nan")
    # a sigma of 0 has no density: use the smallest positive number
    spread = np.maximum(sigma[known].astype(np.float64), np.finfo(np.float32).tiny)
    distance = np.abs(error[known].astype(np.float64))
    if truth_step == 0:
        return float(np.mean(0.5 * (distance / spread) ** 2 + np.log(spread) + 0.5 * np.log(2 * np.pi)))
    # slow to import
    from scipy.special import log_ndtr

    # both ends of the step as upper tails, so that their logarithms do not underflow
    near, far = (log_ndtr(-(distance + side * truth_step / 2) / spread) for side in (-1, 1))
    share = near + np.log(-np.expm1(np.minimum(far - near, -np.finfo(np.float64).tiny)))
    return float(np.mean(np.log(truth_step) - share))


def ause(doubt: FloatMap, error: FloatMap) -> float:
    """Area under the sparsification error curve [1]_: how far the ranking by uncertainty is from that by error.

    Pixels are removed once in order of decreasing uncertainty and once in order of decreasing error. The curve is the
    difference of the mean absolute errors of the remaining pixels, divided by that of all pixels.

    Parameters
    ----------
    doubt, error : ndarray of the same shape
        Uncertainty, such as a standard deviation or ``1 - confidence``; estimate minus ground truth. Pixels whose error
        is not finite are left out.

    Returns
    -------
    float
        Mean over 0, 1, ... 99 % of pixels removed: 0 if both rankings agree; NaN without pixels.

    References
    ----------
    .. [1] E. Ilg et al., "Uncertainty estimates and multi-hypotheses networks for optical flow", ECCV 2018.
           doi:10.1007/978-3-030-01234-2_40

    Examples
    --------
    >>> import numpy as np
    >>> from sepi.scoring.error_bars import ause
    >>> error = np.random.default_rng(0).normal(0, 0.1, (100, 100))
    >>> ause(np.abs(error), error), round(ause(np.ones_like(error), error), 1)
    (0.0, 0.6)
    """
    # NaN counts as the largest uncertainty
    curve = sparsification(-np.nan_to_num(doubt, nan=np.inf, posinf=np.inf, neginf=-np.inf), error)
    return 0.0 if curve[0] == 0 else float(np.mean(curve - oracle(error)) / curve[0])


def reliability(confidence: FloatMap, error: FloatMap, close: float) -> Reliability:
    """Reliability of a confidence: how often errors are small, by stated probability [1]_.

    Parameters
    ----------
    confidence : ndarray
        Probability of an absolute error of at most ``close``, 0..1.
    error : ndarray of the same shape
        Estimate minus ground truth; non-finite errors count as large. Leave out pixels without ground truth.
    close : float
        Error bound, in the unit of ``error``.

    Returns
    -------
    Reliability
        By ten equal bins of 0..1.

    References
    ----------
    .. [1] A. Niculescu-Mizil, R. Caruana, "Predicting good probabilities with supervised learning", ICML 2005.
           doi:10.1145/1102351.1102430

    Examples
    --------
    A confidence of 0.85 where nine of ten errors are small:

    >>> import numpy as np
    >>> from sepi.scoring.error_bars import reliability
    >>> found = reliability(np.full(10, 0.85), np.array([0.01] * 9 + [0.5]), close=0.07)
    >>> int(found.pixels[8]), round(float(found.found[8]), 3), round(found.gap, 3)
    (10, 0.9, 5.0)
    """
    place = np.clip((BINS * confidence.ravel()).astype(np.int64), 0, BINS - 1)
    pixels, said, found = (
        np.bincount(place, weights, BINS).astype(np.float64)
        for weights in (None, confidence.ravel(), np.abs(error.ravel()) <= close)
    )
    there = np.where(pixels > 0, pixels, np.nan)
    return Reliability(pixels, said / there, found / there)
