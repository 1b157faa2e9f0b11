"""Evidence that a pixel beside a depth discontinuity is mostly background, from its mixture of colours.

A pixel that an edge runs through mixes the colours ``F`` of the nearer surface and ``B`` of the more distant one, and
its residuals are small at the nearer disparity, with which the edge moves: depth maps are one pixel too wide there. Its
colour ``I`` tells the share of the nearer surface in it, ``(I - B) (F - B) / |F - B|^2``, with ``F`` and ``B`` from
clean pixels close by; where that is little, the pixel is the more distant surface's. A colour that lies beside all
mixtures of both is none: surfaces are darker, or of another colour, towards their edge. In a grey picture no colour
does, and all count for less.
"""

import cv2
import numpy as np

from sepi.boundaries.parameters import BoundaryParameters
from sepi.boundaries.rim import Surroundings
from sepi.kernels import colour_mixture as kernels
from sepi.lightfield import FloatMap

_GREY_TRUST = 0.105
"""Of colours in a grey picture."""

_COLOURED = 0.02
"""Part of the colours' variance that is beside grey, from which on a picture is coloured."""


def mixture_evidence(
    disparity: FloatMap, around: Surroundings, guide: FloatMap, noise: float, parameters: BoundaryParameters
) -> FloatMap:
    """Evidence of the colours that a pixel of the nearer surface is mostly background.

    Parameters
    ----------
    disparity : ndarray, shape (H, W), float32
        Pixels per view step.
    around : Surroundings
        Of the disparity.
    guide : ndarray, shape (H, W, 3), float32
        Reference view, 0..1.
    noise : float
        Expected squared residual by noise, summed over RGB.
    parameters : BoundaryParameters

    Returns
    -------
    ndarray, shape (H, W), float32
        0..1; 0 away from depth discontinuities, and on their more distant side.
    """
    evidence = np.zeros(disparity.shape, np.float32)
    searched = parameters.boundary_step, parameters.clean_radius
    alpha = parameters.alpha_contrast, parameters.alpha_threshold
    # a hundredth of full scale counts as equal even without noise
    kernels.mixture_evidence(disparity, *around, guide, *searched, *alpha, 1e-4 + noise, evidence)
    return evidence * _trust(guide)


def _trust(guide: FloatMap) -> np.float32:
    """Weight of the evidence of a colour between two others, 0..1: in a grey picture all are."""
    channels = cv2.split(guide)
    # exactly zero for grey, despite rounding
    beside_grey = (channels[c] - channels[c - 1] for c in range(3))
    own, between = (sum(float(cv2.meanStdDev(of)[1][0, 0]) ** 2 for of in some) for some in (channels, beside_grey))
    chroma = between / 3 / max(own, 1e-12)
    return np.float32(_GREY_TRUST + (1 - _GREY_TRUST) * min(chroma / _COLOURED, 1.0))
