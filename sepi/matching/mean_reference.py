"""Mean of other views, which replaces the reference view in noisy light fields.

The noise of the reference view is in every residual alike, so no number of views averages it away. The mean of the
views that see a pixel according to the current map has hardly any noise. Views unlike the reference view count less in
the mean, so it stays near the reference view where the map is wrong.

No view is compared with a mean that it is part of. Its own noise would make it fit best at the map's current disparity,
and in strong noise every error would stay.
"""

from __future__ import annotations

import numpy as np

from sepi.lightfield import BoolMap, FloatMap, LightField
from sepi.matching.base_detail import BaseDetailParameters

LEAST_OTHERS = 8
"""Views that are not compared: with the reference view, their mean has a ninth of the noise's variance."""


def mean_reference(
    light_field: LightField,
    disparity: FloatMap,
    compared: BoolMap,
    parameters: BaseDetailParameters,
    occlusion_margin: float,
) -> FloatMap | None:
    """Mean, at each pixel, of the views that see it and are not compared.

    Parameters
    ----------
    light_field : LightField
        Denoised.
    disparity : ndarray, shape (H, W), float32
        By which they are aligned, pixels per view step.
    compared : ndarray, shape (T, S), bool
        The views that are to be compared with it.
    parameters : BaseDetailParameters
        How well colours must fit.
    occlusion_margin : float
        By how much an occluder must be nearer, pixels per view step.

    Returns
    -------
    ndarray, shape (H, W, 3), float32, or None
        Colours, 0..1; None if there are too few other views.
    """
    from sepi.matching.aligned_views import AlignedViews
    from sepi.matching.spline_views import forget_splines

    others = light_field.present & ~compared
    if others.sum() < LEAST_OTHERS:
        return None
    colours_alone = parameters.model_copy(update={"use_detail": False})
    mean = AlignedViews(light_field, colours_alone, occlusion_margin, others).mean(disparity)[..., :3]
    # later steps need the memory
    forget_splines(light_field)
    return np.ascontiguousarray(mean)
