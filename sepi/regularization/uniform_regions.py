"""Regions without texture, told from faint texture by the noise, and planes for them.

The mean of all views that see a pixel has a small fraction of one view's noise. A region is uniform where the mean's
gradients are no larger than that noise explains: then no view knows anything about its depth, whatever a threshold on
contrast says. (This takes the place of the paper's LTI, section IV-C of [1]_.)

What is known lies on its border. An edge moves with the nearer of the two surfaces that meet there, so the region is
nowhere nearer than its border: the plane sought agrees with as much of the border as possible, while border that
would lie *behind* it counts against it. Border that is nearer belongs to what stands before the region.

References
----------
.. [1] Zhou, Shi, Liu, Jin, Zhang, Hou: Light Field Depth Estimation via Stitched Epipolar Plane Images.
"""

from __future__ import annotations

import cv2
import numpy as np
import numpy.typing as npt
from pydantic import Field

from sepi.image.noise import noise_level
from sepi.lightfield import BoolMap, FloatMap, LightField, full_scale
from sepi.matching.base_detail import BaseDetailParameters
from sepi.matching.denoising import DenoisingParameters, denoised
from sepi.matching.view_subsets import spread_views
from sepi.stage import OcclusionMarginParameters, StageMaps

LEAST_NOISE = 1e-5
"""Noise below which rounding of float32 is noise too; integers have at least 0.3 levels by rounding."""

# residuals that are computed at once: enough to save calls, few enough for the cache
_AT_ONCE = 2**17
_PIXELS_OF_A_PLANE = 12  # least border to fit one to


class UniformPlanesParameters(OcclusionMarginParameters, DenoisingParameters):
    """Parameters of uniform regions and their planes."""

    colour_scale: float = Field(
        0.0316, ge=1e-6, le=2, description="residual at which a view counts half in the mean; RGB distance, 0..1"
    )
    views: int | None = Field(25, ge=2, description="views that are averaged, at least; null: all")
    window_radius: int = Field(4, ge=1, le=20, description="gradients are averaged over 2 r + 1 pixels")
    noise_factor: float = Field(
        4.0, gt=0, description="squared gradient, in units of what noise explains, below which a region is uniform"
    )
    growth: int = Field(
        8, ge=0, le=50, description="how far beyond the window's reach a region grows into its own colour, in pixels"
    )
    colour_tolerance: float = Field(
        0.0102, ge=0, le=1, description="RGB distance that counts as the region's colour, colours in 0..1"
    )
    grow_confidence: float = Field(0.75, ge=0, le=1, description="confidence beyond which a pixel keeps its own depth")
    min_area: int = Field(50, ge=1, description="smaller regions are left alone, in pixels")
    border_confidence: float = Field(0.3, ge=0, le=1, description="confidence from which a border pixel counts")
    tolerance: float = Field(0.05, gt=0, description="distance from the plane of what agrees, pixels per view step")
    behind_penalty: float = Field(
        2.0, ge=0, description="weight of border behind the plane against border that agrees with it"
    )
    min_inlier_ratio: float = Field(0.25, ge=0, le=1, description="share of the border without which there is no plane")
    ransac_iterations: int = Field(500, ge=1, description="planes tried for each region")


def fill_uniform_regions(
    light_field: LightField, before: StageMaps, parameters: UniformPlanesParameters
) -> tuple[FloatMap, BoolMap]:
    """Disparity with planes in uniform regions, and these regions.

    Parameters
    ----------
    light_field : LightField
    before : StageMaps
    parameters : UniformPlanesParameters

    Returns
    -------
    disparity : ndarray, shape (H, W), float32
    uniform : ndarray, shape (H, W), bool
        The regions that have a plane.

    Raises
    ------
    SepiError
        If the disparity range is unknown.
    """
    from scipy import ndimage

    from sepi.matching.gauss_newton import GaussNewton

    light_field = denoised(light_field, parameters.denoising)
    colours = BaseDetailParameters(colour_scale=parameters.colour_scale, detail_share=0.0)
    compared = spread_views(light_field, parameters.views)
    mean = GaussNewton(light_field, colours, parameters.occlusion_margin, compared).mean(before.disparity)[..., :3]
    views = int(compared.sum())
    rounding = 0.3 / full_scale(light_field.views.dtype) if light_field.views.dtype != np.float32 else 0.0
    variance = max(noise_level(light_field.reference_view), rounding, LEAST_NOISE) ** 2 / views
    uniform = uniform_regions(mean, variance, before.confidence, parameters)
    labels, _ = ndimage.label(uniform)
    uniform &= np.bincount(labels.ravel())[labels] >= parameters.min_area
    known = light_field.require_disparity_range()
    disparity, filled = before.disparity.copy(), np.zeros_like(uniform)
    for number, place in enumerate(ndimage.find_objects(labels), start=1):
        around = tuple(slice(max(side.start - 2, 0), side.stop + 2) for side in place)
        own = uniform[around] & (labels[around] == number)
        border = cv2.dilate(own.astype(np.uint8), np.ones((5, 5), np.uint8)) > 0
        # what lies in another region is no border, whether or not that one gets a plane: their order must not matter
        border &= ~uniform[around] & (before.confidence[around] > parameters.border_confidence)
        plane = ransac_plane(border, before.disparity[around], parameters)
        if plane is not None:
            y, x = np.nonzero(own)
            # a plane that its border holds at one side only may lead anywhere
            disparity[around][own] = np.clip(_basis(y, x, own.shape) @ plane, known.minimum, known.maximum)
            filled[around] |= own
    return disparity, filled


def uniform_regions(
    mean: FloatMap, variance: float, confidence: FloatMap, parameters: UniformPlanesParameters
) -> BoolMap:
    """Where the mean of the views varies no more than its noise.

    Parameters
    ----------
    mean : ndarray, shape (H, W, 3), float32
        Colours, 0..1.
    variance : float
        Of the noise of one channel of the mean.
    confidence : ndarray, shape (H, W), float32
    parameters : UniformPlanesParameters

    Returns
    -------
    ndarray, shape (H, W), bool
    """
    down, across = np.gradient(mean, axis=(0, 1))
    size = 2 * parameters.window_radius + 1
    energy = cv2.blur((down**2 + across**2).sum(axis=2), (size, size))
    # central differences halve the noise along each of the two axes; three channels
    core = energy < parameters.noise_factor * 3 * variance
    if not core.any():
        return np.asarray(core)
    size += 2 * parameters.growth
    near = cv2.blur(core.astype(np.float32), (size, size))
    colour = cv2.blur(mean * core[..., None].astype(np.float32), (size, size)) / np.maximum(near, 1e-9)[..., None]
    alike = ((mean - colour) ** 2).sum(axis=2) < 27 * variance + parameters.colour_tolerance**2
    # a running sum leaves rounding errors where there is nothing
    return np.asarray(core | ((near > 0.5 / size**2) & alike & (confidence < parameters.grow_confidence)))


def ransac_plane(
    border: BoolMap, disparity: FloatMap, parameters: UniformPlanesParameters
) -> npt.NDArray[np.float64] | None:
    """Plane that most of a border agrees with and little of it lies behind.

    The triples of pixels that planes are tried through do not depend on other regions, nor on which way the picture is
    mirrored.

    Parameters
    ----------
    border : ndarray, shape (h, w), bool
    disparity : ndarray, shape (h, w), float32
    parameters : UniformPlanesParameters

    Returns
    -------
    ndarray, shape (3,), or None
        ``a, b, c`` of ``a + b x + c y`` with ``x`` and ``y`` from the middle of the array; None where too little of
        the border agrees.
    """
    y, x = np.nonzero(border)
    values = disparity[border].astype(np.float64)
    if values.size < _PIXELS_OF_A_PLANE:
        return None
    positions = _basis(y, x, border.shape)
    order = np.lexsort(((positions[:, 1:] ** 2).sum(axis=1), values))
    positions, values = positions[order], values[order]
    triples = np.random.default_rng(0).integers(values.size, size=(parameters.ransac_iterations, 3))
    triples = triples[np.abs(np.linalg.det(positions[triples])) > 1e-9]
    planes = np.linalg.solve(positions[triples], values[triples, None])[..., 0]
    if not len(planes):
        return None
    parts = np.array_split(planes, -(-len(planes) * values.size // _AT_ONCE))
    scores = np.concatenate([_scores(positions, values, part, parameters) for part in parts])
    chosen = abs(_residuals(positions, values, planes[scores.argmax(), None])[0]) < parameters.tolerance
    if chosen.sum() < max(3, parameters.min_inlier_ratio * values.size):
        return None
    return np.asarray(np.linalg.lstsq(positions[chosen], values[chosen], rcond=None)[0])


def _scores(
    positions: npt.NDArray[np.float64],
    values: npt.NDArray[np.float64],
    planes: npt.NDArray[np.float64],
    parameters: UniformPlanesParameters,
) -> npt.NDArray[np.float64]:
    """How much of a border agrees with each of some planes (P, 3), less what lies behind it."""
    residual = _residuals(positions, values, planes)
    agreeing = (abs(residual) < parameters.tolerance).sum(axis=1)
    behind = (residual < -parameters.tolerance).sum(axis=1)
    return np.asarray(agreeing - parameters.behind_penalty * behind)


def _residuals(
    positions: npt.NDArray[np.float64], values: npt.NDArray[np.float64], planes: npt.NDArray[np.float64]
) -> npt.NDArray[np.float64]:
    """By how much each of N values is above each of P planes, (P, N)."""
    a, b, c = planes.T[..., None]
    # term by term: a product of matrices rounds as the number of threads has it
    return np.asarray(values - (a + b * positions[:, 1] + c * positions[:, 2]))


def _basis(y: npt.NDArray[np.int64], x: npt.NDArray[np.int64], shape: tuple[int, ...]) -> npt.NDArray[np.float64]:
    """1, x and y of pixels, (N, 3), from the middle of an array of this shape."""
    height, width = shape
    return np.stack([np.ones(x.size), x - (width - 1) / 2, y - (height - 1) / 2], axis=1)
