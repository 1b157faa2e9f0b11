"""A console with a mirror, balls of chrome, brass and lacquer: surfaces that show nothing but others.

What they show is there: the table and its things, a bookcase behind the cameras, and round them a room with windows,
which is a panorama and gives all the light.
"""

import numpy as np
import numpy.typing as npt

from sepi.extensions.rendered import patterns, shapes
from sepi.extensions.rendered.shapes import ball, box, moved, thing, turned_body, wall
from sepi.extensions.rendered.staging import fruit, profile, vessel
from sepi.extensions.rendered.world import Cameras, Light, Material, Mesh, Pattern, Things, Vector, World

TABLE, WALL = 0.3, 2.3
CHROME, SILVER = Material(kind="mirror", metal="Cr"), Material(kind="mirror", metal="Ag")
_QUINCE = Material(patterns.noise(21, (0.66, 0.62, 0.24), 0.03, 0.12, (3, 256)))
GILT = Material(kind="mirror", metal="Au", roughness=0.22)
# place of the mirror, its turn (leaning, to the left), width and height
_MIRROR = ((-0.18, TABLE - 0.035, 1.95), (-0.04, 0.13, 0.0), 0.46, 0.6)
_BALLS = [(0.13, 1.5, 0.115), (-0.14, 1.32, 0.055), (0.33, 1.27, 0.04), (-0.02, 1.2, 0.03), (-0.4, 1.68, 0.08)]
_VASE = [(0.06, 0.36), (0.066, 0.355), (0.04, 0.32), (0.036, 0.27), (0.09, 0.2), (0.105, 0.13), (0.07, 0.05),
         (0.05, 0.03), (0.075, 0.015), (0.078, 0.0)]  # fmt: skip
_STICK = [(0.018, 0.26), (0.022, 0.255), (0.014, 0.235), (0.011, 0.2), (0.02, 0.17), (0.012, 0.14), (0.014, 0.08),
          (0.03, 0.04), (0.02, 0.03), (0.055, 0.012), (0.058, 0.0)]  # fmt: skip
_QUINCES = [(0.02, 1.34), (-0.22, 1.22)]
_CUP = [(0.045, 0.07), (0.047, 0.068), (0.044, 0.04), (0.03, 0.01), (0.026, 0.0)]


def world() -> World:
    things = [*_console(), *_books((0.43, TABLE, 1.4), 31, [0.024, 0.03, 0.018]), *_bookcase()]
    things += [*_porthole((0.34, -0.3, WALL - 0.02)), *_candles()]
    light = Light(sky=_room(), exposure=1.65, depth=6, roulette=4, gloss=0.55)
    return World(things, Cameras(1.0, WALL, 2.0, -1.8, 38), light)


def _console() -> Things:
    foot, turn, width, height = _MIRROR
    inlay = patterns.tiles(1, 0.44, 8, (0.74, 0.58, 0.4), (0.4, 0.25, 0.16))
    yield thing(box((0, TABLE + 0.03, 1.65), (3.4, 0.06, 1.3)), inlay)
    yield thing(wall((-2.5, -2, WALL), 5, 3), _wallpaper())
    yield thing(moved(wall((-width / 2, -height, 0), width, height), turn, foot), SILVER)
    # a moulding of two steps
    bars = []
    for bar, depth, out in ((0.05, 0.03, 0.02), (0.018, 0.045, 0.0)):
        bars += [box((x, -height / 2, 0), (bar, height + bar, depth)) for x in (-width / 2 - out, width / 2 + out)]
        bars += [box((0, y, 0), (width + bar, bar, depth)) for y in (-height - out, out)]
    yield thing(moved(bars, turn, foot), GILT)
    for x, z, radius in _BALLS:
        yield thing(ball((x, TABLE - radius, z), radius), CHROME)
    yield thing(vessel(_VASE, 0.004, (0.44, TABLE, 1.78)), Material(kind="mirror", metal="Au", roughness=0.07))
    lacquer = Material(patterns.noise(11, (0.5, 0.07, 0.05), 0.05, 0.2, (3, 60)), "glossy")
    yield thing(box((-0.42, TABLE - 0.05, 1.42), (0.24, 0.1, 0.17), (0, 0.35, 0)), lacquer)
    yield thing(box((-0.42, TABLE - 0.112, 1.42), (0.25, 0.02, 0.18), (0, 0.35, 0)), lacquer)
    yield thing(vessel(_CUP, 0.003, (0.3, TABLE, 1.47)), Material(_china(), "glossy"))
    for number, (x, z) in enumerate(_QUINCES):
        yield thing(fruit((x, TABLE - 0.033, z), 0.036, number), _QUINCE)


def _candles() -> Things:
    candle = [(0.0005, 0.42), (0.008, 0.418), (0.0105, 0.41), (0.0105, 0.25)]
    for x, z in ((0.26, 1.92), (0.17, 2.02)):
        yield thing(turned_body(profile(_STICK), (x, TABLE, z)), CHROME)
        yield thing(turned_body(profile(candle), (x, TABLE, z)), (0.9, 0.86, 0.76))


def _porthole(centre: Vector) -> Things:
    """A round mirror that bulges, on the wall."""
    cap = profile([(0.0005, 0.035), (0.05, 0.03), (0.1, 0.014), (0.13, 0.0)])
    yield thing(moved(turned_body(cap, (0, 0, 0)), (np.pi / 2, 0, 0), centre), SILVER)
    turn = np.linspace(0, 2 * np.pi, 97)
    ring = np.array(centre) + 0.135 * np.stack([np.cos(turn), np.sin(turn), 0 * turn], 1)
    yield thing(shapes.tube(ring, 0.016), GILT)


def _books(foot: Vector, seed: int, heights: list[float]) -> Things:
    """A pile that lies on the table."""
    rng, (x, y, z) = np.random.default_rng(seed), foot
    for number, height in enumerate(heights):
        colour = patterns.noise(seed + 4 * number, rng.uniform(0.15, 0.5, 3), 0.04, 0.15, (3, 256))
        yield thing(box((x, y - height / 2, z), (0.2, height, 0.14), (0, rng.uniform(-0.4, 0.4), 0)), colour)
        y -= height


def _bookcase() -> Things:
    """Behind the cameras: only mirrors show it."""
    rng, shelves = np.random.default_rng(5), []
    books: list[list[Mesh]] = [[], [], [], []]
    for shelf in (-1.0, -0.6, -0.2, 0.2, 0.6):
        shelves.append(box((-0.9, shelf + 0.02, -1.7), (3.2, 0.03, 0.3)))
        x = -2.5
        while x < 0.7:
            width, height = rng.uniform(0.02, 0.06), rng.uniform(0.2, 0.34)
            books[rng.integers(4)].append(box((x, shelf - height / 2, -1.7), (width, height, 0.22)))
            x += width + 0.003 + 0.1 * (rng.random() < 0.06)
    oak = Material(patterns.wood(41, 0.6))
    yield thing(shelves, oak)
    yield thing(box((-0.9, -0.2, -1.86), (3.2, 1.9, 0.02)), oak)
    colours = [(0.5, 0.16, 0.12), (0.16, 0.3, 0.24), (0.18, 0.2, 0.36), (0.62, 0.52, 0.34)]
    for spines, colour in zip(books, colours, strict=True):
        yield thing(spines, colour)


def _wallpaper() -> Pattern:
    """Flowers in a lattice, in two tones of green, on stripes."""
    y, x = np.mgrid[:1024, :1024] * (4 * np.pi / 1024)
    lattice = np.cos(x) + np.cos(y)
    flower = np.abs(lattice) > 1.25 + 0.4 * np.cos(6 * np.arctan2(np.sin(y), np.sin(x)))
    share = 0.8 * flower + 0.6 * (np.abs(lattice) < 0.12) + 0.15 * (np.cos(8 * x) > 0)
    share += 0.06 * patterns.field(51, 3, 60)
    colour = np.array([0.37, 0.49, 0.43]) + share[..., None] * np.array([0.3, 0.22, 0.14])
    return patterns.painted(colour, 0.5, 0.7)


def _china() -> Pattern:
    """Blue on white."""
    blue = np.clip(3 * (np.abs(patterns.field(61, 20, 90)) - 0.7), 0, 1)[..., None]
    colour = np.array([0.9, 0.9, 0.88]) + blue * np.array([-0.7, -0.6, -0.3])
    return patterns.painted(colour, 0.25)


def _room() -> npt.NDArray[np.float32]:
    """Radiance of ceiling, walls, floor, and of windows with bars in the wall behind and on the left."""
    down, across = (np.mgrid[:256, :512] + 0.5) / 256
    room = np.empty((256, 512, 3))
    below = np.where((down < 0.66)[..., None], [0.3, 0.27, 0.22], [0.1, 0.075, 0.05])
    room[:] = np.where((down < 0.3)[..., None], [0.5, 0.49, 0.46], below)
    for left, width in ((0.28, 0.22), (0.54, 0.18), (1.4, 0.16)):
        inside = (across > left) & (across < left + width) & (down > 0.27) & (down < 0.55)
        bars = ((across - left) / width * 3 % 1 < 0.08) | ((down - 0.27) / 0.07 % 1 < 0.1)
        room[inside & ~bars] = [5.2, 5.6, 6.2]
        room[inside & bars] = 0.2
    lamp = np.hypot((across - 1.7) * 1.3, down - 0.12) < 0.07
    room[lamp] = [9.0, 7.5, 5.5]
    return room.astype(np.float32)
