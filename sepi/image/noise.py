"""Noise of the reference view: what a residual of two equal surfaces looks like before anything else goes wrong."""

from __future__ import annotations

import cv2
import numpy as np

from sepi.lightfield import BoolMap, FloatMap

# a second difference along both axes: blind to planes and to straight edges along the axes (Immerkaer 1996,
# doi:10.1006/cviu.1996.0060); its response to white noise of standard deviation 1 has standard deviation 6
_MASK = np.array([[1, -2, 1], [-2, 4, -2], [1, -2, 1]], np.float32)
_MEDIAN_TO_SIGMA: float = 1 / 0.6745


def noise_level(image: FloatMap, region: BoolMap | None = None) -> float:
    """Standard deviation of the noise in one channel, by the median of the mask's response.

    The median, where Immerkaer takes the mean, leaves out edges and most texture.

    Parameters
    ----------
    image : ndarray, shape (H, W, C), float32
        Values in 0..1.
    region : ndarray, shape (H, W), bool, optional
        Where to measure; everywhere unless given.

    Returns
    -------
    float
        In the image's units, 0..1; 0 over no pixels.
    """
    response = np.abs(cv2.filter2D(np.ascontiguousarray(image), cv2.CV_32F, _MASK))
    if region is not None:
        response = response[region]
        if not response.size:
            return 0.0
    return float(np.median(response).item() * _MEDIAN_TO_SIGMA / 6)


def residual_variance(image: FloatMap) -> float:
    """Expected squared residual, summed over channels, between two views of the same surface: noise of both views."""
    return variance_of_residuals(noise_level(image), image.shape[2])


def variance_of_residuals(noise: float, channels: int) -> float:
    """The same of views with this noise and so many channels."""
    return float(2 * channels * noise**2)
