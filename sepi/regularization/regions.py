"""Regions of a picture, each with x and y of its own."""

from __future__ import annotations

from typing import NamedTuple

import cv2
import numpy as np
import numpy.typing as npt

from sepi.lightfield import BoolMap

Place = tuple[slice, slice]
"""Rows and columns of a picture."""

Plane = npt.NDArray[np.float64]
"""``a, b, c`` of the disparity ``a + b x + c y``, shape (3,), pixels per view step; ``x`` and ``y`` as in
:func:`basis_of`."""


class Region(NamedTuple):
    """Pixels that belong together.

    Attributes
    ----------
    place : Place
        Rows and columns of the picture that hold it.
    pixels : ndarray, shape (h, w), bool
        Which of these it is.
    """

    place: Place
    pixels: BoolMap

    @property
    def area(self) -> int:
        """How many they are."""
        return int(np.count_nonzero(self.pixels))

    @property
    def basis(self) -> npt.NDArray[np.float64]:
        """1, x and y of its pixels, (N, 3), from the middle of its place."""
        return basis_of(self.pixels)


def seen_from(plane: Plane, one: Region, other: Region) -> Plane:
    """The plane of one region as that of the place of another one."""
    down, across = (
        there.start - here.start + (longer - length) / 2
        for here, length, there, longer in zip(
            one.place, one.pixels.shape, other.place, other.pixels.shape, strict=True
        )
    )
    return np.array([plane[0] + plane[1] * across + plane[2] * down, *plane[1:]])


class Parts(NamedTuple):
    """The connected parts of a mask.

    Attributes
    ----------
    labels : ndarray, shape (H, W), int32
        Number of the part that a pixel belongs to, from 1 on; 0 outside.
    places : list of Place
        The smallest that hold them.
    areas : ndarray, shape (N,), int32
        Pixels of each.
    """

    labels: npt.NDArray[np.int32]
    places: list[Place]
    areas: npt.NDArray[np.int32]


def parts_of(mask: BoolMap) -> Parts:
    """Parts that hang together by the sides of their pixels, of a mask (H, W)."""
    # SciPy's needs a quarter of a second to be imported
    _, labels, stats, _ = cv2.connectedComponentsWithStats(mask.astype(np.uint8), connectivity=4, ltype=cv2.CV_32S)
    places = [
        (slice(top, top + height), slice(left, left + width)) for left, top, width, height, _ in stats[1:].tolist()
    ]
    return Parts(np.asarray(labels, np.int32), places, np.asarray(stats[1:, cv2.CC_STAT_AREA], np.int32))


def widened(place: Place, margin: int) -> Place:
    """A place with ``margin`` pixels more on each side, as far as the picture goes."""
    rows, columns = (slice(max(side.start - margin, 0), side.stop + margin) for side in place)
    return rows, columns


def basis_of(pixels: BoolMap) -> npt.NDArray[np.float64]:
    """1, x and y of the pixels that are set in an array (h, w), from its middle; (N, 3)."""
    height, width = pixels.shape
    y, x = np.nonzero(pixels)
    return np.stack([np.ones(x.size), x - (width - 1) / 2, y - (height - 1) / 2], axis=1)
