"""Superpixel regularisation over partially occluded boundary regions [1]_, "POBR".

The method uses a simple data cost and corrects its errors at occlusions afterwards, by weights. A label map and its
*label confidence* come from plain photo-consistency. Next to a nearer surface, pixels are hidden in some of the views
and their labels mix both surfaces; these partially occluded boundary regions are found with superpixels of the
reference view. There the label confidence and the *edge strength weights* are shrunk or reinforced, so that weighted
least squares fill them from their surroundings up to the edges of the view, instead of spreading the wrong labels.

With the disparity ``d``, candidates ``k``, colours ``I_v`` of view ``v`` of baseline ``b_v``, and reference view ``I``:

1. cost ``C(p, k) = G[ mean_v min(|I_v(p - k b_v) - I(p)|, t) / t ]``, ``G`` the guided filter with ``I`` as guide;
   ``d`` is the candidate of least cost, refined by a parabola, and ``c = 1 - min_k C / mean_k C``;
2. superpixels ``S``; region ``R``: those with ``std_S(d) > tau_1``;
3. shrinkage of the confidence: ``c' = c max(exp(-tau_0 (std_S(d) - tau_1)), q)`` within ``R``, ``c' = c`` elsewhere;
4. edge strength ``e = |grad I|^2``; within ``R``, texture inside superpixels is shrunk and borders between superpixels
   are reinforced: ``e = |step J|^2 + a |grad I|^2``, with the mean colour ``J`` of each superpixel and its full steps
   between neighbours;
5. weighted least squares: ``d'`` minimises
   ``sum_p c'^2 (d' - d)^2 + alpha sum_p s(p) sum_q (d'(p) - d'(q))^2`` over the 4-connected neighbours ``q``, with
   ``s = exp(-tau_2 c') / (e + f^2)``.

The choice ``pobr`` of the initial stage is step 1, that of the occlusion stage steps 2 to 4, that of the global
optimisation step 5.

Known of the publication are its abstract, and the parts used by [2]_, whose global optimisation builds on it:
``tau_0 = 1000``, ``tau_1 = 0.2``, ``tau_2 = 1.5`` and the forms of steps 3 and 5. The rest was chosen here:

- the data cost: the mean truncated colour difference, and a guided filter that mixes little of other surfaces;
- the confidence: relative to the scene's best (95th percentile), squared as data weight;
- the detection of the region: by the deviation of the labels in each superpixel, which [2]_ computes in a small window.
  The number of SLIC superpixels does not depend on the view size: small objects and small views need small ones;
- the share ``q`` of confidence that remains after shrinkage: with the authors' ``tau_0`` the exponential is a step to
  0, but where both surfaces of a superpixel are well estimated, as at thin structures, some must remain;
- the operations on the edge strength, of which only the words "shrinkage" and "reinforcement" are known, the share
  ``a`` of texture and the floor ``f``, without which noise would prevent smoothing.

Missing views, views off the grid and a single row or column of views are handled without special cases.

References
----------
.. [1] Chen, Hou, Ni, Chau: Accurate light field depth estimation with superpixel regularization over partially
   occluded regions. IEEE TIP 27(10), 4889-4900, 2018. arXiv:1708.01964
.. [2] Zhou, Shi, Liu, Jin, Zhang, Hou: Light Field Depth Estimation via Stitched Epipolar Plane Images.
"""

import math

import cv2
import numpy as np
from pydantic import Field

from sepi.extensions.methods.costs import GuidedFilter, colour_differences, filtered, maps_of
from sepi.image.noise import noise_level
from sepi.image.superpixels import Superpixels, superpixels
from sepi.lightfield import FloatMap, LightField
from sepi.matching.candidates import CandidateParameters, CandidateRule, number_field
from sepi.matching.sheared_views import ShearedViews
from sepi.regularization.wls import solve
from sepi.stage import Choice, Needs, Parameters, Progress, StageMaps, relative_confidence, require_previous

COMPACTNESS = 10.0
"""Compactness of the superpixels; the usual value for SLIC."""

LEAST_SIZE = 3
"""Minimum side of a superpixel in pixels; in smaller ones the labels' deviation is meaningless."""

TEXTURE_SHARE = 0.1
"""Weight ``a`` of texture in the edge strength of a region."""

NOISE_GAIN = 9 / 8
"""Expected squared Sobel gradient of noise of variance 1, summed over three channels."""

LEAST_CONFIDENCE = 3e-4
"""Minimum confidence, which keeps the system solvable."""

RTOL = 1e-9
"""Relative residual at which the solver stops; small because of pixels with low weight."""


class PobrCostParameters(CandidateParameters):
    """Parameters of the photo-consistency."""

    rule = CandidateRule(usual=101, finest=0.02, coarsest=0.5)
    needs = Needs(bytes_per_sample=31, bytes_per_pixel=1500, bytes_per_candidate=8, seconds_per_megasample=1.5)

    num_disparities: int | None = number_field(rule, "docs/reproduce/compared.md")
    truncation: float = Field(0.1, gt=0, le=1, description="t, largest difference of colours, 0..1, that counts")
    radius: int = Field(2, ge=1, le=20, description="window of the guided filter of the costs, 2 r + 1 pixels")
    epsilon: float = Field(1e-4, gt=0, description="variance of colours, 0..1, above which filtered edges stay")


class PobrRegionParameters(Parameters):
    """Parameters of the partially occluded boundary regions."""

    superpixels: int = Field(2000, ge=1, description="number of superpixels")
    tau_0: float = Field(1000.0, ge=0, description="how sharply the label confidence falls beyond tau_1")
    tau_1: float = Field(0.2, ge=0, description="deviation of a superpixel's labels at which confidence falls, px/step")
    least_share: float = Field(0.03, gt=0, le=1, description="q, least factor of the label confidence")


class PobrSmoothingParameters(Parameters):
    """Parameters of the weighted least squares."""

    alpha: float = Field(3e-6, ge=0, description="weight of smoothness against data, for gradients of 0..1 per px")
    gradient_floor: float = Field(0.002, gt=0, description="f, gradient below which smoothness no longer grows, per px")
    tau_2: float = Field(1.5, ge=0, description="how strongly label confidence weakens smoothness")


def pobr_cost(
    light_field: LightField, previous: StageMaps | None, parameters: PobrCostParameters, progress: Progress
) -> StageMaps:
    """Labels of least photo-consistency cost and their confidence.

    Returns
    -------
    StageMaps
        ``disparity`` and ``confidence``, shape (H, W), float32.
    """
    disparities = parameters.candidates(light_field)
    views = ShearedViews(light_field)
    smooth = GuidedFilter(light_field.reference_view, parameters.radius, parameters.epsilon)
    costs = (photo_consistency(one, views.reference, parameters.truncation) for _, one in views.over(disparities))
    return maps_of(filtered(smooth, disparities, costs, progress)).without_costs()


def photo_consistency(sheared: FloatMap, reference: int, truncation: float) -> FloatMap:
    """Mean truncated difference of views (N, 3, H, W) from one of them, divided by the truncation; (H, W), 0..1."""
    total = np.zeros(sheared.shape[2:], np.float32)
    for difference in colour_differences(sheared, sheared[reference]):
        total += np.minimum(difference, truncation)
    return total / np.float32(truncation * (len(sheared) - 1))


def pobr_regions(
    light_field: LightField, previous: StageMaps | None, parameters: PobrRegionParameters, progress: Progress
) -> StageMaps:
    """Label confidence and edge strength, adjusted in partially occluded boundary regions.

    Returns
    -------
    StageMaps
        The same ``disparity`` and the shrunk ``confidence``. Adds ``occluded``, bool, the regions, and
        ``edge_strength``, float32, squared gradient per pixel^2 of values in 0..1.
    """
    before = require_previous(previous)
    image = light_field.reference_view
    size = max(LEAST_SIZE, round(math.sqrt(image[..., 0].size / parameters.superpixels)))
    segments = superpixels(image, size, COMPACTNESS)
    # standard deviation of the labels over each pixel's superpixel
    residual = before.disparity - segments.means(before.disparity)[segments.labels]
    deviation = np.sqrt(segments.means(residual**2))[segments.labels].astype(np.float32)
    regions = deviation > parameters.tau_1
    cut = np.exp(-np.minimum(parameters.tau_0 * np.maximum(deviation - parameters.tau_1, 0), 80))
    confidence = (relative_confidence(before.confidence) * np.maximum(cut, parameters.least_share)).astype(np.float32)
    texture = squared_gradient(image)
    edges = np.where(regions, squared_steps(image, segments) + TEXTURE_SHARE * texture, texture).astype(np.float32)
    progress(1.0)
    return before.updated(before.disparity, confidence, occluded=regions, edge_strength=edges)


def pobr_smoothing(
    light_field: LightField, previous: StageMaps | None, parameters: PobrSmoothingParameters, progress: Progress
) -> StageMaps:
    """Disparity of least energy.

    Uses the map ``edge_strength`` of the occlusion stage if there is one, otherwise the gradient of the view.

    Returns
    -------
    StageMaps
    """
    before = require_previous(previous)
    image = light_field.reference_view
    edges, confidence = before.extra.get("edge_strength"), before.confidence
    if edges is None:
        edges, confidence = squared_gradient(image), relative_confidence(confidence)
    floor = parameters.gradient_floor**2 + NOISE_GAIN * noise_level(image) ** 2
    smoothness = (np.exp(-parameters.tau_2 * confidence) / (edges + floor)).astype(np.float32)
    weight = np.maximum(confidence, np.float32(LEAST_CONFIDENCE)) ** 2
    progress(0.1)
    disparity = solve(before.disparity, weight, smoothness, parameters.alpha, RTOL)
    return before.updated(disparity, confidence).without_costs()


def squared_gradient(image: FloatMap) -> FloatMap:
    """Squared gradient of the colours ``(H, W, 3)``, summed over the channels; shape (H, W), float32, per pixel^2."""
    dx, dy = (cv2.Sobel(image, cv2.CV_32F, *order, ksize=3, scale=1 / 8) for order in ((1, 0), (0, 1)))
    return np.asarray((dx**2 + dy**2).sum(axis=2), np.float32)


def squared_steps(image: FloatMap, segments: Superpixels) -> FloatMap:
    """Squared step of the superpixels' mean colours at pixels next to a border, 0 inside; shape (H, W), float32."""
    means = np.stack([segments.means(channel)[segments.labels] for channel in np.moveaxis(image, 2, 0)], axis=2)
    # the central difference is half the step
    return np.asarray(4 * squared_gradient(means.astype(np.float32)), np.float32)


CHOICES = {
    "initial": {"pobr": Choice(PobrCostParameters, pobr_cost)},
    "occlusion": {"pobr": Choice(PobrRegionParameters, pobr_regions)},
    "optimize": {"pobr": Choice(PobrSmoothingParameters, pobr_smoothing)},
}
