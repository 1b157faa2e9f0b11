"""What several compared methods do with costs: differences, filters, the best candidate of each pixel.

A guided filter [1]_ smooths each candidate's costs and keeps the edges of the reference view: in each window the output
is a linear function of the guide's colours, and each pixel is the mean over all windows that contain it. Then each
pixel selects the candidate of least cost (``guided_costs`` [2]_, a choice of the global optimisation). A weighted
median [3]_ removes outliers and rough edges from a map without introducing new values (``guided_median``, another).

References
----------
.. [1] He, Sun, Tang: Guided image filtering. IEEE TPAMI 35(6), 2013. doi:10.1109/TPAMI.2012.213
.. [2] Hosni, Rhemann, Bleyer, Rother, Gelautz: Fast cost-volume filtering for visual correspondence and beyond.
   IEEE TPAMI 35(2), 2013. doi:10.1109/TPAMI.2012.156
.. [3] Ma, He, Wei, Sun, Wu: Constant time weighted median filtering for stereo matching and beyond. ICCV 2013.
   doi:10.1109/ICCV.2013.13
"""

from collections.abc import Iterable, Iterator

import cv2
import numpy as np
import numpy.typing as npt
from pydantic import Field

from sepi.kernels import weighted_median as kernels
from sepi.lightfield import FloatMap, LightField
from sepi.stage import Choice, CostVolume, Parameters, Progress, StageMaps, require_costs

GREY = np.array([0.299, 0.587, 0.114], np.float32)
"""Weights of red, green and blue in the grey value (ITU-R BT.601)."""

IntArray = npt.NDArray[np.int64]
Previous = StageMaps | None
"""Maps of the stage before; None for the first stage."""


def least_costs(volume: CostVolume) -> IntArray:
    """Index of the candidate of least cost of each pixel.

    Parameters
    ----------
    volume : CostVolume

    Returns
    -------
    ndarray, shape (H, W), int64
        Index into ``volume.disparities``; the first of equal costs.

    Examples
    --------
    >>> import numpy as np
    >>> from sepi.extensions.methods.costs import least_costs
    >>> from sepi.stage import CostVolume
    >>> volume = CostVolume(np.arange(3, dtype=np.float32), np.float16([[[0.9, 0.5]], [[0.1, 0.5]], [[0.9, 0.5]]]))
    >>> least_costs(volume).tolist()
    [[1, 0]]
    """
    return np.asarray(np.argmin(volume.costs, axis=0))


def disparity_of(volume: CostVolume, labels: IntArray) -> FloatMap:
    """Disparity of the chosen candidates, refined by the parabola through the costs of each and its two neighbours.

    Parameters
    ----------
    volume : CostVolume
    labels : ndarray, shape (H, W), int64
        Numbers of candidates.

    Returns
    -------
    ndarray, shape (H, W), float32
        Pixels per view step. Candidates at an end of the range, or that are not a minimum, are not refined.

    Examples
    --------
    Costs that fall to a minimum at 1.25, between two candidates:

    >>> import numpy as np
    >>> from sepi.extensions.methods.costs import disparity_of, least_costs
    >>> from sepi.stage import CostVolume
    >>> candidates = np.arange(3, dtype=np.float32)
    >>> volume = CostVolume(candidates, ((candidates - 1.25) ** 2).astype(np.float16)[:, None, None])
    >>> disparity_of(volume, least_costs(volume)).tolist()
    [[1.25]]
    """
    return between_candidates(volume.disparities, volume.costs, labels)


def between_candidates(disparities: FloatMap, costs: npt.NDArray[np.floating], labels: IntArray) -> FloatMap:
    """Disparity of the chosen candidates as of :func:`disparity_of`; costs (K, ...), infinite for rejected ones."""
    last = len(disparities) - 1
    numbers = (np.clip(labels + step, 0, last)[None] for step in (-1, 0, 1))
    below, here, above = (np.take_along_axis(costs, number, axis=0)[0].astype(np.float64) for number in numbers)
    with np.errstate(invalid="ignore"):
        curvature, slope = below - 2 * here + above, below - above
    inner = (labels > 0) & (labels < last) & (here <= np.minimum(below, above))
    inner &= (curvature > 0) & np.isfinite(curvature)
    offset = np.where(inner, slope, 0) / (2 * np.where(inner, curvature, 1))
    return np.asarray(disparities[labels] + (disparities[1] - disparities[0]) * offset, np.float32)


def distinctness(volume: CostVolume, labels: IntArray) -> FloatMap:
    """Confidence: how far the chosen candidates' costs are below the mean over all candidates.

    Parameters
    ----------
    volume : CostVolume
    labels : ndarray, shape (H, W), int64
        Numbers of candidates.

    Returns
    -------
    ndarray, shape (H, W), float32
        As a fraction of the mean, 0..1: 1 for a unique perfect match, 0 if all candidates have the same cost.

    Examples
    --------
    >>> import numpy as np
    >>> from sepi.extensions.methods.costs import distinctness, least_costs
    >>> from sepi.stage import CostVolume
    >>> volume = CostVolume(np.arange(3, dtype=np.float32), np.float16([[[0.75, 0.5]], [[0, 0.5]], [[0.75, 0.5]]]))
    >>> distinctness(volume, least_costs(volume)).tolist()
    [[1.0, 0.0]]
    """
    mean = volume.costs.mean(axis=0, dtype=np.float32)
    least = volume.costs.min(axis=0).astype(np.float32)
    chosen = np.take_along_axis(volume.costs, labels[None], axis=0)[0].astype(np.float32)
    # costs may be negative
    spread = np.maximum(mean - np.minimum(least, 0), np.float32(1e-6))
    return np.asarray(np.clip((mean - chosen) / spread, 0, 1), np.float32)


def maps_of(volume: CostVolume) -> StageMaps:
    """Disparity and confidence of the candidates of least cost, with the cost volume."""
    labels = least_costs(volume)
    return StageMaps(disparity_of(volume, labels), distinctness(volume, labels), cost_volume=volume)


def colour_differences(sheared: FloatMap, reference: FloatMap) -> Iterator[FloatMap]:
    """Mean absolute channel difference of each view (N, 3, H, W) from one view (3, H, W); each (H, W)."""
    for view in sheared:
        red, green, blue = cv2.absdiff(view, reference)
        yield (red + green + blue) * np.float32(1 / 3)


class GuidedFilter:
    """A guided filter [1]_ that applies one guide to many maps, such as the costs of all candidates.

    Parameters
    ----------
    guide : ndarray, shape (H, W, 3), float32
        Colours in 0..1.
    radius : int
        The windows are ``2 radius + 1`` pixels wide.
    epsilon : float
        Colour variance within a window above which its edges are preserved.

    Attributes
    ----------
    guide : ndarray, shape (H, W, 3), float32
        Its colours less their mean.
    shape : (int, int)
        Height and width.

    References
    ----------
    .. [1] He, Sun, Tang: Guided image filtering. IEEE TPAMI 35(6), 2013. doi:10.1109/TPAMI.2012.213

    Examples
    --------
    Noise is smoothed, and the step is preserved, since the guide has it too:

    >>> import numpy as np
    >>> from sepi.extensions.methods.costs import GuidedFilter
    >>> step = np.zeros((32, 32), np.float32)
    >>> step[:, 16:] = 1
    >>> smooth = GuidedFilter(np.repeat(step[..., None], 3, axis=2), radius=4, epsilon=1e-4)
    >>> noisy = step + np.random.default_rng(0).normal(0, 0.2, step.shape).astype(np.float32)
    >>> bool(np.abs(smooth(noisy) - step).max() < 0.5 * np.abs(noisy - step).max())
    True
    >>> bool(np.abs(smooth(step) - step).max() < 0.01)
    True
    """

    def __init__(self, guide: FloatMap, radius: int, epsilon: float) -> None:
        self.shape = guide.shape[:2]
        self._size = (2 * radius + 1, 2 * radius + 1)
        # centred first: one-pass variances of nearly constant colours lose precision in float32
        offset = guide.mean(axis=(0, 1), dtype=np.float64).astype(np.float32)
        self.guide, self._mean = guide - offset, self._box(guide) - offset
        products, of_means = (one[..., None] * one[..., None, :] for one in (self.guide, self._mean))
        covariance = self._box(products.reshape(*self.shape, 9)).reshape(products.shape) - of_means
        self._inverse = np.linalg.inv(covariance + epsilon * np.eye(3)).astype(np.float32)

    def __call__(self, values: FloatMap) -> FloatMap:
        """Filter a map.

        Parameters
        ----------
        values : ndarray, shape (H, W), float32

        Returns
        -------
        ndarray, shape (H, W), float32
        """
        slopes, offsets = self.lines(values)
        return np.asarray((slopes * self.guide).sum(axis=2) + offsets, np.float32)

    def lines(self, values: FloatMap) -> tuple[FloatMap, FloatMap]:
        """The linear functions of ``guide`` that filter a map.

        Parameters
        ----------
        values : ndarray, shape (H, W), float32

        Returns
        -------
        slopes : ndarray, shape (H, W, 3), float32
        offsets : ndarray, shape (H, W), float32
        """
        mean = self._box(values)
        covariance = self._box(self.guide * values[..., None]) - self._mean * mean[..., None]
        slopes = np.einsum("hwij,hwj->hwi", self._inverse, covariance)
        return self._box(slopes), self._box(mean - (slopes * self._mean).sum(axis=2))

    def _box(self, values: FloatMap) -> FloatMap:
        return np.asarray(cv2.blur(values, self._size, borderType=cv2.BORDER_REFLECT))


def filtered(smooth: GuidedFilter, disparities: FloatMap, costs: Iterable[FloatMap], progress: Progress) -> CostVolume:
    """Filtered costs, from those of one candidate after the other (H, W)."""
    volume = np.empty((len(disparities), *smooth.shape), np.float16)
    for k, one in enumerate(costs):
        volume[k] = smooth(one)
        progress((k + 1) / len(disparities))
    return CostVolume(disparities, volume)


def weighted_median(
    values: FloatMap, guide: FloatMap, radius: int, sigma: float, weight: FloatMap | None = None
) -> FloatMap:
    """The value in each window at which half of the weight lies below [1]_.

    Parameters
    ----------
    values : ndarray, shape (H, W), float32
        The map to filter.
    guide : ndarray, shape (H, W, 3), float32
        Colours in 0..1.
    radius : int
        The window is ``2 radius + 1`` pixels wide; it is cropped at the image border.
    sigma : float
        RGB distance at which a pixel's weight falls to ``exp(-1/2)``, colours in 0..1.
    weight : ndarray, shape (H, W), float32, optional
        Additional weight of each pixel, not negative, such as its confidence. Pixels whose window has no
        weight keep their value.

    Returns
    -------
    ndarray, shape (H, W), float32

    References
    ----------
    .. [1] Ma, He, Wei, Sun, Wu: Constant time weighted median filtering for stereo matching and beyond. ICCV 2013.
       doi:10.1109/ICCV.2013.13

    Examples
    --------
    An edge of the map that is two pixels away from the guide's edge moves there:

    >>> import numpy as np
    >>> from sepi.extensions.methods.costs import weighted_median
    >>> guide = np.zeros((9, 12, 3), np.float32)
    >>> guide[:, 6:] = 1
    >>> fattened = np.zeros((9, 12), np.float32)
    >>> fattened[:, 4:] = 2
    >>> weighted_median(fattened, guide, radius=4, sigma=0.1, weight=np.ones((9, 12), np.float32))[4].tolist()
    [0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 2.0, 2.0, 2.0, 2.0, 2.0, 2.0]
    """
    out = np.empty(values.shape, np.float32)
    weight = np.ones(values.shape, np.float32) if weight is None else weight
    kernels.weighted_medians(values, guide, radius, sigma, weight, out)
    return out


class GuidedCostsParameters(Parameters):
    """Parameters of the filtered costs."""

    radius: int = Field(5, ge=1, le=50, description="window of 2 r + 1 pixels")
    epsilon: float = Field(1e-4, gt=0, description="variance of colour above which edges are kept, colours in 0..1")


def guided_costs(
    light_field: LightField, previous: StageMaps | None, parameters: GuidedCostsParameters, progress: Progress
) -> StageMaps:
    """Candidates of least filtered cost.

    Requires maps with a cost volume.

    Returns
    -------
    StageMaps
        Without the cost volume.
    """
    before, volume = require_costs(previous)
    smooth = GuidedFilter(light_field.reference_view, parameters.radius, parameters.epsilon)
    costs = (of_candidate.astype(np.float32) for of_candidate in volume.costs)
    best = maps_of(filtered(smooth, volume.disparities, costs, progress))
    return before.updated(best.disparity, best.confidence).without_costs()


class GuidedMedianParameters(GuidedCostsParameters):
    """Parameters of the filtered costs and of the median of the map."""

    median_radius: int = Field(3, ge=0, le=50, description="median window of 2 r + 1 pixels; 0: no median")
    median_sigma: float = Field(0.05, gt=0, description="RGB distance (0..1) at which weights in the median fall")


def guided_median(
    light_field: LightField, previous: StageMaps | None, parameters: GuidedMedianParameters, progress: Progress
) -> StageMaps:
    """Candidates of least filtered cost, and the weighted median of their map.

    Requires maps with a cost volume.

    Returns
    -------
    StageMaps
        Without the cost volume.
    """
    maps = guided_costs(light_field, previous, parameters, progress)
    radius, sigma = parameters.median_radius, parameters.median_sigma
    disparity = weighted_median(maps.disparity, light_field.reference_view, radius, sigma)
    return maps.updated(disparity, maps.confidence)


CHOICES = {"optimize": {"guided_costs": Choice(GuidedCostsParameters, guided_costs)}}
CHOICES["optimize"]["guided_median"] = Choice(GuidedMedianParameters, guided_median)
