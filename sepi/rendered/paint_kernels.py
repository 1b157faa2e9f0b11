"""Compiled loop over the rays of pixels: what is painted where they end."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from sepi.compiled import njit, prange
from sepi.rendered.world import FloatArray

_Doubles = npt.NDArray[np.float64]


@njit(cache=True, parallel=True)
def painted(
    faces: npt.NDArray[np.int32],
    pixels: npt.NDArray[np.int64],
    frame: _Doubles,
    corner: _Doubles,
    normal: _Doubles,
    uv: _Doubles,
    gradient: _Doubles,
    thing: npt.NDArray[np.int64],
    starts: npt.NDArray[np.int64],
    texels: FloatArray,
    fine: int,
) -> FloatArray:
    """Mean colour at the ends of ``fine`` by ``fine`` rays of each pixel on its triangle's plane, ``(N, 3)``."""
    count = len(faces)
    found = np.zeros((count, 3), np.float32)
    for n in prange(count):
        total = np.zeros(3)
        face = faces[n]
        one = thing[face]
        height, width = starts[one, 1], starts[one, 2]
        for i in range(fine):
            for j in range(fine):
                right = (pixels[n, 1] + (j + 0.5) / fine - frame[3]) / frame[4]
                down = (pixels[n, 0] + (i + 0.5) / fine - frame[2]) / frame[4]
                away = (
                    normal[face, 0] * (corner[face, 0] - frame[0])
                    + normal[face, 1] * (corner[face, 1] - frame[1])
                    + normal[face, 2] * corner[face, 2]
                ) / (normal[face, 0] * right + normal[face, 1] * down + normal[face, 2])
                x = frame[0] + away * right - corner[face, 0]
                y = frame[1] + away * down - corner[face, 1]
                z = away - corner[face, 2]
                across = uv[face, 0] + gradient[face, 0, 0] * x + gradient[face, 0, 1] * y + gradient[face, 0, 2] * z
                below = uv[face, 1] + gradient[face, 1, 0] * x + gradient[face, 1, 1] * y + gradient[face, 1, 2] * z
                column = int((across - np.floor(across)) * width) % width
                row = int((below - np.floor(below)) * height) % height
                for c in range(3):
                    total[c] += texels[starts[one, 0] + row * width + column, c]
        for c in range(3):
            found[n, c] = total[c] / (fine * fine)
    return found
