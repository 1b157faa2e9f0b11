r"""Depth from phase-shifted views, a compared method: all views against the reference view, with sub-pixel shifts [1]_.

The views of a lenslet camera differ by a few pixels at most, so that neighbouring candidates differ by fractions of a
pixel. Interpolation blurs views by a different amount at each fraction; the phase shift theorem avoids this. The data
cost is the initial choice ``acc``, the remaining steps are the choice ``confident_labels`` of the optimisation.

1. *Phase shift.* ``I(x + D) = F^-1{ F{I}(w) exp(2 pi i w D) }``, with ``D = -l b`` for a view of baseline ``b`` and the
   candidate ``l``.
2. *Data cost.* With ``r_u = I(u_c, .) - I(u, . + D)`` and sums over the views ``u`` and a small window round ``x``,
   ``C(x, l) = sum a min(|r_u|, t1) + (1 - a) (B(u) min(|d/dx r_u|, t2) + (1 - B(u)) min(|d/dy r_u|, t2))``. The share
   ``B(u) = |b_x| / (|b_x| + |b_y|)`` weights gradients along the view's baseline; a shift does not change those across
   it.
3. *Aggregation.* Every cost slice is filtered with the reference view as guide; the candidates of least cost, after a
   weighted median, are the first map ``l_a``. Pixels whose costs hardly vary over the candidates are unreliable.
4. *Labels.* The labels minimise ``sum_x C(x, l) + L1 [x reliable] |l - l_a| + L2 [x matched] |l - l_c| + L3 sum_x'
   |l - l(x')|`` over neighbours ``x'``; ``l_c`` is the disparity of features matched in several views
   (:func:`matched_disparities`).
5. *Iterative refinement.* From labels to a continuous map, four times: costs of the distance to the current map are
   filtered slice by slice, and the parabola through the least cost and its neighbours,
   ``l - (E(l+) - E(l-)) / (2 (E(l+) + E(l-) - 2 E(l)))``, gives the new map.

Choices made here where the publication is not specific or could not be confirmed:

- The border: views are not periodic, so an image is extended by its mirror image as far as samples reach; beyond, that
  is blended with the mirror image of the opposite border, so that the period has no seam.
- Colours: differences are means over the channels, and the gradients central differences.
- All numbers: the share ``a``, truncations, the size of windows and filters, and the weights. Truncations match the
  differences caused by occlusion and texture; costs are scaled to 0..1; weights are in hundredths of the range.
- The edge-preserving filter: the guided filter.
- Graph cuts: replaced by message passing on the same energy (for the reason, see
  :mod:`sepi.extensions.methods.markov_field`).
- Which pixels are unreliable: the standard deviation of their costs over the candidates is below a threshold.
- Features: mutual nearest neighbours with Lowe's ratio test, and a median instead of the robust regression.
- The costs of the refinement: the squared distance, truncated at two labels. Truncated at one label, that is 0 at a
  pixel's own label and 1 at all others, slopes steeper than a quarter of a label per pixel become steps.
- The correction of a lenslet camera's distortion is left out: it belongs to decoding.

References
----------
.. [1] Jeon, Park, Choe, Park, Bok, Tai, Kweon: Accurate depth map estimation from a lenslet light field camera.
   CVPR 2015. doi:10.1109/CVPR.2015.7298762
"""

from collections.abc import Iterator
from dataclasses import replace

import cv2
import numpy as np
import numpy.typing as npt
from pydantic import Field
from scipy import fft

from sepi.extensions.methods.costs import GuidedFilter, Previous, distinctness, filtered, maps_of, weighted_median
from sepi.extensions.methods.markov_field import labels_of_least_energy
from sepi.kernels import thread_count
from sepi.lightfield import FloatArray, FloatMap, LightField, as_unit_float, without_reference
from sepi.matching.candidates import CandidateParameters, CandidateRule, number_field
from sepi.stage import Choice, CostVolume, Needs, Parameters, Progress, StageMaps, no_progress, require_costs

IntArray = npt.NDArray[np.int64]

_FARTHEST = 2.0
"""Truncation of the refinement's costs: distance from the current depth in labels."""


class AccParameters(CandidateParameters):
    """Parameters of the data cost."""

    rule = CandidateRule(usual=75, finest=0.02, coarsest=0.5, volume_bytes=2**28)
    needs = Needs(bytes_per_sample=14, bytes_per_pixel=1300, bytes_per_candidate=8, seconds_per_megasample=4)

    num_disparities: int | None = number_field(rule, "docs/reproduce/compared.md")
    colour_share: float = Field(0.5, ge=0, le=1, description="share of colours in the cost; gradients have the rest")
    colour_truncation: float = Field(0.05, gt=0, description="largest difference of colours, 0..1, that counts")
    gradient_truncation: float = Field(0.02, gt=0, description="largest difference of gradients, 1/px, that counts")
    window_radius: int = Field(1, ge=0, le=10, description="cost window of 2 r + 1 pixels; 0: none")
    filter_radius: int = Field(5, ge=1, le=50, description="window of 2 r + 1 pixels that filters cost slices")
    filter_epsilon: float = Field(1e-4, gt=0, description="variance of colours, 0..1, above which filtered edges stay")
    median_radius: int = Field(3, ge=1, le=50, description="weighted median's window of 2 r + 1 pixels")
    median_sigma: float = Field(0.05, gt=0, description="RGB distance (0..1) at which weights in the median fall")


class ConfidentLabelsParameters(Parameters):
    """Parameters of the multi-label optimisation and the refinement."""

    needs = Needs(bytes_per_sample=6, bytes_per_pixel=3000, seconds_per_megasample=1)

    reliable_deviation: float = Field(0.003, ge=0, description="standard deviation of the costs of reliable pixels")
    fidelity: float = Field(0.01, ge=0, description="cost of 1 % of the range off a reliable pixel's first depth")
    correspondence: float = Field(0.2, ge=0, description="cost of 1 % of the range off matched features' depth")
    smoothness: float = Field(0.003, ge=0, description="cost of a change by a hundredth of the disparity range")
    iterations: int = Field(5, ge=1, le=100, description="passes of the messages, there and back")
    refinements: int = Field(4, ge=0, le=100, description="number of fits of the continuous depth")
    filter_radius: int = Field(3, ge=1, le=50, description="window of 2 r + 1 pixels that filters the refinement")
    filter_epsilon: float = Field(1e-4, gt=0, description="variance of colours, 0..1, above which filtered edges stay")


def acc(light_field: LightField, previous: Previous, parameters: AccParameters, progress: Progress) -> StageMaps:
    """Candidates of least filtered cost.

    Returns
    -------
    StageMaps
        With the cost volume.
    """
    disparities = parameters.candidates(light_field)
    guide, window = light_field.reference_view, (2 * parameters.window_radius + 1,) * 2
    smooth = GuidedFilter(guide, parameters.filter_radius, parameters.filter_epsilon)
    costs = phase_shift_costs(light_field, disparities, parameters, lambda done: progress(0.9 * done))
    means = (cv2.blur(of_candidate, window, borderType=cv2.BORDER_REFLECT) for of_candidate in costs)
    found = maps_of(filtered(smooth, disparities, means, lambda done: progress(0.9 + 0.1 * done)))
    median = weighted_median(found.disparity, guide, parameters.median_radius, parameters.median_sigma)
    return replace(found, disparity=median)


def phase_shift_costs(
    light_field: LightField, disparities: FloatMap, parameters: AccParameters, progress: Progress
) -> FloatMap:
    """Mean truncated difference between the reference view and the other views shifted by each candidate.

    Parameters
    ----------
    light_field : LightField
    disparities : ndarray, shape (K,), float32
        Candidates, pixels per view step.
    parameters : AccParameters
    progress : callable

    Returns
    -------
    ndarray, shape (K, H, W), float32
        0..1.
    """
    reference = np.ascontiguousarray(light_field.reference_view.transpose(2, 0, 1))
    farthest = light_field.reach * float(np.abs(disparities).max())
    costs = np.zeros((len(disparities), *light_field.shape), np.float32)
    others = np.argwhere(without_reference(light_field, light_field.present))
    for n, (t, s) in enumerate(others):
        view, baseline = as_unit_float(light_field.rgb_views[t, s]), light_field.baselines[t, s]
        # gradients along the baseline; none stands where the reference view does
        share = float(np.abs(baseline[1]) / np.abs(baseline).sum()) if baseline.any() else 0.5
        shifted = phase_shifted(view.transpose(2, 0, 1), -disparities[:, None] * baseline, farthest)
        for cost, moved in zip(costs, shifted, strict=True):
            cost += truncated_difference(moved, reference, share, parameters)
        progress((n + 1) / len(others))
    share, truncation = parameters.colour_share, parameters.colour_truncation
    costs /= np.float32(len(others) * (share * truncation + (1 - share) * parameters.gradient_truncation))
    return costs


def truncated_difference(moved: FloatMap, reference: FloatMap, share: float, parameters: AccParameters) -> FloatMap:
    """Truncated differences of a view's colours and gradients, (3, H or more, W or more), from (3, H, W); (H, W)."""
    height, width = reference.shape[1:]
    colour, across, down = np.zeros((3, height, width), np.float32)
    for here, own in zip(moved, reference, strict=True):
        residual = here[:height, :width] - own
        colour += np.abs(residual)
        # central differences without the division by 2
        across += np.abs(cv2.Sobel(residual, -1, 1, 0, ksize=1, borderType=cv2.BORDER_REPLICATE))
        down += np.abs(cv2.Sobel(residual, -1, 0, 1, ksize=1, borderType=cv2.BORDER_REPLICATE))
    gradients = share * np.minimum(across / 6, parameters.gradient_truncation)
    gradients += (1 - share) * np.minimum(down / 6, parameters.gradient_truncation)
    colours = np.minimum(colour / 3, parameters.colour_truncation)
    return np.asarray(parameters.colour_share * colours + (1 - parameters.colour_share) * gradients, np.float32)


def confident_labels(
    light_field: LightField, previous: StageMaps | None, parameters: ConfidentLabelsParameters, progress: Progress
) -> StageMaps:
    """Labels of least energy, guided by reliable pixels and matched features, refined to a continuous map.

    Requires maps with a cost volume.

    Returns
    -------
    StageMaps
        Without the cost volume.
    """
    before, volume = require_costs(previous)
    costs = _data_terms(light_field, before.disparity, volume, parameters)
    progress(0.2)
    per_label = np.float32(100 / (len(volume.disparities) - 1))
    weight = np.full(before.disparity.shape, parameters.smoothness * per_label, np.float32)
    labels = labels_of_least_energy(costs, weight, weight, len(volume.disparities), parameters.iterations)
    del costs
    progress(0.6)
    disparity = volume.disparities[labels]
    smooth = GuidedFilter(light_field.reference_view, parameters.filter_radius, parameters.filter_epsilon)
    for n in range(parameters.refinements):
        disparity = refined(disparity, volume.disparities, smooth)
        progress(0.6 + 0.4 * (n + 1) / parameters.refinements)
    return before.updated(disparity, distinctness(volume, labels)).without_costs()


def _data_terms(
    light_field: LightField, first: FloatMap, volume: CostVolume, parameters: ConfidentLabelsParameters
) -> FloatMap:
    """Unary costs of each label; shape (K, H, W), float32."""
    low, high = float(volume.disparities[0]), float(volume.disparities[-1])
    hundredths = 100 / (high - low)
    costs = volume.costs.astype(np.float32)
    reliable = costs.std(axis=0) >= parameters.reliable_deviation
    weight = np.float32(parameters.fidelity * hundredths) * reliable
    for k, disparity in enumerate(volume.disparities):
        costs[k] += weight * np.abs(first - disparity)
    rows, columns, matched = matched_disparities(light_field, low, high)
    off = np.abs(volume.disparities[:, None] - matched)
    costs[:, rows, columns] += np.float32(parameters.correspondence * hundredths) * off
    return costs


def refined(disparity: FloatMap, disparities: FloatMap, smooth: GuidedFilter) -> FloatMap:
    """A continuous map from labels: the least filtered cost of the distance to the current map.

    Parameters
    ----------
    disparity : ndarray, shape (H, W), float32
    disparities : ndarray, shape (K,), float32
        Disparities of the labels, pixels per view step.
    smooth : GuidedFilter

    Returns
    -------
    ndarray, shape (H, W), float32
    """
    step = disparities[1] - disparities[0]
    off = (np.minimum(np.abs(disparity - label) / step, np.float32(_FARTHEST)) for label in disparities)
    return maps_of(filtered(smooth, disparities, map(np.square, off), no_progress)).disparity


CHOICES = {
    "initial": {"acc": Choice(AccParameters, acc)},
    "optimize": {"confident_labels": Choice(ConfidentLabelsParameters, confident_labels)},
}


_SEAM = 16
"""Pixels over which the two mirror images are blended."""


def phase_shifted(pictures: FloatMap, offsets: FloatArray, farthest: float | None) -> Iterator[FloatMap]:
    """Pictures shifted by fractions of a pixel in the Fourier domain.

    Parameters
    ----------
    pictures : ndarray, shape (C, H, W), float32
    offsets : ndarray, shape (M, 2), float64
        Down and across, pixels.
    farthest : float or None
        Largest offset in pixels along either axis. None: the pictures are periodic.

    Yields
    ------
    ndarray, shape (C, H or more, W or more), float32
        Samples at ``(y, x) + offset``; values beyond the pictures' height and width are meaningless.
    """
    if farthest is not None:
        margin = 2 * int(np.ceil(farthest)) + _SEAM
        pictures = _seamless(_seamless(pictures, 1, margin), 2, margin)
    size, spectrum = pictures.shape[1:], fft.rfft2(pictures)
    rows, columns = (_phases(length, offsets[:, axis]) for axis, length in enumerate(size))
    columns = columns[:, : spectrum.shape[2]]
    for down, across in zip(rows, columns, strict=True):
        yield fft.irfft2(spectrum * (down[:, None] * across), s=size, overwrite_x=True, workers=thread_count())


def _phases(length: int, offsets: npt.NDArray[np.float64]) -> npt.NDArray[np.complex64]:
    """Phase factors of all frequencies for each offset; shape (M, length), complex64."""
    phases = np.exp(2j * np.pi * np.outer(offsets, np.fft.fftfreq(length)))
    if length % 2 == 0:
        # the Nyquist frequency represents both signs: a real image stays real
        phases[:, length // 2] = phases[:, length // 2].real
    return phases.astype(np.complex64)


def _seamless(pictures: FloatMap, axis: int, margin: int) -> FloatMap:
    """Images extended at the end of an axis by their mirror image, blended into that of the start."""
    length = pictures.shape[axis]
    extra = fft.next_fast_len(length + margin, real=True) - length
    along = np.moveaxis(pictures, axis, -1)
    beyond_end = np.pad(along, ((0, 0), (0, 0), (0, extra)), mode="symmetric")[..., length:]
    before_begin = np.pad(along, ((0, 0), (0, 0), (extra, 0)), mode="symmetric")[..., :extra]
    # both halves are unblended as far as samples reach
    step = np.linspace(-extra / 2, extra / 2, extra, dtype=np.float32) / np.float32(_SEAM / 2)
    share = np.float32(0.5) + np.float32(0.5) * np.sin(np.float32(np.pi / 2) * np.clip(step, -1, 1))
    joined = np.concatenate([along, beyond_end + share * (before_begin - beyond_end)], axis=-1)
    return np.ascontiguousarray(np.moveaxis(joined, -1, axis))


_RATIO = 0.8
"""Ratio of distances to the nearest and second nearest descriptor above which a match is rejected [1]_."""

_OFF_LINE = 1.0
"""Maximum distance of a match from its predicted position, pixels."""

_LEAST_SUPPORT = 0.25
"""Share of the other views that must agree on a feature's disparity."""

_SMALLEST = 16
"""Minimum size of views in pixels for the detection of features."""


def matched_disparities(light_field: LightField, low: float, high: float) -> tuple[IntArray, IntArray, FloatMap]:
    """Pixels of the reference view whose disparity follows from matched features.

    Parameters
    ----------
    light_field : LightField
    low, high : float
        Disparity range of accepted matches, pixels per view step.

    Returns
    -------
    rows, columns : ndarray, shape (M,), int64
        Each pixel occurs once.
    disparity : ndarray, shape (M,), float32
        Pixels per view step.
    """
    points, descriptors = features_of(light_field.reference_view)
    others = without_reference(light_field, light_field.present)
    baselines = light_field.baselines[others]
    found = np.full((len(baselines), len(points)), np.nan)
    for n, (t, s) in enumerate(np.argwhere(others)):
        there, of_view = features_of(as_unit_float(light_field.rgb_views[t, s]))
        first, second = mutual_matches(descriptors, of_view)
        moved = there[second] - points[first]
        # NaN where a view stands where the reference view does
        along = -(moved @ baselines[n]) / (baselines[n] @ baselines[n] or np.nan)
        aside = np.hypot(*(moved + along[:, None] * baselines[n]).T)
        fits = (aside <= _OFF_LINE) & (along >= low) & (along <= high)
        found[n, first[fits]] = along[fits]
    disparity, support = agreed(found, np.hypot(*baselines.T))
    kept = support >= max(1.0, _LEAST_SUPPORT * len(baselines))
    pixels = np.floor(points[kept] + 0.5).astype(np.int64)
    # a point with two orientations yields two features
    pixels, once = np.unique(pixels, axis=0, return_index=True)
    return pixels[:, 0], pixels[:, 1], disparity[kept][once].astype(np.float32)


def features_of(view: FloatMap) -> tuple[FloatArray, FloatMap]:
    """Features of a view ``(H, W, 3)``, colours in 0..1: rows and columns (N, 2), and descriptors (N, 128)."""
    grey = np.clip(np.rint(view.mean(axis=2) * 255), 0, 255).astype(np.uint8)
    large = min(grey.shape) >= _SMALLEST
    keypoints, descriptors = cv2.SIFT.create().detectAndCompute(grey, None) if large else ((), None)
    points = np.array([keypoint.pt[::-1] for keypoint in keypoints]).reshape(-1, 2)
    return points, np.zeros((0, 128), np.float32) if descriptors is None else descriptors


def mutual_matches(first: FloatMap, second: FloatMap) -> tuple[IntArray, IntArray]:
    """Indices of the matching descriptors of ``(N, 128)`` and ``(M, 128)``; each shape (K,), int64."""
    if not (len(first) and len(second) > 1):
        return (np.zeros(0, np.int64),) * 2
    squared = (first**2).sum(axis=1)[:, None] + (second**2).sum(axis=1) - 2 * first @ second.T
    nearest, back = squared.argmin(axis=1), squared.argmin(axis=0)
    least, next_least = np.partition(np.maximum(squared, 0), 1, axis=1)[:, :2].T
    numbers = np.arange(len(first))
    kept = (least < _RATIO**2 * next_least) & (back[nearest] == numbers)
    return numbers[kept], nearest[kept]


def agreed(found: FloatArray, distances: FloatArray) -> tuple[FloatArray, IntArray]:
    """Disparity on which views agree: least squares over those within half a pixel of the median.

    Parameters
    ----------
    found : ndarray, shape (V, N), float64
        Disparity of each feature in each view; NaN where it was not found.
    distances : ndarray, shape (V,), float64
        Distance of the views from the reference view, view steps.

    Returns
    -------
    disparity : ndarray, shape (N,), float64
        NaN where no view found the feature.
    support : ndarray, shape (N,), int64
        Number of views that agree.
    """
    disparity, support = np.full(found.shape[1], np.nan), np.zeros(found.shape[1], np.int64)
    seen = np.isfinite(found).any(axis=0)
    values = found[:, seen]
    with np.errstate(invalid="ignore"):
        agrees = np.abs(values - np.nanmedian(values, axis=0)) * distances[:, None] <= 0.5
    weight = agrees * distances[:, None] ** 2
    total = weight.sum(axis=0)
    disparity[seen] = (weight * np.nan_to_num(values)).sum(axis=0) / np.where(total > 0, total, 1)
    support[seen] = agrees.sum(axis=0)
    return disparity, support
