"""What hides a pixel of the reference view in the others: a nearer surface, or the end of what a view shows."""

from __future__ import annotations

import math

import cv2
import numpy as np
import numpy.typing as npt

from sepi.lightfield import BoolMap, FloatMap, LightField
from sepi.matching.row_bands import Rows


def nearest_surfaces(light_field: LightField, disparity: FloatMap | None, present: BoolMap, rows: Rows) -> FloatMap:
    """The nearest disparity at each position of the views; where a view shows nothing, nearer than everything.

    Parameters
    ----------
    light_field : LightField
    disparity : ndarray, shape (H, W), float32, or None
        Of the reference view, pixels per view step; None: nothing hides anything, but for missing pixels.
    present : ndarray, shape (T, S), bool
        The views that are wanted.
    rows : Rows
        Theirs that are wanted.

    Returns
    -------
    ndarray, shape (T, S, n, W), float32
        From :func:`sepi.matching.visibility_kernels.z_buffers`, with ``MISSING`` at pixels that a view does not show,
        and beside them, since a sample that lies between pixels reads them, too.
    """
    from sepi.matching.visibility_kernels import EMPTY, MARGIN, MISSING, z_buffers

    if disparity is None:
        shape = *light_field.grid, rows.high - rows.low, light_field.shape[1]
        nearest = np.full(math.prod(shape) + MARGIN, EMPTY, np.float32)[:-MARGIN].reshape(shape)
    else:
        nearest = z_buffers(disparity, present, light_field.baselines, *rows)
    if light_field.missing is not None:
        for t, s in np.argwhere(present & light_field.missing.any(axis=(2, 3))).tolist():
            beside = cv2.dilate(light_field.missing[t, s].astype(np.uint8), np.ones((3, 3), np.uint8)) > 0
            nearest[t, s][beside[rows.low : rows.high]] = MISSING
    return np.asarray(nearest)


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
