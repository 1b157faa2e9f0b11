"""Scores of error bars: coverage and width of the intervals, and whether doubt lies where errors are.

An interval that always holds the truth may be as wide as the range: coverage says nothing without the width beside it.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import NamedTuple, Self

import numpy as np
import numpy.typing as npt

from sepi.io.scores import Scores
from sepi.lightfield import BoolMap, FloatMap
from sepi.scoring.confidence import oracle, sparsification
from sepi.scoring.crops import in_frame
from sepi.stage import CLOSE, REACH, StageMaps

ERROR_BAR_SCORES: dict[str, str] = {
    "coverage": "coverage %",
    "width": "width",
    "nll": "NLL",
    "ause": "AUSE",
    "ause_confidence": "AUSE, confidence",
    "gap": "confidence's gap %",
}
"""Score of error bars to its name in tables; maps without them have none of these."""

BINS = 10
"""Parts of 0..1 that the said probabilities are sorted into."""

ENOUGH = 0.01
"""Least share of the pixels that a bin must hold for its gap to count."""

FloatArray = npt.NDArray[np.float64]


class Reliability(NamedTuple):
    """How often errors are small where a confidence says how often they are; arrays (10,), by said probability.

    Attributes
    ----------
    pixels : ndarray
        How many have such a confidence.
    said : ndarray
        Their mean confidence; NaN without pixels.
    found : ndarray
        Share of them whose error is within the bound; NaN without pixels.
    """

    pixels: FloatArray
    said: FloatArray
    found: FloatArray

    @property
    def enough(self) -> BoolMap:
        """Which bins (10,) hold enough pixels: what few say is noise."""
        return np.asarray((self.pixels > 0) & (self.pixels >= ENOUGH * self.pixels.sum()))

    @property
    def gap(self) -> float:
        """Largest difference of what was said and found, in percent, over bins that hold enough pixels."""
        gaps = np.abs(self.found - self.said)[self.enough]
        return 100 * float(gaps.max()) if gaps.size else float("nan")


@dataclass(frozen=True)
class ErrorBars:
    """Error bars of a disparity map, with what their scores need.

    Attributes
    ----------
    sigma, low, high, confidence : ndarray, shape (H, W), float32
        As :class:`sepi.StageMaps` has them.
    close : float or None
        Error in pixels per view step that the confidence is about; None where nobody knows how far the views stand
        apart.
    truth_step : float
        What the ground truth is a multiple of, pixels per view step; 0 unless it is rounded.
    """

    sigma: FloatMap
    low: FloatMap
    high: FloatMap
    confidence: FloatMap
    close: float | None = None
    truth_step: float = 0.0

    @classmethod
    def of(cls, maps: StageMaps, reach: float | None = None, truth_step: float = 0.0) -> Self | None:
        """Those of finished maps, None where they have none; ``reach`` is the light field's."""
        if maps.sigma is None or maps.low is None or maps.high is None:
            return None
        close = CLOSE * REACH / reach if reach else None
        return cls(maps.sigma, maps.low, maps.high, maps.confidence, close, truth_step)

    def in_frame(self, offset: tuple[int, int], shape: tuple[int, int]) -> Self:
        """Those of a crop in the whole picture, as :func:`sepi.scoring.crops.in_frame` puts its map."""
        maps = (self.sigma, self.low, self.high, self.confidence)
        sigma, low, high, confidence = (in_frame(values, offset, shape)[0] for values in maps)
        return replace(self, sigma=sigma, low=low, high=high, confidence=confidence)

    def scores(self, estimate: FloatMap, ground_truth: FloatMap, chosen: BoolMap) -> Scores:
        """Those of :data:`ERROR_BAR_SCORES`, over the chosen pixels (H, W) that have finite ground truth."""
        picked = (values[chosen] for values in (estimate, ground_truth, self.sigma, self.low, self.high))
        disparity, truth, sigma, low, high = picked
        confidence = self.confidence[chosen]
        error = np.abs(disparity.astype(np.float64) - truth)
        # an interval round nothing is none
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
    """How often an interval holds the truth.

    Parameters
    ----------
    low, high : ndarray of any shape, float32
        Bounds, pixels per view step; one that is not finite holds nothing.
    truth : ndarray of the same shape, float32
        Pixels where it is not finite count nowhere.
    truth_step : float
        What the truth is a multiple of: it is held where the interval meets half a step on either side.

    Returns
    -------
    float
        Percentage; NaN without truth.

    Examples
    --------
    Two of three, and the third within the truth's own rounding:

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

    It is least, on average, where the standard deviations are the true ones: too small ones cost as too large ones do.

    Parameters
    ----------
    error, sigma : ndarray of the same shape
        Pixels per view step. Where one is not finite, the pixel is left out.
    truth_step : float
        What the truth is a multiple of: the density is then its mean over half a step on either side.

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
    # a sigma of 0 is no distribution; its error costs what the smallest number's does
    spread = np.maximum(sigma[known].astype(np.float64), np.finfo(np.float32).tiny)
    distance = np.abs(error[known].astype(np.float64))
    if truth_step == 0:
        return float(np.mean(0.5 * (distance / spread) ** 2 + np.log(spread) + 0.5 * np.log(2 * np.pi)))
    # slow to import
    from scipy.special import log_ndtr

    # both ends of the step as upper tails, whose logarithms do not underflow
    near, far = (log_ndtr(-(distance + side * truth_step / 2) / spread) for side in (-1, 1))
    share = near + np.log(-np.expm1(np.minimum(far - near, -np.finfo(np.float64).tiny)))
    return float(np.mean(np.log(truth_step) - share))


def ause(doubt: FloatMap, error: FloatMap) -> float:
    """Area under the sparsification error curve [1]_: how far doubt is from the order of the errors.

    Pixels are taken away from the most doubtful on, and, beside that, from the largest error on. The curve is the
    difference of the mean absolute errors of those that stay, divided by that of all pixels.

    Parameters
    ----------
    doubt, error : ndarray of the same shape
        The larger the more doubtful, such as a standard deviation, or ``1 - confidence``; estimate minus ground truth.
        Pixels whose error is not finite are left out.

    Returns
    -------
    float
        Mean over the shares 0, 1, ... 99 % taken away: 0 for the order of the errors; NaN without pixels.

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
    # doubt that is no number is the greatest
    curve = sparsification(-np.nan_to_num(doubt, nan=np.inf, posinf=np.inf, neginf=-np.inf), error)
    if curve[0] == 0:
        return 0.0
    return float(np.mean(curve - oracle(error)) / curve[0])


def reliability(confidence: FloatMap, error: FloatMap, close: float) -> Reliability:
    """Reliability of a confidence: how often errors are small, by stated probability [1]_.

    Parameters
    ----------
    confidence : ndarray
        Probability of an absolute error of at most ``close``, 0..1.
    error : ndarray of the same shape
        Estimate minus ground truth; one that is not finite is a large one. Leave out pixels without ground truth.
    close : float
        In the error's unit.

    Returns
    -------
    Reliability
        By ten equal parts of 0..1.

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
