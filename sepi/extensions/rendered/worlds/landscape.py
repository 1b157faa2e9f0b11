"""A valley with a village, trees and hills under clouds, all of it far away.

Nothing is nearer than fifty metres, and all disparities lie within half a pixel or so: what counts is what can be told
from a fraction of a pixel. The terrain is a height field that houses and trees stand on; the sky behind is painted on a
screen at the far end.
"""

import numpy as np

from sepi.extensions.rendered import patterns, shapes
from sepi.extensions.rendered.patterns import bricks, noise
from sepi.extensions.rendered.shapes import Points, ball, box, joined, moved, raster, sheet, thing, turned_body, wall
from sepi.extensions.rendered.staging import house, seen_from
from sepi.extensions.rendered.world import Cameras, Light, Material, Mesh, Pattern, Sun, Things, World

_FAR = 900.0
# where houses stand: those in front, and the village behind
_PLACES = [(-20.0, 105.0), (9.0, 120.0), (-4.0, 150.0), (24.0, 165.0), (-34.0, 190.0), (6.0, 215.0)]
_PLACES += zip(np.random.default_rng(4).uniform(-75, 60, 22).tolist(), np.linspace(200, 430, 22).tolist(), strict=True)


def world() -> World:
    """The valley on a morning in summer."""
    things = [*_terrain(), *_sky(), *_village(), *_trees(), *_lane()]
    light = Light(sky=(0.7, 0.85, 1.1), suns=[Sun((0.85, 0.75, 0.35), (6.5, 6.0, 5.0))], exposure=0.95)
    return seen_from(World(things, Cameras(56.0, 890.0, 0.6, -0.55, 32), light), (0.0, -31.0, 0.0), below=5.5)


def _height(x: Points | float, z: Points | float) -> Points:
    """Metres above the river's level: a valley floor, hills to the left and right, a ridge behind."""
    valley = 26 * (1 - np.exp(-(((x + 0.12 * z - 10) / (45 + 0.16 * z)) ** 2)))
    ridge = 95 / (1 + np.exp(-(z - 690 + 0.25 * x) / 55))
    waves = 2.2 * np.sin(x / 23 + z / 61) + 1.6 * np.sin(x / 41 - z / 37 + 1) + 9 * np.sin(x / 130 + z / 170 + 2)
    tufts = 0.15 * np.sin(x * 0.9 + 3 * np.sin(z / 7)) * np.sin(z * 0.31 + 2 * np.sin(x / 9))
    return np.asarray(valley * np.clip(z / 300, 0.2, 1.4) + ridge * (1 + 0.25 * np.sin(x / 90 + 1)) + waves + tufts)


def _terrain() -> Things:
    z = np.geomspace(30, _FAR + 20, 300)[:, None]
    x = np.linspace(-0.5, 0.5, 300)[None, :] * (z + 40)
    # the pattern lies on the ground as on a map
    flat = raster(x, z).reshape(-1, 2).astype(np.float32)
    yield thing(sheet(raster(x, -_height(x, z), z))._replace(uv=flat), _fields())


def _fields() -> Pattern:
    """Fields of several crops in strips, with the grain of grass: 100 m a side."""
    grain = patterns.field(1, 2.5, 40) + 0.6 * patterns.field(2, 20, 300)
    colours = np.array([[0.3, 0.42, 0.17], [0.4, 0.47, 0.2], [0.55, 0.5, 0.25], [0.26, 0.36, 0.15]])
    chosen = np.digitize(patterns.field(3, 90, 500), [-0.7, 0.1, 0.9])
    crops = colours[chosen] * (1 + 0.16 * grain[..., None])
    return Pattern(crops.clip(0.03, 0.95).astype(np.float32), (100.0, 100.0))


def _sky() -> Things:
    """Clouds on a screen, paler towards the horizon."""
    clouds = np.clip(patterns.field(11, 24, 500, stretch=0.5) * 0.45 + 0.35, 0, 1)[..., None]
    down = np.linspace(0, 1, len(clouds))[:, None, None]
    clear = (1 - down) * np.array([0.45, 0.62, 0.86]) + down * np.array([0.82, 0.87, 0.9])
    colours = clear + (0.75 - 0.35 * down) * clouds * (np.array([0.97, 0.96, 0.95]) - clear)
    screen = wall((-700, -700, _FAR), 1400, 700)
    yield thing(screen._replace(uv=np.sign(screen.uv)), Pattern(colours.astype(np.float32), (1.0, 1.0)))


def _village() -> Things:
    rng = np.random.default_rng(4)
    walls, roofs, dark = [list[Mesh](), list[Mesh](), list[Mesh]()], list[Mesh](), list[Mesh]()
    for number, (x, z) in enumerate(_PLACES):
        wide, deep, tall = rng.uniform(8, 12), rng.uniform(7, 9), rng.uniform(4.5, 6.5)
        turn, rise = rng.uniform(-0.6, 0.6), rng.uniform(3.0, 4.2)
        parts = house(wide, deep, tall, rise)
        for mesh, kind in zip(parts, (walls[number % 3], roofs, dark), strict=True):
            kind.append(moved(mesh, (0, turn, 0), (x, -float(_height(x, z)) + 0.8, z)))
    for number, colour in enumerate(((0.8, 0.76, 0.66), (0.74, 0.6, 0.46), (0.84, 0.83, 0.8))):
        yield thing(walls[number], noise(30 + 5 * number, colour, 0.04, 9.0, (4, 300)))
    yield thing(roofs, bricks(21, 7.0, 24, (0.56, 0.27, 0.18)))
    yield thing(dark, Material((0.1, 0.11, 0.13), "glossy"))


def _trees() -> Things:
    rng = np.random.default_rng(6)
    kinds = (
        (_crown(1), 700, (2.0, 9.5), (0.2, 0.33, 0.11)),
        (_crown(2), 700, (1.5, 8.0), (0.32, 0.4, 0.14)),
        (_fir(), 1100, (9.0, 17.0), (0.12, 0.23, 0.13)),
    )
    for number, (shape, count, heights, green) in enumerate(kinds):
        z = rng.uniform(0, 1, count) ** 0.6 * 760 + 75
        x = rng.uniform(-0.31, 0.31, count) * (z + 20)
        # a wood on the hills, single trees in the valley
        keep = rng.uniform(0, 1, count) < np.clip(np.abs(x + 0.12 * z - 10) / (45 + 0.16 * z) - 0.35, 0.12, 1)
        # none in the lane, or in a house
        keep &= (np.abs(x - _lane_at(z)) > 4) | (z > 165)
        for right, far in _PLACES:
            keep &= np.hypot(x - right, z - far) > 8.5
        x, z = x[keep], z[keep]
        places = np.stack([x, -_height(x, z) + 0.4, z], axis=1)
        axes = shapes.about_vertical(rng.uniform(0, 2 * np.pi, len(x)))
        leaves = noise(50 + 5 * number, green, 0.07, 12.0, (3, 120))
        yield thing(shapes.copies(shape, axes, places, rng.uniform(*heights, len(x))), leaves)


def _crown(seed: int) -> Mesh:
    """A broad-leaved tree one metre high, its trunk in its own shade."""
    waves = np.random.default_rng(seed).normal(0, 1, (14, 3)) * 5

    def bumps(direction: Points) -> Points:
        return np.asarray(0.045 * np.sin(direction @ waves.T + np.arange(14)).sum(-1))

    trunk = turned_body([[0.03, 0.4], [0.05, 0.0]], (0, 0, 0), 8)
    return joined([ball((0, -0.58, 0), 0.38, bumps, 11), trunk])


def _fir() -> Mesh:
    """A conifer one metre high: skirts of branches above each other."""
    outline = [[0.0, 1.0]]
    for n in range(7):
        outline += [[0.035 + 0.03 * n, 0.86 - 0.12 * n], [0.02 + 0.022 * n, 0.87 - 0.12 * n]]
    return turned_body(np.array([*outline, [0.03, 0.1], [0.03, 0.0]]), (0, 0, 0), 10)


def _lane_at(z: Points) -> Points:
    return np.asarray(-17 + 0.26 * (z - 60) + 2 * np.sin(z / 13))


def _lane() -> Things:
    """A lane with posts at its side, and bales of straw on the field that it passes."""
    z = np.linspace(45, 160, 200)
    x = _lane_at(z)
    across, along = np.array([-1.5, -0.5, 0.5, 1.5]) + x[:, None], z[:, None]
    lane = sheet(raster(across, -_height(across, along) - 0.12, along))
    yield thing(lane, noise(61, (0.6, 0.55, 0.45), 0.06, 20.0, (3, 100)))
    places = raster(x, -_height(x, z), z)[10::6]
    posts = [box((a - 2.6, b - 0.5, c), (0.16, 1.6, 0.16)) for a, b, c in places]
    yield thing(posts, (0.62, 0.58, 0.5), thin=True)
    rng = np.random.default_rng(7)
    drum = turned_body([[0, 0.7], [0.75, 0.69], [0.78, 0.6], [0.78, -0.6], [0.75, -0.69], [0, -0.7]], (0, 0, 0), 24)
    bales = []
    for right, far in zip(rng.uniform(3, 32, 22), rng.uniform(58, 125, 22), strict=True):
        at = (right, -float(_height(right, far)) - 0.7, far)
        bales.append(moved(drum, (np.pi / 2, rng.uniform(0, 3), 0), at))
    yield thing(bales, noise(62, (0.72, 0.6, 0.32), 0.08, 6.0, (3, 60)))
