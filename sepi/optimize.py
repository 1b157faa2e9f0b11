"""Global optimisation (section IV-D, Eq. 8-12 of [1]_).

``wls`` minimises the weighted least squares energy of Eq. 8: fidelity to the refined depth by its confidence, reduced
at depth discontinuities (Eq. 9-10), and smoothness on the 4-connected grid where the image is smooth (Eq. 11) and the
depth uncertain (Eq. 12).

``second_order`` compares the views again: Gauss-Newton steps on their residuals (:mod:`sepi.matching.gauss_newton`)
refine the depth below the disparity sampling. Second-order smoothing (:mod:`sepi.regularization.second_order`), which
leaves planes unchanged, weights each pixel by the views' information on it. ``none`` returns the depth unchanged.

:class:`sepi.stage.Choice` describes arguments and results of all choices.

References
----------
.. [1] Zhou, Shi, Liu, Jin, Zhang, Hou: Light Field Depth Estimation via Stitched Epipolar Plane Images.
"""

from __future__ import annotations

from typing import NamedTuple, Self

import cv2
import numpy as np
from pydantic import Field, model_validator

from sepi.error_bars.bars import error_bars
from sepi.error_bars.calibration import SECOND_ORDER, WLS, Calibration
from sepi.error_bars.cues import cues_of_map, cues_of_stage_before, cues_of_texture, cues_of_views
from sepi.image.noise import reference_residual_variance
from sepi.lightfield import BoolMap, FloatMap, LightField
from sepi.matching.base_detail import BaseDetailParameters, forget_detail
from sepi.matching.denoising import DenoisedLightField, denoised, measured_noise
from sepi.matching.gauss_newton import ANY_SURFACE, Evidence, GaussNewton, Surfaces, windowed_step
from sepi.matching.softening import compared_views, reference_sharpness
from sepi.matching.spline_views import forget_splines
from sepi.matching.view_subsets import spread_views
from sepi.regularization.multilevel import solve_smooth
from sepi.regularization.second_order import (
    colour_changes,
    inverse_diagonal,
    second_difference_stencil,
    smoothness_weights,
    upper_quartile,
)
from sepi.regularization.wls import WlsParameters, data_weight, rectified_confidence, smoothness_coefficient, solve
from sepi.stage import (
    LIGHT_DEVIATION,
    Choice,
    NoParameters,
    OcclusionMarginParameters,
    Progress,
    StageMaps,
    none,
    require_previous,
)

UNIFORM_WEIGHT = 0.05
"""Weight of the data on planes of textureless regions; planes cost nothing, so a small weight keeps them."""

WLS_VIEWS = 9
"""Least number of views for the error bars of a map by weighted least squares."""

LEAST_RELIABILITY = 1e-6
LEAST_SMOOTHNESS = 1e-8

THRESHOLDS = 0.01, 0.05
"""Least and largest second difference that may mark a discontinuity after the first round, pixels per view step."""


class SecondOrderParameters(BaseDetailParameters, OcclusionMarginParameters):
    """Parameters of Gauss-Newton refinement and second-order smoothing."""

    least_noise: float = Field(
        0.02,
        ge=0,
        le=1,
        description="least noise at which this stage works on denoised views; standard deviation of one channel, "
        "colours in 0..1. Below it, denoising would lose faint detail that many views show",
    )
    views: int | None = Field(None, ge=2, description="least number of views for the last step; null: all")
    first_views: int | None = Field(
        25, ge=2, description="least number of views for all steps but the last; null, or if they are noisy: all"
    )
    refinements: int = Field(0, ge=0, le=20, description="Gauss-Newton steps before the first smoothing")
    noisy_refinements: int = Field(
        6, ge=0, le=20, description="the same for noisy views, where matching ends farther from the true depth"
    )
    refinement_radius: int = Field(4, ge=0, le=20, description="window of these steps, 2 r + 1 pixels")
    one_surface: bool = Field(True, description="whether a window leaves out other surfaces, by depth and colour")
    solves: int = Field(4, ge=0, le=10, description="rounds of one Gauss-Newton step and one smoothing")
    solve_radius: int = Field(1, ge=0, le=20, description="window of the steps of these rounds, 2 r + 1 pixels")
    max_update: float = Field(0.05, gt=0, description="largest change by one Gauss-Newton step, pixels per view step")
    strength: float = Field(7.0, ge=0, description="weight of smoothness; the best-known tenth of data has weight 1")
    second_difference_threshold: float = Field(
        0.03, gt=0, description="second difference that marks a discontinuity in the first round, pixels per view step"
    )
    roughness_factor: float = Field(
        40.0, ge=0, description="the same in later rounds, as a multiple of the second differences' upper quartile"
    )
    smooth_colour: float = Field(
        0.1,
        gt=0,
        description="RGB distance at which smoothness and windows' weights fall, colours in 0..1; noise adds to it",
    )
    reliable_confidence: float = Field(
        0.5, gt=0, le=1, description="confidence within two pixels from which a discontinuity in the data is trusted"
    )
    rtol: float = Field(3e-4, ge=1e-5, lt=1, description="relative residual that ends the solver in the last round")
    first_rtol: float = Field(3e-3, ge=1e-5, lt=1, description="the same for the other rounds")
    max_iterations: int = Field(200, ge=1, description="most iterations of the solver")

    @model_validator(mode="after")
    def _does_something(self) -> Self:
        if self.refinements + self.solves == 0:
            raise ValueError("refinements and solves cannot both be 0; the choice 'none' switches the stage off")
        return self


def wls(
    light_field: LightField, previous: StageMaps | None, parameters: WlsParameters, progress: Progress
) -> StageMaps:
    """Depth by globally weighted least squares (section IV-D, Eq. 8-12 of [1]_).

    Uses the map ``textureless`` if the stage before made one.

    Returns
    -------
    StageMaps
        With the error bars ``sigma``, ``low`` and ``high``; ``confidence`` is the probability of an error of at most
        :data:`sepi.stage.CLOSE`, not the rectified confidence c' of Eq. 10, which weights the data.

    References
    ----------
    .. [1] Zhou, Shi, Liu, Jin, Zhang, Hou: Light Field Depth Estimation via Stitched Epipolar Plane Images.
       arXiv:2203.15201.

    Examples
    --------
    The first and the last stage of the paper alone:

    >>> import numpy as np
    >>> from sepi import initial, optimize
    >>> from sepi.scenes import render
    >>> from sepi.stage import no_progress
    >>> light_field = render("wall", size=64, views=3)
    >>> before = initial.sepi(light_field, None, initial.CHOICES["sepi"].parameters(), no_progress)
    >>> after = optimize.wls(light_field, before, optimize.CHOICES["wls"].parameters(), no_progress)
    >>> errors = [np.square(maps.disparity - light_field.ground_truth).mean() for maps in (before, after)]
    >>> bool(errors[1] < 0.8 * errors[0])
    True
    """
    before = require_previous(previous)
    confidence = rectified_confidence(before.confidence, before.mask("textureless"), parameters)
    weight = data_weight(before.disparity, confidence, parameters)
    smoothness = smoothness_coefficient(light_field.reference_view, confidence, parameters)
    progress(0.1)
    disparity = solve(before.disparity, weight, smoothness, parameters.alpha, parameters.rtol)
    progress(0.6)
    views = spread_views(light_field, WLS_VIEWS)
    matching = GaussNewton(light_field, BaseDetailParameters(), OcclusionMarginParameters().occlusion_margin, views)
    told = matching.with_evidence(matching.mean(disparity), disparity)
    return _with_bars(light_field, before, disparity, told, None, WLS)


def second_order(
    light_field: LightField, previous: StageMaps | None, parameters: SecondOrderParameters, progress: Progress
) -> StageMaps:
    """Depth refined by the views, with second-order smoothing; variant ``best`` uses it.

    Uses the map ``textureless`` if the stage before made one.

    Returns
    -------
    StageMaps
        With the error bars ``sigma``, ``low`` and ``high``; ``confidence`` is the probability of an error of at most
        :data:`sepi.stage.CLOSE`.

    Examples
    --------
    >>> import numpy as np
    >>> from sepi import initial, optimize
    >>> from sepi.scenes import render
    >>> from sepi.stage import no_progress
    >>> light_field = render("slanted_plane", size=64, views=5)
    >>> before = initial.sepi(light_field, None, initial.CHOICES["sepi"].parameters(), no_progress)
    >>> after = optimize.second_order(light_field, before, optimize.CHOICES["second_order"].parameters(), no_progress)
    >>> errors = [np.abs(maps.disparity - light_field.ground_truth).mean() for maps in (before, after)]
    >>> bool(errors[1] < 0.8 * errors[0])
    True
    """
    before, given = require_previous(previous), light_field
    noisy = isinstance(denoised(light_field, parameters.denoising), DenoisedLightField)
    light_field = compared_views(light_field, parameters, parameters.least_noise)
    disparity = before.disparity
    uniform = before.mask("textureless")
    prior, variance = _prior(light_field, before.confidence, uniform, parameters), None
    lowest, highest = light_field.require_disparity_range().candidates(2)
    refinements = max(parameters.refinements, parameters.noisy_refinements if noisy else 0)
    by_depth = Surfaces(parameters.occlusion_margin if parameters.one_surface else ANY_SURFACE)
    total = refinements + parameters.solves
    for i in range(total):
        progress((i + 0.5) / (total + 1))
        smooth, last = i >= refinements, i == total - 1
        if i == 0 or last:
            views = spread_views(light_field, parameters.views if last or noisy else parameters.first_views)
            matching = GaussNewton(light_field, parameters, parameters.occlusion_margin, views)
        if i <= refinements or last:
            # later steps are too small to change the visibility
            mean = matching.mean(disparity)
        if i == 0:
            # a smoothed map tells its discontinuities itself
            by_colour = _coloured(mean, light_field, parameters) if refinements and parameters.one_surface else by_depth
        if last:
            # the splines hold a copy
            matching.forget_detail()
            told = gradient, information, _ = matching.with_evidence(mean, disparity)
            # memory for the solver
            del matching, mean
            forget_splines(light_field)
            forget_detail(light_field)
        else:
            gradient, information = matching.gradient_and_hessian(mean, disparity)
        surfaces = by_depth if smooth else by_colour
        radius = parameters.solve_radius if smooth else parameters.refinement_radius
        step, curvature = windowed_step(gradient, information, disparity, surfaces, radius, parameters.max_update)
        # in uniform regions, a step would follow the noise
        target = np.clip(disparity + np.where(uniform, np.float32(0), step), lowest, highest)
        if smooth:
            threshold = _threshold(disparity, parameters, first=i == refinements)
            target, variance = _smoothed(target, curvature, disparity, prior, threshold, parameters, last=last)
        disparity = np.clip(target, lowest, highest)
    return _with_bars(given, before, disparity, told, variance, SECOND_ORDER)


def _with_bars(
    light_field: LightField,
    before: StageMaps,
    disparity: FloatMap,
    told: tuple[FloatMap, FloatMap, Evidence],
    variance: FloatMap | None,
    calibration: Calibration,
) -> StageMaps:
    """Maps with error bars, from the views' evidence about (nearly) this map.

    The light field is the original one, whose noise counts. ``variance``, if given, is the variance after smoothing.
    """
    gradient, curvature, evidence = told
    known, noise = light_field.require_disparity_range(), measured_noise(light_field)
    cues = {
        **cues_of_map(disparity, curvature, known),
        **cues_of_views(gradient, curvature, evidence, noise.usual),
        **cues_of_stage_before(
            before.confidence, before.mask("textureless"), before.extra.get(LIGHT_DEVIATION), curvature
        ),
    }
    if variance is not None:
        cues["deviation"] = np.sqrt(variance)
    cues |= cues_of_texture(reference_sharpness(light_field, noise), cues["agreement"], cues["deviation"])
    return before.updated(disparity, **error_bars(disparity, cues, known, calibration))


def _threshold(disparity: FloatMap, parameters: SecondOrderParameters, first: bool) -> float:
    """Second difference of a discontinuity, in proportion to the map's own: leaves curve more than a wall.

    In the first round it is a parameter, because second differences are mostly noise before any smoothing.
    """
    if first:
        return parameters.second_difference_threshold
    low, high = THRESHOLDS
    return min(max(parameters.roughness_factor * upper_quartile(disparity), low), high)


class _Prior(NamedTuple):
    """Inputs of the smoothing that are the same in all rounds.

    Attributes
    ----------
    uniform : ndarray, shape (H, W), bool
        Pixels of textureless regions with a plane.
    reliability : ndarray, shape (H, W), float32
        Trust in second differences of the data, 0..1.
    colours : list of ndarray
        From :func:`sepi.regularization.second_order.colour_changes`.
    colour_variance : float
        Squared change of colour that weakens smoothness.
    """

    uniform: BoolMap
    reliability: FloatMap
    colours: list[FloatMap]
    colour_variance: float


def _prior(
    light_field: LightField, confidence: FloatMap, uniform: BoolMap, parameters: SecondOrderParameters
) -> _Prior:
    # edges lower the confidence, so the best within two pixels counts
    best = cv2.dilate(confidence, np.ones((5, 5), np.uint8))
    trust = np.clip((best / parameters.reliable_confidence) ** 2, LEAST_RELIABILITY, 1)
    reliability = np.where(uniform, 1, trust).astype(np.float32)
    variance = parameters.smooth_colour**2 + 4 * reference_residual_variance(light_field)
    return _Prior(uniform, reliability, colour_changes(light_field.reference_view), variance)


def _coloured(mean: FloatMap, light_field: LightField, parameters: SecondOrderParameters) -> Surfaces:
    colours = np.ascontiguousarray(np.moveaxis(mean[..., :3], 2, 0))
    width = np.sqrt(parameters.smooth_colour**2 + reference_residual_variance(light_field))
    return Surfaces(parameters.occlusion_margin, colours, float(width))


def _smoothed(
    target: FloatMap,
    curvature: FloatMap,
    shape: FloatMap,
    prior: _Prior,
    threshold: float,
    parameters: SecondOrderParameters,
    *,
    last: bool,
) -> tuple[FloatMap, FloatMap | None]:
    """``target``, of inverse variance ``curvature``, after second-order smoothing; in the last round with its variance.

    Smoothing is weak where ``shape``, the map so far, has a second difference beyond the threshold, or the colours
    change.
    """
    unit = max(float(np.percentile(curvature, 90)), 1e-9)
    weight = np.minimum(curvature / unit, 1) * prior.reliability
    weight = np.where(prior.uniform, np.float32(UNIFORM_WEIGHT), weight)
    changes = smoothness_weights(shape, prior.colours, prior.reliability, threshold, prior.colour_variance)
    smoothness = [parameters.strength * change + LEAST_SMOOTHNESS for change in changes]
    del changes
    rtol = parameters.rtol if last else parameters.first_rtol
    solution = solve_smooth(
        second_difference_stencil(smoothness, target.shape), weight, target, shape, rtol, parameters.max_iterations
    )
    return solution, inverse_diagonal(weight, smoothness) / np.float32(unit) if last else None


CHOICES = {
    "wls": Choice(WlsParameters, wls),
    "second_order": Choice(SecondOrderParameters, second_order),
    "none": Choice(NoParameters, none),
}

if __name__ == "__main__":
    from sepi.process.command import stage_command

    stage_command("optimize", CHOICES)()
