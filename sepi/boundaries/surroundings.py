"""Disparities around a pixel, which show whether an edge runs through it."""

from __future__ import annotations

from typing import NamedTuple

import cv2
import numpy as np

from sepi.lightfield import FloatMap

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
