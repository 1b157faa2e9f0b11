"""Uniform regions, which have no more texture than noise explains, and their planes.

The mean of all views that see a pixel has a small fraction of one view's noise. A region is uniform where the mean's
gradients are no larger than this noise explains, so that no view has evidence for the depth of its pixels. (This
replaces the paper's LTI, section IV-C of [1]_.)

The region's border (:mod:`sepi.regularization.border_planes`) and the change of its light
(:mod:`sepi.regularization.lit_planes`) tell its plane.

References
----------
.. [1] Zhou, Shi, Liu, Jin, Zhang, Hou: Light Field Depth Estimation via Stitched Epipolar Plane Images.
"""

from __future__ import annotations

import itertools

import cv2
import numpy as np
from pydantic import Field

from sepi.image.noise import noise_of_reference_view
from sepi.lightfield import BoolMap, FloatMap, LightField, full_scale
from sepi.matching.base_detail import BaseDetailParameters
from sepi.matching.denoising import DenoisedLightField
from sepi.matching.gauss_newton import GaussNewton
from sepi.matching.softening import SofteningParameters, compared_views
from sepi.matching.view_noise import variance_map
from sepi.matching.view_subsets import spread_views
from sepi.process.memory import take_blas_buffer
from sepi.regularization.border_planes import BorderPlane, BorderPlaneParameters
from sepi.regularization.contradiction import contradicted
from sepi.regularization.lit_planes import LitPlane, lit_planes
from sepi.regularization.plane_choice import LIT_AREA, chosen_plane, kept_pixels
from sepi.regularization.regions import Region, around, parts_of, together, widened
from sepi.stage import OcclusionMarginParameters, StageMaps

LEAST_NOISE = 1e-5
"""Least noise: rounding of float32. Integers have at least 0.3 levels."""

LEFT_OF_SLOPES = 15 / 128
"""Share of the variance of a central difference of white noise that the binomial filter of denoising leaves."""

MOST_CONTRADICTED = 0.1
"""Largest share of a region, before it spreads, in which views may contradict its plane; beyond, it loses the plane."""

ROUNDS, FEW_PLAIN = 3, 2.0
"""Number of times that regions spread, and factor of the squared gradient up to which few pixels are plain."""

NOISY_VIEWS = 25
"""Least number of noisy views to average: in the mean of fewer, noise hides texture."""

LIT_SHARE = 0.01
"""Least share of the picture for which planes are sought by the light: this takes as long as an optimisation round."""


class UniformPlanesParameters(OcclusionMarginParameters, SofteningParameters, BorderPlaneParameters):
    """Parameters of uniform regions and their planes."""

    colour_scale: float = Field(
        0.0316, ge=1e-6, le=2, description="residual at which a view counts half in the mean; RGB distance, 0..1"
    )
    views: int | None = Field(25, ge=2, description="least number of views to average; if noisy at least 25; null: all")
    window_radius: int = Field(4, ge=1, le=20, description="gradients are averaged over 2 r + 1 pixels")
    noise_factor: float = Field(
        4.0, gt=0, description="squared gradient below which a region is uniform, as a multiple of what noise explains"
    )
    growth: int = Field(8, ge=0, le=50, description="how far regions grow over their colour, in pixels")
    colour_tolerance: float = Field(0.0102, ge=0, le=1, description="RGB distance that counts as one colour, 0..1")
    grow_confidence: float = Field(0.75, ge=0, le=1, description="confidence from which a region does not take a pixel")
    min_area: int = Field(50, ge=1, description="least area of a region that may get a plane, in pixels")
    border_confidence: float = Field(0.3, ge=0, le=1, description="confidence above which a border pixel counts")
    light: bool = Field(True, description="whether the change of a region's light may tell its plane, too")
    edges: bool = Field(True, description="whether edges beside a region are decided again once it has its plane")


def fill_uniform_regions(
    light_field: LightField, before: StageMaps, parameters: UniformPlanesParameters
) -> tuple[FloatMap, BoolMap, FloatMap]:
    """Disparity with planes in uniform regions, the mask of their pixels, and how well light tells them.

    Parameters
    ----------
    light_field : LightField
    before : StageMaps
        Maps of the stage before.
    parameters : UniformPlanesParameters

    Returns
    -------
    disparity : ndarray, shape (H, W), float32
    held : ndarray, shape (H, W), bool
        Pixels that got a plane and should keep it; where noise may hide faint texture, a border's plane is not held.
    light_deviation : ndarray, shape (H, W), float32
        Standard deviation of the disparity of planes by light, pixels per view step; 0 elsewhere.

    Raises
    ------
    SepiError
        If the disparity range is unknown.
    """
    # before the views take the memory
    take_blas_buffer()
    field = compared_views(light_field, parameters)
    noisy = isinstance(field, DenoisedLightField)
    averaged = parameters.views if parameters.views is None or not noisy else max(parameters.views, NOISY_VIEWS)
    compared = spread_views(light_field, averaged)
    colours = BaseDetailParameters(colour_scale=parameters.colour_scale, use_detail=False)
    matching = GaussNewton(field, colours, parameters.occlusion_margin, compared)
    variance = _variance_of_views(light_field, field, compared)
    of_mean = variance * np.float32((LEFT_OF_SLOPES if noisy else 1) / compared.sum())
    mean = matching.mean(before.disparity)[..., :3]
    gradients = squared_gradients(mean)
    core = plain_pixels(gradients, of_mean, parameters)
    # noise is measured; what rounding adds is supposed, and a single pixel may be plain by chance
    inner = uniform_regions(mean, core, of_mean, before.confidence, parameters, fewest=1 if noisy else 2)
    uniform = spread_over_plain(mean, gradients, inner, of_mean, before.confidence, parameters)
    found = _with_borders(uniform, mean, of_mean, before, parameters)
    lit = _by_light(light_field, matching, before.disparity, found, variance, noisy) if parameters.light else {}
    known = light_field.require_disparity_range()
    planes = [
        chosen_plane(region, before.disparity[region.place], border, lit.get(n), noisy)
        for n, (region, border) in enumerate(found)
    ]
    disparity, held, light_deviation = before.disparity.copy(), np.zeros_like(core), np.zeros_like(before.disparity)
    known_planes = [(n, found[n][0], chosen) for n, chosen in enumerate(planes) if chosen is not None]
    for n, region, chosen in known_planes:
        if chosen.source == "light":
            light_deviation[region.place][region.pixels] = lit[n].deviations(region.basis)
        # a plane known at one side only may leave the range at the other
        values = np.clip(region.basis @ chosen.plane, known.minimum, known.maximum)
        disparity[region.place][region.pixels] = values
    regions = disparity != before.disparity
    asked = compared, parameters.occlusion_margin, float(np.median(variance))
    against = contradicted(light_field, before.disparity, disparity, regions, *asked)
    for _, (place, pixels), chosen in known_planes:
        kept = pixels & against[place]
        if (kept & inner[place]).sum() > MOST_CONTRADICTED * (pixels & inner[place]).sum():
            kept = pixels
        elif noisy:
            kept |= kept_pixels(pixels, disparity[place], before.disparity[place], chosen)
        disparity[place][kept], light_deviation[place][kept] = before.disparity[place][kept], 0
        pixels = pixels & ~kept
        # faint texture below the noise may tell the surface better than a border's plane
        faint = noisy and chosen.source == "border" and 2 * core[place][pixels].sum() < pixels.sum()
        held[place] |= pixels & np.bool_(not faint)
    return disparity, held, light_deviation


def _variance_of_views(light_field: LightField, field: LightField, compared: BoolMap) -> FloatMap:
    """Variance of the noise of one channel of a view (H, W); ``field`` is the light field, denoised if it is noisy."""
    if isinstance(field, DenoisedLightField):
        return variance_map(light_field, field.of_views, compared)
    rounding = 0.3 / full_scale(light_field.views.dtype) if light_field.views.dtype != np.float32 else 0.0
    noise = max(noise_of_reference_view(light_field), rounding, LEAST_NOISE)
    return np.full(light_field.shape, noise**2, np.float32)


def _with_borders(
    uniform: BoolMap, mean: FloatMap, variance: FloatMap, before: StageMaps, parameters: UniformPlanesParameters
) -> list[tuple[Region, BorderPlane | None]]:
    """The regions that are large enough, and the planes of their borders."""
    parts = parts_of(uniform)
    uniform = np.append(False, parts.areas >= parameters.min_area)[parts.labels]
    parts = parts_of(uniform)
    found: list[tuple[Region, BorderPlane | None]] = []
    for group in together(parts, mean, _most_apart(variance, parameters)):
        place = widened(around([parts.places[number - 1] for number in group]), 2)
        pixels = np.isin(parts.labels[place], group)
        border = cv2.dilate(pixels.astype(np.uint8), np.ones((5, 5), np.uint8)) > 0
        # pixels of other regions never count as border, so that the order of regions does not matter
        border &= ~uniform[place] & (before.confidence[place] > parameters.border_confidence)
        found.append((Region(place, pixels), BorderPlane.of(border, before.disparity[place], parameters)))
    return found


def _by_light(
    light_field: LightField,
    matching: GaussNewton,
    disparity: FloatMap,
    found: list[tuple[Region, BorderPlane | None]],
    variance: FloatMap,
    noisy: bool,
) -> dict[int, LitPlane]:
    """Planes by the light, for large regions; without noise only for those whose border tells no single plane."""
    asked = [
        n
        for n, (region, border) in enumerate(found)
        if region.area >= LIT_AREA and (noisy or border is None or not border.is_one_plane(region.area))
    ]
    if sum(found[n][0].area for n in asked) < LIT_SHARE * disparity.size:
        return {}
    regions, starts = [], []
    for region, border in (found[n] for n in asked):
        regions.append(region)
        middle = np.array([np.median(disparity[region.place][region.pixels]), 0, 0])
        starts.append(middle if border is None else border.plane)
    told = lit_planes(light_field, matching, disparity, regions, starts, variance)
    return {n: plane for n, plane in zip(asked, told, strict=True) if plane is not None}


def squared_gradients(mean: FloatMap) -> FloatMap:
    """Of central differences of a picture (H, W, C), across and down, summed over channels; shape (H, W), float32."""
    axes = (1, 0), (0, 1)
    total = np.zeros(mean.shape[:2], np.float32)
    # a channel at a time is several times as fast as all channels of a pixel
    for channel, axis in itertools.product(cv2.split(mean), axes):
        total += cv2.Sobel(channel, -1, *axis, ksize=1, scale=0.5, borderType=cv2.BORDER_REPLICATE) ** 2
    return total


def _most_gradient(variance: FloatMap, parameters: UniformPlanesParameters) -> float | FloatMap:
    """Mean squared gradient up to which pixels are plain."""
    # central differences halve the variance; two axes, three channels
    return parameters.noise_factor * 3 * variance


def plain_pixels(gradients: FloatMap, variance: FloatMap, parameters: UniformPlanesParameters) -> BoolMap:
    """Pixels round which the mean of the views varies no more than its noise.

    Parameters
    ----------
    gradients : ndarray, shape (H, W), float32
        :func:`squared_gradients` of the mean.
    variance : ndarray, shape (H, W), float32
        Of the noise of one channel of the mean.
    parameters : UniformPlanesParameters

    Returns
    -------
    ndarray, shape (H, W), bool
    """
    size = 2 * parameters.window_radius + 1
    return np.asarray(cv2.blur(gradients, (size, size)) < _most_gradient(variance, parameters))


def _most_apart(variance: FloatMap, parameters: UniformPlanesParameters) -> FloatMap:
    """Squared difference up to which colours are one, summed over channels: three deviations of each, or more."""
    return np.asarray(27 * variance + np.float32(parameters.colour_tolerance**2), np.float32)


def _alike(
    mean: FloatMap, region: BoolMap, variance: FloatMap, confidence: FloatMap, parameters: UniformPlanesParameters
) -> tuple[BoolMap, FloatMap]:
    """Pixels of the colour that the region has within reach, and how much of the reach the region fills."""
    size = 2 * (parameters.window_radius + parameters.growth) + 1
    inside = region.astype(np.float32)
    near, apart = cv2.blur(inside, (size, size)), np.zeros_like(inside)
    for channel in cv2.split(mean):
        apart += (channel - cv2.blur(channel * inside, (size, size)) / np.maximum(near, np.float32(1e-9))) ** 2
    alike = apart < _most_apart(variance, parameters)
    # half a pixel is more than the rounding errors of a running sum
    alike &= (confidence < parameters.grow_confidence) & (near > 0.5 / size**2)
    return np.asarray(alike), np.asarray(near * np.float32(size**2))


def uniform_regions(
    mean: FloatMap,
    core: BoolMap,
    variance: FloatMap,
    confidence: FloatMap,
    parameters: UniformPlanesParameters,
    fewest: int,
) -> BoolMap:
    """Plain pixels, and pixels of their colour around them, also in gaps too narrow for a plain window.

    Parameters
    ----------
    mean : ndarray, shape (H, W, 3), float32
        Mean of the views, 0..1.
    variance : ndarray, shape (H, W), float32
        Of the noise of one of its channels.
    core : ndarray, shape (H, W), bool
        The plain pixels.
    confidence : ndarray, shape (H, W), float32
    parameters : UniformPlanesParameters
    fewest : int
        Plain pixels within reach of a pixel of their colour; one is enough between pixels of the region.

    Returns
    -------
    ndarray, shape (H, W), bool
    """
    if not core.any():
        return core
    alike, number = _alike(mean, core, variance, confidence, parameters)
    uniform = core | (alike & (number > fewest - 0.5))
    between = cv2.morphologyEx(uniform.astype(np.uint8), cv2.MORPH_CLOSE, np.ones((5, 5), np.uint8)) > 0
    return np.asarray(uniform | (alike & between))


def spread_over_plain(
    mean: FloatMap,
    gradients: FloatMap,
    region: BoolMap,
    variance: FloatMap,
    confidence: FloatMap,
    parameters: UniformPlanesParameters,
) -> BoolMap:
    """Uniform regions, and what is plain among pixels of their colour, as in gaps that are narrower than a window.

    Parameters
    ----------
    mean, variance, confidence
        As in :func:`uniform_regions`.
    gradients : ndarray, shape (H, W), float32
        :func:`squared_gradients` of the mean.
    region : ndarray, shape (H, W), bool
        Of :func:`uniform_regions`.
    parameters : UniformPlanesParameters

    Returns
    -------
    ndarray, shape (H, W), bool
    """
    if not region.any():
        return region
    most = FEW_PLAIN * _most_gradient(variance, parameters)
    size = (2 * parameters.window_radius + 1,) * 2
    beside = cv2.getStructuringElement(cv2.MORPH_CROSS, (3, 3))
    for _ in range(ROUNDS):
        alike, _ = _alike(mean, region, variance, confidence, parameters)
        # gradients between pixels of one colour: those of a border are larger
        among = cv2.erode((region | alike).astype(np.float32), beside, borderValue=1)
        share = cv2.blur(among, size)
        plain = alike & (share > 0.5 / size[0] ** 2) & (cv2.blur(gradients * among, size) < most * share)
        # a row of mixed pixels on an outline leads from one surface to the next
        region = region | (cv2.morphologyEx((region | plain).astype(np.uint8), cv2.MORPH_OPEN, np.ones((3, 3))) > 0)
    return region
