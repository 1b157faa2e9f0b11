"""The built-in scenes: their surfaces, and the difficulty that each one poses.

Lengths are fractions of the image size, disparities are pixels per view step.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from sepi.scenes import textures
from sepi.scenes.surfaces import Plane, Surface, blob, everywhere, polygon, pyramid, rectangle, thread

# textures are made only for drawing; the surfaces' positions do not depend on them
noise, photograph, shading = (textures.later(make) for make in (textures.noise, textures.photograph, textures.shading))


class Scene(NamedTuple):
    """A built-in scene."""

    description: str
    surfaces: Callable[[], list[Surface]]
    pixel_noise: tuple[float, float] = (0.0, 0.0)
    """Noise standard deviation at the left and the right edge of each view, full range = 1."""


def _fine_structures() -> list[Surface]:
    ground = Surface([everywhere()], Plane(-0.8, across=0.6), photograph("gravel", (1.05, 1.0, 0.9), seed=3))
    front = Plane(0.9, down=-0.4)
    paint, cord = noise(4, (0.62, 0.4, 0.3), 0.13, coarsest=24), noise(5, (0.85, 0.83, 0.75), 0.08)
    # equal bars, each gap wider than the one before
    bars, left, gap = [], 0.06, 0.008
    while left < 0.94:
        bars.append(rectangle(left, 0.07, left + 0.014, 0.42))
        left, gap = left + 0.014 + gap, 1.3 * gap
    # teeth that taper to a point: the gap between two of them grows all the way down
    teeth = [polygon((x, 0.5), (x + 0.075, 0.5), (x + 0.0375, 0.94)) for x in np.arange(0.06, 0.55, 0.08)]
    threads = [thread((0.64, 0.92), (0.7 + 0.09 * i, 0.5), 0.006) for i in range(4)]
    return [
        ground,
        *(Surface([bar], front, paint) for bar in bars),
        *(Surface([tooth], front, paint) for tooth in teeth),
        *(Surface([line], Plane(0.3), cord) for line in threads),
    ]


def _dots() -> list[Surface]:
    ground = Surface([everywhere()], Plane(-0.5), noise(6, (0.35, 0.37, 0.42), 0.1))
    texture = noise(7, (0.68, 0.62, 0.5), 0.14)
    dots = []
    for row in range(6):
        for column in range(6):
            outline = blob(0.1 + 0.16 * column, 0.1 + 0.16 * row, 0.02 + 0.0095 * row)
            dots.append(Surface([outline], Plane(0.1 + 0.2 * ((column + 2 * row) % 6)), texture))
    return [ground, *dots]


def _pyramids() -> list[Surface]:
    plane = Plane(0.0, across=0.3, down=0.2)
    stone, brick = noise(8, (0.48, 0.5, 0.55), 0.13), photograph("brick", (1.1, 0.95, 0.85), seed=9)
    front = [(0.27, 0.27, 0.0, (0.02, -0.03)), (0.74, 0.73, 0.35, (-0.05, -0.03))]
    sunk = [(0.74, 0.26, -0.2, (0.03, 0.02)), (0.26, 0.74, 0.1, (-0.03, 0.04))]
    holes, faces = [], []
    for positions, height, texture in ((front, 1.2, stone), (sunk, -1.2, brick)):
        for x, y, turn, shift in positions:
            angle = turn + np.pi / 4 + np.pi / 2 * np.arange(4)
            base = np.stack([x + 0.27 * np.cos(angle), y + 0.27 * np.sin(angle)], axis=1)
            faces += pyramid(base, (x + shift[0], y + shift[1]), height, plane, texture)
            if height < 0:
                holes.append(base)
    return [
        Surface([everywhere(), *holes], plane, photograph("immunohistochemistry", (0.85, 0.9, 0.9), seed=10)),
        *faces,
    ]


def _stripes() -> list[Surface]:
    tint = np.array([0.5, 0.48, 0.46])
    ground = Surface([everywhere()], Plane(-0.6), noise(11, (0.5, 0.48, 0.46), 0.06))
    stripes = []
    for i in range(8):
        contrast = 0.16 * 0.65**i
        red, green, blue = tint + contrast * np.array([1.2, 0.6, -0.8])
        outline = rectangle(0.045 + 0.12 * i, 0.06, 0.105 + 0.12 * i, 0.94)
        stripes.append(Surface([outline], Plane(0.7, down=0.3), noise(12 + i, (red, green, blue), contrast)))
    return [ground, *stripes]


def _wall() -> list[Surface]:
    wall = Plane(-0.7, across=1.0)
    bare = rectangle(0.1, 0.1, 0.9, 0.72)
    poster, window = rectangle(0.2, 0.2, 0.36, 0.42), rectangle(0.66, 0.17, 0.8, 0.32)
    # the floor has the wall's disparity where it meets it, at 0.72
    floor = Plane(-2.02, across=1.0, down=6.0)
    return [
        Surface([everywhere(), bare], wall, photograph("brick", (1.0, 0.85, 0.75), seed=20)),
        Surface([bare, poster, window], wall, shading((0.74, 0.72, 0.66), 0.02), textureless=True),
        Surface([poster], wall, photograph("coffee", (1.0, 1.0, 1.0), seed=21)),
        Surface([window], wall, noise(22, (0.45, 0.6, 0.75), 0.12)),
        Surface([rectangle(-3, 0.72, 4, 4)], floor, photograph("gravel", (0.9, 0.95, 1.0), seed=23)),
        Surface([blob(0.5, 0.6, 0.1)], Plane(0.75, across=0.4), noise(24, (0.75, 0.4, 0.3), 0.13)),
        Surface(
            [polygon((0.68, 0.9), (0.64, 0.48), (0.79, 0.44), (0.84, 0.86))],
            Plane(1.1, across=0.5),
            photograph("astronaut", (1.0, 1.0, 1.0), seed=25),
        ),
        Surface([blob(0.23, 0.74, 0.13, [(3, 0.15, 0.4)])], Plane(1.5), noise(26, (0.4, 0.58, 0.35), 0.13)),
    ]


def _curved_occluders() -> list[Surface]:
    ground = Surface([everywhere()], Plane(-2.2, across=0.4, down=0.2), photograph("grass", (1.05, 1.0, 0.85), seed=30))
    return [
        ground,
        Surface([blob(0.25, 0.25, 0.17)], Plane(1.2, down=0.8), noise(31, (0.65, 0.45, 0.3), 0.14)),
        Surface([blob(0.7, 0.28, 0.2), blob(0.7, 0.28, 0.12)], Plane(1.8), noise(32, (0.35, 0.5, 0.65), 0.14)),
        Surface([blob(0.7, 0.28, 0.055)], Plane(0.2), noise(33, (0.7, 0.65, 0.35), 0.13)),
        Surface(
            [blob(0.28, 0.72, 0.18, [(3, 0.2, 0.3), (5, 0.1, 1.0)])],
            Plane(0.6, across=-0.8),
            photograph("coffee", (1.0, 1.0, 1.0), seed=34),
        ),
        Surface([blob(0.72, 0.74, 0.16, [(7, 0.25, 0.0)])], Plane(1.9), noise(35, (0.5, 0.35, 0.55), 0.14)),
    ]


def _rack() -> list[Surface]:
    ground = Surface([everywhere()], Plane(-1.4, across=0.5), noise(40, (0.42, 0.36, 0.3), 0.1))
    # plates one behind the other, each partly hidden by the next: three depths meet where outlines cross
    plates = []
    for i in range(7):
        glaze = noise(41 + i, (0.78 - 0.05 * i, 0.76, 0.6 + 0.05 * i), 0.1 if i % 2 else 0.03)
        outline = blob(0.2 + 0.1 * i, 0.42 + 0.02 * (i % 3), 0.15)
        plates.append(Surface([outline], Plane(-0.9 + 0.3 * i, across=-0.5, down=0.2), glaze))
    # rods in front, with gaps of one to five pixels of 192
    rods, left = [], 0.05
    for i in range(28):
        rods.append(rectangle(left, 0.62, left + 0.016, 0.93))
        left += 0.016 + 0.005 * (1 + i % 5)
    wood = noise(48, (0.62, 0.5, 0.38), 0.1)
    return [ground, *plates, *(Surface([rod], Plane(1.3, down=0.3), wood) for rod in rods)]


def _pencils() -> list[Surface]:
    wall = Surface([everywhere()], Plane(-1.6, down=0.8), noise(50, (0.55, 0.57, 0.6), 0.02))
    sheet = polygon((0.05, 0.06), (0.6, 0.02), (0.66, 0.5), (0.1, 0.55))
    pencils = []
    for i in range(11):
        foot, tip = (0.3 + 0.04 * i, 0.8), (0.06 + 0.088 * i, 0.1 + 0.05 * (i * i % 5))
        # some are as dark as the pot, some as bright as the wall
        tone = 0.2 + 0.07 * (i * 3 % 11)
        plane = Plane(0.1 + 0.14 * (i * 4 % 11), down=0.5 - 0.1 * (i % 4))
        paint = noise(51 + i, (tone, 0.8 * tone + 0.1, 0.6 * tone + 0.15), 0.04)
        pencils.append(Surface([thread(foot, tip, 0.016 + 0.003 * (i % 3))], plane, paint))
    pot = polygon((0.24, 0.66), (0.78, 0.66), (0.72, 0.97), (0.3, 0.97))
    return [
        wall,
        Surface([sheet], Plane(-1.2), photograph("coffee", (1.0, 1.0, 1.0), seed=62)),
        *sorted(pencils, key=lambda pencil: pencil.plane.at_centre),
        Surface([pot], Plane(1.9), noise(63, (0.3, 0.42, 0.5), 0.12)),
    ]


DEFINITIONS: dict[str, Scene] = {
    "fronto_parallel": Scene(
        "one textured plane of disparity exactly 1",
        lambda: [Surface([everywhere()], Plane(1.0), noise(1, (0.5, 0.47, 0.43), 0.14))],
    ),
    "slanted_plane": Scene(
        "one textured plane, tilted about both axes",
        lambda: [Surface([everywhere()], Plane(0.0, 1.6, -0.8), noise(2, (0.42, 0.5, 0.46), 0.14))],
    ),
    "fine_structures": Scene("thin bars, teeth and threads before a background, with growing gaps", _fine_structures),
    "dots": Scene("small discs before a plane, under pixel noise that grows to the right", _dots, (0.02, 0.1)),
    "pyramids": Scene("slanted pyramids, two standing and two sunk", _pyramids),
    "stripes": Scene("stripes before a plane, each of lower contrast than the one before", _stripes),
    "wall": Scene("textured objects before a large slanted wall without texture", _wall, (0.004, 0.004)),
    "curved_occluders": Scene(
        "occluders with curved outlines and a disparity discontinuity of up to 4", _curved_occluders
    ),
    "rack": Scene("plates that hide each other, behind rods with narrow gaps", _rack),
    "pencils": Scene("crossing pencils before paper and a wall with next to no texture", _pencils, (0.006, 0.006)),
}
"""The built-in scenes in their order."""

SCENES: dict[str, str] = {name: scene.description for name, scene in DEFINITIONS.items()}
"""Name and one line about each built-in scene, in their order."""
