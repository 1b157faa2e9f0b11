"""Compiled loops over triangles: which of them the rays of a view's pixels meet first."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from sepi.compiled import njit, prange

_Doubles = npt.NDArray[np.float64]

# rows of rays that are looked at together
_BAND = 32
# pixels: more than rounding moves a corner
_SLACK = 1e-4


@njit(cache=True)
def _extent(triangle: _Doubles, near: float) -> tuple[float, float, float, float]:
    """Least and greatest row and column, per depth, at which a triangle may be met beyond ``near``."""
    top, bottom, left, right = np.inf, -np.inf, np.inf, -np.inf
    for k in range(3):
        one, two = triangle[k], triangle[(k + 1) % 3]
        for end in range(2):
            # a corner before the camera, and where the side from it goes behind
            if end == 0 and one[2] >= near:
                x, y, z = one[0], one[1], one[2]
            elif end == 1 and (one[2] >= near) != (two[2] >= near):
                part = (near - one[2]) / (two[2] - one[2])
                x, y, z = one[0] + part * (two[0] - one[0]), one[1] + part * (two[1] - one[1]), near
            else:
                continue
            top, bottom = min(top, y / z), max(bottom, y / z)
            left, right = min(left, x / z), max(right, x / z)
    return top, bottom, left, right


@njit(cache=True)
def _middles(least: float, greatest: float, axis: float, focal: float, size: int) -> tuple[int, int]:
    """First and last of the pixels whose middles lie between; the first is the greater where none does."""
    first = np.ceil(min(max(focal * least + axis - 0.5 - _SLACK, 0.0), float(size)))
    last = np.floor(max(min(focal * greatest + axis - 0.5 + _SLACK, size - 1.0), -1.0))
    return int(first), int(last)


@njit(cache=True)
def _by_band(spans: npt.NDArray[np.int64], size: int) -> tuple[npt.NDArray[np.int64], npt.NDArray[np.int64]]:
    """The triangles of each band of rows one after the other, and where each band's begin."""
    bands = (size + _BAND - 1) // _BAND
    starts = np.zeros(bands + 1, np.int64)
    for n in range(len(spans)):
        if spans[n, 0] <= spans[n, 1] and spans[n, 2] <= spans[n, 3]:
            for band in range(spans[n, 0] // _BAND, spans[n, 1] // _BAND + 1):
                starts[band + 1] += 1
    starts = np.cumsum(starts)
    numbers, filled = np.empty(starts[-1], np.int64), starts.copy()
    for n in range(len(spans)):
        if spans[n, 0] <= spans[n, 1] and spans[n, 2] <= spans[n, 3]:
            for band in range(spans[n, 0] // _BAND, spans[n, 1] // _BAND + 1):
                numbers[filled[band]] = n
                filled[band] += 1
    return numbers, starts


@njit(cache=True, parallel=True)
def first_met(
    corners: _Doubles, origin: _Doubles, rotation: _Doubles, frame: _Doubles, size: int, near: float
) -> npt.NDArray[np.int32]:
    """Which triangle the ray through the middle of each pixel meets first, ``(size, size)``; 0 for none.

    Triangles are ``(N, 3, 3)``, the first one is nobody's; ``origin`` is where the camera is, ``rotation`` carries its
    directions (right, down, away) into the world, ``frame`` is its focal length in pixels and the row and column of its
    axis. No ray slips through where triangles meet in a side: both compute the same number for it.
    """
    count = len(corners)
    focal, middle_row, middle_column = frame
    triangles, spans = np.empty((count, 3, 3)), np.empty((count, 4), np.int64)
    for n in prange(count):
        for k in range(3):
            for i in range(3):
                total = 0.0
                for j in range(3):
                    total += (corners[n, k, j] - origin[j]) * rotation[j, i]
                triangles[n, k, i] = total
        top, bottom, left, right = _extent(triangles[n], near)
        spans[n, 0], spans[n, 1], spans[n, 2], spans[n, 3] = 0, -1, 0, -1
        if n > 0 and top <= bottom:
            spans[n, 0], spans[n, 1] = _middles(top, bottom, middle_row, focal, size)
            spans[n, 2], spans[n, 3] = _middles(left, right, middle_column, focal, size)
    numbers, starts = _by_band(spans, size)
    across = (np.arange(size) + 0.5 - middle_column) / focal
    found = np.zeros((size, size), np.int32)
    for band in prange(len(starts) - 1):
        first, last = band * _BAND, min((band + 1) * _BAND, size) - 1
        depth = np.full((last - first + 1, size), np.inf)
        for number in range(starts[band], starts[band + 1]):
            n = numbers[number]
            a, b, c = triangles[n, 0], triangles[n, 1], triangles[n, 2]
            # of each side the normal of the plane through it and the camera
            ax, ay, az = b[1] * c[2] - b[2] * c[1], b[2] * c[0] - b[0] * c[2], b[0] * c[1] - b[1] * c[0]
            bx, by, bz = c[1] * a[2] - c[2] * a[1], c[2] * a[0] - c[0] * a[2], c[0] * a[1] - c[1] * a[0]
            cx, cy, cz = a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]
            volume = a[0] * ax + a[1] * ay + a[2] * az
            for row in range(max(spans[n, 0], first), min(spans[n, 1], last) + 1):
                y = (row + 0.5 - middle_row) / focal
                af, bf, cf = ay * y + az, by * y + bz, cy * y + cz
                for column in range(spans[n, 2], spans[n, 3] + 1):
                    x = across[column]
                    u, v, w = ax * x + af, bx * x + bf, cx * x + cf
                    if (u >= 0 and v >= 0 and w >= 0) or (u <= 0 and v <= 0 and w <= 0):
                        total = u + v + w
                        if total != 0:
                            away = volume / total
                            if near < away < depth[row - first, column]:
                                depth[row - first, column] = away
                                found[row, column] = n
    return found
