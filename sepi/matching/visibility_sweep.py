"""Plane sweep over colours and detail of the views that see a pixel.

A view sees pixel ``p`` at candidate ``d`` unless something nearer than ``d`` lies where the view would show ``p``. A
z-buffer of an earlier depth map in each view tells this. It is the half-SEPI's idea, decided view by view.

Several passes compute visibility and depth in turn. All maps but the last only serve the visibility, so a few views,
spread over the grid, and fewer candidates are enough for them. Some views compare all candidates, so that errors of the
earlier map can be corrected; the others compare those near the earlier map. The last of several passes only refines
the map: all its views compare the candidates near it. In noise they compare all, since maps from few views are wrong by
chance. The compiled loops are in ``kernels/visibility.cpp``.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Annotated, ClassVar

import cv2
import numpy as np
import numpy.typing as npt
from pydantic import Field

from sepi.image.noise import variance_of_residuals
from sepi.image.texture import variance_within_surface
from sepi.kernels import visibility as kernels
from sepi.lightfield import BoolMap, FloatMap, LightField
from sepi.matching.base_detail import (
    BaseDetailParameters,
    ColourScale,
    base_detail_decomposition,
    compared_with,
    reference_noise,
)
from sepi.matching.candidates import CandidateParameters, CandidateRule, number_field
from sepi.matching.denoising import DenoisedLightField, guide_of
from sepi.matching.gaps import GapParameters, with_open_gaps
from sepi.matching.nearest_surfaces import EMPTY, SeenViews, nearest_surfaces, z_buffers
from sepi.matching.row_bands import Band, row_bands
from sepi.matching.semi_global import (
    ROWS_AT_ONCE,
    AveragedCosts,
    CostVolumes,
    LargePenalty,
    SmallPenalty,
    SmoothingParameters,
)
from sepi.matching.sweep_arrays import Visibility, sampled_candidates
from sepi.matching.view_subsets import views_without_aliases
from sepi.stage import Needs, Progress, StageMaps, part_of

CANDIDATES = CandidateRule(usual=91, finest=0.03, coarsest=0.4, volume_bytes=2**30)
"""Coarser than the paper's: the optimisation refines the disparity with the views."""

TEXTURE = 1.85
"""Factor from the reference view's measured noise to the colour difference within one surface.

In views without noise the measurement is of texture. In strong texture few pixels of a window have similar colours.
"""

AROUND, LIKELY_CANDIDATES = 8, 5
"""Radius of the window whose disparities are likely candidates, pixels, and the number of candidates beyond them."""

STEP, SHARE_BESIDE_STEPS = 0.3, 0.18
"""Where a map's disparities differ by this step within ``AROUND``, pixels per view step, and the share of the texture
that widens a pixel's window there: more would join thin structures to what is behind them. Elsewhere all of it does, so
that the colours of a repeated texture share a window."""

BYTES_PER_CANDIDATE = 5
"""Per pixel: averaged costs, smoothed costs, and costs of a few rows."""

BYTES_PER_PIXEL = 2 + 4
"""Per pixel of a view: the detail, and the z-buffer."""


FirstViews = Annotated[
    int, Field(ge=2, description="least number of views for all maps but the last; of a single row, 25 or all")
]


class VisibilitySweepParameters(CandidateParameters, BaseDetailParameters, SmoothingParameters):
    """Parameters of a visibility sweep and its smoothing."""

    rule: ClassVar[CandidateRule] = CANDIDATES
    needs: ClassVar[Needs] = Needs(bytes_per_candidate=BYTES_PER_CANDIDATE)

    num_disparities: int | None = number_field(CANDIDATES, "docs/method/best_initial.md")
    first_views: FirstViews = 25
    first_sampling: float = Field(2.0, ge=1, le=8, description="distance of their candidates, steps of num_disparities")

    @property
    def finest_sampling(self) -> float:
        """Least distance of the candidates of any map, in steps of ``num_disparities``."""
        return self.first_sampling

    def fewer(self, light_field: LightField, sampling: float) -> int:
        """Number of candidates that are ``sampling`` times as far apart as ``num_disparities`` says."""
        return max(2, round((self.number(light_field) - 1) / sampling) + 1)


class VisibleViewsParameters(VisibilitySweepParameters, GapParameters):
    """Parameters of the sweep over the views that see a pixel."""

    views: int = Field(41, ge=2, description="least number of views for the last map")
    sampling: float = Field(1.0, ge=1, le=8, description="distance of its candidates, steps of num_disparities")
    passes: int = Field(3, ge=1, le=10, description="number of times that visibility and depth are computed in turn")
    mean_noise: float = Field(
        0.02,
        ge=0,
        le=1,
        description="least noise at which views are compared with the mean of the views instead of the reference "
        "view; standard deviation of one channel, colours in 0..1",
    )
    searched_views: int = Field(
        13,
        ge=2,
        description="least number of views that compare all candidates; the others compare those near the earlier "
        "map. All views if they are noisy",
    )
    occluded_view_weight: float = Field(0.01, ge=0, le=1, description="weight of a view in which the pixel is occluded")

    @property
    def finest_sampling(self) -> float:
        """Least distance of the candidates of any map, in steps of ``num_disparities``."""
        return min(self.sampling, self.first_sampling) if self.passes > 1 else self.sampling


class FirstDepthParameters(VisibilitySweepParameters):
    """Parameters of the first depth map; a small colour scale limits the cost of views that do not see the pixel."""

    first_views: FirstViews = 9
    colour_scale: ColourScale = 0.0077
    small_penalty: SmallPenalty = 0.04
    large_penalty: LargePenalty = 0.8


def first_depth(light_field: LightField, parameters: VisibilitySweepParameters, progress: Progress) -> StageMaps:
    """Depth from a few views, as if each saw every pixel.

    Parameters
    ----------
    light_field : LightField
        With a known disparity range.
    parameters : VisibilitySweepParameters
    progress : callable

    Returns
    -------
    StageMaps

    Raises
    ------
    SepiError
        If the disparity range is unknown.
    """
    views = views_without_aliases(light_field, parameters.first_views)
    return _sweep(light_field, views, parameters.first_sampling, None, None, parameters, CostVolumes(), progress)


MeanOf = Callable[[LightField, FloatMap, BoolMap, BaseDetailParameters, float], FloatMap | None]
"""What :func:`sepi.matching.aligned_views.mean_reference` is."""


def depth_from_visible_views(
    light_field: LightField,
    disparity: FloatMap,
    parameters: VisibleViewsParameters,
    progress: Progress,
    mean_of: MeanOf | None = None,
) -> StageMaps:
    """Depth from the views that see a pixel, computed in several passes.

    Parameters
    ----------
    light_field : LightField
        With a known disparity range.
    disparity : ndarray, shape (H, W), float32
        The first map, pixels per view step.
    parameters : VisibleViewsParameters
    progress : callable
    mean_of : callable, optional
        :func:`sepi.matching.aligned_views.mean_reference`, for noisy views; default: views are compared with the
        reference view.

    Returns
    -------
    StageMaps

    Raises
    ------
    SepiError
        If the disparity range is unknown.
    """
    n, noise = parameters.passes, parameters.mean_noise
    few = views_without_aliases(light_field, parameters.first_views)
    if parameters.gaps:
        disparity = with_open_gaps(light_field, disparity, few, parameters)
    volumes = CostVolumes()
    confidence = np.ones(light_field.shape, np.float32)
    for i in range(n):
        last = i == n - 1
        present = views_without_aliases(light_field, parameters.views, far=True) if last else few
        mean = None
        if mean_of and isinstance(light_field, DenoisedLightField) and light_field.of_views.usual >= noise:
            mean = mean_of(light_field, disparity, present, parameters, parameters.occlusion_margin)
        refined = last and i > 0 and not isinstance(light_field, DenoisedLightField)
        found = _sweep(
            light_field,
            present,
            parameters.sampling if last else parameters.first_sampling,
            disparity,
            mean,
            parameters,
            volumes,
            part_of(progress, i, n),
            refined=refined,
        )
        if refined:
            # the sweep before knows minima beyond the candidates near its map
            found = replace(found, confidence=np.minimum(found.confidence, confidence))
        disparity, confidence = found.disparity, found.confidence
    return found


def occluded_in_any_view(
    light_field: LightField, disparity: FloatMap, occlusion_margin: float, present: BoolMap
) -> BoolMap:
    """Pixels that something nearer occludes in at least one view.

    Parameters
    ----------
    light_field : LightField
    disparity : ndarray, shape (H, W), float32
        Pixels per view step.
    occlusion_margin : float
        By how much an occluder must be nearer, pixels per view step.
    present : ndarray, shape (T, S), bool
        The views that are examined.

    Returns
    -------
    ndarray, shape (H, W), bool
    """
    places, baselines = np.argwhere(present), light_field.baselines[present]
    occluded = np.zeros(light_field.shape, bool)
    for begin, end, rows in row_bands(light_field, present, float(np.abs(disparity).max()), BYTES_PER_PIXEL):
        nearest = z_buffers(disparity, baselines, *rows)
        if light_field.missing is not None:
            # where a view has no pixels, nothing in it can occlude
            nearest[light_field.missing[:, :, rows.low : rows.high][present]] = EMPTY
        asked = SeenViews(places, baselines, nearest, rows.low, occlusion_margin)
        kernels.occluded_in_any_view(disparity, asked, begin, end, occluded)
    return occluded


def _sweep(
    light_field: LightField,
    present: BoolMap,
    sampling: float,
    disparity: FloatMap | None,
    mean: FloatMap | None,
    parameters: VisibilitySweepParameters,
    volumes: CostVolumes,
    progress: Progress,
    *,
    refined: bool = False,
) -> StageMaps:
    """Smoothed map from some of the views, with candidates ``sampling`` times as far apart as usual.

    Pixels are compared with their ``mean``, where there is one, instead of the reference view; only at candidates near
    the map where that is ``refined``.
    """
    disparities = light_field.require_disparity_range().candidates(parameters.fewer(light_field, sampling))
    likely: npt.NDArray[np.int32] | None = None
    share: npt.ArrayLike = 1
    if disparity is not None:
        likely, share = _likely_candidates(disparity, disparities)
    guide = guide_of(light_field, mean)
    least = variance_of_residuals(_contrast_of_surfaces(light_field))
    contrast = variance_within_surface(guide, least, share)
    shown = light_field.present
    if light_field.missing is not None:
        shown = shown & ~light_field.missing.all(axis=(2, 3))
    smoothing = parameters.for_views(int(shown.sum()), max(1, int((shown & present).sum())))
    costs = AveragedCosts(volumes, disparities, guide, contrast, smoothing, likely if refined else None)
    searched = np.zeros_like(present) if refined else _searched_views(light_field, present, parameters)
    candidates = sampled_candidates(disparities, light_field.baselines)
    for band in row_bands(light_field, present, float(np.abs(disparities).max()), BYTES_PER_PIXEL):
        visibility = _visibility(light_field, present, disparity, searched, likely, parameters, band)
        views = base_detail_decomposition(light_field, parameters, band.rows, present)
        if mean is not None:
            views = compared_with(views, mean, parameters, band.rows)
        scales2 = views.scales2(parameters)
        for begin in range(band.begin, band.end, ROWS_AT_ONCE):
            end = min(band.end, begin + ROWS_AT_ONCE)
            room = costs.room(end - begin)
            kernels.sweep_visible_rows(views, visibility, scales2, parameters.shares, candidates, begin, end, room)
            costs.add(end - begin)
            # the smoothing takes about a tenth of the time
            progress(0.9 * end / light_field.shape[0])
    result = costs.smoothed()
    progress(1.0)
    return result


def _contrast_of_surfaces(light_field: LightField) -> float:
    """Standard deviation of one channel's colours within a surface, at least."""
    noise = reference_noise(light_field)
    # denoising has taken noise and faint texture out of the guide
    return noise if isinstance(light_field, DenoisedLightField) else TEXTURE * noise


def _searched_views(light_field: LightField, present: BoolMap, parameters: VisibilitySweepParameters) -> BoolMap:
    """The views that compare all candidates with a map."""
    # in noise, the mean of fewer views is the lowest of many candidates' by chance
    if isinstance(parameters, VisibleViewsParameters) and not isinstance(light_field, DenoisedLightField):
        return views_without_aliases(replace(light_field, present=present), parameters.searched_views)
    return present


def _visibility(
    light_field: LightField,
    present: BoolMap,
    disparity: FloatMap | None,
    searched: BoolMap,
    likely: npt.NDArray[np.int32] | None,
    parameters: VisibilitySweepParameters,
    band: Band,
) -> Visibility:
    """In which views the pixels of a band are seen: in all of them where no map tells."""
    if disparity is None or likely is None or not isinstance(parameters, VisibleViewsParameters):
        everywhere = np.empty((int(present.sum()), band.rows.high - band.rows.low, 0), np.float32)
        if light_field.missing is not None:
            everywhere = nearest_surfaces(light_field, None, present, band.rows)
        return Visibility(everywhere, np.float32(0), np.float32(1), present, np.empty((2, 0, 0), np.int32))
    return Visibility(
        nearest_surfaces(light_field, disparity, present, band.rows),
        np.float32(parameters.occlusion_margin),
        np.float32(parameters.occluded_view_weight),
        searched,
        likely,
    )


def _likely_candidates(
    disparity: FloatMap, candidates: FloatMap
) -> tuple[npt.NDArray[np.int32], npt.NDArray[np.float32]]:
    """First and last of the candidates near the map's disparities around each pixel, and what texture widens windows.

    Shapes (2, H, W) and (H, W).
    """
    window = np.ones((2 * AROUND + 1, 2 * AROUND + 1), np.uint8)
    lowest, highest = cv2.erode(disparity, window), cv2.dilate(disparity, window)
    step = candidates[1] - candidates[0]
    first = np.ceil((lowest - candidates[0]) / step - LIKELY_CANDIDATES)
    last = np.floor((highest - candidates[0]) / step + LIKELY_CANDIDATES)
    share = np.where(highest - lowest < STEP, np.float32(1), np.float32(SHARE_BESIDE_STEPS))
    return np.stack([first, last]).clip(0, len(candidates) - 1).astype(np.int32), share
