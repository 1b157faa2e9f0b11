"""Regions of a picture, each with its own x and y axes."""

from __future__ import annotations

from typing import NamedTuple

import cv2
import numpy as np
import numpy.typing as npt

from sepi.lightfield import BoolMap, FloatArray

Place = tuple[slice, slice]
"""Rows and columns of a picture."""

Plane = FloatArray
"""``a, b, c`` of the disparity ``a + b x + c y``, shape (3,), pixels per view step; ``x`` and ``y`` as in
:func:`basis_of`."""


class Region(NamedTuple):
    """A set of pixels of a picture.

    Attributes
    ----------
    place : Place
        Rows and columns of the picture that contain it.
    pixels : ndarray, shape (h, w), bool
        Its pixels within these.
    """

    place: Place
    pixels: BoolMap

    @property
    def area(self) -> int:
        """Number of pixels."""
        return int(np.count_nonzero(self.pixels))

    @property
    def basis(self) -> FloatArray:
        """1, x and y of each pixel, from the middle of the place; shape (N, 3)."""
        return basis_of(self.pixels)


class Parts(NamedTuple):
    """The connected parts of a mask.

    Attributes
    ----------
    labels : ndarray, shape (H, W), int32
        Number of the part of each pixel, from 1; 0 outside.
    places : list of Place
        Bounding box of each part.
    areas : ndarray, shape (N,), int32
        Area of each part in pixels.
    """

    labels: npt.NDArray[np.int32]
    places: list[Place]
    areas: npt.NDArray[np.int32]


def parts_of(mask: BoolMap) -> Parts:
    """Parts of a mask (H, W) that are connected by sides of pixels."""
    # importing SciPy's function takes a quarter of a second
    _, labels, stats, _ = cv2.connectedComponentsWithStats(mask.astype(np.uint8), connectivity=4, ltype=cv2.CV_32S)
    places = [
        (slice(top, top + height), slice(left, left + width)) for left, top, width, height, _ in stats[1:].tolist()
    ]
    return Parts(np.asarray(labels, np.int32), places, np.asarray(stats[1:, cv2.CC_STAT_AREA], np.int32))


def widened(place: Place, margin: int) -> Place:
    """A place with ``margin`` more pixels on each side, within the picture."""
    rows, columns = (slice(max(side.start - margin, 0), side.stop + margin) for side in place)
    return rows, columns


def basis_of(pixels: BoolMap) -> FloatArray:
    """1, x and y of the pixels of a mask (h, w), from its middle; shape (N, 3)."""
    height, width = pixels.shape
    y, x = np.nonzero(pixels)
    return np.stack([np.ones(x.size), x - (width - 1) / 2, y - (height - 1) / 2], axis=1)
