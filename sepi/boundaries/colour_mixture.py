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

from sepi.boundaries.parameters import BoundaryParameters
from sepi.boundaries.surroundings import Surroundings
from sepi.lightfield import FloatMap

_WIDTH = 1.0
"""Of the weights of clean pixels, pixels."""

_APART = 0.019
"""Squared distance of a colour from all mixtures at which it counts 1/e, in units of their variance."""

_RAMP = 0.07
"""Share below the threshold from which on there is no doubt."""

_LEAST_WEIGHT = 0.05
"""Of clean pixels of each side, in pixels right beside."""

_GREY_TRUST = 0.105
"""Of colours in a grey picture."""

_COLOURED = 0.02
"""Part of the colours' variance that is beside grey, from which on a picture is coloured."""


def mixture_evidence(
    disparity: FloatMap, around: Surroundings, guide: FloatMap, noise: float, parameters: BoundaryParameters
) -> FloatMap:
    """How surely the colours say that a pixel of the nearer surface is background for the most part.

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
    lowest, highest, radius = around.farthest, around.nearest, parameters.clean_radius
    step, middle = np.float64(parameters.boundary_step), (lowest + highest) / 2
    y, x = np.nonzero((highest - lowest >= step) & (disparity > middle))
    middle, most, least = middle[y, x], highest[y, x] + step, lowest[y, x] - step
    planes = np.stack([disparity, lowest, highest, *guide.transpose(2, 0, 1)])
    # beyond the border is nothing, which is on neither side
    planes = np.pad(planes, ((0, 0), (radius, radius), (radius, radius)), constant_values=np.nan)
    # over the clean pixels of the farther and of the nearer side: weights, three colours, all their squares
    sums = np.zeros((2, 5, len(y)))
    for dy, dx in np.ndindex(2 * radius + 1, 2 * radius + 1):
        there, farthest, nearest, *colours = planes[:, y + dy, x + dx]
        # surfaces beyond the two do not count
        clean = ((farthest > middle) | (nearest <= middle)) & (there <= most) & (there >= least)
        weight = np.exp(-((dy - radius) ** 2 + (dx - radius) ** 2) / (2 * _WIDTH**2))
        weighted = weight * np.stack([np.ones_like(there), *colours, *np.square(colours)])
        for side, belongs in zip(sums, (clean & (there <= middle), clean & (there > middle)), strict=True):
            own = np.where(belongs, weighted, 0)
            side[:4] += own[:4]
            for squared in own[4:]:
                side[4] += squared
    told = (sums[:, 0] >= _LEAST_WEIGHT).all(axis=0)
    y, x, sums = y[told], x[told], sums[:, :, told]
    far, near = sums[:, 1:4] / sums[:, :1]
    # a hundredth of full scale counts as equal even without noise
    variance = 1e-4 + noise + sums[0, 4] / sums[0, 0] + sums[1, 4] / sums[1, 0]
    distance, projection, apart = np.zeros((3, len(y)))
    for of_far, of_near, colour in zip(far, near, guide[y, x].T, strict=True):
        own, other = colour - of_far, of_near - of_far
        distance += other * other
        projection += own * other
        apart += own * own
        variance -= of_far * of_far + of_near * of_near
    # what is left of the colour beside both: a surface darker towards its edge is no mixture
    distance = np.maximum(distance, 1e-12)
    apart -= np.square(np.maximum(projection, 0)) / distance
    little = np.clip((parameters.alpha_threshold - projection / distance) / _RAMP, 0, 1)
    evidence = np.zeros(disparity.shape, np.float32)
    contrast = distance / (distance + parameters.alpha_contrast * variance)
    evidence[y, x] = little * contrast * np.exp(-apart / (_APART * variance))
    return evidence * _trust(guide)


def _trust(guide: FloatMap) -> np.float32:
    """How much a colour between two others tells, 0..1: in a grey picture all are."""
    colours = guide.reshape(-1, 3).astype(np.float64)
    colours = colours - colours.mean(axis=0)
    # exactly zero for grey, whatever is rounded
    beside_grey = colours - colours[:, [1, 2, 0]]
    chroma = (beside_grey**2).sum() / 3 / max((colours**2).sum(), 1e-12)
    return np.float32(_GREY_TRUST + (1 - _GREY_TRUST) * min(chroma / _COLOURED, 1.0))
