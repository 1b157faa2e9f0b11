"""Noise of the reference view: what a residual of two equal surfaces looks like before anything else goes wrong."""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np

from sepi.lightfield import BoolMap, FloatMap, LightField
from sepi.workspace import OfViews, kept_of

BLACK, SATURATED = 0.01, 254 / 255
"""As dark and as bright as can be told: beyond, noise is cut off."""

_LEAST_SHARE = 0.01
"""Of the samples that must hold a signal; with fewer, all are measured."""

# a second difference along both axes: blind to planes and to straight edges along the axes (Immerkaer 1996,
# doi:10.1006/cviu.1996.0060); its response to white noise of standard deviation 1 has standard deviation 6
_MASK = np.array([[1, -2, 1], [-2, 4, -2], [1, -2, 1]], np.float32)
_MEDIAN_TO_SIGMA: float = 1 / 0.6745


def noise_level(image: FloatMap, region: BoolMap | None = None) -> float:
    """Standard deviation of the noise in one channel, by the median of the mask's response.

    The median, where Immerkaer takes the mean, leaves out edges and most texture. What is black, saturated or exactly
    flat has none of the noise that the rest has, and would drag the median to nothing.

    Parameters
    ----------
    image : ndarray, shape (H, W, C), float32
        Values in 0..1.
    region : ndarray, shape (H, W), bool, optional
        Where to measure, whatever is there; where there is a signal unless given.

    Returns
    -------
    float
        In the image's units, 0..1; 0 over no pixels.
    """
    response = np.abs(_response(image))
    if region is None:
        region = _with_signal(image)
    response = response.reshape(image.shape)[region]
    if not response.size:
        return 0.0
    return float(np.median(response).item() * _MEDIAN_TO_SIGMA / 6)


@dataclass
class _Kept(OfViews):
    """The noise of the reference view."""

    noise: float | None = None


def noise_of_reference_view(light_field: LightField) -> float:
    """:func:`noise_level` of the reference view; in a workspace found once."""
    kept = kept_of(light_field, _Kept)
    if kept.noise is None:
        kept.noise = noise_level(light_field.reference_view)
    return kept.noise


def mask_energy(image: FloatMap) -> FloatMap:
    """Squared response of the mask (H, W), mean over the channels: of white noise its variance, on average."""
    return np.asarray(np.square(_response(image).reshape(image.shape) / 6).mean(axis=2), np.float32)


def _response(image: FloatMap) -> FloatMap:
    return np.asarray(cv2.filter2D(np.ascontiguousarray(image), cv2.CV_32F, _MASK), np.float32)


def _with_signal(image: FloatMap) -> BoolMap:
    """Samples (H, W, C) whose 3x3 neighbourhood is neither cut off as a whole nor flat; all where these are few."""
    box = np.ones((3, 3), np.uint8)
    lowest, highest = (change(image, box).reshape(image.shape) for change in (cv2.erode, cv2.dilate))
    found = (highest > BLACK) & (lowest < SATURATED) & (lowest < highest)
    return np.asarray(found if found.mean() >= _LEAST_SHARE else np.ones_like(found))


def residual_variance(image: FloatMap) -> float:
    """Expected squared residual, summed over channels, between two views of the same surface: noise of both views."""
    return variance_of_residuals(noise_level(image), image.shape[2])


def reference_residual_variance(light_field: LightField) -> float:
    """:func:`residual_variance` of the reference view; in a workspace its noise is found once."""
    return variance_of_residuals(noise_of_reference_view(light_field), light_field.reference_view.shape[2])


def variance_of_residuals(noise: float, channels: int) -> float:
    """The same of views with this noise and so many channels."""
    return float(2 * channels * noise**2)
