"""Light on matte surfaces, gathered by all views together: a path tracer's noise without its paths.

A matte surface sends the same light to all views. What a pixel shows of it, divided by what is painted there, is the
light that falls on it; where several views see the same point by the exact disparity, the mean of theirs takes the
place of each: with 81 views a ninth of the noise, and one light for all of them. That again is the mean of all pixels
about it which may have the same light for all that chance allows, as the views' spread tells. Pixels in which surfaces
mix keep what paths brought, and so do gloss, mirrors and glass, which send each view something else.
"""

from __future__ import annotations

import cv2
import numpy as np
import numpy.typing as npt

from sepi.kernels import reprojection as kernels
from sepi.lightfield import BoolMap
from sepi.rendered.world import FloatArray

# pixels per view step: how far the disparities of one point may be apart
_BEND = 0.02
# half width in pixels of the window in which light is asked whether it is the same
_REACH = 3
# times what chance makes of the same light, on average: what is farther apart is not
_DOUBT = 2.0
# half width in pixels of the window that says what bends and corners of a surface may show
_BESIDE = 2


def with_shared_light(
    pictures: FloatArray,
    albedo: FloatArray,
    disparities: FloatArray,
    things: npt.NDArray[np.int16],
    whole: BoolMap,
    positions: npt.NDArray[np.float64],
) -> FloatArray:
    """The pictures of all views with the light of matte surfaces from all of them.

    Parameters
    ----------
    pictures : ndarray, shape (N, H, W, 3), float32
        Linear, path-traced.
    albedo : ndarray, shape (N, H, W, 3), float32
        Of matte surfaces; 0 where it is not known.
    disparities : ndarray, shape (N, H, W), float32
        In pixels per view step.
    things : ndarray, shape (N, H, W), int16
        What each pixel shows.
    whole : ndarray, shape (N, H, W), bool
        Whether that, and what is beside it, is one matte surface.
    positions : ndarray, shape (N, 2), float64
        Where the views stand, in view steps: down, across.

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
    """Keep pixels (H, W, 3) that are not whole, amid one thing, within the light of its whole ones beside them."""
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
    """Mean light of the pixels about each whole one that chance alone may tell from it: 3x3 pixels from 3x3.

    Parameters
    ----------
    light : ndarray, shape (H, W, 3), float32
    variance : ndarray, shape (H, W), float32
        Of the sum of its colours.
    surface : ndarray, shape (H, W), int16
        Which thing pixels show whole, -1 for none; these keep their light.

    Returns
    -------
    ndarray, shape (H, W, 3), float32
    """
    height, width = surface.shape
    whole = surface >= 0
    # of a patch its grey, the variance of that, and 1 where it counts: not beyond the picture
    patches = np.pad([light.sum(axis=2), variance, whole], ((0, 0), (_REACH + 1,) * 2, (_REACH + 1,) * 2))
    colours = np.pad([*np.moveaxis(light, 2, 0), np.ones_like(variance)], ((0, 0), (_REACH,) * 2, (_REACH,) * 2))
    things = np.pad(surface, _REACH, constant_values=-1)
    own, total = patches[:, _REACH:-_REACH, _REACH:-_REACH], np.zeros((4, height, width), np.float32)
    for y, x in np.ndindex(2 * _REACH + 1, 2 * _REACH + 1):
        other = patches[:, y : y + height + 2, x : x + width + 2]
        # what is apart beyond what chance makes of it
        apart = own[2] * other[2] * (np.square(own[0] - other[0]) - np.float32(_DOUBT) * (own[1] + other[1]))
        rows = apart[:-2] + apart[1:-1] + apart[2:]
        alike = rows[:, :-2] + rows[:, 1:-1] + rows[:, 2:] <= 0
        alike &= things[y : y + height, x : x + width] == surface
        total += colours[:, y : y + height, x : x + width] * alike
    mean = np.moveaxis(total[:3] / np.maximum(total[3], 1), 0, 2)
    return np.where(whole[..., None], mean, light)
