"""Light on matte surfaces, gathered by all views together: a path tracer's noise without its paths.

A matte surface sends the same light to all views. What a pixel shows of it, divided by what is painted there, is the
light that falls on it; where several views see the same point by the exact disparity, the mean of theirs takes the
place of each: with 81 views a ninth of the noise, and one light for all of them. Pixels in which surfaces mix keep
their own, within that of the surfaces beside them. Gloss, mirrors and glass send each view something else, and keep
what paths brought.
"""

from __future__ import annotations

import numba
import numpy as np
import numpy.typing as npt

from sepi.lightfield import BoolMap
from sepi.rendered.world import FloatArray

# pixels per view step: how far a surface may bend from pixel to pixel to be one, and its disparities be apart
_BEND = 0.02
# linear; on what is darker there is no telling the light
_DARKEST = 1e-3
# half width in pixels of the window in which mixed pixels look for surfaces
_BESIDE = 2


def with_shared_light(
    pictures: FloatArray,
    paint: FloatArray,
    disparities: FloatArray,
    things: npt.NDArray[np.int16],
    matte: BoolMap,
    positions: npt.NDArray[np.float64],
) -> FloatArray:
    """The pictures of all views with the light of matte surfaces from all of them.

    Parameters
    ----------
    pictures : ndarray, shape (N, H, W, 3), float32
        Linear, path-traced.
    paint : ndarray, shape (N, H, W, 3), float32
        What is painted on matte surfaces, by the same rays.
    disparities : ndarray, shape (N, H, W), float32
        In pixels per view step.
    things : ndarray, shape (N, H, W), int16
        What each pixel shows.
    matte : ndarray, shape (N, H, W), bool
        Whether that is matte.
    positions : ndarray, shape (N, 2), float64
        Where the views stand, in view steps: down, across.

    Returns
    -------
    ndarray, shape (N, H, W, 3), float32
    """
    known = matte & (paint.min(axis=-1) > _DARKEST)
    light = (pictures / np.where(known[..., None], paint, 1)).astype(np.float32)
    whole = known & _whole(disparities, things)
    gathered = np.empty_like(light)
    for view in range(len(pictures)):
        gathered[view] = _gathered(light, disparities, things, whole, positions - positions[view], view)
    for view in range(len(pictures)):
        _limit_mixed(gathered[view], light[view], whole[view], known[view])
    shown: FloatArray = np.where(known[..., None], gathered * paint, pictures)
    return shown


def _whole(disparities: FloatArray, things: npt.NDArray[np.int16]) -> BoolMap:
    """Pixels that show one surface, and whose neighbours do."""
    whole = np.zeros(things.shape, bool)
    middle = (slice(None), slice(1, -1), slice(1, -1))
    whole[middle] = True
    height, width = things.shape[1:]
    for down, across in ((0, 1), (1, 0), (1, 1), (1, -1)):
        before = (slice(None), slice(1 - down, height - 1 - down), slice(1 - across, width - 1 - across))
        after = (slice(None), slice(1 + down, height - 1 + down), slice(1 + across, width - 1 + across))
        bend = np.abs(disparities[before] - 2 * disparities[middle] + disparities[after])
        same = (things[before] == things[middle]) & (things[after] == things[middle])
        whole[middle] &= same & (bend < _BEND)
    return whole


@numba.njit(cache=True, parallel=True)
def _gathered(
    light: FloatArray,
    disparities: FloatArray,
    things: npt.NDArray[np.int16],
    whole: BoolMap,
    baselines: npt.NDArray[np.float64],
    view: int,
) -> FloatArray:
    """Mean light of all views that show the surface whole, for whole pixels of one view; its own elsewhere."""
    count, height, width = disparities.shape
    result = light[view].copy()
    for y in numba.prange(height):
        for x in range(width):
            if not whole[view, y, x]:
                continue
            own = disparities[view, y, x]
            total = light[view, y, x].astype(np.float64)
            seen = 1
            for other in range(count):
                if other == view:
                    continue
                row, column = y - own * baselines[other, 0], x - own * baselines[other, 1]
                if not (0 <= row <= height - 1 and 0 <= column <= width - 1):
                    continue
                top, left = min(int(row), height - 2), min(int(column), width - 2)
                down, across = row - top, column - left
                same = True
                there = 0.0
                for i in range(2):
                    for j in range(2):
                        weight = (down if i else 1 - down) * (across if j else 1 - across)
                        there += weight * disparities[other, top + i, left + j]
                        same &= whole[other, top + i, left + j]
                        same &= things[other, top + i, left + j] == things[view, y, x]
                if not same or abs(there - own) > _BEND:
                    continue
                seen += 1
                for c in range(3):
                    for i in range(2):
                        for j in range(2):
                            weight = (down if i else 1 - down) * (across if j else 1 - across)
                            total[c] += weight * light[other, top + i, left + j, c]
            for c in range(3):
                result[y, x, c] = total[c] / seen
    gathered: FloatArray = result
    return gathered


@numba.njit(cache=True)
def _limit_mixed(gathered: FloatArray, light: FloatArray, whole: BoolMap, known: BoolMap) -> None:
    """Keep the light of pixels in which surfaces mix within that of whole ones beside them, if all there are matte."""
    height, width = whole.shape
    for y in range(height):
        for x in range(width):
            if whole[y, x] or not known[y, x]:
                continue
            rows = range(max(y - _BESIDE, 0), min(y + _BESIDE + 1, height))
            columns = range(max(x - _BESIDE, 0), min(x + _BESIDE + 1, width))
            usable = True
            for i in range(max(y - 1, 0), min(y + 2, height)):
                for j in range(max(x - 1, 0), min(x + 2, width)):
                    usable &= known[i, j]
            for c in range(3):
                low, high = np.inf, -np.inf
                for i in rows:
                    for j in columns:
                        if whole[i, j]:
                            low, high = min(low, gathered[i, j, c]), max(high, gathered[i, j, c])
                if usable and low <= high:
                    gathered[y, x, c] = min(max(light[y, x, c], low), high)
