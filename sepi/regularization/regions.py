"""Regions of a picture, each with x and y of its own."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from sepi.lightfield import BoolMap

Plane = npt.NDArray[np.float64]
"""``a, b, c`` of the disparity ``a + b x + c y``, shape (3,), pixels per view step; ``x`` and ``y`` as in
:func:`basis_of`."""


class Region(NamedTuple):
    """Pixels that belong together.

    Attributes
    ----------
    place : tuple of slice
        Rows and columns of the picture that hold it.
    pixels : ndarray, shape (h, w), bool
        Which of these it is.
    """

    place: tuple[slice, slice]
    pixels: BoolMap

    @property
    def area(self) -> int:
        """How many they are."""
        return int(np.count_nonzero(self.pixels))

    @property
    def basis(self) -> npt.NDArray[np.float64]:
        """1, x and y of its pixels, (N, 3), from the middle of its place."""
        return basis_of(self.pixels)


def basis_of(pixels: BoolMap) -> npt.NDArray[np.float64]:
    """1, x and y of the pixels that are set in an array (h, w), from its middle; (N, 3)."""
    height, width = pixels.shape
    y, x = np.nonzero(pixels)
    return np.stack([np.ones(x.size), x - (width - 1) / 2, y - (height - 1) / 2], axis=1)
