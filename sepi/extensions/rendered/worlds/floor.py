"""Chairs, pots and a curtain on a floor of polished stone tiles that mirrors them.

What the floor mirrors lies as far below it as the things stand above, and moves against the veins of the stone from
view to view. The cameras look along the floor, where a polish mirrors most.
"""

import numpy as np

from sepi.extensions.rendered import patterns, shapes
from sepi.extensions.rendered.patterns import noise
from sepi.extensions.rendered.shapes import ball, bevelled, box, ground, moved, rod, thing, turned_body, wall
from sepi.extensions.rendered.staging import chair, lamp_towards, seen_from
from sepi.extensions.rendered.world import Cameras, Light, Material, Pattern, Things, World

_WALL = 4.1


def world() -> World:
    """A hall without a ceiling, lit from the upper left."""
    lamp = lamp_towards((-2.6, -3.2, 0.8), (0.1, -0.3, 3.0), 1.7, (26.0, 24.0, 21.0))
    things = [*_hall(), *_curtain(), *_chairs(), *_pots(), *_agave()]
    light = Light(sky=(0.75, 0.8, 0.88), lamps=[lamp], exposure=1.25, depth=7, roulette=5, gloss=0.39)
    hall = World(things, Cameras(1.81, 4.17, 2.0, -1.7, 36), light)
    return seen_from(hall, (0.05, -0.95, 0.0), below=12)


def _hall() -> Things:
    panels = [box((-2.9 + 0.62 * n, -0.5, _WALL - 0.012), (0.5, 0.72, 0.024)) for n in range(10)]
    panels += [box((0, y, _WALL - 0.018), (8, h, 0.036)) for y, h in ((-0.07, 0.14), (-0.94, 0.07))]
    yield thing(ground((-4, 0, -1), 8, _WALL + 1.0), Material(_tiles(), "glossy"))
    yield thing(wall((-4, -4, _WALL), 8, 4), noise(1, (0.62, 0.55, 0.4), 0.045, 0.9, (4, 120), 0.25))
    yield thing(wall((-4, -0.98, _WALL - 0.006), 8, 0.98), (0.66, 0.7, 0.68))
    yield thing(panels, (0.7, 0.74, 0.72))


def _tiles() -> Pattern:
    """Light and dark stone in turn, 40 cm a tile."""
    light = patterns.stone(11, 1.6, (0.66, 0.58, 0.48), (0.4, 0.32, 0.25)).raster
    dark = patterns.stone(12, 1.6, (0.2, 0.22, 0.22), (0.07, 0.09, 0.1)).raster
    odd, joint = patterns.checks(4, 0.006)
    return patterns.painted(np.where(joint, np.float32(0.3), np.where(odd == 1, light, dark)), 1.6)


def _curtain() -> Things:
    across, down = np.linspace(0, 1, 260)[None, :], np.linspace(0, 1, 50)[:, None]
    fold = np.sin(2 * np.pi * 9 * across + 0.9 * np.sin(5 * across) + 0.5 * down)
    depth = (0.03 + 0.035 * down) * fold + 0.015 * np.sin(23 * across + 3 * down)
    points = shapes.raster(-1.45 + 1.5 * across + 0.01 * fold * down, -2.2 + 2.18 * down, _WALL - 0.22 + depth)
    striped = patterns.stripes(0.44, [(0.55, 0.14, 0.13), (0.78, 0.7, 0.55), (0.55, 0.14, 0.13), (0.3, 0.34, 0.4)])
    grain = 0.03 * patterns.field(21, 3, 30)[..., None]
    yield thing(shapes.sheet(points), patterns.painted(striped.raster + grain, 0.44))
    yield thing(rod((-1.6, -2.22, _WALL - 0.22), (0.3, -2.22, _WALL - 0.22), 0.015), (0.2, 0.14, 0.1))


def _chairs() -> Things:
    yield thing(chair(0.55, (-0.42, 0, 2.75), 5), patterns.wood(31, 0.8, (0.74, 0.52, 0.32), (0.58, 0.37, 0.2)))
    yield thing(chair(-2.5, (0.35, 0, 3.1), 3), Material((0.6, 0.1, 0.07), "glossy", 0.08))
    x, z = 0.86, 3.5
    seat = turned_body(bevelled([[0, 0.62], [0.17, 0.62], [0.17, 0.58], [0, 0.58]], 0.006), (x, 0, z))
    sides = [(np.cos(turn), np.sin(turn)) for turn in np.arange(4) * np.pi / 2 + 0.5]
    legs = [rod((x + 0.19 * c, -0.013, z + 0.19 * s), (x + 0.1 * c, -0.59, z + 0.1 * s), 0.014) for c, s in sides]
    yield thing([seat, *legs], Material((0.12, 0.2, 0.26), "glossy", 0.15))


def _pots() -> Things:
    vase = [[0.052, 0.43], [0.06, 0.44], [0.05, 0.4], [0.075, 0.34], [0.115, 0.27], [0.13, 0.2], [0.115, 0.11]]
    vase += [[0.085, 0.04], [0.075, 0.0], [0.0, 0.0]]
    pot = [[0.14, 0.24], [0.155, 0.24], [0.155, 0.27], [0.17, 0.27], [0.17, 0.22], [0.155, 0.22], [0.115, 0.0]]
    small = [[0.05, 0.1], [0.056, 0.1], [0.06, 0.085], [0.045, 0.0], [0.0, 0.0]]
    smalls = [turned_body(bevelled(small, 0.003), place) for place in ((-0.3, 0, 2.0), (-0.12, 0, 2.2))]
    glazed = Material(noise(41, (0.12, 0.3, 0.42), 0.05, 0.5, (4, 200), 0.5), "glossy", 0.05)
    yield thing(turned_body(_round(vase), (-0.88, 0, 3.2)), glazed)
    clay = noise(42, (0.62, 0.34, 0.22), 0.035, 0.6, (3, 200), 0.2)
    yield thing(turned_body(bevelled([*pot, [0.0, 0.0]], 0.004), (0.44, 0, 2.3)), clay)
    yield thing(smalls, Material((0.8, 0.78, 0.7), "glossy", 0.05))
    soil = turned_body([[0, 0.235], [0.15, 0.225]], (0.44, 0, 2.3))
    yield thing(soil, noise(43, (0.16, 0.12, 0.09), 0.05, 0.3, (3, 30)))
    yield thing(ball((0.08, -0.06, 2.45), 0.06), Material((0.78, 0.52, 0.08), "glossy", 0.1))


def _round(outline: list[list[float]]) -> shapes.Points:
    """An outline with its corners rounded twice, each between the middles of its sides."""
    points = np.array(outline)
    for _ in range(2):
        cut = np.stack([0.75 * points[:-1] + 0.25 * points[1:], 0.25 * points[:-1] + 0.75 * points[1:]], 1)
        points = np.concatenate([points[:1], cut.reshape(-1, 2), points[-1:]])
    return points


def _agave() -> Things:
    rng, leaves = np.random.default_rng(51), []
    for number in range(26):
        rise = np.interp(number, [0, 25], [0.35, 1.4]) + rng.normal(0, 0.06)
        blade = shapes.leaf(rng.uniform(0.3, 0.44), 0.055, rng.uniform(0.5, 1.0), 0.5, 14)
        leaves.append(moved(moved(blade, (0, 0, -rise)), (0, 2.4 * number, 0), (0.44, -0.235, 2.3)))
    yield thing(leaves, noise(52, (0.3, 0.44, 0.28), 0.04, 0.4, (3, 120), 0.4))
