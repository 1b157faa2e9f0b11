"""Near or far beside a depth step, by all views and the reference view's colours, along edges.

A pixel that an edge runs through shows a share of the nearer surface, and for the rest the surface behind. It moves
with the nearer one and fits its disparity, however small its share is: by matching alone, surfaces are one pixel too
wide, and narrow gaps between them close. The pixel is near if the share exceeds a half, else far. The evidence:

- all views, which show it before other and other pieces of background (:mod:`sepi.boundaries.surface_shares`),
- its colour, between those of both surfaces (:mod:`sepi.boundaries.colour_mixture`),
- its neighbours: the edge goes on through them (:mod:`sepi.boundaries.edge_lines`).

The cost of a share is the evidence of views and colours against it, and its distance from the map's current side.
"""

from __future__ import annotations

import numpy as np

from sepi.boundaries.colour_mixture import mixture_evidence
from sepi.boundaries.edge_lines import line_evidence
from sepi.boundaries.parameters import BoundaryParameters
from sepi.boundaries.rim import Rim, Surroundings, rim_of, surroundings
from sepi.boundaries.surface_shares import ShareCosts, nothing_told, share_costs
from sepi.image.noise import reference_residual_variance
from sepi.lightfield import FloatMap, LightField

_UNTOLD = np.float32(4)
"""How much more a pixel that the views do not tell of is held on the side that the map has."""

_MIXTURE_COST = np.float32(4)
"""Of a whole share beyond the next where colours without doubt speak for the farther surface."""

_FREE_SHARE = np.float32(0.4)
"""Share of the nearer surface up to which colours that speak for the farther one cost nothing."""


def assigned_to_surfaces(
    light_field: LightField, disparity: FloatMap, parameters: BoundaryParameters, before: FloatMap | None = None
) -> FloatMap:
    """Disparity map whose pixels beside depth steps belong to the surface that fills most of them.

    Parameters
    ----------
    light_field : LightField
    disparity : ndarray, shape (H, W), float32
        Pixels per view step.
    parameters : BoundaryParameters
    before : ndarray, shape (H, W), float32, optional
        A map that was decided: only pixels beside what has changed by a depth step since are decided again.

    Returns
    -------
    ndarray, shape (H, W), float32
        ``disparity`` itself if there is no evidence, or no step.
    """
    if not (parameters.use_shares or parameters.use_mixture):
        return disparity
    rim = rim_of(disparity, parameters.share_radius, parameters.boundary_step, before)
    if not rim.inside.any():
        return disparity
    around = surroundings(disparity)
    costs, told = _costs(light_field, disparity, around, rim, parameters)
    evidence = line_evidence(disparity, rim, costs) if parameters.use_lines else _own_evidence(costs)
    farther = evidence > 0
    decided = disparity.copy()
    is_near = rim.is_near[rim.inside]
    other = np.where(is_near, rim.far[rim.inside], rim.near[rim.inside])
    decided[rim.inside] = np.where(told & (farther == is_near), other, decided[rim.inside])
    return decided


def _costs(
    light_field: LightField, disparity: FloatMap, around: Surroundings, rim: Rim, parameters: BoundaryParameters
) -> ShareCosts:
    """Costs of each share by views, colours and the map itself; ``told`` where views or colours give evidence."""
    if parameters.use_shares:
        costs, told = share_costs(light_field, disparity, around, rim, parameters)
    else:
        costs, told = nothing_told(int(rim.inside.sum()))
    is_near = rim.is_near[rim.inside][:, None]
    share = np.linspace(0, 1, costs.shape[1], dtype=np.float32)
    held = np.float32(parameters.share_evidence) * np.where(told, np.float32(1), _UNTOLD)
    costs += held[:, None] * np.where(is_near, 1 - share, share)
    if parameters.use_mixture:
        colours, variance = light_field.reference_view, reference_residual_variance(light_field)
        mixture = mixture_evidence(disparity, around, colours, variance, parameters)[rim.inside]
        costs += _MIXTURE_COST * mixture[:, None] * np.maximum(share - _FREE_SHARE, 0)
        told |= mixture > 0
    return ShareCosts(costs, told)


def _own_evidence(costs: FloatMap) -> FloatMap:
    """By how much the best share below one half costs less than the best above, of pixels alone; shape (n,)."""
    half = costs.shape[1] // 2
    return np.asarray(costs[:, half:].min(axis=1) - costs[:, :half].min(axis=1), np.float32)
