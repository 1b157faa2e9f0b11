"""Named groups of arrays that the kernels of the decision beside depth steps take."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from sepi.lightfield import BoolMap, FloatMap


class RimViews(NamedTuple):
    """The compared views, and the occlusions in them.

    Attributes
    ----------
    lines : ndarray, shape (T, S, H, W C), uint8, uint16 or float32
        Rows of the pixels, their channels side by side.
    channels : int
        C, 1 or 3.
    units : ndarray, shape (N,), float32
        What the pixels of each view that is compared are multiplied with to be 0..1, and as bright as the reference.
    places : ndarray, shape (N, 2), int64
        Row and column in the grid of each view that is compared.
    baselines : ndarray, shape (N, 2), float64
        Theirs, down and across, in view steps.
    nearest : ndarray, shape (T, S, n, W), float32
        z-buffers of the map, its nearer surfaces widened by a pixel, so that no mixed pixel counts as background.
    low : int
        First row of ``nearest``.
    margin : float32
        By how much an occluder must be nearer, pixels per view step.
    """

    lines: npt.NDArray[Any]
    channels: int
    units: FloatMap
    places: npt.NDArray[np.int64]
    baselines: npt.NDArray[np.float64]
    nearest: FloatMap
    low: int
    margin: np.float32


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
