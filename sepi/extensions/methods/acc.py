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
   (:mod:`sepi.extensions.methods.acc_features`).
5. *Iterative refinement.* From labels to a continuous map, four times: costs of the distance to the current map are
   filtered slice by slice, and the parabola through the least cost and its neighbours,
   ``l - (E(l+) - E(l-)) / (2 (E(l+) + E(l-) - 2 E(l)))``, gives the new map.

Choices made here where the publication is not specific or could not be confirmed:

- The border: views continue as their mirror image (:mod:`sepi.extensions.methods.acc_phase_shift`).
- Colours: differences are means over the channels, and the gradients central differences.
- All numbers: the share ``a``, truncations, the size of windows and filters, and the weights. Truncations match the
  differences caused by occlusion and texture; costs are scaled to 0..1; weights are in hundredths of the range.
- The edge-preserving filter: the guided filter.
- Graph cuts: replaced by message passing on the same energy (for the reason, see
  :mod:`sepi.extensions.methods.message_passing`).
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

from __future__ import annotations

from typing import ClassVar

import cv2
import numpy as np
import numpy.typing as npt
from pydantic import Field

from sepi.extensions.methods.acc_features import matched_disparities
from sepi.extensions.methods.acc_phase_shift import PhaseShift
from sepi.extensions.methods.cost_volumes import disparity_of, distinctness, least_costs
from sepi.extensions.methods.guided_filter import GuidedFilter
from sepi.extensions.methods.message_passing import labels_of_least_energy
from sepi.extensions.methods.weighted_median import weighted_median
from sepi.lightfield import FloatMap, LightField, as_unit_float
from sepi.matching.candidates import CandidateParameters, CandidateRule, number_field
from sepi.stage import Choice, CostVolume, Needs, Parameters, Progress, StageMaps, require_costs

CANDIDATES = CandidateRule(usual=75, finest=0.02, coarsest=0.5, volume_bytes=2**28)

_AT_ONCE = 8
"""Candidates that are transformed together."""

_FARTHEST = 2.0
"""Truncation of the refinement's costs: distance from the current depth in labels."""


class AccParameters(CandidateParameters):
    """Parameters of the data cost."""

    rule: ClassVar[CandidateRule] = CANDIDATES
    needs: ClassVar[Needs] = Needs(
        bytes_per_sample=14, bytes_per_pixel=1300, bytes_per_candidate=8, seconds_per_megasample=4
    )

    num_disparities: int | None = number_field(CANDIDATES, "docs/reproduce/compared.md")
    colour_share: float = Field(0.5, ge=0, le=1, description="share of colours in the cost; gradients have the rest")
    colour_truncation: float = Field(
        0.05, gt=0, description="difference beyond which the cost no longer grows, colours in 0..1"
    )
    gradient_truncation: float = Field(
        0.02, gt=0, description="difference of gradients beyond which the cost no longer grows, colours per pixel"
    )
    window_radius: int = Field(1, ge=0, le=10, description="cost window of 2 r + 1 pixels; 0: none")
    filter_radius: int = Field(5, ge=1, le=50, description="window of 2 r + 1 pixels that filters cost slices")
    filter_epsilon: float = Field(
        1e-4, gt=0, description="variance of colour above which the filter keeps edges, colours in 0..1"
    )
    median_radius: int = Field(3, ge=1, le=50, description="weighted median's window of 2 r + 1 pixels")
    median_sigma: float = Field(
        0.05, gt=0, description="colour distance at which a pixel's weight in the median falls; RGB, colours in 0..1"
    )


class ConfidentLabelsParameters(Parameters):
    """Parameters of the multi-label optimisation and the refinement."""

    needs: ClassVar[Needs] = Needs(bytes_per_sample=6, bytes_per_pixel=3000, seconds_per_megasample=1)

    reliable_deviation: float = Field(
        0.003, ge=0, description="standard deviation of the costs from which a pixel is reliable"
    )
    fidelity: float = Field(
        0.01, ge=0, description="cost of a hundredth of the disparity range off a reliable pixel's first depth"
    )
    correspondence: float = Field(
        0.2, ge=0, description="cost of a hundredth of the disparity range off the depth of matched features"
    )
    smoothness: float = Field(0.003, ge=0, description="cost of a change by a hundredth of the disparity range")
    iterations: int = Field(5, ge=1, le=100, description="passes of the messages, there and back")
    refinements: int = Field(4, ge=0, le=100, description="number of fits of the continuous depth")
    filter_radius: int = Field(3, ge=1, le=50, description="window of 2 r + 1 pixels that filters the refinement")
    filter_epsilon: float = Field(
        1e-4, gt=0, description="variance of colour above which the filter keeps edges, colours in 0..1"
    )


def acc(
    light_field: LightField, previous: StageMaps | None, parameters: AccParameters, progress: Progress
) -> StageMaps:
    """Candidates of least filtered cost.

    Returns
    -------
    StageMaps
        With the cost volume.
    """
    disparities = parameters.candidates(light_field)
    costs = phase_shift_costs(light_field, disparities, parameters, progress)
    guide = light_field.reference_view
    smooth = GuidedFilter(guide, parameters.filter_radius, parameters.filter_epsilon)
    window = (2 * parameters.window_radius + 1, 2 * parameters.window_radius + 1)
    volume = CostVolume(disparities, np.empty(costs.shape, np.float16))
    for k, costs_of_candidate in enumerate(costs):
        volume.costs[k] = smooth(cv2.blur(costs_of_candidate, window, borderType=cv2.BORDER_REFLECT))
    labels = least_costs(volume)
    disparity = weighted_median(
        disparity_of(volume, labels),
        guide,
        parameters.median_radius,
        parameters.median_sigma,
        np.ones(guide.shape[:2], np.float32),
    )
    progress(1.0)
    return StageMaps(disparity, distinctness(volume, labels), cost_volume=volume)


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
    others = light_field.present.copy()
    others[light_field.reference_position] = False
    farthest = light_field.reach * float(np.abs(disparities).max())
    costs = np.zeros((len(disparities), *light_field.shape), np.float32)
    for n, (t, s) in enumerate(np.argwhere(others)):
        baseline = light_field.baselines[t, s]
        view = PhaseShift(as_unit_float(light_field.rgb_views[t, s].transpose(2, 0, 1)), farthest)
        for begin in range(0, len(disparities), _AT_ONCE):
            part = slice(begin, begin + _AT_ONCE)
            for cost, moved in zip(costs[part], view.by(-disparities[part, None] * baseline), strict=True):
                cost += truncated_difference(moved, reference, across_share(baseline), parameters)
        progress(0.9 * (n + 1) / others.sum())
    share, truncation = parameters.colour_share, parameters.colour_truncation
    costs /= np.float32(others.sum() * (share * truncation + (1 - share) * parameters.gradient_truncation))
    return costs


def truncated_difference(
    moved: FloatMap, reference: FloatMap, across_share: float, parameters: AccParameters
) -> FloatMap:
    """Truncated differences of a view's colours and gradients, (3, H or more, W or more), from (3, H, W); (H, W)."""
    height, width = reference.shape[1:]
    colour, across, down = np.zeros((3, height, width), np.float32)
    for here, own in zip(moved, reference, strict=True):
        residual = here[:height, :width] - own
        colour += np.abs(residual)
        # central differences without the division by 2
        across += np.abs(cv2.Sobel(residual, -1, 1, 0, ksize=1, borderType=cv2.BORDER_REPLICATE))
        down += np.abs(cv2.Sobel(residual, -1, 0, 1, ksize=1, borderType=cv2.BORDER_REPLICATE))
    gradients = across_share * np.minimum(across / 6, parameters.gradient_truncation)
    gradients += (1 - across_share) * np.minimum(down / 6, parameters.gradient_truncation)
    colours = np.minimum(colour / 3, parameters.colour_truncation)
    return np.asarray(parameters.colour_share * colours + (1 - parameters.colour_share) * gradients, np.float32)


def across_share(baseline: npt.NDArray[np.float64]) -> float:
    """Weight of horizontal gradients in the cost of a view with this baseline ``(down, across)``; 0..1."""
    down, across = np.abs(baseline).tolist()
    return float(across / (across + down)) if across + down else 0.5


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
    distances = CostVolume(disparities, np.empty((len(disparities), *disparity.shape), np.float16))
    for k, label in enumerate(disparities):
        distances.costs[k] = smooth(np.square(np.minimum(np.abs(disparity - label) / step, np.float32(_FARTHEST))))
    return disparity_of(distances, least_costs(distances))


CHOICES = {
    "initial": {"acc": Choice(AccParameters, acc)},
    "optimize": {"confident_labels": Choice(ConfidentLabelsParameters, confident_labels)},
}
