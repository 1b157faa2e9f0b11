"""Surfaces of the built-in scenes: planar patches with an outline and a texture.

Coordinates are those of the centre view, in fractions of the image: (0, 0) is the outer corner of the top left pixel,
(1, 1) that of the bottom right pixel. Shapes therefore scale with the image while disparities do not.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from sepi.lightfield import FloatMap

Outline = npt.NDArray[np.float64]
"""Corners ``(N, 2)`` of a closed polygon as (x, y)."""

Texture = FloatMap | Callable[[], FloatMap]
"""Periodic, one texel per pixel, shape (M, M, 3) in 0..1; or a function that makes it."""

# Corners of a circle: at 1024 pixels the polygon deviates by less than 0.1 pixels.
CIRCLE_CORNERS = 180


class Plane(NamedTuple):
    """Disparity ``at_centre + across * (x - 1/2) + down * (y - 1/2)`` in pixels per view step."""

    at_centre: float
    across: float = 0.0
    down: float = 0.0

    def at(self, x: float, y: float) -> float:
        """Disparity at a point of the image."""
        return self.at_centre + self.across * (x - 0.5) + self.down * (y - 0.5)


class Surface(NamedTuple):
    """A planar patch."""

    outlines: Sequence[Outline]
    """Points inside an odd number of outlines belong to the surface (a second outline cuts a hole)."""
    plane: Plane
    texture: Texture
    textureless: bool = False
    """Whether the texture has too little detail to estimate depth."""


def everywhere() -> Outline:
    """A rectangle far larger than the part visible in any view."""
    return rectangle(-3, -3, 4, 4)


def rectangle(left: float, top: float, right: float, bottom: float) -> Outline:
    """An upright rectangle."""
    return np.array([[left, top], [right, top], [right, bottom], [left, bottom]], float)


def polygon(*corners: tuple[float, float]) -> Outline:
    """A polygon through the given corners."""
    return np.array(corners, float)


def blob(x: float, y: float, radius: float, waves: Sequence[tuple[int, float, float]] = ()) -> Outline:
    """A circle with a radius that varies with the angle: waves of (periods, amplitude / radius, phase in radians)."""
    angle = 2 * np.pi * np.arange(CIRCLE_CORNERS) / CIRCLE_CORNERS
    r = radius * (1 + sum((a * np.cos(n * angle + phase) for n, a, phase in waves), np.zeros_like(angle)))
    return np.stack([x + r * np.cos(angle), y + r * np.sin(angle)], axis=1)


def thread(start: tuple[float, float], end: tuple[float, float], width: float) -> Outline:
    """A straight bar of the given width."""
    a, b = np.array(start), np.array(end)
    along = (b - a) / np.hypot(*(b - a))
    side = 0.5 * width * np.array([-along[1], along[0]])
    return np.stack([a + side, b + side, b - side, a - side])


def pyramid(base: Outline, apex: tuple[float, float], height: float, ground: Plane, texture: Texture) -> list[Surface]:
    """The faces of a pyramid on ``ground`` with its top at ``apex`` in the centre view.

    ``height`` is the disparity of the top relative to the ground; negative for a pyramid sunk into it.
    """
    faces = []
    for a, b in zip(base, np.roll(base, -1, axis=0), strict=True):
        corners = np.stack([a, b, np.array(apex)])
        disparity = [ground.at(*a), ground.at(*b), ground.at(*apex) + height]
        plane = Plane(*np.linalg.solve(np.column_stack([np.ones(3), corners - 0.5]), disparity).tolist())
        faces.append(Surface([corners], plane, texture))
    return faces
