"""The reference view's disparity map as other views see it.

A pixel of disparity ``d`` goes to the pixel nearest to ``(y, x) - d * baseline``; where several meet, the nearest
surface is seen. What no pixel reaches is not known: the reference view did not see it, or the surface is stretched
there. A single pixel between two of a much nearer surface is what lies behind, seen through such a crack, and is not
known either.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from sepi.lightfield import BoolMap, FloatMap

# surfaces apart by more than this many pixels between the two views are different ones
_APART = 1.0


def carried_disparity(disparity: FloatMap, known: BoolMap, baseline: npt.NDArray[np.float64]) -> FloatMap:
    """Disparity of another view, shape (H, W), float32; NaN where it is not known.

    Parameters
    ----------
    disparity : ndarray, shape (H, W), float32
        Of the reference view, pixels per view step.
    known : ndarray, shape (H, W), bool
        Pixels that count; their disparity is finite.
    baseline : ndarray, shape (2,), float64
        ``(down, across)`` from the reference view to the other, in view steps.
    """
    height, width = disparity.shape
    rows, columns, inside = landing(disparity, known, baseline)
    nearest = np.full(height * width, -np.inf, np.float32)
    np.maximum.at(nearest, rows[inside] * width + columns[inside], disparity[known][inside])
    carried = nearest.reshape(height, width)
    if baseline.any():
        carried[_cracks(carried, _APART / float(np.abs(baseline).max()))] = -np.inf
    return np.where(np.isfinite(carried), carried, np.float32(np.nan))


def landing(
    disparity: FloatMap, known: BoolMap, baseline: npt.NDArray[np.float64]
) -> tuple[npt.NDArray[np.int64], npt.NDArray[np.int64], BoolMap]:
    """Row and column, in another view, of each known pixel of the reference view, and whether it lies inside; (P,)."""
    height, width = disparity.shape
    y, x = np.nonzero(known)
    values = disparity[known].astype(np.float64)
    there_y, there_x = y - values * baseline[0], x - values * baseline[1]
    inside = (there_y > -0.5) & (there_y < height - 0.5) & (there_x > -0.5) & (there_x < width - 0.5)
    # of what lies outside no whole number need exist
    rows, columns = (np.rint(np.where(inside, there, 0)).astype(np.int64) for there in (there_y, there_x))
    return rows, columns, inside


def seen(
    carried: FloatMap, disparity: FloatMap, known: BoolMap, baseline: npt.NDArray[np.float64]
) -> npt.NDArray[np.bool_]:
    """Which of the known pixels another view sees, (P,): those that it holds and that nothing nearer hides.

    Parameters
    ----------
    carried : ndarray, shape (H, W), float32
        What :func:`carried_disparity` gave for this view.
    disparity, known, baseline
        As there; ``known`` may be a part of what was.
    """
    rows, columns, inside = landing(disparity, known, baseline)
    reach = float(np.abs(baseline).max())
    # comparison with NaN is false: where nothing is known, nothing is seen
    return inside & ((carried[rows, columns] - disparity[known]) * reach <= _APART)


def _cracks(carried: FloatMap, apart: float) -> BoolMap:
    """Pixels whose two neighbours in a row or a column are both nearer, by more than ``apart`` pixels per view step."""
    # minus infinity at the border and where nothing is: never nearer
    framed = np.pad(carried, 1, constant_values=-np.inf)
    behind = carried + np.float32(apart)
    across = np.minimum(framed[1:-1, :-2], framed[1:-1, 2:]) > behind
    down = np.minimum(framed[:-2, 1:-1], framed[2:, 1:-1]) > behind
    return np.asarray((across | down) & np.isfinite(carried), bool)
