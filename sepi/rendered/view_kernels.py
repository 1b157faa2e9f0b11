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
def farthest_of_four(disparities: FloatArray) -> FloatArray:
    """Least disparity of each pixel and those right of it, below it, and both, ``(N, H, W)``; of the last ones 0."""
    count, height, width = disparities.shape
    found = np.zeros_like(disparities)
    for row in prange(count * (height - 1)):
        n, y = row // (height - 1), row % (height - 1)
        for x in range(width - 1):
            above = min(disparities[n, y, x], disparities[n, y, x + 1])
            found[n, y, x] = min(above, min(disparities[n, y + 1, x], disparities[n, y + 1, x + 1]))
    return found


@njit(cache=True, parallel=True)
def seen_elsewhere(
    own: FloatArray, farthest: FloatArray, baselines: npt.NDArray[np.float64], view: int, same: float
) -> tuple[npt.NDArray[np.bool_], npt.NDArray[np.bool_]]:
    """Whether some view that has the point in its picture does not see it, and whether some other view sees it.

    A point lands between four pixels of another view (:func:`farthest_of_four`); where all are nearer, it is hidden.
    """
    height, width = own.shape
    hidden = np.zeros((height, width), np.bool_)
    seen = np.zeros((height, width), np.bool_)
    for y in prange(height):
        # view by view: pixels beside each other lie beside each other in all of them
        for other in range(len(farthest)):
            if other == view:
                continue
            there = farthest[other]
            for x in range(width):
                inside, _, _, top, left = _landing(y, x, own[y, x], baselines[other], height, width)
                if inside:
                    behind = there[top, left] > own[y, x] + same
                    hidden[y, x] |= behind
                    seen[y, x] |= not behind
    return hidden, seen


@njit(cache=True, parallel=True)
def one_of_four(surface: npt.NDArray[np.int16]) -> npt.NDArray[np.int16]:
    """Which one each pixel and those right of it, below it, and both show, ``(N, H, W)``; -2 where they differ."""
    count, height, width = surface.shape
    found = np.full(surface.shape, -2, np.int16)
    for row in prange(count * (height - 1)):
        n, y = row // (height - 1), row % (height - 1)
        for x in range(width - 1):
            one = surface[n, y, x]
            if surface[n, y, x + 1] == one and surface[n, y + 1, x] == one and surface[n, y + 1, x + 1] == one:
                found[n, y, x] = one
    return found


@njit(cache=True, parallel=True)
def gathered_light(
    light: FloatArray,
    disparities: FloatArray,
    surface: npt.NDArray[np.int16],
    around: npt.NDArray[np.int16],
    baselines: npt.NDArray[np.float64],
    view: int,
    bend: float,
) -> tuple[FloatArray, FloatArray]:
    """Mean light of all views that show the surface whole, for whole pixels of one view; its own elsewhere.

    ``surface`` is which thing the pixels of the view show whole, ``(H, W)``, -1 for none; ``around`` that of each four
    of all views (:func:`one_of_four`). Second, the variance of that mean, of all colours' sum.
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
            shown, depth, one = light[other], disparities[other], around[other]
            for x in range(width):
                own, thing = disparities[view, y, x], surface[y, x]
                inside, row, column, i, j = _landing(y, x, own, baselines[other], height, width)
                if not inside or other == view or thing < 0 or one[i, j] != thing:
                    continue
                down, across = np.float32(row - i), np.float32(column - j)
                up, left = np.float32(1) - down, np.float32(1) - across
                a, b, c, d = up * left, up * across, down * left, down * across
                there = a * depth[i, j] + b * depth[i, j + 1] + c * depth[i + 1, j] + d * depth[i + 1, j + 1]
                if abs(there - own) > bend:
                    continue
                grey = np.float32(0)
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
    light: FloatArray, variance: FloatArray, surface: npt.NDArray[np.int16], reach: int, doubt: float
) -> FloatArray:
    """Mean light of the pixels about each whole one that chance alone may tell from it: 3x3 pixels from 3x3.

    ``surface`` is which thing pixels show whole, -1 for none.
    """
    height, width = surface.shape
    grey = light[..., 0] + light[..., 1] + light[..., 2]
    counts = (surface >= 0).astype(np.float32)
    colours = np.empty((3, height, width), np.float32)
    for c in range(3):
        colours[c] = light[..., c]
    result = light.copy()
    for y in prange(height):
        number, total = np.zeros(width, np.float32), np.zeros((3, width), np.float32)
        # with a pixel of nothing at either end
        apart, expected = np.empty(width + 2, np.float32), np.empty(width + 2, np.float32)
        for v in range(max(y - reach, 0), min(y + reach + 1, height)):
            for across in range(max(-reach, 1 - width), min(reach, width - 1) + 1):
                # of a row shifted against the other, the pixels that both have
                first, there, length = max(0, -across), max(0, across), width - abs(across)
                apart[: length + 2], expected[: length + 2] = 0, 0
                # those of the three rows that both have within the picture
                for i in range(-min(y, v, 1), min(height - y, height - v, 2)):
                    one, other = grey[y + i, first : first + length], grey[v + i, there : there + length]
                    chance, doubted = variance[y + i, first : first + length], variance[v + i, there : there + length]
                    here, beyond = counts[y + i, first : first + length], counts[v + i, there : there + length]
                    for x in range(length):
                        both = here[x] * beyond[x]
                        apart[x + 1] += both * (one[x] - other[x]) ** 2
                        expected[x + 1] += both * (chance[x] + doubted[x])
                same, asked = surface[y, first : first + length], surface[v, there : there + length]
                for x in range(length):
                    difference = apart[x] + apart[x + 1] + apart[x + 2]
                    if difference <= doubt * (expected[x] + expected[x + 1] + expected[x + 2]) and same[x] == asked[x]:
                        number[first + x] += 1
                        for c in range(3):
                            total[c, first + x] += colours[c, v, there + x]
        for x in range(width):
            if surface[y, x] >= 0:
                for c in range(3):
                    result[y, x, c] = total[c, x] / number[x]
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
