"""Which side of a depth step a pixel belongs to, by the mixture of colours in it.

A pixel that an edge runs through mixes the colours ``F`` of the nearer surface and ``B`` of the farther one, and its
residuals are small at the nearer disparity, with which the edge moves: depth maps are one pixel too wide there. Its
colour ``I`` tells how much of it the nearer surface covers, ``(I - B) (F - B) / |F - B|^2``, with ``F`` and ``B`` from
clean pixels close by; where that is little, the pixel goes to the farther surface.
"""

from __future__ import annotations

from pydantic import Field

from sepi.lightfield import FloatMap
from sepi.stage import Parameters


class MixtureParameters(Parameters):
    """Parameters of the decision by colour mixture."""

    mixture: float = Field(
        0.3, ge=0, le=1, description="covered share up to which a pixel goes to the farther surface; 0 moves none"
    )
    mixture_step: float = Field(0.3, gt=0, description="depth step beside which pixels mix, pixels per view step")
    mixture_reach: int = Field(4, ge=1, le=20, description="how far away clean colours are looked for, in pixels")
    mixture_contrast: float = Field(
        9.0, ge=0, description="least squared colour difference of the two sides, in units of their variance"
    )


def farther_where_little_covered(
    disparity: FloatMap, guide: FloatMap, noise: float, parameters: MixtureParameters
) -> FloatMap:
    """Disparity map whose mixed pixels at steps belong to the surface that covers most of them.

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
    if parameters.mixture == 0:
        return disparity
    from sepi.image.mixed_pixels_kernels import decided_pixels

    decided: FloatMap = decided_pixels(
        disparity,
        guide,
        parameters.mixture_step,
        parameters.mixture_reach,
        parameters.mixture_contrast,
        parameters.mixture,
        # a hundredth of full scale counts as equal even without noise
        1e-4 + noise,
    )
    return decided
