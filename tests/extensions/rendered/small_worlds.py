"""Small worlds whose truth is known by formula, and what they are rendered with."""

import numpy as np

from sepi.extensions.rendered import shapes
from sepi.extensions.rendered.patterns import noise
from sepi.extensions.rendered.rendering import RenderOptions
from sepi.extensions.rendered.world import Cameras, Lamp, Light, Material, Thing, World

WALL, FLOOR = 3.0, 0.6
RED = Material((0.6, 0.2, 0.2))
# no finer than ten pixels, so that it can be interpolated
PAINT = noise(1, (0.5, 0.45, 0.4), 0.12, 2.4, (80, 256))


def taking(size: int = 64, views: int = 3, samples: int = 4, **values: object) -> RenderOptions:
    return RenderOptions.model_validate({"size": size, "grid": (views, views), "samples": samples, **values})


CAMERAS = Cameras(1.2, WALL, 2.0, -1.5)
EVEN = Light((1.0, 1.0, 1.0), exposure=0.7, depth=8)


def room(*things: Thing, light: Light = EVEN) -> World:
    """A wall at ``WALL`` and a floor ``FLOOR`` below the camera, and things before them, under an even sky."""
    wall = Thing(shapes.rectangle((-4, -4, WALL), (8, 0, 0), (0, 8, 0)), Material(PAINT))
    floor = Thing(shapes.rectangle((-4, FLOOR, 0.3), (8, 0, 0), (0, 0, 3)), Material(PAINT))
    return World([wall, floor, *things], CAMERAS, light)


def bar(depth: float = 1.5, width: float = 0.1, material: Material = RED) -> Thing:
    """An upright bar in the middle, facing the camera."""
    return Thing(shapes.rectangle((-width / 2, -2, depth), (width, 0, 0), (0, 4, 0)), material, thin=True)


def lamp_above() -> Lamp:
    """Shines down."""
    return Lamp((-1, -2, 1), (0, 0, 1), (2, 0, 0), (6.0, 6.0, 6.0))


def ball(x: float, material: Material, y: float = 0.3, radius: float = 0.2) -> Thing:
    return Thing(shapes.ball((x, y, 1.9), radius, fineness=48), material)


def depth_of_room(size: int, focal_px: float) -> np.ndarray:
    """Depth of the wall and the floor in the reference view, by formula."""
    down = (np.arange(size) + 0.5 - size / 2) / focal_px
    floor = np.where(down > 0, FLOOR / np.where(down > 0, down, 1), np.inf)
    return np.repeat(np.minimum(floor, WALL)[:, None], size, axis=1)
