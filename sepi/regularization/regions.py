"""Regions of a picture, each with its own x and y axes."""

from collections.abc import Sequence
from typing import NamedTuple

import cv2
import numpy as np
import numpy.typing as npt

from sepi.lightfield import BoolMap, FloatArray, FloatMap

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


THIN, ALONG = 6, 3.0
"""Width of something before a surface, pixels, on both sides of which the surface goes on; and along how much of the
smaller side, in sides of a square of its area."""


def together(parts: Parts, colours: FloatMap, most: FloatMap) -> list[list[int]]:
    """Parts behind something thin, such as a wire, by their numbers: of one colour on both sides of it.

    Parameters
    ----------
    parts : Parts
    colours : ndarray, shape (H, W, C), float32
    most : ndarray, shape (H, W), float32
        Squared difference of colours, summed over channels, up to which they count as one.

    Returns
    -------
    list of list of int
        Each part is in one of the lists.
    """
    reach = THIN + 1
    wide = np.pad(parts.labels, reach)
    y, x = np.nonzero(parts.labels)
    pairs, changes = [], []
    for down, across in ((0, reach), (reach, 0), (reach, reach), (reach, -reach)):
        here, there = parts.labels[y, x], wide[y + reach + down, x + reach + across]
        apart = (there > 0) & (here != there)
        v, u = y[apart], x[apart]
        pairs.append(np.sort([here[apart], there[apart]], axis=0))
        beyond = v + down, u + across
        # noise of both
        changes.append(((colours[v, u] - colours[beyond]) ** 2).sum(axis=-1) / (most[v, u] + most[beyond]))
    alike, where, number = np.unique(np.hstack(pairs), axis=1, return_inverse=True, return_counts=True)
    along = number >= ALONG * np.sqrt(np.append(0, parts.areas)[alike].min(axis=0))
    root = np.arange(len(parts.areas) + 1)
    for one, other in alike.T[along & (np.bincount(where.ravel(), np.hstack(changes)) < number)]:
        root[root == root[other]] = root[one]
    return [np.flatnonzero(root == one).tolist() for one in np.unique(root[1:])]


def around(places: Sequence[Place]) -> Place:
    """The least place that contains all of some."""
    rows, columns = (
        slice(min(one.start for one in sides), max(one.stop for one in sides)) for sides in zip(*places, strict=True)
    )
    return rows, columns


def widened(place: Place, margin: int) -> Place:
    """A place with ``margin`` more pixels on each side, within the picture."""
    rows, columns = (slice(max(side.start - margin, 0), side.stop + margin) for side in place)
    return rows, columns


def basis_of(pixels: BoolMap) -> FloatArray:
    """1, x and y of the pixels of a mask (h, w), from its middle; shape (N, 3)."""
    height, width = pixels.shape
    y, x = np.nonzero(pixels)
    return np.stack([np.ones(x.size), x - (width - 1) / 2, y - (height - 1) / 2], axis=1)
