"""Which side of a depth step a pixel belongs to, by the share of the nearer surface in it.

A pixel that an edge runs through shows a share ``a`` of the nearer surface, of colour ``F``, and of the background the
rest. It moves with the nearer surface: along that disparity every view ``v`` shows the same share before another piece
of background, ``I_v = a F + (1 - a) B_v``. Views that are not hidden show what is behind, ``B_v``, so that ``a`` and
``F`` follow from all views together, without any window. Where ``a`` is more than a half the pixel is near, else far.

Matching costs cannot tell that, since a mixed pixel fits the nearer disparity, however small its share is: without it
surfaces are one pixel too wide, and narrow gaps between them close.
"""

from __future__ import annotations

import cv2
import numpy as np
from pydantic import Field

from sepi.image.noise import noise_level
from sepi.lightfield import BoolMap, FloatMap, LightField, full_scale
from sepi.matching.row_bands import row_bands
from sepi.matching.view_subsets import spread_views
from sepi.stage import OcclusionMarginParameters

_BYTES_PER_PIXEL = 4
"""Of a pixel of a view: the z-buffer."""


class SurfaceShareParameters(OcclusionMarginParameters):
    """Parameters of the decision by shares."""

    share_evidence: float = Field(
        0.01, ge=0, le=1, description="difference of mean costs, 0..1, that moves a pixel; 1 moves none"
    )
    share_step: float = Field(
        0.2, gt=0, description="depth step beside which shares are looked at, pixels per view step"
    )
    share_radius: int = Field(2, ge=1, le=10, description="distance from the step within which they are, in pixels")
    share_scale: float = Field(
        0.03, ge=1e-6, le=2, description="residual at which a view counts half; difference of one channel, 0..1"
    )
    share_views: int = Field(81, ge=2, description="views that are compared, at least")


def reassign_by_shares(
    light_field: LightField, disparity: FloatMap, parameters: SurfaceShareParameters
) -> FloatMap:
    """Disparity map whose pixels beside depth steps belong to the surface that fills most of them.

    Parameters
    ----------
    light_field : LightField
    disparity : ndarray, shape (H, W), float32
        Pixels per view step.
    parameters : SurfaceShareParameters

    Returns
    -------
    ndarray, shape (H, W), float32
    """
    if parameters.share_evidence == 1:
        return disparity
    from sepi.matching import surface_shares_kernels as kernels
    from sepi.matching.visibility_kernels import z_buffers

    rim = kernels.rim_of(disparity, parameters.share_radius, parameters.share_step)
    if not rim.inside.any():
        return disparity
    compared = spread_views(light_field, parameters.share_views)
    guide = light_field.reference_view
    scale2 = parameters.share_scale**2 + 2 * noise_level(guide) ** 2
    layer, distance = _more_distant_layer(disparity, rim.far, rim.inside, parameters.occlusion_margin)
    moved = float((rim.near - rim.far).max()) * float(np.abs(light_field.baselines[compared]).max())
    wanted = distance <= moved + 2
    widened = cv2.dilate(disparity, np.ones((3, 3), np.uint8))
    clean = disparity - cv2.erode(disparity, np.ones((3, 3), np.uint8)) < parameters.share_step
    margin = np.float32(parameters.occlusion_margin)
    places, baselines = np.argwhere(compared), light_field.baselines[compared]
    unit = np.float32(1 / full_scale(light_field.views.dtype))
    evidence = np.zeros_like(disparity)
    # a piece of background lies as far away as both surfaces move apart, and is looked for in other views
    reach = float(np.abs(disparity).max()) + float((rim.near - rim.far).max())
    height = light_field.shape[0]
    rows_apart = int(np.ceil(moved)) + 2
    for begin, end, rows in row_bands(light_field, compared, reach, _BYTES_PER_PIXEL):
        nearest = z_buffers(widened, compared, light_field.baselines, *rows)
        views = kernels.RimViews(light_field.views, unit, places, baselines, nearest, rows.low)
        background = kernels.background_of(
            views, layer, wanted, margin, max(0, begin - rows_apart), min(height, end + rows_apart)
        )
        kernels.evidence_of_shares(
            views, rim, background, disparity, guide, clean, margin, scale2, begin, end, evidence
        )
    other = np.where(rim.is_near, rim.far, rim.near)
    return np.where(evidence > parameters.share_evidence, other, disparity)


def _more_distant_layer(
    disparity: FloatMap, far: FloatMap, inside: BoolMap, margin: float
) -> tuple[FloatMap, FloatMap]:
    """The map with the more distant surface of the next step in place of all that is nearer, and the distance to it."""
    outside = (~inside).astype(np.uint8)
    distance, labels = cv2.distanceTransformWithLabels(outside, cv2.DIST_L2, 5, labelType=cv2.DIST_LABEL_PIXEL)
    of_label = np.zeros(labels.max() + 1, np.float32)
    of_label[labels[inside]] = far[inside]
    behind = of_label[labels]
    return np.where(disparity > behind + margin, behind, disparity), distance
