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

from sepi.compiled import fma, njit, prange
from sepi.lightfield import BoolMap, FloatMap
from sepi.vectors import at_most, exp, load, minus, spread, store

ITERATIONS = 5

VECTOR = 8
"""Pixels that are done together: see :mod:`sepi.vectors`."""

_UNLIKE = np.float32(1e4)
"""Colour and disparity beyond the picture."""

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
    H, W, C = image.shape
    # the last of them is disparity; beyond the picture nothing is alike
    planes = np.full((4, H + 2 * radius, W + 2 * radius + 2 * VECTOR), _UNLIKE, np.float32)
    within = planes[:, radius : radius + H, radius : radius + W]
    within[:3] = 0
    within[:C] = (np.sqrt(0.5) / sigma_colour * image).transpose(2, 0, 1)
    within[3] = np.sqrt(0.5) / sigma_disparity * disparity
    modes = disparity.astype(np.float32)
    _patch_modes(planes, mask, radius, np.float32(np.sqrt(2) * sigma_disparity), modes)
    return modes


@njit(inline="always")
def _of_patch(planes: Any, y: int, x: int, size: int, place: Any) -> Any:
    """Mean of a patch ``size`` pixels wide and high, weighted by how near each pixel is to ``place``; the weights."""
    total = red = green = blue = depth = spread(np.float32(0))
    for v in range(y, y + size):
        for u in range(x, x + size):
            r, g, b, d = (
                load(planes, (0, v, u)),
                load(planes, (1, v, u)),
                load(planes, (2, v, u)),
                load(planes, (3, v, u)),
            )
            e0, e1, e2, e3 = r - place[0], g - place[1], b - place[2], d - place[3]
            weight = exp(minus(fma(e3, e3, fma(e2, e2, fma(e1, e1, e0 * e0)))))
            total = total + weight
            red, green, blue = fma(weight, r, red), fma(weight, g, green), fma(weight, b, blue)
            depth = fma(weight, d, depth)
    return (red / total, green / total, blue / total, depth / total), total


@njit(cache=True, error_model="numpy", borrows=True)
def _patch_modes_of_row(planes: Any, mask: Any, y: int, radius: int, unit: Any, found: Any) -> None:
    """:func:`patch_modes` of a row, into ``found (W + VECTOR,)``, where one of eight pixels is in the mask."""
    W, least = mask.shape[1], spread(np.float32(1e-6))
    for x in range(0, W, VECTOR):
        wanted = False
        for i in range(x, min(W, x + VECTOR)):
            wanted |= mask[y, i]
        if not wanted:
            continue
        v, u = y + radius, x + radius
        red, green, blue = load(planes, (0, v, u)), load(planes, (1, v, u)), load(planes, (2, v, u))
        depth = load(planes, (3, v, u))
        for _ in range(ITERATIONS):
            means, total = _of_patch(planes, y, x, 2 * radius + 1, (red, green, blue, depth))
            # the pixel itself starts with weight one, so the total never vanishes at once
            red, green = at_most(least, total, means[0], red), at_most(least, total, means[1], green)
            blue, depth = at_most(least, total, means[2], blue), at_most(least, total, means[3], depth)
        store(found, x, depth * spread(unit))


@njit(cache=True, parallel=True)
def _patch_modes(planes: Any, mask: Any, radius: int, unit: Any, modes: Any) -> None:
    H, W = mask.shape
    for y in prange(H):
        found = np.empty(W + VECTOR, np.float32)
        _patch_modes_of_row(planes, mask, y, radius, unit, found)
        for x in range(W):
            if mask[y, x]:
                modes[y, x] = found[x]


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
