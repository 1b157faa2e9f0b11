"""Mean shift on a patch of the image and of the depth map: the cue that confirms occlusion (section IV-B of [1]_).

Started at a pixel, mean shift climbs to the mode of the joint distribution of colour and disparity round it. The mode's
disparity is that of the surface the pixel belongs to, free of the outliers that stand between two surfaces.

References
----------
.. [1] Zhou, Shi, Liu, Jin, Zhang, Hou: Light Field Depth Estimation via Stitched Epipolar Plane Images.
.. [2] Comaniciu, Meer: Mean shift: a robust approach toward feature space analysis. TPAMI 24(5), 2002.
   doi:10.1109/34.1000236
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numba import njit, prange

from sepi.lightfield import BoolMap, FloatMap

ITERATIONS = 5


def patch_modes(
    image: FloatMap, disparity: FloatMap, wanted: BoolMap, *, radius: int, sigma_colour: float, sigma_disparity: float
) -> FloatMap:
    """Disparity of the colour-and-disparity mode that each wanted pixel belongs to.

    Parameters
    ----------
    image : ndarray, shape (H, W, C), float32
        Centre view, 0..1.
    disparity : ndarray, shape (H, W), float32
        Pixels per view step.
    wanted : ndarray, shape (H, W), bool
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
    _patch_modes(scaled, disparity.astype(np.float32), wanted, radius, factor, modes)
    return modes


@njit(cache=True, parallel=True)
def _patch_modes(image: Any, disparity: Any, wanted: Any, radius: int, factor: Any, modes: Any) -> None:
    H, W, C = image.shape
    for y in prange(H):
        colour = np.empty(C, np.float32)
        moved = np.empty(C, np.float32)
        for x in range(W):
            if not wanted[y, x]:
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
