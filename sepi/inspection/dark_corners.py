"""Dark corners that a lens leaves in its pictures: they are no surfaces of the scene.

The edge of such a corner moves from view to view with the lens, not with the scene, and occludes what is behind it like
a near surface.
"""

from __future__ import annotations

import cv2
import numpy as np

from sepi.lightfield import BoolMap, FloatMap

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
    reduced = cv2.resize(black.astype(np.uint8), shape[::-1], interpolation=cv2.INTER_AREA)
    _, labels = cv2.connectedComponents(reduced)
    corners = set(labels[[0, 0, -1, -1], [0, -1, 0, -1]].tolist()) - {0}
    dark = np.isin(labels, list(corners)).astype(np.uint8)
    return np.asarray(cv2.dilate(dark, np.ones((2 * reach + 1, 2 * reach + 1), np.uint8)) > 0)
