"""Which side of a depth discontinuity a pixel belongs to, by the mixture of colours in it.

A pixel that an edge runs through mixes the colours ``F`` of the nearer surface and ``B`` of the more distant one, and
its residuals are small at the nearer disparity, with which the edge moves: depth maps are one pixel too wide there. Its
colour ``I`` tells the share of the nearer surface in it, ``(I - B) (F - B) / |F - B|^2``, with ``F`` and ``B`` from
clean pixels close by; where that is little, the pixel goes to the more distant surface. A colour that lies beside all
mixtures of both is none: surfaces are darker, or of another colour, towards their edge.
"""

from __future__ import annotations

from pydantic import Field

from sepi.lightfield import FloatMap
from sepi.stage import Parameters


class MixtureParameters(Parameters):
    """Parameters of the decision by colour mixture."""

    alpha_threshold: float = Field(
        0.3,
        ge=0,
        le=1,
        description="share of the nearer surface up to which a pixel goes to the more distant one; 0 moves none",
    )
    alpha_discontinuity: float = Field(
        0.3, gt=0, description="depth discontinuity beside which pixels mix, pixels per view step"
    )
    alpha_radius: int = Field(4, ge=1, le=20, description="how far away clean colours are looked for, in pixels")
    alpha_contrast: float = Field(
        9.0, ge=0, description="least squared colour difference of the two sides, in units of their variance"
    )


def reassign_mixed_pixels(
    disparity: FloatMap, guide: FloatMap, noise: float, parameters: MixtureParameters
) -> FloatMap:
    """Disparity map whose mixed pixels belong to the surface that fills most of them.

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
    """
    if parameters.alpha_threshold == 0:
        return disparity
    from sepi.image.mixed_pixels_kernels import reassigned_pixels

    reassigned: FloatMap = reassigned_pixels(
        disparity,
        guide,
        parameters.alpha_discontinuity,
        parameters.alpha_radius,
        parameters.alpha_contrast,
        parameters.alpha_threshold,
        # a hundredth of full scale counts as equal even without noise
        1e-4 + noise,
    )
    return reassigned
