"""Depth of textureless regions (section IV-C, Eq. 6-7 of [1]_).

``lti`` finds superpixels with too little texture for a slope, and propagates depth linearly into them from the reliable
edges around them:

1. SLIC superpixels; texture points are Canny edges and pixels whose slope is distinct;
2. local texture information (LTI), the share of texture points (Eq. 6), with an adaptive threshold where the sorted LTI
   rises fastest;
3. a robust plane for each superpixel; those with texture are held, the others are free;
4. the coupled energy of data and continuity (Eq. 7), with the HSV mean-shift cue for the likeness of neighbours;
5. a plane may smooth any depth, but replaces only depth that is neither distinct nor in agreement with its
   neighbourhood. (Noise lowers the confidence of good depth, but not its agreement.)

``uniform_planes`` finds textureless regions by comparison with the noise, and gives each the plane of its border
(:mod:`sepi.regularization.uniform_regions`). Beside them it decides again what is near or far. ``none`` returns the
depth unchanged.

:class:`sepi.stage.Choice` describes arguments and results of all choices.

References
----------
.. [1] Zhou, Shi, Liu, Jin, Zhang, Hou: Light Field Depth Estimation via Stitched Epipolar Plane Images.
"""

from __future__ import annotations

import numpy as np
from pydantic import Field

from sepi.boundaries.decision import assigned_to_surfaces
from sepi.boundaries.parameters import BoundaryParameters
from sepi.image.edges import CannyParameters, canny_edges
from sepi.image.superpixels import Superpixels, adjacency, colour_modes, superpixels
from sepi.lightfield import BoolMap, FloatArray, FloatMap, LightField
from sepi.regularization.uniform_regions import UniformPlanesParameters, fill_uniform_regions
from sepi.stage import (
    LIGHT_DEVIATION,
    Choice,
    NoParameters,
    Progress,
    StageMaps,
    none,
    relative_confidence,
    require_previous,
)

# weight of distance relative to colour in superpixels, as usual for SLIC
_COMPACTNESS = 10.0
# least confidence of a distinct slope, relative to the scene's best; least share of neighbours that agree with a slope
_DISTINCT, _AGREEING = 0.8, 0.9
# neighbourhood of this agreement, 2 r + 1 pixels, and largest difference in it, pixels per view step
_NEIGHBOURS, _ALIKE = 3, 0.15
# least and greatest threshold of the LTI, share of texture points
_FLOOR, _CEILING = 0.1, 0.4
# mean-shift bandwidth in the HSV cone of radius 1 and height 1
_BANDWIDTH = 0.03
# change of depth below which no pixel resists, pixels per view step; share of a superpixel that may resist
_SMOOTHING, _RESISTING = 0.1, 0.3


class LtiParameters(CannyParameters):
    """Parameters of the refinement by local texture information."""

    superpixel_size: int = Field(15, ge=4, le=100, description="superpixel width up to 512x512 pixels, in pixels")
    superpixel_size_large: int = Field(17, ge=4, le=100, description="superpixel width above 512x512 pixels, in pixels")
    min_support: float = Field(
        0.25,
        ge=0,
        le=1,
        description="share of texture points and agreeing slopes from which a superpixel keeps its depth",
    )
    continuity: float = Field(0.3, ge=0, description="tau_out, weight of continuity between neighbours")
    tolerance: float = Field(0.05, gt=0, description="residual of an inlier, pixels per view step")
    keep_confidence: float = Field(0.7, ge=0, le=1, description="relative confidence from which pixels resist a plane")


def lti(
    light_field: LightField, previous: StageMaps | None, parameters: LtiParameters, progress: Progress
) -> StageMaps:
    """Depth with planes in superpixels of little local texture information (section IV-C, Eq. 6-7 of [1]_).

    Returns
    -------
    StageMaps
        Adds ``superpixels``, int32 labels; ``lti``, float32, that of each pixel's superpixel, 0..1; ``textureless``,
        bool, the pixels whose depth was replaced.

    References
    ----------
    .. [1] Zhou, Shi, Liu, Jin, Zhang, Hou: Light Field Depth Estimation via Stitched Epipolar Plane Images.
       arXiv:2203.15201.

    Examples
    --------
    Superpixels on the bare wall have less texture than the others:

    >>> from sepi import initial, textureless
    >>> from sepi.scenes import render
    >>> from sepi.stage import no_progress
    >>> light_field = render("wall", size=96, views=5)
    >>> before = initial.sepi(light_field, None, initial.CHOICES["sepi"].parameters(), no_progress)
    >>> maps = textureless.lti(light_field, before, textureless.CHOICES["lti"].parameters(), no_progress)
    >>> information, bare = maps.extra["lti"], light_field.masks["textureless"]
    >>> bool(information[bare].mean() < 0.5 * information[~bare].mean())
    True
    """
    before = require_previous(previous)
    confidence = relative_confidence(before.confidence)
    segments = superpixels(light_field.reference_view, superpixel_size(light_field.shape, parameters), _COMPACTNESS)
    progress(0.3)
    agreement = slope_agreement(before.disparity)
    # where an end of the range was best, agreement of neighbours means nothing
    lowest, highest = light_field.require_disparity_range().candidates(2)
    rounding = 1e-6 * (highest - lowest + abs(highest) + abs(lowest))
    at_end = (before.disparity <= lowest + rounding) | (before.disparity >= highest - rounding)
    agreement = np.where(at_end, np.float32(0), agreement)
    agrees = agreement > _AGREEING
    texture = canny_edges(light_field.reference_view, parameters) | (confidence > _DISTINCT)
    information = local_texture_information(segments, texture)
    free = information < lti_threshold(information)
    # much depth is doubtful here, so the weight rises steeply with confidence
    weight = confidence**4 * agreement**2
    # far from its data, a plane may leave the range
    plane = np.clip(
        propagated(light_field.reference_view, segments, free, before.disparity, weight, parameters), lowest, highest
    )
    progress(0.9)
    unsupported = local_texture_information(segments, texture | agrees) < parameters.min_support
    # a plane may smooth any depth, but replaces only depth neither distinct nor in agreement with its neighbourhood
    overruled = np.abs(plane - before.disparity) > _SMOOTHING
    resists = overruled & ((confidence > parameters.keep_confidence) | agrees | ~unsupported[segments.labels])
    taken = free & (segments.means(resists) < _RESISTING)
    replaced = taken[segments.labels] & ~resists
    return before.updated(
        np.where(replaced, plane, before.disparity),
        before.confidence,
        superpixels=segments.labels.astype(np.int32),
        lti=information[segments.labels].astype(np.float32),
        textureless=replaced,
    )


def uniform_planes(
    light_field: LightField, previous: StageMaps | None, parameters: UniformPlanesParameters, progress: Progress
) -> StageMaps:
    """Depth with planes in uniform regions, which have no more texture than noise; variant ``best`` uses it.

    Returns
    -------
    StageMaps
        Adds ``textureless``, bool: pixels that got a plane; and :data:`sepi.stage.LIGHT_DEVIATION`.

    Examples
    --------
    >>> import numpy as np
    >>> from sepi import estimate_depth, textureless
    >>> from sepi.variants import Variant
    >>> from sepi.scenes import render
    >>> from sepi.stage import no_progress
    >>> light_field = render("wall", size=96, views=5)
    >>> before = estimate_depth(light_field, Variant("semi_global", "visibility", "none", "none"))
    >>> parameters = textureless.CHOICES["uniform_planes"].parameters()
    >>> after = textureless.uniform_planes(light_field, before, parameters, no_progress)
    >>> bare = after.mask("textureless")
    >>> errors = [np.abs(maps.disparity - light_field.ground_truth)[bare].mean() for maps in (before, after)]
    >>> bool(errors[1] < 0.5 * errors[0])
    True
    """
    before = require_previous(previous)
    filled, uniform, deviation = fill_uniform_regions(light_field, before, parameters)
    disparity = filled
    if parameters.edges:
        # beside what moved back, the map had no depth step at which to decide; 25 views are enough for so few pixels
        rims = BoundaryParameters(occlusion_margin=parameters.occlusion_margin, share_views=25)
        disparity = assigned_to_surfaces(light_field, filled, rims, before.disparity)
    same = disparity == filled
    uniform &= same
    progress(1.0)
    return before.updated(disparity, before.confidence, textureless=uniform, **{LIGHT_DEVIATION: deviation * same})


def superpixel_size(shape: tuple[int, int], parameters: LtiParameters) -> int:
    """Width of a superpixel for images of this height and width, pixels."""
    return parameters.superpixel_size if shape[0] * shape[1] <= 512 * 512 else parameters.superpixel_size_large


def slope_agreement(disparity: FloatMap) -> FloatMap:
    """Share of a pixel's neighbours whose slope agrees with its own.

    Parameters
    ----------
    disparity : ndarray, shape (H, W), float32

    Returns
    -------
    ndarray, shape (H, W), float32
        0..1.
    """
    H, W = disparity.shape
    padded = np.pad(disparity, _NEIGHBOURS, constant_values=np.nan)
    agreeing = np.zeros((H, W), np.float32)
    inside = np.zeros((H, W))
    for dy, dx in np.ndindex(2 * _NEIGHBOURS + 1, 2 * _NEIGHBOURS + 1):
        there = padded[dy : dy + H, dx : dx + W]
        agreeing += np.abs(there - disparity) < _ALIKE
        inside += ~np.isnan(there)
    return np.asarray(agreeing / inside, np.float32)


def local_texture_information(segments: Superpixels, texture: BoolMap) -> FloatArray:
    """Share of texture points, without those on its border, in each superpixel (Eq. 6); shape (N,), 0..1."""
    return segments.means(texture & segments.interior())


def lti_threshold(information: FloatArray) -> float:
    """Adaptive threshold: the LTI at which the first-order difference of the sorted LTI is greatest.

    Few superpixels lie between those with and those without texture, so the sorted LTI rises fastest there. Differences
    are taken over 3 % of the superpixels, since single ones are mostly zero or one pixel.

    Parameters
    ----------
    information : ndarray, shape (N,), float

    Returns
    -------
    float
    """
    ordered = np.sort(information)
    run = max(1, round(0.03 * len(ordered)))
    rise = ordered[run:] - ordered[:-run]
    middle = 0.5 * (ordered[run:] + ordered[:-run])
    inside = (middle >= _FLOOR) & (middle <= _CEILING)
    if not inside.any():
        return _FLOOR if ordered[len(ordered) // 2] > _CEILING else _CEILING
    return float(middle[inside][np.argmax(rise[inside])])


def propagated(
    reference_view: FloatMap,
    segments: Superpixels,
    free: BoolMap,
    disparity: FloatMap,
    weight: FloatMap,
    parameters: LtiParameters,
) -> FloatMap:
    """Disparity of every pixel on its superpixel's plane, after propagation; shape (H, W), float32."""
    from sepi.regularization.planes import basis, evaluate_planes, fit_planes, propagate

    design = basis(segments)
    planes = fit_planes(segments, disparity, weight, design, parameters.tolerance)
    adjacent = adjacency(segments)
    modes = colour_modes(reference_view, segments, _BANDWIDTH)
    apart = ((modes[adjacent.first] - modes[adjacent.second]) ** 2).sum(axis=1)
    affinity = np.exp(-0.5 * apart / _BANDWIDTH**2)
    if free.any():
        coupling = parameters.continuity, parameters.tolerance
        planes = propagate(segments, adjacent, affinity, planes, free, disparity, weight, design, *coupling)
    return evaluate_planes(segments, planes, design)


CHOICES = {
    "lti": Choice(LtiParameters, lti),
    "uniform_planes": Choice(UniformPlanesParameters, uniform_planes),
    "none": Choice(NoParameters, none),
}

if __name__ == "__main__":
    from sepi.process.command import stage_command

    stage_command("textureless", CHOICES)()
