"""Mean shift [2]_, which climbs from a point to the mode of the distribution round it.

On a patch of the image and of the depth map it confirms occlusion (section IV-B of [1]_): started at a pixel, it ends
at the disparity of the surface that the pixel belongs to, free of the outliers that stand between two surfaces. On the
colours of superpixels it finds those that belong together (section IV-C).

References
----------
.. [1] Zhou, Shi, Liu, Jin, Zhang, Hou: Light Field Depth Estimation via Stitched Epipolar Plane Images.
.. [2] Comaniciu, Meer: Mean shift: a robust approach toward feature space analysis. TPAMI 24(5), 2002.
   doi:10.1109/34.1000236
"""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

from sepi.compiled import njit, prange
from sepi.lightfield import BoolMap, FloatMap

ITERATIONS = 5

MAX_ITERATIONS, TOLERANCE = 50, 1e-3
"""Where the search for a mode of samples ends: iterations, or an update's part of the bandwidth."""


def patch_modes(
    image: FloatMap, disparity: FloatMap, mask: BoolMap, *, radius: int, sigma_colour: float, sigma_disparity: float
) -> FloatMap:
    """Disparity of the colour-and-disparity mode that each pixel of the mask belongs to.

    Parameters
    ----------
    image : ndarray, shape (H, W, C), float32
        Centre view, 0..1.
    disparity : ndarray, shape (H, W), float32
        Pixels per view step.
    mask : ndarray, shape (H, W), bool
        The others keep their disparity.
    radius : int
        The patch is ``2 radius + 1`` pixels wide and high.
    sigma_colour, sigma_disparity : float
        Bandwidths: colour distance, and pixels per view step.

    Returns
    -------
    ndarray, shape (H, W), float32
    """
    scaled = (np.sqrt(0.5) / sigma_colour * image).astype(np.float32)
    factor = np.float32(0.5 / sigma_disparity**2)
    modes = disparity.astype(np.float32)
    _patch_modes(scaled, disparity.astype(np.float32), mask, radius, factor, modes)
    return modes


@njit(cache=True, parallel=True)
def _patch_modes(image: Any, disparity: Any, mask: Any, radius: int, factor: Any, modes: Any) -> None:
    H, W, C = image.shape
    for y in prange(H):
        colour = np.empty(C, np.float32)
        moved = np.empty(C, np.float32)
        for x in range(W):
            if not mask[y, x]:
                continue
            colour[:] = image[y, x]
            depth = disparity[y, x]
            for _ in range(ITERATIONS):
                total = np.float32(0)
                depth_sum = np.float32(0)
                moved[:] = 0
                for v in range(max(0, y - radius), min(H, y + radius + 1)):
                    for u in range(max(0, x - radius), min(W, x + radius + 1)):
                        distance = factor * (disparity[v, u] - depth) ** 2
                        for c in range(C):
                            distance += (image[v, u, c] - colour[c]) ** 2
                        weight = np.exp(-distance)
                        total += weight
                        depth_sum += weight * disparity[v, u]
                        for c in range(C):
                            moved[c] += weight * image[v, u, c]
                # the pixel itself starts with weight one, so the total never vanishes at once
                if total < np.float32(1e-6):
                    break
                depth = depth_sum / total
                for c in range(C):
                    colour[c] = moved[c] / total
            modes[y, x] = depth


def sample_modes(samples: npt.NDArray[np.float64], bandwidth: float) -> npt.NDArray[np.float64]:
    """Mode that each of a few thousand samples belongs to, by a Gaussian kernel.

    Parameters
    ----------
    samples : ndarray, shape (N, D), float64
    bandwidth : float
        Standard deviation of the kernel, in the samples' units.

    Returns
    -------
    ndarray, shape (N, D), float64
        Samples of one cluster get the same point but for the tolerance.
    """
    modes = np.ascontiguousarray(samples, np.float64).copy()
    _sample_modes(np.ascontiguousarray(samples, np.float64), float(bandwidth), modes)
    return modes


@njit(cache=True, parallel=True)
def _sample_modes(samples: Any, bandwidth: float, modes: Any) -> None:
    N, D = samples.shape
    factor = -0.5 / bandwidth**2
    for n in prange(N):
        moved = np.empty(D)
        for _ in range(MAX_ITERATIONS):
            total = 0.0
            moved[:] = 0
            for m in range(N):
                distance = 0.0
                for d in range(D):
                    distance += (samples[m, d] - modes[n, d]) ** 2
                weight = np.exp(factor * distance)
                total += weight
                for d in range(D):
                    moved[d] += weight * samples[m, d]
            update = 0.0
            for d in range(D):
                moved[d] /= total
                update = max(update, abs(moved[d] - modes[n, d]))
                modes[n, d] = moved[d]
            if update < TOLERANCE * bandwidth:
                break
