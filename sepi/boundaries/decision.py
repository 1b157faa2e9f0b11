"""Near or far beside a depth step, by the votes of all views and of the reference view's colours.

A pixel that an edge runs through shows a share of the nearer surface, and of what is behind it the rest. It moves with
the nearer one and fits that one's disparity, however small its share is: by matching alone, surfaces are one pixel too
wide, and narrow gaps between them close. Where the share is more than a half the pixel is near, else far. It is told by

- all views, which show it before other and other pieces of background (:mod:`sepi.boundaries.surface_shares`),
- its colour, between those of both surfaces (:mod:`sepi.boundaries.colour_mixture`).
"""

from __future__ import annotations

import numpy as np

from sepi.boundaries.colour_mixture import mixture_evidence
from sepi.boundaries.parameters import BoundaryParameters
from sepi.boundaries.surface_shares import share_evidence
from sepi.boundaries.surroundings import surroundings
from sepi.image.noise import reference_residual_variance
from sepi.lightfield import FloatMap, LightField

_CERTAIN = np.float32(0.0075)
"""Difference of mean costs at which shares are rather sure that a pixel is the more distant surface's; 0..1."""

_MIXTURE_WEIGHT = np.float32(4.6)
"""Of the colours' vote beside that of the shares, which is -1..1."""

_MAJORITY = 0.36
"""Sum of votes with which a pixel leaves the nearer surface."""


def assigned_to_surfaces(light_field: LightField, disparity: FloatMap, parameters: BoundaryParameters) -> FloatMap:
    """Disparity map whose pixels beside depth steps belong to the surface that fills most of them.

    Parameters
    ----------
    light_field : LightField
    disparity : ndarray, shape (H, W), float32
        Pixels per view step.
    parameters : BoundaryParameters

    Returns
    -------
    ndarray, shape (H, W), float32
        ``disparity`` itself where nothing has a vote, or there is no step.
    """
    if not (parameters.use_shares or parameters.use_mixture):
        return disparity
    from sepi.boundaries.rim_kernels import rim_of

    rim = rim_of(disparity, parameters.share_radius, parameters.boundary_step)
    if not rim.inside.any():
        return disparity
    around = surroundings(disparity)
    evidence = np.zeros_like(disparity)
    if parameters.use_shares:
        evidence = share_evidence(light_field, disparity, around, rim, parameters)
    votes = np.tanh(evidence / _CERTAIN)
    if parameters.use_mixture:
        colours = light_field.reference_view
        variance = reference_residual_variance(light_field)
        votes += _MIXTURE_WEIGHT * mixture_evidence(disparity, around, colours, variance, parameters)
    leaves = rim.is_near & rim.inside & (votes > _MAJORITY)
    joins = ~rim.is_near & (evidence > parameters.share_evidence)
    return np.where(leaves, rim.far, np.where(joins, rim.near, disparity))
