"""How surely a pixel beside a depth discontinuity is background for the most part, by the mixture of colours in it.

A pixel that an edge runs through mixes the colours ``F`` of the nearer surface and ``B`` of the more distant one, and
its residuals are small at the nearer disparity, with which the edge moves: depth maps are one pixel too wide there. Its
colour ``I`` tells the share of the nearer surface in it, ``(I - B) (F - B) / |F - B|^2``, with ``F`` and ``B`` from
clean pixels close by; where that is little, the pixel is the more distant surface's. A colour that lies beside all
mixtures of both is none: surfaces are darker, or of another colour, towards their edge. In a grey picture no colour
does, and all count for less.
"""

from __future__ import annotations

import numpy as np
from pydantic import Field

from sepi.lightfield import FloatMap
from sepi.stage import Parameters

_GREY_TRUST = 0.26
"""Of colours in a grey picture."""

_COLOURED = 0.02
"""Part of the colours' variance that is beside grey, from which on a picture is coloured."""


class MixtureParameters(Parameters):
    """Parameters of the evidence by colour mixture."""

    alpha_threshold: float = Field(
        0.39,
        ge=0,
        le=1,
        description="share of the nearer surface below which colours speak for the more distant one; 0: they never do",
    )
    alpha_discontinuity: float = Field(
        0.3, gt=0, description="depth discontinuity beside which pixels mix, pixels per view step"
    )
    alpha_radius: int = Field(4, ge=1, le=20, description="how far away clean colours are looked for, in pixels")
    alpha_contrast: float = Field(
        9.0,
        ge=0,
        description="squared colour difference of the two sides at which they speak half as loud, in units of their "
        "variance",
    )


def mixture_evidence(disparity: FloatMap, guide: FloatMap, noise: float, parameters: MixtureParameters) -> FloatMap:
    """How surely the colours say that a pixel of the nearer surface is background for the most part.

    Parameters
    ----------
    disparity : ndarray, shape (H, W), float32
        Pixels per view step.
    guide : ndarray, shape (H, W, 3), float32
        Reference view, 0..1.
    noise : float
        Expected squared residual by noise, summed over RGB.
    parameters : MixtureParameters

    Returns
    -------
    ndarray, shape (H, W), float32
        0..1; 0 away from depth discontinuities, and on their more distant side.
    """
    if parameters.alpha_threshold == 0:
        return np.zeros_like(disparity)
    from sepi.image import mixed_pixels_kernels as kernels

    evidence: FloatMap = kernels.mixture_evidence(
        disparity,
        guide,
        parameters.alpha_discontinuity,
        parameters.alpha_radius,
        parameters.alpha_contrast,
        parameters.alpha_threshold,
        # a hundredth of full scale counts as equal even without noise
        1e-4 + noise,
    )
    return evidence * _trust(guide)


def _trust(guide: FloatMap) -> np.float32:
    """How much a colour between two others tells, 0..1: in a grey picture all are."""
    colours = guide.reshape(-1, 3).astype(np.float64)
    colours = colours - colours.mean(axis=0)
    # exactly zero for grey, whatever is rounded
    beside_grey = colours - colours[:, [1, 2, 0]]
    chroma = (beside_grey**2).sum() / 3 / max((colours**2).sum(), 1e-12)
    return np.float32(_GREY_TRUST + (1 - _GREY_TRUST) * min(chroma / _COLOURED, 1.0))
