"""A disparity map, or values of its pixels, as another view sees its surfaces; the nearest surface wins."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from sepi.kernels import all_views as kernels
from sepi.lightfield import BoolMap, FloatMap

TOLERANCE: float = kernels.TOLERANCE
"""Disparities that differ by no more are of one surface, pixels per view step."""


def carried_map(disparity: FloatMap, baseline: tuple[float, float], known: BoolMap | None = None) -> FloatMap:
    """A disparity map as another view sees its surfaces.

    Parameters
    ----------
    disparity : ndarray, shape (H, W), float32
        Pixels per view step.
    baseline : (float, float)
        From the map's view to the other, down and across, in view steps.
    known : ndarray, shape (H, W), bool, optional
        Pixels that count, whose disparity is finite; all unless given.

    Returns
    -------
    ndarray, shape (H, W), float32
        NaN where the other view sees no surface of the map.
    """
    return _carried(disparity, baseline, known)[0]


def carried_values(
    disparity: FloatMap, values: FloatMap, baseline: tuple[float, float], known: BoolMap | None = None
) -> FloatMap:
    """Values of a map's pixels as another view sees its surfaces; arguments as :func:`carried_map`.

    Parameters
    ----------
    values : ndarray, shape (H, W), float32
        Of each pixel of the map.

    Returns
    -------
    ndarray, shape (H, W), float32
        NaN where the other view sees no surface of the map.
    """
    origin = _carried(disparity, baseline, known)[1]
    return np.where(origin >= 0, values.ravel()[origin], np.float32(np.nan))


def corner_disparities(disparity: FloatMap) -> FloatMap:
    """Disparity at the corners of each pixel: what the pixels that meet there, and belong together, agree on.

    Parameters
    ----------
    disparity : ndarray, shape (H, W), float32
        Pixels per view step; H and W at least 2.

    Returns
    -------
    ndarray, shape (H, W, 4), float32
        Top left, top right, bottom right, bottom left.
    """
    corners = np.empty((*disparity.shape, 4), np.float32)
    kernels.corner_disparities(np.ascontiguousarray(disparity, np.float32), corners)
    return corners


def _carried(
    disparity: FloatMap, baseline: tuple[float, float], known: BoolMap | None
) -> tuple[FloatMap, npt.NDArray[np.int32]]:
    """The map that :func:`carried_map` gives, and the number of the pixel that is seen, -1 where none is."""
    nearest, origin = np.empty(disparity.shape, np.float32), np.empty(disparity.shape, np.int32)
    if known is not None:
        # compiled code knows no NaN; behind all else, what is unknown hides nothing
        disparity = np.where(known, disparity, disparity[known].min(initial=0) - np.float32(1))
    disparity = np.ascontiguousarray(disparity, np.float32)
    kernels.carry(disparity, corner_disparities(disparity), *baseline, nearest, origin)
    if known is not None:
        origin[~known.ravel()[origin]] = -1
    nearest[origin < 0] = np.nan
    # surfaces go on to the border of their last pixel, but no surface is farther or nearer than the map has one
    seen = disparity if known is None else disparity[known]
    return (np.clip(nearest, seen.min(), seen.max()) if seen.size else nearest), origin
