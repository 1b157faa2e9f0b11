"""Edges of the reference view and discontinuities of a depth map."""

import cv2
import numpy as np
from pydantic import Field

from sepi.image.noise import noise_level
from sepi.lightfield import BoolMap, FloatMap
from sepi.stage import Parameters


class CannyParameters(Parameters):
    """Parameters of the Canny edges."""

    canny_sigma: float = Field(1.0, gt=0, le=10, description="smoothing before the edges, in pixels")
    canny_low: float = Field(0.01, gt=0, le=1, description="least gradient along an edge, grey values 0..1 per px")
    canny_high: float = Field(0.025, gt=0, le=1, description="gradient that starts an edge, grey values 0..1 per px")


# response of the 3x3 Sobel operator to a gradient of one grey level per pixel
_SOBEL_GAIN = 8


def canny_edges(reference_view: FloatMap, parameters: CannyParameters) -> BoolMap:
    """Canny edges of the reference view; thresholds rise with its noise.

    Parameters
    ----------
    reference_view : ndarray, shape (H, W, 3), float32
        Values in 0..1.
    parameters : CannyParameters

    Returns
    -------
    ndarray, shape (H, W), bool
    """
    smooth = _smooth_grey(reference_view, parameters.canny_sigma)
    noise = noise_level(smooth[..., None])
    dx, dy = (cv2.Sobel(smooth, cv2.CV_32F, *order, ksize=3) for order in ((1, 0), (0, 1)))
    # Canny takes 16-bit derivatives
    scale = 16384 / _SOBEL_GAIN
    low, high = (scale * _SOBEL_GAIN * (value + 2 * noise) for value in (parameters.canny_low, parameters.canny_high))
    edges = cv2.Canny((scale * dx).astype(np.int16), (scale * dy).astype(np.int16), low, high, L2gradient=True)
    return np.asarray(edges > 0)


def edge_angle(reference_view: FloatMap, parameters: CannyParameters) -> FloatMap:
    """Angle of the normal of the strongest edge near each pixel, from ``+x`` towards ``+y``.

    Parameters
    ----------
    reference_view : ndarray, shape (H, W, 3), float32
    parameters : CannyParameters

    Returns
    -------
    ndarray, shape (H, W), float32
        Radians, -pi..pi.
    """
    smooth = _smooth_grey(reference_view, parameters.canny_sigma)
    dx, dy = (cv2.Sobel(smooth, cv2.CV_32F, *order, ksize=3) for order in ((1, 0), (0, 1)))
    # at double angles, opposite normals add up
    wide = 4 * parameters.canny_sigma
    along = cv2.GaussianBlur(dx * dx - dy * dy, (0, 0), wide)
    across = cv2.GaussianBlur(2 * dx * dy, (0, 0), wide)
    return np.asarray(0.5 * np.arctan2(across, along), np.float32)


def depth_discontinuities(disparity: FloatMap, threshold: float) -> BoolMap:
    """Pixels whose 3x3 neighbourhood spans more than ``threshold`` pixels of disparity per view step; (H, W), bool."""
    box = np.ones((3, 3), np.uint8)
    return np.asarray(cv2.dilate(disparity, box) - cv2.erode(disparity, box) > threshold)


def _smooth_grey(reference_view: FloatMap, sigma: float) -> FloatMap:
    return np.asarray(cv2.GaussianBlur(np.mean(cv2.split(reference_view), axis=0), (0, 0), sigma), np.float32)
