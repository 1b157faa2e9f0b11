"""Mean shift [2]_: the mode of a distribution near a point.

On colour and disparity of a patch, it confirms occlusion (section IV-B of [1]_): started at a pixel, it ends at the
disparity of that pixel's surface, free of outliers between two surfaces. On the mean colours of superpixels, it finds
those that look alike (section IV-C).

References
----------
.. [1] Zhou, Shi, Liu, Jin, Zhang, Hou: Light Field Depth Estimation via Stitched Epipolar Plane Images.
.. [2] Comaniciu, Meer: Mean shift: a robust approach toward feature space analysis. TPAMI 24(5), 2002.
   doi:10.1109/34.1000236
"""

from __future__ import annotations

import numpy as np

from sepi.kernels import mean_shift as kernels
from sepi.lightfield import BoolMap, FloatArray, FloatMap

_ROOM = 16
"""Columns behind the picture and its margins: pixels are looked at eight at a time."""

_UNLIKE = np.float32(1e4)
"""Colour and disparity beyond the picture."""


def patch_modes(
    image: FloatMap, disparity: FloatMap, mask: BoolMap, radius: int, sigma_colour: float, sigma_disparity: float
) -> FloatMap:
    """Disparity of each masked pixel's mode in colour and disparity.

    Parameters
    ----------
    image : ndarray, shape (H, W, C), float32
        Centre view, 0..1.
    disparity : ndarray, shape (H, W), float32
        Pixels per view step.
    mask : ndarray, shape (H, W), bool
        Other pixels keep their disparity.
    radius : int
        The patch is ``2 radius + 1`` pixels wide and high.
    sigma_colour, sigma_disparity : float
        Bandwidths: colour distance, and pixels per view step.

    Returns
    -------
    ndarray, shape (H, W), float32
    """
    H, W, C = image.shape
    # channels and disparity; values beyond the picture are like no others
    planes = np.full((4, H + 2 * radius, W + 2 * radius + _ROOM), _UNLIKE, np.float32)
    within = planes[:, radius : radius + H, radius : radius + W]
    within[:3] = 0
    within[:C] = (np.sqrt(0.5) / sigma_colour * image).transpose(2, 0, 1)
    within[3] = np.sqrt(0.5) / sigma_disparity * disparity
    modes = disparity.astype(np.float32)
    kernels.patch_modes(planes, mask, radius, np.sqrt(2) * sigma_disparity, modes)
    return modes


def sample_modes(samples: FloatArray, bandwidth: float) -> FloatArray:
    """Mode of each of a few thousand samples, by a Gaussian kernel.

    Parameters
    ----------
    samples : ndarray, shape (N, D), float64
    bandwidth : float
        Standard deviation of the kernel, in the samples' units.

    Returns
    -------
    ndarray, shape (N, D), float64
        Samples of one cluster get the same mode, up to a tolerance.
    """
    modes = np.array(samples, np.float64, order="C")
    kernels.sample_modes(modes.copy(), bandwidth, modes)
    return modes
