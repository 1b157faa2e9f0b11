"""Search of the range estimate: a coarse plane sweep that keeps each pixel's best candidate and how clear it is.

Unlike the sweep of the initial depth, it must withstand candidates far outside the scene's range, vignetting in the
outer views, and noise. So it averages truncated absolute differences of high-pass filtered views over a window;
sub-pixel accuracy does not matter. Dark corners that a lens leaves in its pictures are no surfaces of the scene: their
edge moves from view to view with the lens, and occludes what is behind it like a near surface.
"""

from __future__ import annotations

import cv2
import numpy as np
import numpy.typing as npt

from sepi.kernels import coarse_sweep as kernels
from sepi.lightfield import BoolMap, FloatMap


def coarse_sweep(
    reference: FloatMap, views: FloatMap, offsets: FloatMap, candidates: FloatMap, truncation: float, radius: int
) -> tuple[FloatMap, FloatMap, FloatMap, FloatMap]:
    """Match the reference view against other views at each candidate disparity.

    Parameters
    ----------
    reference : ndarray, shape (H, W), float32
        The reference view.
    views : ndarray, shape (V, H, W), float32
        Other views.
    offsets : ndarray, shape (V, 2), float32
        Baseline ``(down, across)`` of each, view steps.
    candidates : ndarray, shape (N,), float32
        Disparities in pixels per view step, uniform, rising.
    truncation : float
        Largest difference that one view can count for.
    radius : int
        Half width of the square window in pixels.

    Returns
    -------
    lowest, second, mean, disparity : ndarrays, shape (H, W), float32
        Lowest cost; lowest cost outside the valley round it (infinite if there is no other valley); mean cost; the
        candidate of the lowest cost, refined by a parabola. A candidate at which fewer than half of the views see a
        pixel of the window is left out; ``lowest`` is infinite where that leaves none, or where the lowest cost is at
        an end of the candidates and so may go on falling beyond.
    """
    out = np.empty((4, *reference.shape), np.float32)
    kernels.coarse_sweep(reference, views, offsets, candidates, truncation, radius, out)
    lowest, second, mean, disparity = out
    return lowest, second, mean, disparity


def agreeing(disparity: FloatMap, trusted: BoolMap, window: int, tolerance: float) -> npt.NDArray[np.int32]:
    """Pixels of the window of so many about each that are trusted and have its disparity within a tolerance, (H, W)."""
    H, W = disparity.shape
    padded = np.pad(np.where(trusted, disparity, np.inf), window // 2, constant_values=np.inf)
    count = np.zeros((H, W), np.int32)
    for dy, dx in np.ndindex(window, window):
        count += abs(padded[dy : dy + H, dx : dx + W] - disparity) < tolerance
    return count


# Brightness of black, as a share of the brightest; largest share of a picture that a lens leaves black
_BLACK = 0.05
_MOST_BLACK = 0.35


def dark_corners(reference_view: FloatMap, shape: tuple[int, ...], reach: int) -> BoolMap:
    """Mask of the corners that the lens leaves black, and of pixels into which filters mix them.

    Parameters
    ----------
    reference_view : ndarray, shape (H, W, 3), float32
    shape : tuple of int
        Height and width of the result; the picture is reduced to them.
    reach : int
        Reach of filters, pixels of the result.

    Returns
    -------
    ndarray, bool
        Mask of this shape; all False if more is black than a lens leaves, since then it is the scene's background.
    """
    brightness = np.max(cv2.split(reference_view), axis=0)
    black = brightness < _BLACK * np.quantile(brightness, 0.99)
    if black.mean() > _MOST_BLACK:
        return np.zeros(shape, bool)
    _, labels = cv2.connectedComponents(cv2.resize(black.astype(np.uint8), shape[::-1], interpolation=cv2.INTER_AREA))
    corners = set(labels[[0, 0, -1, -1], [0, -1, 0, -1]].tolist()) - {0}
    dark = np.isin(labels, list(corners)).astype(np.uint8)
    return np.asarray(cv2.dilate(dark, np.ones((2 * reach + 1, 2 * reach + 1), np.uint8)) > 0)
