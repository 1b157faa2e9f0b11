"""Sub-sample disparity: Gauss-Newton on the residuals of all views that see a pixel.

For pixel ``p``, a view of baseline ``v`` and mean ``m`` of the views, the residual ``r_v(d) = L_v(p - d v) - m(p)``
changes with the disparity by ``-g v``, where ``g`` is the derivative of the mean along y and x. With robust weights
``w`` the cost is least at an update of ``sum(w r g v) / sum(w (g v)^2)``, both sums over a window. The mean of the
views has much less noise than the reference view, so that its derivatives are sound even where texture is faint; views
are interpolated by cubic splines, since linear interpolation pulls the minimum towards half pixels.

A window makes a step more certain, but only through pixels that move alike. Across a depth step it carries the strong
evidence of the nearer surface's edge to pixels of the farther one, where the views may have little, and would hold
wrong pixels there. Nor does a slope beside a nearer surface belong to the farther one: the mean of the views contains
the edge between the two, and the views that see the pixel have that edge elsewhere. So windows hold one surface. Where
a map extends a surface too far, disparity does not reveal it, but colour may: a wall that the map places as near as the
box beside it still has the colours of the wall.
"""

from functools import cached_property
from typing import NamedTuple

import cv2
import numpy as np
import numpy.typing as npt

from sepi.image.noise import variance_of_residuals
from sepi.kernels import gauss_newton as kernels
from sepi.kernels import splines, surface_windows
from sepi.lightfield import FloatMap
from sepi.matching.aligned_views import AlignedViews
from sepi.matching.base_detail import reference_noise
from sepi.matching.nearest_surfaces import SeenViews
from sepi.matching.row_bands import Band
from sepi.matching.spline_views import SplineViews

BESIDE_NEARER = 0.02
"""What the equation of a pixel beside a nearer surface counts: enough to hold it where nothing else does."""

OF_OTHER_COLOUR = 0.1
"""What a pixel of the same disparity counts, whatever its colour: one surface may have many."""

ANY_SURFACE = 1e6
"""Margin by which no disparities differ: windows hold whatever is in them; pixels per view step."""

LEAST_WIDTH = 1e-6
"""Where no margin is allowed; pixels per view step."""

_SMOOTH = np.array([1, 4, 1], np.float32) / 6
_DIFFERENCE = np.array([-1, 0, 1], np.float32) / 2


class Evidence(NamedTuple):
    """Evidence on a disparity beside the Gauss-Newton step: sums of each pixel over the views that see it.

    Attributes
    ----------
    halves : ndarray, shape (4, 2, H, W), float32
        Gradient and curvature by the views to the left, to the right, above and below alone.
    misfit : ndarray, shape (H, W), float32
        Squared residual of the colours, times its weight.
    agreement, detail_agreement : ndarray, shape (H, W), float32
        Weight of the views by colours, and by detail: 1 for each view that equals the mean.
    seeing : ndarray, shape (H, W), float32
        Number of views.
    """

    halves: FloatMap
    misfit: FloatMap
    agreement: FloatMap
    detail_agreement: FloatMap
    seeing: FloatMap


class GaussNewton(AlignedViews):
    """Gauss-Newton sums over the views of a light field; parameters as of :class:`AlignedViews`."""

    @cached_property
    def colour_variance(self) -> float:
        """Divisor of the squared residuals of colours, in gradients and curvatures."""
        return self._parameters.colour_scale**2 + variance_of_residuals(reference_noise(self._light_field))

    def gradient_and_hessian(
        self, mean: FloatMap, disparity: FloatMap, slopes: tuple[FloatMap, FloatMap] | None = None
    ) -> tuple[FloatMap, FloatMap]:
        """Gradient and curvature of the cost of each pixel, before any window.

        Parameters
        ----------
        mean : ndarray, shape (H, W, 4), float32
            From :meth:`mean`; of a slightly different map is good enough.
        disparity : ndarray, shape (H, W), float32
            Pixels per view step.
        slopes : tuple of ndarray, shape (H, W, 4), float32, optional
            Derivatives of the mean along y and x; those of its spline unless given.

        Returns
        -------
        gradient, curvature : ndarray, shape (H, W), float32
            The curvature is the inverse variance of the disparity, 1 / (pixels per view step)^2.
        """
        gradient, curvature = self._sums(2, disparity, mean, *(slopes or spline_derivatives(mean)))
        # the next map differs
        self._seen = None
        return gradient, curvature

    def with_evidence(self, mean: FloatMap, disparity: FloatMap) -> tuple[FloatMap, FloatMap, Evidence]:
        """:meth:`gradient_and_hessian`, and further evidence of the views on the disparity.

        Parameters
        ----------
        mean : ndarray, shape (H, W, 4), float32
        disparity : ndarray, shape (H, W), float32
            Pixels per view step.

        Returns
        -------
        gradient, curvature : ndarray, shape (H, W), float32
        evidence : Evidence
        """
        gradient, curvature, *rest = sums = self._sums(14, disparity, mean, *spline_derivatives(mean))
        return gradient, curvature, Evidence(sums[2:10].reshape(4, 2, *disparity.shape), *rest[8:])

    def _sums(self, number: int, disparity: FloatMap, mean: FloatMap, down: FloatMap, across: FloatMap) -> FloatMap:
        """The first sums of ``kernels/gauss_newton.cpp``, with a mean and its derivatives."""
        sums = np.empty((number, *disparity.shape), np.float32)

        def add(views: SplineViews, seen: SeenViews, band: Band) -> None:
            kernels.equations_of_views(views, seen, disparity, mean, down, across, band.begin, band.end, sums)

        self.in_bands(disparity, add)
        return sums


def spline_derivatives(image: FloatMap) -> tuple[FloatMap, FloatMap]:
    """Derivatives along y and x of the cubic spline through an image; shapes (H, W, C), float32."""
    coefficients = np.empty((image.shape[2], *image.shape[:2]), np.float32)
    splines.spline_coefficients(image, coefficients)

    def filtered(along_x: npt.NDArray[np.floating], along_y: npt.NDArray[np.floating]) -> FloatMap:
        # mirrored as the splines are
        border = cv2.BORDER_REFLECT_101
        channels = [cv2.sepFilter2D(each, -1, along_x, along_y, borderType=border) for each in coefficients]
        return np.asarray(cv2.merge(channels), np.float32).reshape(image.shape)

    return filtered(_SMOOTH, _DIFFERENCE), filtered(_DIFFERENCE, _SMOOTH)


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
        From :meth:`GaussNewton.gradient_and_hessian`.
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
    like = radius, float(width), surfaces.colour_width, OF_OTHER_COLOUR
    surface_windows.sums_of_surface(gradient * share, curvature * share, disparity, surfaces.colours, *like, sums)
    # as a window full of the surface would have them, but for what lies beyond the picture
    rows, columns = (_within(length, radius) for length in disparity.shape)
    sums /= rows[:, None] * columns
    update = sums[0] / (sums[1] + np.float32(1e-9))
    return np.clip(update, -max_update, max_update).astype(np.float32), np.maximum(sums[1], 0)


def _within(length: int, radius: int) -> npt.NDArray[np.float32]:
    """How many pixels of the window round each of so many lie in the picture, along one axis."""
    at = np.arange(length)
    return (np.minimum(at + radius + 1, length) - np.maximum(at - radius, 0)).astype(np.float32)
