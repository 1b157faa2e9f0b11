"""The built-in scenes: their surfaces and textures, and the difficulty that each one poses.

A scene is a list of planar patches with an outline and a texture. Coordinates are those of the centre view, in
fractions of the image: (0, 0) is the outer corner of the top left pixel, (1, 1) that of the bottom right pixel. Shapes
therefore scale with the image while disparities, in pixels per view step, do not.

Textures are periodic rasters, one texel per pixel of the centre view, sampled by cubic splines. They have pixel-scale
detail at every image size, so that depth can be estimated. The photographs are samples included in scikit-image.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial
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


Colour = tuple[float, float, float]
"""Red, green, blue, full range = 1."""

# Texels per period; far longer than any disparity range, so that a repetition is never a false match.
PERIOD = 512
# Shortest wavelength of noise in pixels.
FINEST = 3.0
# Share of a texture's variation that differs between colour channels.
CHROMA = 0.25
# Standard deviation of the noise added to a photograph.
GRAIN = 0.05


def later(make: Callable[..., FloatMap]) -> Callable[..., Callable[[], FloatMap]]:
    """Wrap a texture function so that calls return a function that makes the texture when it is drawn."""
    return lambda *given, **named: partial(make, *given, **named)


@later
def noise(seed: int, colour: Colour, contrast: float, *, coarsest: float = 48.0) -> FloatMap:
    """Smooth noise around a colour with equal energy per octave between two wavelengths in pixels.

    ``contrast`` is the standard deviation of the brightness. No wavelength is below 2 pixels, so that views are sampled
    without aliasing.
    """
    brightness, *chroma = _bands(np.random.default_rng(seed), coarsest)
    variation = brightness[..., None] + CHROMA * np.stack(chroma, axis=-1)
    return _limited(np.array(colour) + contrast * variation)


@later
def photograph(name: str, tint: Colour, *, seed: int) -> FloatMap:
    """A sample image included in scikit-image, mirrored so that it repeats without a seam.

    Its colours are multiplied by ``tint``; fine noise is added so that smooth parts have detail too.
    """
    from skimage import data

    # range reduced, since clipping at black or white would leave no detail to match
    picture = 0.12 + 0.76 * np.asarray(getattr(data, name)(), np.float64) / 255
    if picture.ndim == 2:
        picture = np.repeat(picture[..., None], 3, axis=-1)
    half = PERIOD // 2
    top, left = (picture.shape[0] - half) // 2, (picture.shape[1] - half) // 2
    tile = picture[top : top + half, left : left + half]
    tile = np.concatenate([tile, tile[::-1]])
    tile = np.concatenate([tile, tile[:, ::-1]], axis=1)
    return _limited(tile * np.array(tint) + noise(seed, (0.5, 0.5, 0.5), GRAIN, coarsest=12)() - 0.5)


@later
def shading(colour: Colour, amplitude: float) -> FloatMap:
    """One colour with brightness varying only over hundreds of pixels: too smooth to estimate depth."""
    phase = 2 * np.pi * np.arange(PERIOD) / PERIOD
    wave = 0.5 * amplitude * (np.sin(phase)[:, None] + np.sin(phase)[None, :])
    return _limited(np.array(colour) + wave[..., None])


def _bands(rng: np.random.Generator, coarsest: float) -> npt.NDArray[np.float64]:
    """Four independent fields of unit variance, shape (4, PERIOD, PERIOD)."""
    white = rng.standard_normal((4, PERIOD, PERIOD))
    from scipy import fft

    frequency = np.hypot(fft.fftfreq(PERIOD)[:, None], fft.rfftfreq(PERIOD)[None, :])
    # amplitude 1/f gives equal energy per octave; smooth flanks avoid ripples
    with np.errstate(divide="ignore"):
        amplitude = np.where(frequency > 0, 1 / frequency, 0)
    amplitude *= np.exp(-((frequency * FINEST) ** 8)) * (1 - np.exp(-((frequency * coarsest) ** 4)))
    fields = fft.irfft2(fft.rfft2(white) * amplitude, s=(PERIOD, PERIOD))
    normalised: npt.NDArray[np.float64] = fields / fields.std(axis=(1, 2), keepdims=True)
    return normalised


def _limited(values: npt.NDArray[np.float64]) -> FloatMap:
    """Values limited to slightly inside 0..1, so that their spline stays within 0..1."""
    return np.clip(values, 0.02, 0.98).astype(np.float32)


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
    ground = photograph("immunohistochemistry", (0.85, 0.9, 0.9), seed=10)
    return [Surface([everywhere(), *holes], plane, ground), *faces]


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


def _curved() -> list[Surface]:
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
    "curved_occluders": Scene("occluders with curved outlines and a disparity discontinuity of up to 4", _curved),
    "rack": Scene("plates that hide each other, behind rods with narrow gaps", _rack),
    "pencils": Scene("crossing pencils before paper and a wall with next to no texture", _pencils, (0.006, 0.006)),
}
"""The built-in scenes in their order."""

SCENES: dict[str, str] = {name: scene.description for name, scene in DEFINITIONS.items()}
"""Name and one line about each built-in scene, in their order."""
