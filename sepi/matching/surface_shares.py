"""Which side of a depth step a pixel belongs to, by the share of the nearer surface in it.

A pixel that an edge runs through shows a share ``a`` of the nearer surface, of colour ``F``, and of the background the
rest. It moves with the nearer surface: along that disparity every view ``v`` shows the same share before another piece
of background, ``I_v = a F + (1 - a) B_v``. Views that are not hidden show what is behind, ``B_v``, so that ``a`` and
``F`` follow from all views together, without any window. Where ``a`` is more than a half the pixel is near, else far.

Matching costs cannot tell that, since a mixed pixel fits the nearer disparity, however small its share is: without it
surfaces are one pixel too wide, and narrow gaps between them close.

The colours of the reference view alone tell something, too (:mod:`sepi.image.mixed_pixels`): whether a pixel leaves the
nearer surface is voted on by both.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import cv2
import numpy as np
from pydantic import Field

from sepi.image.noise import noise_level
from sepi.lightfield import BoolMap, FloatMap, LightField, full_scale
from sepi.matching.nearest_surfaces import nearest_surfaces
from sepi.matching.row_bands import row_bands
from sepi.matching.view_subsets import spread_views
from sepi.stage import OcclusionMarginParameters

if TYPE_CHECKING:
    from sepi.matching.depth_step_kernels import Rim
    from sepi.matching.surface_shares_kernels import RimViews

_LEAST_SCALE = 0.005
"""Of the residual at which a view counts half, beside noise; 0..1."""

_MOST_DARKENING = 1.25
"""Ratio of brightness, either way, up to which a view is taken for another exposure of the same."""

_CERTAIN = 0.0075
"""Difference of mean costs at which shares are rather sure that a pixel is the more distant surface's; 0..1."""

_MIXTURE_WEIGHT = 4.6
"""Of the colours' vote beside that of the shares, which is -1..1."""

_MAJORITY = 0.36
"""Sum of votes with which a pixel leaves the nearer surface."""

BYTES_PER_PIXEL = 4
"""Of a pixel of a view: the z-buffer."""


class SurfaceShareParameters(OcclusionMarginParameters):
    """Parameters of the decision by shares."""

    share_evidence: float = Field(
        0.006,
        ge=0,
        le=1,
        description="difference of mean costs, 0..1, that moves a pixel to the nearer surface; 1: shares move none",
    )
    share_step: float = Field(
        0.3, gt=0, description="depth step beside which shares are looked at, pixels per view step"
    )
    share_radius: int = Field(2, ge=1, le=10, description="distance from the step within which they are, in pixels")
    share_scale: float = Field(
        0.2,
        gt=0,
        le=2,
        description="residual at which a view counts half, as part of the difference of both surfaces' colours",
    )
    share_views: int = Field(81, ge=2, description="views that are compared, at least")


def reassign_at_steps(
    light_field: LightField, disparity: FloatMap, parameters: SurfaceShareParameters, mixture: FloatMap | None = None
) -> FloatMap:
    """Disparity map whose pixels beside depth steps belong to the surface that fills most of them.

    Parameters
    ----------
    light_field : LightField
    disparity : ndarray, shape (H, W), float32
        Pixels per view step.
    parameters : SurfaceShareParameters
    mixture : ndarray, shape (H, W), float32, optional
        How surely colours say that a pixel is not the nearer surface's, 0..1.

    Returns
    -------
    ndarray, shape (H, W), float32
    """
    by_shares = parameters.share_evidence < 1
    if not by_shares and mixture is None:
        return disparity
    from sepi.matching.depth_step_kernels import rim_of

    rim: Rim = rim_of(disparity, parameters.share_radius, parameters.share_step)
    if not rim.inside.any():
        return disparity
    evidence = _evidence(light_field, disparity, rim, parameters) if by_shares else np.zeros_like(disparity)
    votes = np.tanh(evidence / np.float32(_CERTAIN))
    if mixture is not None:
        votes += np.float32(_MIXTURE_WEIGHT) * mixture
    leaves = rim.is_near & rim.inside & (votes > _MAJORITY)
    joins = ~rim.is_near & (evidence > parameters.share_evidence)
    return np.where(leaves, rim.far, np.where(joins, rim.near, disparity))


def _evidence(light_field: LightField, disparity: FloatMap, rim: Rim, parameters: SurfaceShareParameters) -> FloatMap:
    """By how much the other surface explains the views better than the one that a pixel has, shape (H, W)."""
    from sepi.matching import surface_shares_kernels as kernels

    guide = light_field.reference_view
    scales2 = _LEAST_SCALE**2 + 2 * noise_level(guide) ** 2, parameters.share_scale**2
    around = np.ones((3, 3), np.uint8)
    clean = disparity - cv2.erode(disparity, around) < parameters.share_step
    widened = np.asarray(cv2.dilate(disparity, around), np.float32)
    margin = np.float32(parameters.occlusion_margin)
    layer, distance = _more_distant_layer(disparity, rim, margin)
    views = _views_alike(light_field, disparity, clean, parameters)
    if not len(views.places):
        # they say nothing for either surface
        return np.zeros_like(disparity)
    present = np.zeros(light_field.grid, bool)
    present[tuple(views.places.T)] = True
    # how far from a pixel the pieces of background lie that views show with it
    step = float((rim.near - rim.far).max())
    moved = math.ceil(step * float(np.abs(views.baselines).max())) + 2
    rows_moved = math.ceil(step * float(np.abs(views.baselines[:, 0]).max())) + 1
    farthest = float(np.abs(disparity).max())
    evidence = np.zeros_like(disparity)
    height = light_field.shape[0]
    for begin, end, rows in row_bands(light_field, present, farthest, BYTES_PER_PIXEL, rows_moved):
        nearest = nearest_surfaces(light_field, widened, present, rows)
        views = views._replace(nearest=nearest, low=rows.low)
        background = kernels.background_of(
            views, layer, distance <= moved, margin, max(0, begin - rows_moved), min(height, end + rows_moved)
        )
        kernels.evidence_of_shares(
            views, rim, background, disparity, guide, clean, margin, scales2, begin, end, evidence
        )
    return evidence


def _views_alike(
    light_field: LightField, disparity: FloatMap, clean: BoolMap, parameters: SurfaceShareParameters
) -> RimViews:
    """The views that are compared, as bright as the reference, without those that show it badly or are much darker.

    Lenses darken and blur views towards the edge of the grid; shares would take that for another surface.
    """
    from sepi.matching.surface_shares_kernels import RimViews, brightness_of_views

    present = spread_views(light_field, parameters.share_views)
    places, baselines = np.argwhere(present), light_field.baselines[present]
    units = np.full(len(places), 1 / full_scale(light_field.views.dtype), np.float32)
    # a part of another array would have kernels of its own compiled, which takes a minute
    pixels = np.ascontiguousarray(light_field.views)
    views = RimViews(pixels, units, places, baselines, np.empty((0, 0, 0, 0), np.float32), 0)
    missing = np.zeros((*light_field.grid, 0, 0), bool) if light_field.missing is None else light_field.missing
    brightness, residual = brightness_of_views(views, disparity, light_field.reference_view, clean, missing)
    alike = (brightness > 1 / _MOST_DARKENING) & (brightness < _MOST_DARKENING)
    showing = np.isfinite(residual)
    usual = float(np.median(residual[showing])) if showing.any() else 0.0
    alike &= showing & (residual <= 2 * usual + _LEAST_SCALE)
    units = (units[alike] / brightness[alike]).astype(np.float32)
    return views._replace(units=units, places=places[alike], baselines=baselines[alike])


def _more_distant_layer(disparity: FloatMap, rim: Rim, margin: np.float32) -> tuple[FloatMap, FloatMap]:
    """The map with the more distant surface of the next step in place of all that is nearer, and the distance to it."""
    outside = (~rim.inside).astype(np.uint8)
    distance, labels = cv2.distanceTransformWithLabels(outside, cv2.DIST_L2, 5, labelType=cv2.DIST_LABEL_PIXEL)
    of_label = np.zeros(labels.max() + 1, np.float32)
    of_label[labels[rim.inside]] = rim.far[rim.inside]
    behind = of_label[labels]
    return np.where(disparity > behind + margin, behind, disparity), np.asarray(distance, np.float32)
