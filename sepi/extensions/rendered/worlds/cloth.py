"""Curtains, a table cloth, a blanket on a rack and folded linen: folds, faint texture, soft shading.

All cloth is a sheet bent by formula: a hanging one has folds that are gathered where it is held and open towards its
hem, the table's falls from the rim in flutes that deepen.
"""

import numpy as np

from sepi.extensions.rendered.patterns import field, linen, noise, plaid, weave, wood
from sepi.extensions.rendered.shapes import Points, ground, moved, raster, rectangle, sheet, thing, tube, wall
from sepi.extensions.rendered.world import Cameras, Lamp, Light, Mesh, Things, Vector, World

FLOOR, TABLE = 1.0, 0.26


def world() -> World:
    """By daylight from a wide window on the left."""
    lamp = Lamp((-3.0, -1.2, 0.4), (0, 0, 1.6), (0.9, -1.3, 0), (13.0, 12.5, 11.8))
    light = Light(sky=(0.26, 0.27, 0.29), lamps=[lamp], exposure=2.0, depth=4)
    return World([*_things()], Cameras(1.85, 3.5, 1.9, -1.7, 46), light)


def _things() -> Things:
    rug = rectangle((-0.95, FLOOR - 0.012, 1.6), (2.0, 0, 0.1), (-0.07, 0, 1.35))
    yield thing(_curtain(), linen(1, 1.0, (0.56, 0.63, 0.68), 0.05))
    yield thing(wall((-3, -2.5, 3.55), 6, 4), (0.8, 0.78, 0.72))
    yield thing(ground((-3, FLOOR, 0.5), 6, 3.2), wood(41, 1.1, (0.56, 0.42, 0.29), (0.38, 0.26, 0.17)))
    yield thing(rug, weave(61, 0.9, (0.5, 0.42, 0.4), 0.14))
    yield thing(_table_cloth((0.16, TABLE, 2.6), 0.46), plaid(11, 0.9, (0.84, 0.8, 0.7), (0.72, 0.6, 0.5), 5, 0.35))
    yield thing(_tied((0.83, 0.4, 1.98)), noise(31, (0.55, 0.2, 0.17), 0.022, 0.7, (4, 80)))
    yield thing(_blanket((-0.72, -0.1, 2.45)), plaid(21, 0.8, (0.55, 0.5, 0.34), (0.3, 0.36, 0.3), 4, 0.8))
    yield thing(_rack((-0.72, -0.1, 2.45)), wood(51, 0.4))
    for n, colour in enumerate([(0.86, 0.84, 0.8), (0.62, 0.68, 0.6), (0.78, 0.66, 0.56), (0.86, 0.85, 0.83)]):
        folded = _folded((0.32 + 0.008 * (n % 2), TABLE - 0.032 - 0.06 * n, 2.58), n)
        yield thing(folded, linen(70 + 3 * n, 0.6, colour))
    yield thing(_crumpled((-0.07, TABLE - 0.003, 2.42)), linen(91, 0.6, (0.8, 0.74, 0.72), 0.05))


def _waves(along: Points, seed: int, period: float) -> Points:
    """Phase of folds that are not all as wide."""
    rng = np.random.default_rng(seed)
    found = 2 * np.pi * along / period
    for factor in (3.1, 5.3, 9.7):
        found = found + 0.22 * factor * np.sin(along * 2 * np.pi / (period * factor) + rng.uniform(0, 6))
    return np.asarray(found)


def _curtain() -> Mesh:
    """From beyond one border to beyond the other, as deep in its folds as it is gathered."""
    along, down = np.linspace(-2.3, 2.3, 1100)[None, :], np.linspace(0, 1, 60)[:, None]
    phase = _waves(along + 0.05 * np.sin(3 * down + along), 3, 0.19)
    depth = 0.035 + 0.03 * down + 0.012 * np.sin(1.7 * along + 4 * down)
    x = along - 0.02 * np.sin(2 * phase)
    z = 3.3 + depth * (np.cos(phase) + 0.18 * np.cos(2 * phase + 1.5 * down)) + 0.01 * np.sin(5 * along + 6 * down)
    return sheet(raster(x, -1.9 + 2.88 * down, z))


def _tied(tie: Vector) -> Mesh:
    """A curtain held at a point on the right: it swings across above and falls straight below."""
    along, y = np.linspace(0, 1, 300)[None, :], np.linspace(-1.7, 0.99, 110)[:, None]
    above = np.clip((tie[1] - y) / 1.6, 0, 1)
    half = 0.075 + np.where(y < tie[1], 0.42 * above**1.3, 0.09 * (1 - np.exp(-((y - tie[1]) / 0.25))))
    centre = tie[0] - 0.3 * above**1.3 + 0.06 * np.exp(-(((y - tie[1]) / 0.1) ** 2))
    phase = _waves(1.5 * along, 8, 0.21)
    x = centre + half * (2 * along - 1) - 0.12 * half * np.sin(2 * phase)
    z = tie[2] + (0.03 + 0.035 * np.minimum(half / 0.2, 1)) * np.cos(phase + 0.5 * above)
    return sheet(raster(x, y, z))


def _table_cloth(centre: Vector, radius: float) -> Mesh:
    angle, length = np.linspace(0, 2 * np.pi, 481)[None, :], np.linspace(1e-4, radius + 0.62, 130)[:, None]
    fall = np.maximum(length - radius, 0)
    bend = 0.02 * (1 - np.exp(-fall / 0.02))
    flute = _waves(radius * angle, 5, 2 * np.pi * radius / 13)
    flute = flute - angle / (2 * np.pi) * (flute[:, -1:] - flute[:, :1] - 26 * np.pi)
    depth = 0.075 * (1 - np.exp(-((fall / 0.35) ** 2))) * (0.75 + 0.25 * np.sin(3 * angle + 1))
    out = np.minimum(length, radius) + bend + depth * (0.5 + np.cos(flute)) + 0.01 * np.cos(2 * flute) * fall
    turn = angle + 0.35 * depth / radius * np.sin(2 * flute)
    drop = np.maximum(fall - 0.008, 0) * (0.97 - 0.03 * np.cos(flute))
    points = raster(out * np.cos(turn), drop, -out * np.sin(turn))
    mesh = sheet(points + np.array(centre))
    laid = raster(length * np.cos(angle), length * np.sin(angle)).reshape(-1, 2)
    return mesh._replace(uv=laid.astype(np.float32))


def _blanket(bar: Vector) -> Mesh:
    """Over a bar, its hind part shorter."""
    along, length = np.linspace(-0.3, 0.3, 110)[None, :], np.linspace(-0.5, 0.78, 140)[:, None]
    curve = np.clip(length / 0.022, -np.pi / 2, np.pi / 2)
    hang = np.maximum(np.abs(length) - 0.022 * np.pi / 2, 0)
    phase = _waves(along + 0.1 * hang, 12, 0.2)
    z = -0.022 * np.sin(curve) - np.sign(length) * hang * 0.06 + 0.05 * hang * np.cos(phase) / (0.3 + hang)
    y = -0.022 * np.cos(curve) + hang * (1 + 0.015 * np.sin(5 * along))
    x = along * (1 - 0.07 * hang) - 0.012 * np.sin(2 * phase) * np.minimum(hang / 0.3, 1)
    mesh = sheet(raster(x, y, z))
    return moved(mesh, (0, 0.3, 0), bar)


def _rack(bar: Vector) -> Mesh:
    """Two frames of round wood with a bar between."""
    pairs = [(side, foot) for side in (-0.36, 0.36) for foot in (-0.2, 0.2)]
    legs = [tube([[side, -0.03, -foot * 0.03], [side, FLOOR - bar[1], foot]], 0.014) for side, foot in pairs]
    return moved([tube([[-0.38, 0, 0], [0.38, 0, 0]], 0.016), *legs], (0, 0.3, 0), bar)


def _folded(centre: Vector, number: int) -> Mesh:
    """Linen in four layers, which its front shows."""
    around, along = np.linspace(0, 2 * np.pi, 160)[None, :], np.linspace(-1, 1, 60)[:, None]
    c, s = np.cos(around), np.sin(around)
    end = (1 - np.abs(along) ** 14) ** 0.3
    z = 0.13 * np.sign(c) * np.abs(c) ** 0.25 * (1 - 0.035 * np.abs(np.cos(2 * np.pi * (s + 1))) * np.abs(c))
    y = 0.031 * np.sign(s) * np.abs(s) ** 0.45 * end + 0.003 * np.sin(6 * along + number) * s
    points = raster(0.17 * along, y, z * (0.97 + 0.03 * end))
    return moved(sheet(points), (0, 0.25 - 0.09 * (number % 3), 0), centre)


def _crumpled(centre: Vector) -> Mesh:
    """A napkin that was let fall: ridges between hollows."""
    relief = np.abs(field(101, 20, 90, 128)) + 0.35 * np.abs(field(102, 9, 40, 128))
    v, u = np.mgrid[-1:1:128j, -1:1:128j]
    round_ = np.hypot(u + 0.12 * field(103, 40, 120, 128), v + 0.12 * field(104, 40, 120, 128))
    height = 0.075 * np.clip(1.15 - round_, 0, 1) * (0.6 + 0.5 * (1.3 - relief))
    points = np.stack([0.17 * u + 0.01 * relief, -np.maximum(height, 0), 0.13 * v], -1)
    return moved(sheet(points), (0, 0.4, 0), centre)
