"""A square between houses: windows, shutters, blinds, awnings and bars that repeat by whole periods.

One front faces the cameras far away, one stands nearer on the left with a side that runs back, one recedes on the
right; a terrace with railings is nearest. A front is put together from bands and piers, so that its windows lie within.
"""

from typing import NamedTuple

import numpy as np

from sepi.extensions.rendered.patterns import bricks, noise, stripes, tiles
from sepi.extensions.rendered.shapes import box, ground, moved, raster, rectangle, sheet, thing, tube, turned_body, wall
from sepi.extensions.rendered.world import Cameras, Light, Material, Mesh, Sun, Things, Vector, World

GROUND = 4.0
_PANE = Material((0.1, 0.12, 0.14), "glossy")
_WHITE, _IRON = Material((0.86, 0.85, 0.8)), Material((0.13, 0.14, 0.15))
_SILL = Material(noise(91, (0.74, 0.7, 0.62), 0.05, 2.0, (3, 256)))


class Front(NamedTuple):
    """A front: where its lower left corner is, how it turns away, and what is on it (lengths in metres)."""

    corner: Vector
    turn: float
    bays: int
    floors: int
    wall: Material
    seed: int
    pitch: float = 2.2
    window: tuple[float, float] = (1.1, 1.7)
    shutters: Material | None = None
    awnings: Material | None = None
    balconies: bool = False
    storey: float = 3.3


def world() -> World:
    """On a clear afternoon: the sun on two of the fronts, the third in the shade."""
    light = Light(sky=(0.36, 0.44, 0.56), suns=[Sun((0.36, 0.72, 0.55), (2.0, 1.86, 1.62))], exposure=1.6, depth=4)
    return World([*_square()], Cameras(6.6, 26.0, 2.2, -1.5, 50), light)


def _square() -> Things:
    red_white = Material(stripes(0.8, [(0.74, 0.16, 0.14), (0.9, 0.87, 0.8)]))
    green = Material(stripes(0.6, [(0.2, 0.4, 0.28), (0.88, 0.85, 0.74)]))
    slats = Material(stripes(0.16, [(0.22, 0.36, 0.34), (0.3, 0.46, 0.43)], across=False))
    brick = Material(bricks(1, 2.4, 20, (0.62, 0.36, 0.27)))
    stucco = Material(noise(11, (0.8, 0.66, 0.44), 0.035, 4.0, (3, 400)))
    stone = Material(noise(21, (0.74, 0.71, 0.65), 0.04, 3.0, (3, 100)))
    left = Front((-14.0, GROUND, 15), 0, 5, 5, stucco, 1, 2.1, shutters=slats, awnings=green)
    fronts = [
        Front((-8, GROUND, 25), 0, 9, 7, brick, 2, 2.05, (1.0, 1.8), awnings=red_white),
        left,
        left._replace(corner=(-3.5, GROUND, 15), turn=-np.pi / 2, awnings=None, seed=3),
        Front((5.6, GROUND, 25.2), 1.63, 8, 7, stone, 4, 2.0, (0.95, 2.0), awnings=red_white, balconies=True),
    ]
    yield thing(ground((-30, GROUND, 2), 60, 40), tiles(31, 3.2, 8, (0.64, 0.61, 0.56), (0.52, 0.5, 0.47)))
    yield from _terrace()
    for front in fronts:
        yield from _front(front)
    for number, (x, z) in enumerate([(0.2, 17.5), (2.9, 15.5), (-0.9, 20.5), (3.9, 20.0)]):
        yield from _parasol((x, GROUND, z), red_white if number % 2 else green)


def _front(front: Front) -> Things:
    """Made with ``x`` along the front, ``y`` down from its foot and ``z`` into the house, then put in its place."""
    rng = np.random.default_rng(front.seed)
    length, (w, h) = front.bays * front.pitch, front.window
    centres = (np.arange(front.bays) + 0.5) * front.pitch
    blind = Material(stripes(0.3, [(0.8, 0.76, 0.66), (0.7, 0.66, 0.56)], across=False))
    walls, sills, bars, panes, blinds, leaves, iron, awnings = parts = [list[Mesh]() for _ in range(8)]
    surfaces = [front.wall, _SILL, _WHITE, _PANE, blind, front.shutters or _WHITE, _IRON, front.awnings or _WHITE]
    for floor in range(front.floors):
        foot = -floor * front.storey
        low, high, top = foot - 0.9, foot - 0.9 - h, foot - front.storey
        walls += [_slab((0, top), (length, high), 0.3), _slab((0, low), (length, foot), 0.3)]
        edges = np.concatenate([[0], np.stack([centres - w / 2, centres + w / 2], 1).ravel(), [length]])
        walls += [_slab((a, high), (b, low), 0.3) for a, b in edges.reshape(-1, 2)]
        sills.append(_slab((-0.05, top + 0.2), (length + 0.05, top + 0.38), 0.35, -0.09))
        for x in centres:
            sills.append(_slab((x - w / 2 - 0.08, low), (x + w / 2 + 0.08, low + 0.09), 0.3, -0.1))
            bars += _casement(x, w, high, low)
            drop = rng.choice([0, 0, 0, 0.35, 0.6, 1.0])
            if drop:
                blinds.append(wall((x - w / 2, high, 0.2), w, drop * h))
            if front.shutters and floor:
                sides = (x - 0.77 * w, x + 0.77 * w)
                leaves += [_slab((at - w / 4, high), (at + w / 4, low), 0.04, -0.05) for at in sides]
            if front.balconies and floor:
                iron += _railing(x - w / 2 - 0.15, low + 0.05, w + 0.3, 0.95, -0.3, 0.12, 0.012)
                sills.append(_slab((x - w / 2 - 0.2, low), (x + w / 2 + 0.2, low + 0.12), 0.1, -0.38))
    if front.awnings:
        for x in centres[-2::-2] + front.pitch / 2:
            awnings += _awning(x, 1.7 * front.pitch)
    panes.append(_slab((0, -front.floors * front.storey), (length, 0), 0.05, 0.27))
    for meshes, material in zip(parts, surfaces, strict=True):
        if meshes:
            yield thing(moved(meshes, (0, front.turn, 0), front.corner), material, thin=meshes is iron)


def _slab(low: tuple[float, float], high: tuple[float, float], depth: float, at: float = 0.0) -> Mesh:
    """A box between two corners of its front; what is painted on a front goes on from one slab to the next."""
    (x0, y0), (x1, y1) = low, high
    mesh = box(((x0 + x1) / 2, (y0 + y1) / 2, at + depth / 2), (x1 - x0, y1 - y0, depth))
    return mesh._replace(uv=mesh.vertices[:, :2] + mesh.vertices[:, 2:])


def _casement(x: float, w: float, high: float, low: float) -> list[Mesh]:
    """Frame, middle post and two cross bars."""
    middles = [x + s * (w / 2 - 0.035) for s in (-1, 0, 1)]
    upright = [_slab((at - 0.035, high), (at + 0.035, low), 0.06, 0.2) for at in middles]
    levels = (high, high + 0.32 * (low - high), low - 0.07)
    return upright + [_slab((x - w / 2, y), (x + w / 2, y + 0.07), 0.06, 0.21) for y in levels]


def _railing(x: float, y: float, length: float, height: float, at: float, pitch: float, radius: float) -> list[Mesh]:
    """Upright bars between two rails; ``x`` and ``y`` are of the lower left corner."""
    steps = np.linspace(0, length, int(length / pitch) + 1)
    bars = [tube([[x + s, y - height, at], [x + s, y, at]], radius, 8) for s in steps]
    rails = [_slab((x, y - off - 0.025), (x + length, y - off + 0.025), 0.04, at - 0.02) for off in (height, 0.12)]
    return [bar._replace(smooth=False) for bar in bars] + rails


def _awning(x: float, width: float) -> list[Mesh]:
    """A slope, and a border that hangs down from it in scallops."""
    slope = rectangle((x - width / 2, -2.95, -0.05), (width, 0, 0), (0, 0.65, -1.15))
    u, v = np.linspace(0, width, 121), np.linspace(0, 1, 3)[:, None]
    drop = v * (0.18 + 0.08 * np.abs(np.sin(np.pi * u / 0.4)))
    return [slope, sheet(raster(x - width / 2 + u, -2.3 + drop, -1.2), smooth=False)]


def _terrace() -> Things:
    """The railing before the cameras, on a low wall."""
    yield thing(_railing(-4.0, 2.8, 8.0, 1.0, 6.9, 0.125, 0.013), _IRON, thin=True)
    yield thing([box((x, 2.28, 6.9), (0.09, 1.2, 0.09)) for x in (-2.6, 0.4, 3.4)], _IRON)
    yield thing(box((0, 3.38, 6.95), (10, 1.15, 0.35)), _SILL)


def _parasol(foot: Vector, cloth: Material) -> Things:
    """Eight panels on a pole, over a table."""
    roof = turned_body([[0.02, 2.75], [1.5, 2.1], [1.5, 1.95]], foot, 8)
    yield thing(roof._replace(smooth=False), cloth)
    yield thing(tube(np.array(foot) + np.array([[0, -2.75, 0], [0, 0, 0]]), 0.03), _WHITE, thin=True)
    table = turned_body([[0.001, 0.75], [0.5, 0.75], [0.5, 0.71], [0.05, 0.7], [0.05, 0.03], [0.3, 0.0]], foot)
    yield thing(table, _WHITE)
