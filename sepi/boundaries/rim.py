"""The pixels beside depth steps, the surfaces on both sides, and the views that are compared there."""

from typing import Any, NamedTuple

import cv2
import numpy as np
import numpy.typing as npt

from sepi.lightfield import BoolMap, FloatMap
from sepi.matching.nearest_surfaces import SeenViews


class RimViews(NamedTuple):
    """The compared views, and the occlusions in them.

    Attributes
    ----------
    lines : ndarray, shape (T, S, H, W C), uint8, uint16 or float32
        Rows of the pixels, their channels side by side.
    channels : int
        C, 1 or 3.
    units : ndarray, shape (V,), float32
        What the pixels of each view that is compared are multiplied with to be 0..1, and as bright as the reference.
    seen : SeenViews
        By the map, its nearer surfaces widened by a pixel, so that no mixed pixel counts as background.
    """

    lines: npt.NDArray[Any]
    channels: int
    units: FloatMap
    seen: SeenViews


class Sides(NamedTuple):
    """The surfaces of a map, and their colours in the reference view.

    Attributes
    ----------
    disparity : ndarray, shape (H, W), float32
    guide : ndarray, shape (H, W, 3), float32
        Reference view, 0..1.
    clean : ndarray, shape (H, W), bool
        Pixels of one surface alone.
    clean_radius : int
        How far away clean colours of the nearer surface are looked for, pixels.
    """

    disparity: FloatMap
    guide: FloatMap
    clean: BoolMap
    clean_radius: int


_AROUND = np.ones((3, 3), np.uint8)


class Surroundings(NamedTuple):
    """The least and the largest disparity of each pixel and its eight neighbours.

    A pixel is clean with respect to a level between two surfaces where all nine lie on one side of it: the edge between
    them does not run through it.

    Attributes
    ----------
    farthest, nearest : ndarray, shape (H, W), float32
        Pixels per view step.
    """

    farthest: FloatMap
    nearest: FloatMap


def surroundings(disparity: FloatMap) -> Surroundings:
    """Those of a disparity map (H, W), float32; beyond its border there is nothing."""
    farthest, nearest = cv2.erode(disparity, _AROUND), cv2.dilate(disparity, _AROUND)
    return Surroundings(np.asarray(farthest, np.float32), np.asarray(nearest, np.float32))


class Rim(NamedTuple):
    """The pixels beside a depth step, and the two surfaces that they may belong to.

    Attributes
    ----------
    near, far : ndarray, shape (H, W), float32
        Disparities of both surfaces; the map's own elsewhere.
    inside : ndarray, shape (H, W), bool
        Whether a pixel lies beside a step.
    is_near : ndarray, shape (H, W), bool
        Whether the map has the nearer one.
    """

    near: FloatMap
    far: FloatMap
    inside: BoolMap
    is_near: BoolMap


def rim_of(disparity: FloatMap, radius: int, step: float, before: FloatMap | None = None) -> Rim:
    """Surfaces on both sides of each depth step, means over a window by nearness.

    Parameters
    ----------
    disparity : ndarray, shape (H, W), float32
        Pixels per view step.
    radius : int
        Of the window, pixels.
    step : float
        By how much the disparities in the window of a pixel beside a step differ.
    before : ndarray, shape (H, W), float32, optional
        Another map: only pixels are inside in whose window both differ by a step.

    Returns
    -------
    Rim
    """
    window = np.ones((2 * radius + 1, 2 * radius + 1), np.uint8)
    lowest, highest = cv2.erode(disparity, window), cv2.dilate(disparity, window)
    inside = np.asarray(highest - lowest >= np.float64(step))
    if before is not None:
        inside &= cv2.dilate(np.abs(disparity - before), window) >= np.float64(step)
    y, x = np.nonzero(inside)
    middle = (lowest + highest)[inside] / 2
    # beyond the border is nothing, which is on neither side
    padded = np.pad(disparity.astype(np.float64), radius, constant_values=np.nan)
    weights, sums = np.zeros((2, 2, len(y)))
    for dy, dx in np.ndindex(window.shape):
        there, weight = padded[y + dy, x + dx], 1 / (1 + (dy - radius) ** 2 + (dx - radius) ** 2)
        for side, belongs in enumerate((there <= middle, there > middle)):
            weights[side] += weight * belongs
            sums[side] += np.where(belongs, weight * there, 0)
    near, far = disparity.copy(), disparity.copy()
    far[inside], near[inside] = sums / weights
    return Rim(near, far, inside, inside & (disparity > (near + far) / 2))
