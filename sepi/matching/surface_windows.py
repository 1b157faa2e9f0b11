"""Gauss-Newton steps over windows that hold one surface.

A window makes a step more certain, but only through pixels that move alike. Across a depth step it carries the strong
evidence of the nearer surface's edge to pixels of the farther one, where the views may have little, and would hold
wrong pixels there. Nor does a slope beside a nearer surface belong to the farther one: the mean of the views contains
the edge between the two, and the views that see the pixel have that edge elsewhere.

Where a map extends a surface too far, disparity does not reveal it, but colour may: a wall that the map places as near
as the box beside it still has the colours of the wall.
"""

from __future__ import annotations

from typing import NamedTuple

import cv2
import numpy as np
import numpy.typing as npt

from sepi.kernels import surface_windows as kernels
from sepi.lightfield import FloatMap

BESIDE_NEARER = 0.02
"""What the equation of a pixel beside a nearer surface counts: enough to hold it where nothing else does."""

OF_OTHER_COLOUR = 0.1
"""What a pixel of the same disparity counts, whatever its colour: one surface may have many."""

ANY_SURFACE = 1e6
"""Margin by which no disparities differ: windows hold whatever is in them; pixels per view step."""

LEAST_WIDTH = 1e-6
"""Where no margin is allowed; pixels per view step."""


class Surfaces(NamedTuple):
    """Criteria for whether two pixels belong to one surface.

    Attributes
    ----------
    margin : float
        By how much disparities of another surface differ at least, pixels per view step; by three times as much they
        surely do.
    colours : ndarray, shape (3, H, W), float32
        Colours in 0..1; (3, 0, 0) where they are not asked.
    colour_width : float
        Colours differ clearly from 1.5 of it on, and hardly up to half of it.
    """

    margin: float
    colours: FloatMap = np.zeros((3, 0, 0), np.float32)
    colour_width: float = 1.0


def windowed_step(
    gradient: FloatMap, curvature: FloatMap, disparity: FloatMap, surfaces: Surfaces, radius: int, max_update: float
) -> tuple[FloatMap, FloatMap]:
    """Update and curvature of each pixel, over the pixels of its surface in a window of ``2 radius + 1`` pixels.

    Parameters
    ----------
    gradient, curvature : ndarray, shape (H, W), float32
        From :meth:`sepi.matching.gauss_newton.GaussNewton.gradient_and_hessian`.
    disparity : ndarray, shape (H, W), float32
        At which they are, pixels per view step.
    surfaces : Surfaces
    radius : int
    max_update : float
        Updates are cut to this, pixels per view step: beyond it the linearisation does not hold.

    Returns
    -------
    update, curvature : ndarray, shape (H, W), float32
        The curvature is the window's mean, to which other surfaces add nothing.
    """
    # fades from one margin to three: a hard limit would make noisy maps depend on pixels just within
    width = np.float32(max(2 * surfaces.margin, LEAST_WIDTH))
    nearer = cv2.dilate(disparity, np.ones((3, 3), np.uint8)) - disparity
    share = np.clip(np.float32(1.5) - nearer / width, np.float32(BESIDE_NEARER), np.float32(1))
    sums = np.empty((2, *disparity.shape), np.float32)
    kernels.sums_of_surface(
        gradient * share,
        curvature * share,
        disparity,
        surfaces.colours,
        radius,
        float(width),
        surfaces.colour_width,
        OF_OTHER_COLOUR,
        sums,
    )
    # as a window full of the surface would have them, but for what lies beyond the picture
    rows, columns = (_within(length, radius) for length in disparity.shape)
    sums /= rows[:, None] * columns
    update = sums[0] / (sums[1] + np.float32(1e-9))
    return np.clip(update, -max_update, max_update).astype(np.float32), np.maximum(sums[1], 0)


def _within(length: int, radius: int) -> npt.NDArray[np.float32]:
    """How many pixels of the window round each of so many lie in the picture, along one axis."""
    at = np.arange(length)
    return (np.minimum(at + radius + 1, length) - np.maximum(at - radius, 0)).astype(np.float32)
