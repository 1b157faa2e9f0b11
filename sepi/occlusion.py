"""Depth at occlusions (section IV-B of [1]_).

A pixel next to a nearer surface is hidden from the views on that surface's side, and the line through its full SEPI
crosses the occluder. ``half_sepi`` repeats the slope computation with the views of one half, or of two halves at once:

1. candidates: pixels near Canny edges of the reference view and near discontinuities of the initial depth;
2. mean shift on the patch of image and depth gives the surface that each pixel belongs to;
3. side: the half away from the nearer surface is kept. (A nearer surface on the right hides the pixel from the views on
   the right, so the left half is kept. The paper's sentence says the reverse.)
4. half-SEPI depth and confidence replace the full ones where they explain the views clearly better.

``wang`` is the occlusion model of [2]_, which the paper's text compares with: it splits the angular patch along the
edge orientation, and keeps the half with the smaller cost. ``none`` returns the initial depth.

``visibility`` chooses the views one by one, by the map so far: those in which nothing occludes the pixel
(:mod:`sepi.matching.visibility_sweep`). A pixel on a depth discontinuity then gets the surface that fills most of it
(:mod:`sepi.boundaries.decision`).

:class:`sepi.stage.Choice` describes arguments and results of all choices.

References
----------
.. [1] Zhou, Shi, Liu, Jin, Zhang, Hou: Light Field Depth Estimation via Stitched Epipolar Plane Images.
.. [2] Wang, Efros, Ramamoorthi: Occlusion-aware depth estimation using light-field cameras. ICCV 2015.
   doi:10.1109/ICCV.2015.398
"""

from __future__ import annotations

from dataclasses import replace

import cv2
import numpy as np
import numpy.typing as npt
from pydantic import Field

from sepi.boundaries.decision import assigned_to_surfaces
from sepi.boundaries.parameters import BoundaryParameters
from sepi.boundaries.specks import without_specks
from sepi.image.edges import CannyParameters, canny_edges, depth_discontinuities, edge_angle
from sepi.lightfield import BoolMap, FloatMap, LightField
from sepi.matching.aligned_views import mean_reference
from sepi.matching.plane_sweep import SweepParameters, SweepResult, sweep
from sepi.matching.softening import compared_views
from sepi.matching.view_subsets import SIDES, half_planes, halves_and_quarters, spread_views
from sepi.matching.visibility_sweep import VisibleViewsParameters, depth_from_visible_views, occluded_in_any_view
from sepi.stage import Choice, NoParameters, Progress, StageMaps, none, require_previous

# change of the initial depth that makes a pixel a candidate for occlusion, pixels per view step
_DISCONTINUITY = 0.3
# mean-shift patch of 2 r + 1 pixels, and its bandwidths: RGB distance, colours in 0..1; pixels per view step
_PATCH = 4, 0.05, 0.3


class OcclusionParameters(SweepParameters, CannyParameters):
    """Parameters of both occlusion models: candidates, and when a half replaces the full SEPI."""

    candidate_reach: int = Field(12, ge=0, le=50, description="largest distance of a candidate from an edge, in pixels")
    gain_half: float = Field(0.015, ge=0, le=1, description="by how much a half must lower the mean cost (0..1)")
    gain_quarter: float = Field(0.03, ge=0, le=1, description="by how much a quarter must lower the mean cost (0..1)")
    min_change: float = Field(0.1, ge=0, description="least change from the depth by all views, pixels per view step")


class HalfSepiParameters(OcclusionParameters):
    """Parameters of the half-SEPI."""

    side_reach: int = Field(16, ge=1, le=50, description="distance within which the nearer surface is searched, pixels")
    side_margin: float = Field(0.1, ge=0, description="by how much the occluder must be nearer, pixels per view step")
    gain_unconfirmed: float = Field(
        0.03, ge=0, le=2, description="further gain that is needed if no nearer surface is found on the hidden side"
    )

    @property
    def groups(self) -> int:
        """Groups between the dividing lines of the halves, and on them."""
        return 8


class VisibilityParameters(VisibleViewsParameters, BoundaryParameters):
    """Parameters of the choice of views, and of pixels beside depth steps."""


class WangParameters(OcclusionParameters):
    """Parameters of the angular-patch split."""

    directions: int = Field(8, ge=2, le=32, multiple_of=2, description="edge orientations over half a turn")

    @property
    def groups(self) -> int:
        """Sectors between the edge orientations."""
        return 2 * self.directions


def half_sepi(
    light_field: LightField, previous: StageMaps | None, parameters: HalfSepiParameters, progress: Progress
) -> StageMaps:
    """Depth from half-SEPIs at occluded pixels (section IV-B of [1]_).

    Returns
    -------
    StageMaps
        Adds ``occlusion_candidates`` and ``occluded``, bool, and ``view_subset``, uint8: number of the subset kept, in
        ``subset_names`` (all views, a half, or a quarter).

    References
    ----------
    .. [1] Zhou, Shi, Liu, Jin, Zhang, Hou: Light Field Depth Estimation via Stitched Epipolar Plane Images.
       arXiv:2203.15201.

    Examples
    --------
    >>> import numpy as np
    >>> from sepi import initial, occlusion
    >>> from sepi.scenes import render
    >>> from sepi.stage import no_progress
    >>> light_field = render("pencils", size=96, views=5)
    >>> before = initial.sepi(light_field, None, initial.CHOICES["sepi"].parameters(), no_progress)
    >>> parameters = occlusion.CHOICES["half_sepi"].parameters()
    >>> after = occlusion.half_sepi(light_field, before, parameters, no_progress)
    >>> hidden = light_field.masks["occluded"]
    >>> errors = [np.abs(maps.disparity - light_field.ground_truth)[hidden].mean() for maps in (before, after)]
    >>> bool(errors[1] < errors[0])
    True
    """
    from sepi.image.mean_shift import patch_modes

    before = require_previous(previous)
    candidates = occlusion_candidates(light_field.reference_view, before.disparity, parameters)
    views = halves_and_quarters(light_field)
    result = sweep(light_field, parameters, subsets=views, mask=candidates, progress=progress)
    near = cv2.dilate(candidates.astype(np.uint8), _box(parameters.side_reach)) > 0
    surface = patch_modes(light_field.reference_view, before.disparity, near, *_PATCH)
    cost = result.cost.copy()
    for n, name in enumerate(views.names[1:], start=1):
        sides = name.split("-")
        nearer = nearer_on_hidden_side(
            surface, result.disparity[n], sides, parameters.side_reach, parameters.side_margin
        )
        cost[n] += parameters.gain_half if len(sides) == 1 else parameters.gain_quarter
        cost[n] += np.where(nearer, 0, parameters.gain_unconfirmed).astype(np.float32)
    return replace_where_better(before, result, cost, candidates, views.names, parameters.min_change)


def wang(
    light_field: LightField, previous: StageMaps | None, parameters: WangParameters, progress: Progress
) -> StageMaps:
    """Depth from the half of the angular patch, split along the edge, with the smaller cost [1]_.

    Returns
    -------
    StageMaps
        Adds ``occlusion_candidates`` and ``occluded``, bool, and ``view_subset``, uint8: number of the subset kept, in
        ``subset_names`` (all views, or a half plane).

    References
    ----------
    .. [1] Wang, Efros, Ramamoorthi: Occlusion-aware depth estimation using light-field cameras. ICCV 2015.
       doi:10.1109/ICCV.2015.398

    Examples
    --------
    >>> from sepi import initial, occlusion
    >>> from sepi.scenes import render
    >>> from sepi.stage import no_progress
    >>> light_field = render("curved_occluders", size=96, views=5)
    >>> before = initial.sepi(light_field, None, initial.CHOICES["sepi"].parameters(), no_progress)
    >>> after = occlusion.wang(light_field, before, occlusion.CHOICES["wang"].parameters(directions=4), no_progress)
    >>> len(after.subset_names), after.subset_names[0]  # all views, and the two sides of four orientations
    (9, 'full')
    >>> bool(after.mask("occluded").any())
    True
    """
    before = require_previous(previous)
    candidates = occlusion_candidates(light_field.reference_view, before.disparity, parameters)
    views = half_planes(light_field, parameters.directions)
    result = sweep(light_field, parameters, subsets=views, mask=candidates, progress=progress)
    # the middles of the two halves lie along the edge's normal and against it
    normal = edge_angle(light_field.reference_view, parameters)
    first = np.floor(normal / np.pi * parameters.directions).astype(np.int64) % (2 * parameters.directions)
    number = np.arange(2 * parameters.directions)[:, None, None]
    beside = (number - first[None]) % parameters.directions == 0
    cost = result.cost.copy()
    cost[1:] = np.where(beside, cost[1:] + parameters.gain_half, np.inf)
    return replace_where_better(before, result, cost, candidates, views.names, parameters.min_change)


def visibility(
    light_field: LightField, previous: StageMaps | None, parameters: VisibilityParameters, progress: Progress
) -> StageMaps:
    """Depth from the views that see each pixel, by the map so far; variant ``best`` uses it.

    Returns
    -------
    StageMaps
        Adds ``occluded``, bool: pixels that something nearer occludes in at least one view.

    Examples
    --------
    >>> import numpy as np
    >>> from sepi import initial, occlusion
    >>> from sepi.scenes import render
    >>> from sepi.stage import no_progress
    >>> light_field = render("curved_occluders", size=96, views=5)
    >>> before = initial.semi_global(light_field, None, initial.CHOICES["semi_global"].parameters(), no_progress)
    >>> parameters = occlusion.CHOICES["visibility"].parameters()
    >>> after = occlusion.visibility(light_field, before, parameters, no_progress)
    >>> errors = [np.abs(maps.disparity - light_field.ground_truth).mean() for maps in (before, after)]
    >>> bool(errors[1] < errors[0])
    True
    """
    before, given = require_previous(previous), light_field
    light_field = compared_views(light_field, parameters)
    result = depth_from_visible_views(light_field, before.disparity, parameters, progress, mean_reference)
    # denoising would mix the colours of both surfaces at a rim
    disparity = assigned_to_surfaces(given, result.disparity, parameters)
    views = spread_views(light_field, parameters.first_views)
    disparity = without_specks(light_field, disparity, views, parameters)
    return before.updated(
        disparity,
        result.confidence,
        occluded=occluded_in_any_view(light_field, disparity, parameters.occlusion_margin, views),
    )


def occlusion_candidates(reference_view: FloatMap, disparity: FloatMap, parameters: OcclusionParameters) -> BoolMap:
    """Pixels within reach of an edge of the reference view or of a depth discontinuity; shape (H, W), bool."""
    edges = canny_edges(reference_view, parameters)
    edges |= depth_discontinuities(disparity, _DISCONTINUITY)
    return np.asarray(cv2.dilate(edges.astype(np.uint8), _box(parameters.candidate_reach)) > 0)


def nearer_on_hidden_side(
    surface: FloatMap, disparity: FloatMap, sides: list[str], reach: int, margin: float
) -> BoolMap:
    """Whether a nearer surface lies on the side that hides the pixel from the views left out.

    Parameters
    ----------
    surface : ndarray, shape (H, W), float32
        Disparity of the surfaces.
    disparity : ndarray, shape (H, W), float32
        Disparity of the pixels by the views that are kept.
    sides : list of str
        The half that is kept, or the two halves of a quarter; a nearer surface on one hidden side is enough.
    reach : int
        Distance of the search, pixels.
    margin : float
        Least difference of disparity, pixels per view step.

    Returns
    -------
    ndarray, shape (H, W), bool
    """
    # the views kept lie towards a side, so the occluder lies on the opposite one
    hiding, steps = np.zeros((2 * reach + 1, 2 * reach + 1), np.uint8), np.arange(1, reach + 1)
    for dt, ds in (SIDES[side] for side in sides):
        hiding[reach - dt * steps, reach - ds * steps] = 1
    return np.asarray(cv2.dilate(surface, hiding) > disparity + margin)


def replace_where_better(
    before: StageMaps,
    result: SweepResult,
    cost: npt.NDArray[np.float32],
    candidates: BoolMap,
    names: tuple[str, ...],
    min_change: float,
) -> StageMaps:
    """Initial maps with depth and confidence of the subset of least cost.

    Parameters
    ----------
    before : StageMaps
    result : SweepResult
        Subset 0 is all views.
    cost : ndarray, shape (N, H, W), float32
        Cost of each subset.
    candidates : ndarray, shape (H, W), bool
        Pixels that may change.
    names : tuple of str, length N
        Names of the subsets.
    min_change : float
        Smaller changes of disparity keep the depth from all views.

    Returns
    -------
    StageMaps
    """
    subset = np.where(candidates, np.argmin(np.nan_to_num(cost, nan=np.inf), axis=0), 0)
    chosen = np.take_along_axis(result.disparity, subset[None], axis=0)[0]
    confidence = np.take_along_axis(result.confidence(), subset[None], axis=0)[0]
    occluded = subset > 0
    changed = occluded & (np.abs(chosen - before.disparity) > min_change)
    maps = before.updated(
        np.where(changed, chosen, before.disparity),
        np.where(occluded, confidence, before.confidence),
        occlusion_candidates=candidates,
        occluded=occluded,
        view_subset=subset.astype(np.uint8),
    )
    return replace(maps, subset_names=names)


def _box(radius: int) -> npt.NDArray[np.uint8]:
    return np.ones((2 * radius + 1, 2 * radius + 1), np.uint8)


CHOICES = {
    "half_sepi": Choice(HalfSepiParameters, half_sepi),
    "wang": Choice(WangParameters, wang),
    "visibility": Choice(VisibilityParameters, visibility),
    "none": Choice(NoParameters, none),
}

if __name__ == "__main__":
    from sepi.process.command import stage_command

    stage_command("occlusion", CHOICES)()
