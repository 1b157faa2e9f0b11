"""Light on matte surfaces averaged over all views, which reduces the path tracer's noise.

A matte surface sends the same light to all views. A pixel's colour divided by its albedo is the light that falls on it.
The mean over the views that see the same point, by the exact disparity, replaces each view's light; 81 views have a
ninth of the noise. This mean is averaged again over nearby pixels whose light is the same within the spread of the
views. Pixels with several surfaces keep their own light, as do gloss, mirrors and glass, which look different from view
to view.
"""

from __future__ import annotations

import cv2
import numpy as np
import numpy.typing as npt

from sepi.extensions.rendered.world import FloatArray
from sepi.kernels import reprojection as kernels
from sepi.lightfield import BoolMap

# largest difference between disparities of one point, pixels per view step
_BEND = 0.02
# half width in pixels of the window of nearby pixels
_REACH = 3
# largest difference of the same light, as a multiple of that by noise
_DOUBT = 2.0
# half width in pixels of the window that limits the light at bends and corners of a surface
_BESIDE = 2


def with_shared_light(
    pictures: FloatArray,
    albedo: FloatArray,
    disparities: FloatArray,
    things: npt.NDArray[np.int16],
    whole: BoolMap,
    positions: npt.NDArray[np.float64],
) -> FloatArray:
    """The pictures of all views with shared light on matte surfaces.

    Parameters
    ----------
    pictures : ndarray, shape (N, H, W, 3), float32
        Path-traced pictures, linear.
    albedo : ndarray, shape (N, H, W, 3), float32
        Albedo of matte surfaces; 0 where unknown.
    disparities : ndarray, shape (N, H, W), float32
        Pixels per view step.
    things : ndarray, shape (N, H, W), int16
        Number of each pixel's thing.
    whole : ndarray, shape (N, H, W), bool
        Pixels that show, with their neighbours, one matte surface.
    positions : ndarray, shape (N, 2), float64
        Positions of the views, ``(down, across)`` in view steps.

    Returns
    -------
    ndarray, shape (N, H, W, 3), float32
    """
    # irradiance over pi
    light = (pictures / np.where(whole[..., None], albedo, 1)).astype(np.float32)
    surface = np.where(whole, things, np.int16(-1))
    shown = np.empty_like(light)
    mean, variance = np.empty_like(light[0]), np.empty_like(disparities[0])
    for view, own in enumerate(surface):
        baselines = positions - positions[view]
        kernels.gathered_light(light, disparities, surface, baselines, view, _BEND, mean, variance)
        alike = alike_light(mean, variance, own)
        shown[view] = np.where(whole[view][..., None], alike * albedo[view], pictures[view])
        limit_bent(things[view], whole[view], shown[view])
    return shown


def limit_bent(things: npt.NDArray[np.int16], whole: BoolMap, shown: FloatArray) -> None:
    """Limit pixels (H, W, 3) that are not whole, within one thing, to the range of nearby whole ones."""
    height, width = whole.shape
    bent = ~whole & (cv2.erode(things, np.ones((3, 3))) == cv2.dilate(things, np.ones((3, 3))))
    around = ((_BESIDE, _BESIDE), (_BESIDE, _BESIDE))
    surface, light = np.pad(np.where(whole, things, -1), around, constant_values=-1), np.pad(shown, (*around, (0, 0)))
    low, high = np.full_like(shown, np.inf), np.full_like(shown, -np.inf)
    for y, x in np.ndindex(2 * _BESIDE + 1, 2 * _BESIDE + 1):
        beside = slice(y, y + height), slice(x, x + width)
        same = (surface[beside] == things)[..., None]
        np.minimum(low, light[beside], out=low, where=same)
        np.maximum(high, light[beside], out=high, where=same)
    known = bent[..., None] & (low <= high)
    shown[known] = np.clip(shown, low, high)[known]


def alike_light(light: FloatArray, variance: FloatArray, surface: npt.NDArray[np.int16]) -> FloatArray:
    """Mean light over the pixels near each whole one whose 3x3 patches differ by noise only.

    Parameters
    ----------
    light : ndarray, shape (H, W, 3), float32
    variance : ndarray, shape (H, W), float32
        Variance of the sum of its colours.
    surface : ndarray, shape (H, W), int16
        Thing of each whole pixel; pixels with -1 keep their light.

    Returns
    -------
    ndarray, shape (H, W, 3), float32
    """
    height, width = surface.shape
    whole = surface >= 0
    # sums over a patch: grey, its variance, and number of pixels in the picture
    patches = np.pad([light.sum(axis=2), variance, whole], ((0, 0), (_REACH + 1,) * 2, (_REACH + 1,) * 2))
    colours = np.pad([*np.moveaxis(light, 2, 0), np.ones_like(variance)], ((0, 0), (_REACH,) * 2, (_REACH,) * 2))
    things = np.pad(surface, _REACH, constant_values=-1)
    own, total = patches[:, _REACH:-_REACH, _REACH:-_REACH], np.zeros((4, height, width), np.float32)
    for y, x in np.ndindex(2 * _REACH + 1, 2 * _REACH + 1):
        other = patches[:, y : y + height + 2, x : x + width + 2]
        # difference beyond that by noise
        apart = own[2] * other[2] * (np.square(own[0] - other[0]) - np.float32(_DOUBT) * (own[1] + other[1]))
        rows = apart[:-2] + apart[1:-1] + apart[2:]
        alike = rows[:, :-2] + rows[:, 1:-1] + rows[:, 2:] <= 0
        alike &= things[y : y + height, x : x + width] == surface
        total += colours[:, y : y + height, x : x + width] * alike
    mean = np.moveaxis(total[:3] / np.maximum(total[3], 1), 0, 2)
    return np.where(whole[..., None], mean, light)
