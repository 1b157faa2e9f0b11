"""Occlusion-aware depth from angular patches that are split along image edges [1]_, a compared method.

Without occlusion, all views sheared by a pixel's disparity show the same colour. Next to an occluder only about half of
the views do, and the line that separates them from the others is parallel to the occluder's edge in the image. The
*angular patch* of a pixel near an edge is therefore split along the edge, and the better half is used. The final map is
smoothed less where occlusions are predicted. Three stages:

*Initial*: for the views ``L_d`` sheared by candidate ``d``, with the mean ``m`` and the variance over the angular
patch of pixel ``p``, the cost is correspondence and defocus, ``C_d + D_d``:
``C_d(p) = sum_views (L_d - m)^2 / (N - 1)`` and ``D_d(p) = (m - L(p))^2`` with the reference view ``L``. The candidate
of least cost wins.

*Occlusion*: pixels near Canny edges take the orientation of the nearest one. The two halves ``j`` of their patches
have means ``m_j`` and variances ``V_j``. With the half ``i`` of smaller variance, ``C_d = V_i`` and
``D_d = (m_i - L(p))^2``. At candidates beyond the occluder's depth the halves' colours are swapped; candidates with
``|m_1 - q_1| + |m_2 - q_2| > |m_2 - q_1| + |m_1 - q_2| + delta`` are rejected, where ``q_1`` and ``q_2`` are the mean
colours of the two sides in the reference view. Occlusions are predicted by three cues at the resulting disparity
``d0``: its gradient, the ratio of the variances, and the difference of the means:
``P = N(f(|grad d0|)) N(f(max(V_1 / V_2, V_2 / V_1))) N(f(|m_1 - m_2|))``, where ``f`` saturates and ``N`` subtracts the
mean and divides by the standard deviation.

*Optimisation*: the energy ``sum_p (1 - exp(-(d(p) - d0(p))^2 / (2 (1 - c(p))^2))) + smoothness sum_pq S(d(p) - d(q)) /
(|L(p) - L(q)| + k |P(p) - P(q)|)`` with the confidence ``c`` of the initial depth and a robust function ``S``.

Choices made here where the publication is not specific or could not be confirmed:

- The product of the cues, the energy's exact form and the confidence could not be confirmed. All weights and tolerances
  were chosen here. The weight of ``P`` is small: ``P`` is large at occlusions, but also around islands of wrong depths,
  which a larger weight would preserve.
- Which pixels are near an edge: an occluder's edge moves by the difference of the disparities times the distance of the
  view, so ``edge_reach`` is a fraction of the largest such shift.
- The edge's orientation: that of the structure tensor at the edge pixel, in sixteen steps over half a turn.
- Views on the dividing line belong to both halves, as does the reference view. If a half has fewer than a quarter of
  the other views (a row of views along the edge, a reference view in a corner of the grid), the patch is not split.
- Colours: costs are means over the three channels. There is no spatial window.
- The side colours ``q`` come from a window as wide as the grid of views. Where all candidates are rejected, the depth
  of the whole patch is kept.
- Depth between candidates: the parabola through the least cost and its neighbours.
- The publication divides the gradient by depth. Disparity does not need this, since that of a plane is linear in the
  image: the gradient is divided by the range, after a median of 3 x 3 pixels. ``f`` saturates at the 95th percentile.
  ``N`` is clipped at 0, since otherwise two negative cues would predict an occlusion. ``P`` is 0 away from edges.
- The confidence is ``1 - least / mean`` of the costs; disparities in the energy are fractions of the range. The colour
  difference has a lower bound, to avoid a division by 0.
- ``S`` is the truncated linear function, and the energy is minimised by message passing instead of graph cuts
  (:mod:`sepi.extensions.methods.markov_field`). Occlusions are not predicted anew from the final map.

References
----------
.. [1] Wang, Efros, Ramamoorthi: Occlusion-aware depth estimation using light-field cameras. ICCV 2015.
   doi:10.1109/ICCV.2015.398. Extended: Depth estimation with occlusion modeling using light-field cameras. IEEE TPAMI
   38(11), 2016. doi:10.1109/TPAMI.2016.2515615. Its colour clusters for several occluders are not implemented.
"""

import cv2
import numpy as np
import numpy.typing as npt
from pydantic import Field

from sepi.extensions.methods.costs import IntArray, Previous, between_candidates, disparity_of
from sepi.extensions.methods.markov_field import changes, labels_of_least_energy
from sepi.image.edges import CannyParameters, canny_edges, edge_angle
from sepi.kernels import occ as kernels
from sepi.lightfield import BoolMap, FloatMap, LightField
from sepi.matching.candidates import CandidateParameters, CandidateRule, number_field
from sepi.matching.sheared_views import ShearedViews
from sepi.stage import Choice, CostVolume, Needs, Progress, StageMaps, require_previous

SATURATION = 95
"""Percentile at which a cue saturates."""

# added to variances, so that the ratio of two near 0 is about 1
_LEAST_VARIANCE = np.float32(1e-5)


class OccParameters(CandidateParameters):
    """Parameters of the costs of whole angular patches."""

    # about an eighth of a pixel in the outermost view of typical light fields
    rule = CandidateRule(usual=101, finest=0.05, coarsest=0.5, volume_bytes=2**30)
    needs = Needs(bytes_per_sample=31, bytes_per_pixel=2400, bytes_per_candidate=16, seconds_per_megasample=2)

    num_disparities: int | None = number_field(rule, "docs/reproduce/compared.md")


class OccSplitParameters(OccParameters, CannyParameters):
    """Parameters of the split patches."""

    edge_reach: float = Field(1.0, ge=0, le=1, description="share of the farthest movement where edges split patches")
    colour_tolerance: float = Field(0.02, ge=0, le=1, description="how far colours of halves, 0..1, may look reversed")


class OccFieldParameters(CandidateParameters):
    """Parameters of the optimisation."""

    # labels of the optimisation, which stores five numbers per label and pixel
    rule = CandidateRule(usual=151, finest=0.02, coarsest=0.5, volume_bytes=2**28)
    needs = Needs(bytes_per_sample=6, bytes_per_pixel=5000, bytes_per_candidate=32, seconds_per_megasample=0.6)

    num_disparities: int | None = number_field(rule, "docs/reproduce/compared.md")
    smoothness: float = Field(1.0, ge=0, description="cost of a jump within one colour; a disparity costs at most 1")
    truncation: float = Field(0.03, gt=0, le=1, description="largest change that counts, share of the disparity range")
    contrast: float = Field(0.02, gt=0, description="difference of colours, 0..1, at which smoothness falls to a half")
    occlusion_weight: float = Field(0.002, ge=0, description="difference of colours worth a predicted occlusion's by 1")
    iterations: int = Field(8, ge=1, le=100, description="passes of the messages, there and back")


def occ(light_field: LightField, previous: Previous, parameters: OccParameters, progress: Progress) -> StageMaps:
    """Depth from whole angular patches.

    Returns
    -------
    StageMaps
    """
    views, disparities = ShearedViews(light_field), parameters.candidates(light_field)
    costs = np.empty((len(disparities), *light_field.shape), np.float32)
    for k, sheared in views.over(disparities, progress):
        costs[k] = whole_patch_costs(sheared, sheared[views.reference])
    return StageMaps(*least_cost(disparities, costs))


def occ_split(
    light_field: LightField, previous: StageMaps | None, parameters: OccSplitParameters, progress: Progress
) -> StageMaps:
    """Depth of pixels near edges from the better halves of their angular patches, and predicted occlusions.

    Requires depth from whole patches.

    Returns
    -------
    StageMaps
        Adds ``occlusion_candidates``, bool, pixels whose patches are split, and ``predicted_occlusion``, float32, not
        negative.
    """
    before = require_previous(previous)
    view = light_field.reference_view
    disparities = parameters.candidates(light_field)
    width = float(disparities[-1] - disparities[0])
    places = places_to_split(view, parameters, parameters.edge_reach * width * light_field.reach)
    costs, cues = split_costs(light_field, disparities, places, parameters.colour_tolerance, progress)
    near = tuple(places[:, :2].T)
    halves, certain = least_cost(disparities, costs)
    known = np.isfinite(costs).any(axis=0)
    disparity, confidence = before.disparity.copy(), before.confidence.copy()
    disparity[near] = np.where(known, halves, disparity[near])
    confidence[near] = np.where(known, certain, confidence[near])
    # without isolated outliers
    slope = np.hypot(*np.gradient(cv2.medianBlur(disparity, 3)))
    split, predicted = np.zeros(light_field.shape, bool), np.zeros(light_field.shape, np.float32)
    split[near] = True
    if len(places):
        predicted[near] = predicted_occlusion(slope[near] / np.float32(width), cues)
    return before.updated(disparity, confidence, occlusion_candidates=split, predicted_occlusion=predicted)


def occ_field(
    light_field: LightField, previous: StageMaps | None, parameters: OccFieldParameters, progress: Progress
) -> StageMaps:
    """Disparities of least energy.

    Uses the map ``predicted_occlusion`` if there is one.

    Returns
    -------
    StageMaps
    """
    before = require_previous(previous)
    volume = data_costs(before, parameters.candidates(light_field))
    truncation = max(1.0, parameters.truncation * (len(volume.disparities) - 1))
    difference = changes(light_field.reference_view)
    if "predicted_occlusion" in before.extra:
        difference += np.float32(parameters.occlusion_weight) * changes(before.extra["predicted_occlusion"][..., None])
    across, down = parameters.smoothness * parameters.contrast / (difference + parameters.contrast) / truncation
    labels = labels_of_least_energy(volume.costs, across, down, truncation, parameters.iterations)
    progress(1.0)
    return before.updated(disparity_of(volume, labels), before.confidence)


def least_cost(disparities: FloatMap, costs: FloatMap) -> tuple[FloatMap, FloatMap]:
    """Candidates of least cost, refined by a parabola, and how far their costs are below the mean.

    Parameters
    ----------
    disparities : ndarray, shape (K,), float32
    costs : ndarray, shape (K, ...), float32
        Infinite for a rejected candidate.

    Returns
    -------
    disparity, confidence : ndarray, shape (...), float32
        The confidence is 0 where all candidates are rejected.
    """
    kept, least = np.isfinite(costs), costs.min(axis=0)
    mean = np.sum(costs, axis=0, where=kept) / np.maximum(1, np.sum(kept, axis=0))
    certain = np.isfinite(least) & (mean > 0)
    confidence = np.where(certain, 1 - np.where(certain, least, 0) / np.where(certain, mean, 1), 0)
    disparity = between_candidates(disparities, costs, np.argmin(costs, axis=0))
    return disparity, np.clip(confidence, 0, 1).astype(np.float32)


def split_costs(
    light_field: LightField, disparities: FloatMap, places: IntArray, tolerance: float, progress: Progress
) -> tuple[FloatMap, FloatMap]:
    """Costs of the better halves of split angular patches.

    Parameters
    ----------
    light_field : LightField
    disparities : ndarray, shape (K,), float32
    places : ndarray, shape (P, 3), int64
        Of :func:`places_to_split`.
    tolerance : float
        Tolerance of the test for swapped colours of the halves.
    progress : callable

    Returns
    -------
    costs : ndarray, shape (K, P), float32
        Infinite where the halves' colours are swapped.
    cues : ndarray, shape (P, 3), float32
        At the least cost: variances of the two halves, and the difference of their means; 0 where none is finite.
    """
    views = ShearedViews(light_field)
    beside = colours_beside(light_field.reference_view, places, max(1, round(light_field.reach)))
    halves = halves_of_views(views.baselines)
    costs = np.empty((len(disparities), len(places)), np.float32)
    cues, least = np.zeros((len(places), 3), np.float32), np.full(len(places), np.inf, np.float32)
    for k, sheared in views.over(disparities, progress):
        costs[k], found = split_patch_costs(sheared, sheared[views.reference], places, halves, beside, tolerance)
        better = costs[k] < least
        least[better], cues[better] = costs[k][better], found[better]
    return costs, cues


def whole_patch_costs(sheared: FloatMap, reference: FloatMap) -> FloatMap:
    """Variance of angular patches (N, 3, H, W) plus squared distance of their mean from a view (3, H, W); (H, W)."""
    total, squares = np.zeros((2, *reference.shape), np.float32)
    for view in sheared:
        # relative to the reference's colour, so that the squares keep their precision
        difference = view - reference
        total += difference
        squares += np.square(difference)
    mean = total / np.float32(len(sheared))
    variance = np.maximum((squares - total * mean).mean(axis=0), 0) / np.float32(max(1, len(sheared) - 1))
    return np.asarray(variance + np.square(mean).mean(axis=0))


def split_patch_costs(
    sheared: FloatMap, reference: FloatMap, places: IntArray, halves: BoolMap, beside: FloatMap, tolerance: float
) -> tuple[FloatMap, FloatMap]:
    """Costs (P,) and cues (P, 3) as of :func:`split_costs`, for one candidate's sheared views (N, 3, H, W)."""
    count = len(places)
    means, variances = np.empty((count, 2, 3), np.float32), np.empty((count, 2), np.float32)
    kernels.moments_of_halves(sheared, reference, places, halves, means, variances)
    colours = means + reference[:, places[:, 0], places[:, 1]].T[:, None]
    as_they_are, changed = (np.abs(sides - beside).mean(axis=2).sum(axis=1) for sides in (colours, colours[:, ::-1]))
    costs = np.where(variances[:, 0] <= variances[:, 1], *(variances + np.square(means).mean(axis=2)).T)
    apart = np.abs(means[:, 0] - means[:, 1]).mean(axis=1)
    return np.where(as_they_are <= changed + tolerance, costs, np.inf), np.column_stack([variances, apart])


def predicted_occlusion(slopes: FloatMap, cues: FloatMap) -> FloatMap:
    """Occlusion score of each pixel with a split patch.

    Parameters
    ----------
    slopes : ndarray, shape (P,), float32
        Slopes of the disparity, fraction of the range per pixel.
    cues : ndarray, shape (P, 3), float32
        Variances of the two halves, and the difference of their means.

    Returns
    -------
    ndarray, shape (P,), float32
        Not negative.
    """
    variances = cues[:, :2] + _LEAST_VARIANCE
    return _above_mean(slopes) * _above_mean(variances.max(axis=1) / variances.min(axis=1)) * _above_mean(cues[:, 2])


def data_costs(before: StageMaps, labels: FloatMap) -> CostVolume:
    """Costs of the disparities: low near the initial one, in a range that narrows with its confidence."""
    width = labels[-1] - labels[0]
    # a tolerance below the label spacing would give pixels between two labels no suitable one
    tolerance = np.maximum(1 - before.confidence, np.float32(1 / (len(labels) - 1)))
    costs = np.empty((len(labels), *before.disparity.shape), np.float16)
    for k, label in enumerate(labels):
        costs[k] = 1 - np.exp(-0.5 * ((before.disparity - label) / (width * tolerance)) ** 2)
    return CostVolume(labels, costs)


def _above_mean(cue: FloatMap) -> FloatMap:
    """Standard deviations by which a saturated cue exceeds its mean; not negative."""
    saturated = np.minimum(cue, np.percentile(cue, SATURATION))
    # equal cues do not exceed it
    return np.asarray(np.maximum(0, (saturated - saturated.mean()) / (float(saturated.std()) or np.inf)), np.float32)


CHOICES = {
    "initial": {"occ": Choice(OccParameters, occ)},
    "occlusion": {"occ": Choice(OccSplitParameters, occ_split)},
    "optimize": {"occ": Choice(OccFieldParameters, occ_field)},
}


ORIENTATIONS = 16
"""Orientations of edges over half a turn."""

LEAST_SHARE = 0.25
"""Minimum share of the other views in each half."""

ON_THE_LINE = 1 / 8
"""Distance within which a view counts as on the dividing line, as a fraction of the farthest view's distance."""


def places_to_split(reference_view: FloatMap, parameters: CannyParameters, reach: float) -> IntArray:
    """Pixels within ``reach`` pixels of a Canny edge, whose angular patches are split along the nearest one.

    Returns
    -------
    ndarray, shape (P, 3), int64
        Row, column and index of the orientation; the edge's normal has the angle ``index pi / ORIENTATIONS`` from
        ``+x`` towards ``+y``.
    """
    lines = canny_edges(reference_view, parameters)
    turns = np.round(edge_angle(reference_view, parameters) * (ORIENTATIONS / np.pi)).astype(np.int64) % ORIENTATIONS
    if not lines.any():
        return np.empty((0, 3), np.int64)
    distance, nearest = cv2.distanceTransformWithLabels(
        (~lines).astype(np.uint8), cv2.DIST_L2, cv2.DIST_MASK_5, labelType=cv2.DIST_LABEL_PIXEL
    )
    turn_of = np.zeros(int(nearest.max()) + 1, np.int64)
    turn_of[nearest[lines]] = turns[lines]
    near = np.asarray(distance <= reach)
    return np.column_stack([np.argwhere(near), turn_of[nearest[near]]])


def halves_of_views(baselines: npt.NDArray[np.float64]) -> BoolMap:
    """The two halves of views into which an edge of each orientation splits the angular patch.

    Parameters
    ----------
    baselines : ndarray, shape (N, 2), float64
        Row and column offset of each view from the reference view, in view steps.

    Returns
    -------
    ndarray, shape (ORIENTATIONS, 2, N), bool
        The second half is on the side to which the edge's normal points.
    """
    along = _normals() @ baselines.T
    line = ON_THE_LINE * np.abs(baselines).max(initial=0)
    halves = np.stack([along <= line, along >= -line], axis=1)
    others = halves.sum(axis=2) - 1
    halves[others < LEAST_SHARE * (len(baselines) - 1)] = True
    return halves


def colours_beside(reference_view: FloatMap, places: IntArray, radius: int) -> FloatMap:
    """Mean colours of the two sides of the edge in a window around each pixel; shape (P, 2, 3), float32.

    The edge's normal points to the second side.
    """
    y, x = np.mgrid[-radius : radius + 1, -radius : radius + 1]
    colours = np.zeros((len(places), 2, 3), np.float32)
    for number, (down, across) in enumerate(_normals()):
        chosen = places[:, 2] == number
        along = y * down + x * across
        for side, window in enumerate((along < -0.5, along > 0.5)):
            weights = window.astype(np.float32) / np.float32(window.sum())
            means = cv2.filter2D(reference_view, cv2.CV_32F, weights, borderType=cv2.BORDER_REPLICATE)
            colours[chosen, side] = means[tuple(places[chosen, :2].T)]
    return colours


def _normals() -> npt.NDArray[np.float64]:
    """Normals of the orientations, ``(down, across)``; shape (ORIENTATIONS, 2)."""
    angle = np.arange(ORIENTATIONS) * np.pi / ORIENTATIONS
    return np.stack([np.sin(angle), np.cos(angle)], axis=1)
