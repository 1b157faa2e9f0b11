"""A disparity map, or values of its pixels, warped to another view as surfaces; the nearest surface wins."""

import numpy as np
import numpy.typing as npt

from sepi.kernels import carried_map as kernels
from sepi.lightfield import BoolMap, FloatMap

TOLERANCE: float = kernels.TOLERANCE
"""Largest difference of neighbours on one surface, pixels per view step."""


def carried_map(disparity: FloatMap, baseline: tuple[float, float], known: BoolMap | None = None) -> FloatMap:
    """A disparity map warped to another view.

    Parameters
    ----------
    disparity : ndarray, shape (H, W), float32
        Pixels per view step.
    baseline : (float, float)
        From the map's view to the other, down and across, in view steps.
    known : ndarray, shape (H, W), bool, optional
        Pixels that count, whose disparity is finite; default: all.

    Returns
    -------
    ndarray, shape (H, W), float32
        NaN where the other view sees no surface of the map.
    """
    return _carried(disparity, baseline, known)[0]


def carried_values(
    disparity: FloatMap, values: FloatMap, baseline: tuple[float, float], known: BoolMap | None = None
) -> FloatMap:
    """Values of a map's pixels warped to another view; other arguments are those of :func:`carried_map`.

    Parameters
    ----------
    values : ndarray, shape (H, W), float32
        Value of each pixel of the map.

    Returns
    -------
    ndarray, shape (H, W), float32
        NaN where the other view sees no surface of the map.
    """
    origin = _carried(disparity, baseline, known)[1]
    return np.where(origin >= 0, values.ravel()[origin], np.float32(np.nan))


def corner_disparities(disparity: FloatMap) -> FloatMap:
    """Disparity at the corners of each pixel, averaged over the pixels of one surface that meet there.

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
    """The map of :func:`carried_map`, and the number of the pixel that is seen, or -1."""
    nearest, origin = np.empty(disparity.shape, np.float32), np.empty(disparity.shape, np.int32)
    if known is not None:
        # kernels take no NaN; unknown pixels lie behind all others, and occlude nothing
        disparity = np.where(known, disparity, disparity[known].min(initial=0) - np.float32(1))
    disparity = np.ascontiguousarray(disparity, np.float32)
    kernels.carry(disparity, corner_disparities(disparity), *baseline, nearest, origin)
    if known is not None:
        origin[~known.ravel()[origin]] = -1
    nearest[origin < 0] = np.nan
    # surfaces reach the border of their last pixel, within the map's range of disparities
    seen = disparity if known is None else disparity[known]
    return (np.clip(nearest, seen.min(), seen.max()) if seen.size else nearest), origin
