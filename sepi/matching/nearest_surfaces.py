"""Occluders of reference pixels in the other views: nearer surfaces, and the end of what a view shows."""

from __future__ import annotations

import math
from typing import NamedTuple, Self

import cv2
import numpy as np
import numpy.typing as npt

from sepi.kernels import LANES
from sepi.kernels import visibility as kernels
from sepi.lightfield import BoolMap, FloatArray, FloatMap, LightField
from sepi.matching.row_bands import Rows

EMPTY: float = kernels.EMPTY
"""Disparity in a z-buffer where no pixel of the reference view falls: nothing is nearer."""

MISSING: float = kernels.MISSING
"""The same where the view shows nothing: not even a view that hides a pixel counts less."""


class SeenViews(NamedTuple):
    """Views that are compared, and what hides pixels of the reference view in them.

    Attributes
    ----------
    places : ndarray, shape (V, 2), int64
        Row and column of each view in the grid.
    baselines : ndarray, shape (V, 2), float64
        Theirs, down and across, in view steps.
    nearest : ndarray, shape (V, n, W), float32
        From :func:`nearest_surfaces`.
    low : int
        First row of ``nearest``.
    margin : float
        By how much an occluder must be nearer, pixels per view step.
    """

    places: npt.NDArray[np.int64]
    baselines: FloatArray
    nearest: FloatMap
    low: int
    margin: float

    @classmethod
    def of(cls, light_field: LightField, disparity: FloatMap, present: BoolMap, rows: Rows, margin: float) -> Self:
        """The views ``present`` (T, S), by a map of what may occlude something; rows of the splines or detail."""
        nearest = nearest_surfaces(light_field, disparity, present, rows)
        return cls(np.argwhere(present), light_field.baselines[present], nearest, rows.low, margin)


def nearest_surfaces(light_field: LightField, disparity: FloatMap | None, present: BoolMap, rows: Rows) -> FloatMap:
    """The nearest disparity at each position of the views; where a view shows nothing, nearer than everything.

    Parameters
    ----------
    light_field : LightField
    disparity : ndarray, shape (H, W), float32, or None
        Of the reference view, pixels per view step; None: no occlusion, except by missing pixels.
    present : ndarray, shape (T, S), bool
        The views that are wanted.
    rows : Rows
        Theirs that are wanted.

    Returns
    -------
    ndarray, shape (V, n, W), float32
        Of the views wanted, row by row of the grid: from :func:`z_buffers`, with ``MISSING`` at pixels that a view
        does not show, and beside them, since samples between pixels read them, too.
    """
    if disparity is None:
        nearest = _with_margin(int(present.sum()), rows.high - rows.low, light_field.shape[1])
        nearest[:] = EMPTY
    else:
        nearest = z_buffers(disparity, light_field.baselines[present], *rows)
    if light_field.missing is not None:
        for view, (t, s) in zip(nearest, np.argwhere(present), strict=True):
            beside = cv2.dilate(light_field.missing[t, s].astype(np.uint8), np.ones((3, 3), np.uint8)) > 0
            view[beside[rows.low : rows.high]] = MISSING
    return nearest


def z_buffers(disparity: FloatMap, baselines: npt.NDArray[np.float64], low: int, high: int) -> FloatMap:
    """Disparity map of the reference view as other views see it: the nearest of the pixels that touch a position.

    Parameters
    ----------
    disparity : ndarray, shape (H, W), float32
        Pixels per view step.
    baselines : ndarray, shape (V, 2), float64
        Of the views: down and across from the reference view, in view steps.
    low, high : int
        The rows of the views that are wanted.

    Returns
    -------
    ndarray, shape (V, high - low, W), float32
        ``EMPTY`` where no pixel falls. A pixel between positions occludes two along either axis, since a bilinear
        sample between them reads its colour, too; otherwise it occludes the one that it falls on. The map's border
        values continue beyond the border.
    """
    nearest = _with_margin(len(baselines), high - low, disparity.shape[1])
    kernels.z_buffers(np.ascontiguousarray(disparity), baselines, low, high, nearest)
    return nearest


def _with_margin(*shape: int) -> FloatMap:
    """An uninitialised array, with the numbers behind it that vector loads reach into."""
    return np.empty(math.prod(shape) + LANES, np.float32)[:-LANES].reshape(shape)


def shown_columns(light_field: LightField) -> npt.NDArray[np.int64]:
    """Columns that each row of the views shows: the longest run of them.

    Returns
    -------
    ndarray, shape (T, S, H, 2) or (T, S, 0, 2), int64
        The first, and the one after the last; empty where all views show everything.
    """
    if light_field.missing is None:
        return np.zeros((*light_field.grid, 0, 2), np.int64)
    columns = np.zeros((*light_field.missing.shape[:3], 2), np.int64)
    columns[..., 1] = light_field.shape[1]
    for place in np.argwhere(light_field.missing.any(axis=3)).tolist():
        edges = np.flatnonzero(np.diff(light_field.missing[tuple(place)], prepend=True, append=True))
        runs = edges.reshape(-1, 2)
        columns[tuple(place)] = runs[np.diff(runs).argmax()] if len(runs) else 0
    return columns
