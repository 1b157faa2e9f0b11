"""Chairs, pots and a curtain on a floor of polished stone tiles that mirrors them.

What the floor mirrors lies as far below it as the things stand above, and moves against the veins of the stone from
view to view. The cameras look along the floor, where a polish mirrors most.
"""

from __future__ import annotations

import numpy as np

from sepi.extensions.rendered import patterns
from sepi.extensions.rendered.shapes import ball, bevelled, box, joined, leaf, moved, rectangle, rod, sheet, turned_body
from sepi.extensions.rendered.staging import chair, lamp_towards, seen_from
from sepi.extensions.rendered.world import Cameras, Light, Material, Mesh, Paths, Pattern, Thing, World

_WALL = 4.1


def world() -> World:
    """A hall without a ceiling, lit from the upper left."""
    lamp = lamp_towards((-2.6, -3.2, 0.8), (0.1, -0.3, 3.0), 1.7, (26.0, 24.0, 21.0))
    things = [*_hall(), *_curtain(), *_chairs(), *_pots(), *_agave()]
    light = Light(sky=(0.75, 0.8, 0.88), lamps=[lamp], exposure=1.25)
    hall = World(things, Cameras(1.81, 4.17, 2.0, -1.7, 36), light, Paths(7, 5, 0.39))
    return seen_from(hall, (0.05, -0.95, 0.0), below=12)


def _hall() -> list[Thing]:
    paper = patterns.noise(1, (0.62, 0.55, 0.4), 0.045, 0.9, finest=4, coarsest=120, chroma=0.25)
    wide = (8.0, 0.0, 0.0)
    panels = [box((-2.9 + 0.62 * n, -0.5, _WALL - 0.012), (0.5, 0.72, 0.024)) for n in range(10)]
    panels += [box((0, y, _WALL - 0.018), (8, h, 0.036)) for y, h in ((-0.07, 0.14), (-0.94, 0.07))]
    return [
        Thing(rectangle((-4, 0, -1), wide, (0, 0, _WALL + 1.0)), Material(_tiles(), "glossy")),
        Thing(rectangle((-4, -4, _WALL), wide, (0, 4, 0)), Material(paper)),
        Thing(rectangle((-4, -0.98, _WALL - 0.006), wide, (0, 0.98, 0)), Material((0.66, 0.7, 0.68))),
        Thing(joined(panels), Material((0.7, 0.74, 0.72))),
    ]


def _tiles() -> Pattern:
    """Light and dark stone in turn, 40 cm a tile."""
    light = patterns.stone(11, 1.6, (0.66, 0.58, 0.48), (0.4, 0.32, 0.25)).raster
    dark = patterns.stone(12, 1.6, (0.2, 0.22, 0.22), (0.07, 0.09, 0.1)).raster
    row, column = np.mgrid[: light.shape[0], : light.shape[1]] * 4 / light.shape[0]
    odd = (np.floor(row) + np.floor(column)) % 2 == 1
    joint = np.minimum(np.abs(row - np.round(row)), np.abs(column - np.round(column))) < 0.006
    raster = np.where(odd[..., None], light, dark)
    return Pattern(np.where(joint[..., None], np.float32(0.3), raster), (1.6, 1.6))


def _curtain() -> list[Thing]:
    across, down = np.linspace(0, 1, 260)[None, :], np.linspace(0, 1, 50)[:, None]
    fold = np.sin(2 * np.pi * 9 * across + 0.9 * np.sin(5 * across) + 0.5 * down)
    depth = (0.03 + 0.035 * down) * fold + 0.015 * np.sin(23 * across + 3 * down)
    points = np.broadcast_arrays(-1.45 + 1.5 * across + 0.01 * fold * down, -2.2 + 2.18 * down, _WALL - 0.22 + depth)
    striped = patterns.stripes(0.44, [(0.55, 0.14, 0.13), (0.78, 0.7, 0.55), (0.55, 0.14, 0.13), (0.3, 0.34, 0.4)])
    grain = 0.03 * patterns.field(21, 3, 30)[..., None]
    cloth = Pattern((striped.raster + grain).clip(0.02, 0.98).astype(np.float32), striped.size)
    return [
        Thing(sheet(np.stack(points, axis=-1)), Material(cloth)),
        Thing(rod((-1.6, -2.22, _WALL - 0.22), (0.3, -2.22, _WALL - 0.22), 0.015), Material((0.2, 0.14, 0.1))),
    ]


def _chairs() -> list[Thing]:
    beech = patterns.wood(31, 0.8, (0.74, 0.52, 0.32), (0.58, 0.37, 0.2))
    red = Material((0.6, 0.1, 0.07), "glossy", 0.08)
    x, z = 0.86, 3.5
    seat = turned_body(bevelled(np.array([[0, 0.62], [0.17, 0.62], [0.17, 0.58], [0, 0.58]]), 0.006), (x, 0, z))
    turns = np.arange(4) * np.pi / 2 + 0.5
    sides = zip(np.cos(turns), np.sin(turns), strict=True)
    legs = [rod((x + 0.19 * c, -0.013, z + 0.19 * s), (x + 0.1 * c, -0.59, z + 0.1 * s), 0.014) for c, s in sides]
    return [
        Thing(chair(0.55, (-0.42, 0, 2.75), 5), Material(beech)),
        Thing(chair(-2.5, (0.35, 0, 3.1), 3), red),
        Thing(joined([seat, *legs]), Material((0.12, 0.2, 0.26), "glossy", 0.15)),
    ]


def _pots() -> list[Thing]:
    glazed = patterns.noise(41, (0.12, 0.3, 0.42), 0.05, 0.5, finest=4, coarsest=200, chroma=0.5)
    clay = patterns.noise(42, (0.62, 0.34, 0.22), 0.035, 0.6, finest=3, coarsest=200, chroma=0.2)
    earth = patterns.noise(43, (0.16, 0.12, 0.09), 0.05, 0.3, finest=3, coarsest=30)
    vase = [[0.052, 0.43], [0.06, 0.44], [0.05, 0.4], [0.075, 0.34], [0.115, 0.27], [0.13, 0.2], [0.115, 0.11]]
    vase += [[0.085, 0.04], [0.075, 0.0], [0, 0]]
    pot = [[0.14, 0.24], [0.155, 0.24], [0.155, 0.27], [0.17, 0.27], [0.17, 0.22], [0.155, 0.22], [0.115, 0.0], [0, 0]]
    small = [[0.05, 0.1], [0.056, 0.1], [0.06, 0.085], [0.045, 0.0], [0, 0]]
    smalls = [turned_body(bevelled(np.array(small), 0.003), place) for place in ((-0.3, 0, 2.0), (-0.12, 0, 2.2))]
    soil = turned_body(np.array([[0, 0.235], [0.15, 0.225]]), (0.44, 0, 2.3))
    return [
        Thing(turned_body(_round(vase), (-0.88, 0, 3.2)), Material(glazed, "glossy", 0.05)),
        Thing(turned_body(bevelled(np.array(pot), 0.004), (0.44, 0, 2.3)), Material(clay)),
        Thing(joined(smalls), Material((0.8, 0.78, 0.7), "glossy", 0.05)),
        Thing(soil, Material(earth)),
        Thing(ball((0.08, -0.06, 2.45), 0.06), Material((0.78, 0.52, 0.08), "glossy", 0.1)),
    ]


def _round(outline: list[list[float]]) -> np.ndarray:
    """An outline with its corners rounded twice, each between the middles of its sides."""
    points = np.array(outline)
    for _ in range(2):
        cut = np.stack([0.75 * points[:-1] + 0.25 * points[1:], 0.25 * points[:-1] + 0.75 * points[1:]], 1)
        points = np.concatenate([points[:1], cut.reshape(-1, 2), points[-1:]])
    return points


def _agave() -> list[Thing]:
    rng = np.random.default_rng(51)
    leaves: list[Mesh] = []
    for number in range(26):
        rise = float(np.interp(number, [0, 25], [0.35, 1.4]) + rng.normal(0, 0.06))
        blade = leaf(float(rng.uniform(0.3, 0.44)), 0.055, float(rng.uniform(0.5, 1.0)), 0.5, 14)
        turned = moved(moved(blade, (0, 0, -rise)), (0, 2.4 * number, 0), (0.44, -0.235, 2.3))
        leaves.append(turned)
    green = patterns.noise(52, (0.3, 0.44, 0.28), 0.04, 0.4, finest=3, coarsest=120, chroma=0.4)
    return [Thing(joined(leaves), Material(green))]
