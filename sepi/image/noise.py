"""Noise of the reference view, and the residuals that it causes between views of the same surface."""

from __future__ import annotations

import cv2
import numpy as np
import numpy.typing as npt

from sepi.lightfield import BoolMap, FloatMap, LightField
from sepi.process.workspace import kept

BLACK, SATURATED = 0.01, 254 / 255
"""Values beyond which a pixel counts as black or overexposed: the limits of the range cut its noise off."""

_LEAST_SHARE = 0.01
"""Least share of samples with a signal; with fewer, all samples are measured."""

# second difference along both axes, 0 on planes and on straight edges along the axes (Immerkaer 1996,
# doi:10.1006/cviu.1996.0060); white noise of standard deviation 1 gives a response of standard deviation 6
_MASK = np.array([[1, -2, 1], [-2, 4, -2], [1, -2, 1]], np.float32)
_MEDIAN_TO_SIGMA: float = 1 / 0.6745


def noise_level(image: FloatMap, region: BoolMap | None = None) -> float:
    """Standard deviation of the noise in one channel, by the median response of a second difference.

    Unlike Immerkaer's mean, the median leaves out edges and most texture. Black, overexposed and exactly flat samples
    have no noise and are left out.

    Parameters
    ----------
    image : ndarray, shape (H, W, C), float32
        Values in 0..1.
    region : ndarray, shape (H, W), bool, optional
        Pixels that are measured, with or without a signal; default: all that have a signal.

    Returns
    -------
    float
        Colours in 0..1; 0 without pixels.
    """
    response = np.abs(_response(image))
    if region is None:
        region = _with_signal(image)
    response = response.reshape(image.shape)[region]
    if not response.size:
        return 0.0
    return median(response) * _MEDIAN_TO_SIGMA / 6


def median(values: npt.NDArray[np.floating]) -> float:
    """Median of a whole array; NumPy's also looks for NaN, and takes ten times as long."""
    middle = values.size // 2
    parted = np.partition(values, middle, axis=None)
    return float(parted[middle] if values.size % 2 else (parted[:middle].max() + parted[middle]) / 2)


def noise_of_reference_view(light_field: LightField) -> float:
    """:func:`noise_level` of the reference view; a workspace keeps it."""
    return kept(light_field, "noise", lambda: noise_level(light_field.reference_view))


def mask_energy(image: FloatMap) -> FloatMap:
    """Squared response of the second difference, mean over channels; in white noise its mean is the variance."""
    return sum_of_channels(np.square(_response(image).reshape(image.shape) / 6)) / np.float32(image.shape[2])


def sum_of_channels(image: FloatMap) -> FloatMap:
    """Sum of the channels of an image (H, W, C), float32; NumPy takes thirty times as long over a short axis."""
    return np.asarray(cv2.transform(image, np.ones((1, image.shape[2]), np.float32)).reshape(image.shape[:2]))


def _response(image: FloatMap) -> FloatMap:
    return np.asarray(cv2.filter2D(np.ascontiguousarray(image), cv2.CV_32F, _MASK), np.float32)


def _with_signal(image: FloatMap) -> BoolMap:
    """Samples (H, W, C) whose 3x3 neighbourhood is not all black, all overexposed or flat; all if these are few."""
    box = np.ones((3, 3), np.uint8)
    lowest, highest = (change(image, box).reshape(image.shape) for change in (cv2.erode, cv2.dilate))
    found = (highest > BLACK) & (lowest < SATURATED) & (lowest < highest)
    return np.asarray(found if found.mean() >= _LEAST_SHARE else np.ones_like(found))


def residual_variance(image: FloatMap) -> float:
    """Expected squared residual, summed over channels, of two views of the same surface by the noise of both."""
    return variance_of_residuals(noise_level(image))


def reference_residual_variance(light_field: LightField) -> float:
    """:func:`residual_variance` of the reference view; a workspace keeps its noise."""
    return variance_of_residuals(noise_of_reference_view(light_field))


def variance_of_residuals(noise: float) -> float:
    """Expected squared residual, summed over three channels, of two views with this noise."""
    return float(6 * noise**2)
