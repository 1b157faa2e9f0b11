"""Texture of a picture: by how much colours differ within one surface."""

import cv2
import numpy as np
import numpy.typing as npt

from sepi.image.noise import sum_of_channels
from sepi.lightfield import FloatMap

RADIUS = 4
"""Of the windows in which texture is measured, pixels; weights fall as a normal distribution of 0.4 of it."""


def variance_within_surface(image: FloatMap, least: float, share: npt.ArrayLike) -> FloatMap:
    """Squared difference that two pixels of one surface may have: that of neighbours around, or more.

    In texture, neighbours differ all over a window; an edge between two plain surfaces fills a small part of one. Of
    the windows that contain a pixel, that of the least texture counts, so that texture ends where it borders on
    something plainer.

    Parameters
    ----------
    image : ndarray, shape (H, W, C), float32
        Colours in 0..1.
    least : float
        Least squared difference, summed over channels, such as that of noise.
    share : float or ndarray, shape (H, W)
        Of the texture that counts.

    Returns
    -------
    ndarray, shape (H, W), float32
        ``share`` of the mean squared difference of neighbours, summed over channels, or ``least`` where that is more.
    """
    size = (2 * RADIUS + 1, 2 * RADIUS + 1)
    energy = np.zeros(image.shape[:2], np.float32)
    for axis, own in enumerate((energy, energy.T)):
        squares = sum_of_channels(np.square(np.diff(image, axis=axis)))
        between = squares.T if axis else squares
        own[1:] += between
        own[:-1] += between
    plainest = cv2.erode(cv2.GaussianBlur(energy / 4, size, 0.4 * RADIUS), np.ones(size, np.uint8))
    return np.asarray(np.maximum(np.asarray(share, np.float32) * plainest, np.float32(least)))
