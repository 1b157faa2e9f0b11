"""Plane sweep over colours and detail of the views, with the views left out in which a pixel is occluded.

A view sees pixel ``p`` at candidate ``d`` unless something nearer than ``d`` occludes the position where ``p`` would be
seen. What occludes it is known from a first depth map: each view gets a z-buffer of that map. This is the idea of the
half-SEPI, with the part of the views chosen view by view. The compiled loops are in
:mod:`sepi.matching.visibility_kernels`.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, ClassVar

import numpy as np
from pydantic import Field

from sepi.lightfield import FloatMap, LightField
from sepi.matching.base_detail import (
    BaseDetail,
    BaseDetailParameters,
    ColourScale,
    base_detail_decomposition,
)
from sepi.matching.candidates import CandidateParameters, CandidateRule, number_field
from sepi.matching.semi_global import SmoothedResult, SmoothingParameters, smooth_and_choose
from sepi.stage import OcclusionMarginParameters, Progress

if TYPE_CHECKING:
    from sepi.matching.visibility_kernels import Visibility

ROWS_PER_REPORT = 128
"""Rows of the picture between two calls of the progress function."""


CANDIDATES = CandidateRule(usual=91, finest=0.03, coarsest=0.4, volume_bytes=2**30)
"""The optimisation goes back to the views, so these need not be as fine as the paper's."""

BYTES_PER_CANDIDATE = 8
"""Of each pixel: two at a time of the costs, their averages, and these smoothed."""


class VisibilitySweepParameters(CandidateParameters, BaseDetailParameters, SmoothingParameters):
    """Parameters of a visibility sweep and of the choice among its candidates."""

    rule: ClassVar[CandidateRule] = CANDIDATES

    num_disparities: int | None = number_field(CANDIDATES, "docs/best.md")


class VisibleViewsParameters(VisibilitySweepParameters, OcclusionMarginParameters):
    """Parameters of the sweep over the views that see a pixel."""

    passes: int = Field(3, ge=1, le=10, description="how often visibility and depth are computed anew")
    occluded_view_weight: float = Field(0.01, ge=0, le=1, description="weight of a view in which the pixel is occluded")


class AllViewsParameters(VisibilitySweepParameters):
    """Parameters of the first depth map: a narrow scale of the colours bears with views that do not see the pixel."""

    colour_scale: ColourScale = 0.0077


def depth_from_all_views(
    light_field: LightField, parameters: VisibilitySweepParameters, progress: Progress
) -> SmoothedResult:
    """Depth as if every view saw every pixel.

    Parameters
    ----------
    light_field : LightField
        With a known disparity range.
    parameters : VisibilitySweepParameters
    progress : callable

    Returns
    -------
    SmoothedResult

    Raises
    ------
    SepiError
        If the disparity range is unknown.
    """
    from sepi.matching.visibility_kernels import Visibility

    everywhere = np.empty((*light_field.grid, light_field.shape[0], 0), np.float32)
    views = base_detail_decomposition(light_field, parameters)
    return _sweep(light_field, views, Visibility(everywhere, np.float32(0), np.float32(1)), parameters, progress)


def depth_from_visible_views(
    light_field: LightField, disparity: FloatMap, parameters: VisibleViewsParameters, progress: Progress
) -> SmoothedResult:
    """Depth over the views that see a pixel, as a first map tells, in several passes.

    Parameters
    ----------
    light_field : LightField
        With a known disparity range.
    disparity : ndarray, shape (H, W), float32
        The first map, pixels per view step.
    parameters : VisibleViewsParameters
    progress : callable

    Returns
    -------
    SmoothedResult

    Raises
    ------
    SepiError
        If the disparity range is unknown.
    """
    from sepi.matching.visibility_kernels import Visibility, z_buffers

    views = base_detail_decomposition(light_field, parameters)
    margin, weight = np.float32(parameters.occlusion_margin), np.float32(parameters.occluded_view_weight)
    n = parameters.passes
    for i in range(n):
        result = _sweep(
            light_field,
            views,
            Visibility(z_buffers(disparity, light_field.present, light_field.baselines), margin, weight),
            parameters,
            lambda fraction, i=i: progress((i + fraction) / n),  # type: ignore[misc]
        )
        disparity = result.disparity
    return result


def _sweep(
    light_field: LightField,
    views: BaseDetail,
    visibility: Visibility,
    parameters: VisibilitySweepParameters,
    progress: Progress,
) -> SmoothedResult:
    disparities = parameters.candidates(light_field)
    # neither is held by a name here: each goes as soon as it has been used
    cost = [_costs(views, visibility, disparities, parameters, progress)]
    del visibility
    result = smooth_and_choose(cost.pop(), disparities, views.guide, views.noise, parameters)
    progress(1.0)
    return result


def _costs(
    views: BaseDetail,
    visibility: Visibility,
    disparities: FloatMap,
    parameters: VisibilitySweepParameters,
    progress: Progress,
) -> FloatMap:
    """Cost of every candidate, 0..1; shape (K, H, W), float32."""
    from sepi.matching.visibility_kernels import RobustCost, sweep_visible_rows

    H, W, _ = views.guide.shape
    cost = np.empty((len(disparities), H, W), np.float32)
    share = parameters.detail_share
    scales2 = [views.squared_scale(s) for s in (parameters.colour_scale, parameters.detail_scale)]
    robust = RobustCost(np.array(scales2, np.float32), np.array([1 - share, share], np.float32))
    for begin in range(0, H, ROWS_PER_REPORT):
        end = min(H, begin + ROWS_PER_REPORT)
        sweep_visible_rows(views, visibility, robust, disparities, begin, end, cost)
        # the smoothing takes about a fifth of the time
        progress(0.8 * end / H)
    return cost
