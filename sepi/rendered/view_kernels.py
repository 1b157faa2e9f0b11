"""Compiled loops over the views of a scene together: what one sees of another's points, by the exact disparity."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from sepi.compiled import njit, prange
from sepi.lightfield import BoolMap
from sepi.rendered.world import FloatArray


@njit(cache=True)
def _landing(
    y: int, x: int, disparity: float, baseline: npt.NDArray[np.float64], height: int, width: int
) -> tuple[bool, float, float, int, int]:
    """Where a view shows a pixel's point: whether inside, row and column, and the first of the four pixels round it."""
    row, column = y - disparity * baseline[0], x - disparity * baseline[1]
    inside = 0 <= row <= height - 1 and 0 <= column <= width - 1
    return inside, row, column, min(int(row), height - 2), min(int(column), width - 2)


@njit(cache=True, parallel=True)
def seen_elsewhere(
    disparities: FloatArray, baselines: npt.NDArray[np.float64], view: int, same: float
) -> tuple[npt.NDArray[np.bool_], npt.NDArray[np.bool_]]:
    """Whether some view that has the point in its picture does not see it, and whether some other view sees it.

    A point lands between four pixels of another view; where all of them are nearer, it is hidden.
    """
    count, height, width = disparities.shape
    hidden = np.zeros((height, width), np.bool_)
    seen = np.zeros((height, width), np.bool_)
    for y in prange(height):
        for x in range(width):
            own = disparities[view, y, x]
            for other in range(count):
                if other == view:
                    continue
                inside, _, _, top, left = _landing(y, x, own, baselines[other], height, width)
                if not inside:
                    continue
                there = min(
                    min(disparities[other, top, left], disparities[other, top, left + 1]),
                    min(disparities[other, top + 1, left], disparities[other, top + 1, left + 1]),
                )
                if there > own + same:
                    hidden[y, x] = True
                else:
                    seen[y, x] = True
    return hidden, seen


@njit(cache=True, parallel=True)
def gathered_light(
    light: FloatArray,
    disparities: FloatArray,
    things: npt.NDArray[np.int16],
    whole: BoolMap,
    baselines: npt.NDArray[np.float64],
    view: int,
    bend: float,
) -> tuple[FloatArray, FloatArray]:
    """Mean light of all views that show the surface whole, for whole pixels of one view; its own elsewhere.

    Second, the variance of that mean, of all colours' sum.
    """
    count, height, width = disparities.shape
    result = light[view].copy()
    variance = np.zeros((height, width), np.float32)
    for y in prange(height):
        # of each pixel of the row: views that count, sums of their colours, of the squares of what those sum to
        seen, squares = np.ones(width), np.zeros(width)
        total = light[view, y].astype(np.float64)
        for x in range(width):
            squares[x] = (total[x, 0] + total[x, 1] + total[x, 2]) ** 2
        # view by view: pixels beside each other lie beside each other in all of them
        for other in range(count):
            shown, depth = light[other], disparities[other]
            for x in range(width):
                own, thing = disparities[view, y, x], things[view, y, x]
                inside, row, column, i, j = _landing(y, x, own, baselines[other], height, width)
                if not inside or other == view or not whole[view, y, x]:
                    continue
                one = whole[other, i, j] and whole[other, i, j + 1]
                one &= whole[other, i + 1, j] and whole[other, i + 1, j + 1]
                one &= things[other, i, j] == thing and things[other, i, j + 1] == thing
                one &= things[other, i + 1, j] == thing and things[other, i + 1, j + 1] == thing
                down, across = row - i, column - j
                a, b, c, d = (1 - down) * (1 - across), (1 - down) * across, down * (1 - across), down * across
                there = a * depth[i, j] + b * depth[i, j + 1] + c * depth[i + 1, j] + d * depth[i + 1, j + 1]
                if not one or abs(there - own) > bend:
                    continue
                grey = 0.0
                for k in range(3):
                    part = a * shown[i, j, k] + b * shown[i, j + 1, k]
                    part += c * shown[i + 1, j, k] + d * shown[i + 1, j + 1, k]
                    total[x, k] += part
                    grey += part
                squares[x] += grey * grey
                seen[x] += 1
        for x in range(width):
            if seen[x] > 1:
                mean = (total[x, 0] + total[x, 1] + total[x, 2]) / seen[x]
                # equal ones may differ by rounding
                variance[y, x] = max(squares[x] / seen[x] - mean**2, 0.0) / (seen[x] - 1)
            for k in range(3):
                result[y, x, k] = total[x, k] / seen[x]
    return result, variance


@njit(cache=True, parallel=True)
def alike_light(
    light: FloatArray, variance: FloatArray, things: npt.NDArray[np.int16], whole: BoolMap, reach: int, doubt: float
) -> FloatArray:
    """Mean light of the pixels about each whole one that chance alone may tell from it: 3x3 pixels from 3x3."""
    height, width = whole.shape
    grey = light[..., 0] + light[..., 1] + light[..., 2]
    result = light.copy()
    for y in prange(height):
        for x in range(width):
            if not whole[y, x]:
                continue
            total = np.zeros(3)
            count = 0
            for v in range(max(y - reach, 0), min(y + reach + 1, height)):
                for u in range(max(x - reach, 0), min(x + reach + 1, width)):
                    if not whole[v, u] or things[v, u] != things[y, x]:
                        continue
                    apart, expected = 0.0, 0.0
                    # those of the 3x3 that both have within the picture
                    for i in range(-min(y, v, 1), min(height - y, height - v, 2)):
                        for j in range(-min(x, u, 1), min(width - x, width - u, 2)):
                            if whole[y + i, x + j] and whole[v + i, u + j]:
                                apart += (grey[y + i, x + j] - grey[v + i, u + j]) ** 2
                                expected += variance[y + i, x + j] + variance[v + i, u + j]
                    if apart <= doubt * expected:
                        count += 1
                        for c in range(3):
                            total[c] += light[v, u, c]
            for c in range(3):
                result[y, x, c] = total[c] / count
    return result


@njit(cache=True, parallel=True)
def limit_bent(shown: FloatArray, things: npt.NDArray[np.int16], whole: BoolMap, reach: int) -> FloatArray:
    """Keep pixels that are not whole, amid one thing, within the light of its whole ones beside them."""
    height, width = whole.shape
    result = shown.copy()
    for y in prange(height):
        for x in range(width):
            one = not whole[y, x]
            for i in range(max(y - 1, 0), min(y + 2, height)):
                for j in range(max(x - 1, 0), min(x + 2, width)):
                    one &= things[i, j] == things[y, x]
            if not one:
                continue
            for c in range(3):
                low, high = np.inf, 0.0
                for i in range(max(y - reach, 0), min(y + reach + 1, height)):
                    for j in range(max(x - reach, 0), min(x + reach + 1, width)):
                        if whole[i, j] and things[i, j] == things[y, x]:
                            low, high = min(low, shown[i, j, c]), max(high, shown[i, j, c])
                if low <= high:
                    result[y, x, c] = min(max(shown[y, x, c], low), high)
    return result
