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
        face = faces[n]
        one = thing[face]
        start, height, width = starts[one]
        if height * width == 1:
            found[n] = texels[start]
            continue
        a, b, c = normal[face]
        left, top, near = corner[face, 0] - frame[0], corner[face, 1] - frame[1], corner[face, 2]
        volume = a * left + b * top + c * near
        ux, uy, uz = gradient[face, 0]
        vx, vy, vz = gradient[face, 1]
        u, v = uv[face]
        red, green, blue = 0.0, 0.0, 0.0
        for i in range(fine):
            down = (pixels[n, 0] + (i + 0.5) / fine - frame[2]) / frame[4]
            for j in range(fine):
                right = (pixels[n, 1] + (j + 0.5) / fine - frame[3]) / frame[4]
                away = volume / (a * right + b * down + c)
                x, y, z = away * right - left, away * down - top, away - near
                across, below = u + ux * x + uy * y + uz * z, v + vx * x + vy * y + vz * z
                # what is left of a whole one may round to one
                column = min(int((across - np.floor(across)) * width), width - 1)
                row = min(int((below - np.floor(below)) * height), height - 1)
                texel = start + row * width + column
                red += texels[texel, 0]
                green += texels[texel, 1]
                blue += texels[texel, 2]
        found[n, 0], found[n, 1], found[n, 2] = red / fine**2, green / fine**2, blue / fine**2
    return found
