"""A builder's yard behind a wire fence, under cables, in the sun.

Wires of one to three pixels at 512 stand before things of every depth up to the wall behind. The fence is woven of
zigzag wires, one each 3 cm; it starts at a post, so that a part of the yard is seen without it.
"""

import numpy as np
import numpy.typing as npt

from sepi.extensions.rendered import shapes
from sepi.extensions.rendered.patterns import bricks, noise, wood
from sepi.extensions.rendered.shapes import Points, box, ground, moved, rod, thing, tube, wall
from sepi.extensions.rendered.staging import crate, leaning, of_boards, seen_from, strand
from sepi.extensions.rendered.world import Cameras, Light, Material, Sun, Things, World

_WALL = 6.4
# the fence: where its first post stands, how long it is, and how it is turned away from the picture's plane
_POST = np.array([-0.5, 0.0, 2.05])
_ALONG = np.array([np.cos(0.25), 0.0, -np.sin(0.25)])
_LENGTH, _HEIGHT, _MESH = 2.1, 1.45, 0.03


def world() -> World:
    """The yard, in the sun of an afternoon."""
    things = [*_ground(), *_wall(), *_bricks(), *_store(), *_fence(), *_cables()]
    light = Light(sky=(0.62, 0.76, 1.0), suns=[Sun((0.55, 0.75, 0.6), (7.0, 6.3, 5.2))])
    return seen_from(World(things, Cameras(1.62, 6.6, 2.0, -1.6, 50), light), (0.0, -1.15, 0.0), below=5)


def _ground() -> Things:
    yield thing(ground((-9, 0, -1), 18, 9), noise(1, (0.5, 0.47, 0.43), 0.09, 1.4, (3, 60)))
    path = [box((-1.35, -0.015, 1.6 + 0.62 * n), (0.9, 0.04, 0.6), (0, 0.01 * (n % 3), 0)) for n in range(8)]
    yield thing(of_boards(path, 0.3, 0.2), noise(2, (0.62, 0.61, 0.58), 0.05, 1.2, (3, 400), 0.1))


def _wall() -> Things:
    boards = [box((-1.75 + 0.115 * n, -1.06, _WALL - 0.03), (0.112, 2.0, 0.03)) for n in range(9)]
    frame = [box((x, -1.06, _WALL - 0.04), (0.09, 2.12, 0.09)) for x in (-1.86, -0.72)]
    frame += [box((-1.29, -2.15, _WALL - 0.04), (1.23, 0.1, 0.09)), box((1.7, -1.42, _WALL - 0.06), (1.5, 0.07, 0.16))]
    frame += [box((x, -1.9, _WALL - 0.03), (0.05, 0.9, 0.06)) for x in (1.02, 1.7, 2.38)]
    frame += [box((1.7, y, _WALL - 0.03), (1.4, 0.05, 0.055)) for y in (-2.33, -1.9, -1.47)]
    pipe = tube(np.array([[0.25, y, _WALL - 0.09] for y in (-4.5, -2.5, 0)]), 0.045, 20)
    yield thing(wall((-9, -6, _WALL), 18, 6), bricks(10, 1.5, 20))
    yield thing(of_boards(boards, 0.21, 0.3), noise(11, (0.25, 0.36, 0.3), 0.05, 0.7, (3, 200), 0.2))
    yield thing(frame, (0.88, 0.87, 0.83))
    yield thing(wall((1.0, -2.35, _WALL - 0.01), 1.4, 0.9), Material((0.1, 0.13, 0.16), "glossy"))
    yield thing(pipe, Material((0.36, 0.37, 0.36), "glossy", 0.2))


def _bricks() -> Things:
    rng = np.random.default_rng(7)
    stacks, pallets = [], []
    for x, z, turn, layers in ((0.62, 4.3, 0.3, 9), (-0.55, 5.2, -0.15, 6)):
        stack = []
        for layer, column in np.ndindex(layers, 4):
            for row in range(4 if layer < layers - 1 else rng.integers(1, 4)):
                off = rng.normal(0, 0.004, 2)
                place = (0.245 * (column - 1.5) + off[0], -0.18 - 0.072 * layer, 0.12 * (row - 1.5) + off[1])
                brick = box(place, (0.235, 0.068, 0.11), (0, rng.normal(0, 0.02), 0))
                stack.append(shapes.painted_from(brick, *rng.uniform(0, 0.6, 2)))
        pallet = [box((side, -0.06, 0), (0.1, 0.12, 0.6)) for side in (-0.42, 0.0, 0.42)]
        pallet.append(of_boards([box((0, -0.131, 0.13 * (n - 2)), (1.1, 0.022, 0.1)) for n in range(5)], 0.2, 0.1))
        stacks.append(moved(stack, (0, turn, 0), (x, 0, z)))
        pallets.append(moved(pallet, (0, turn, 0), (x, 0, z)))
    yield thing(stacks, noise(21, (0.6, 0.32, 0.23), 0.06, 0.6, (3, 100)))
    yield thing(pallets, wood(22, 0.9, (0.66, 0.58, 0.46), (0.45, 0.37, 0.28)))


def _store() -> Things:
    crates = [
        crate((0.6, 0.4, 0.42), 4, 0.5, (1.75, 0, 4.9)),
        crate((0.6, 0.36, 0.42), 4, 0.3, (1.72, -0.41, 4.9)),
        crate((0.5, 0.35, 0.4), 3, -0.4, (-0.35, 0, 3.6)),
    ]
    side = [[0, 0.88], [0.27, 0.88], [0.285, 0.86], [0.28, 0.6], [0.295, 0.59], [0.28, 0.58], [0.28, 0.3]]
    side += [[0.295, 0.29], [0.28, 0.28], [0.285, 0.0], [0, 0]]
    barrel = shapes.turned_body(shapes.bevelled(side, 0.006), (1.42, 0, 3.6))
    ladder = [rod((-2.32, -0.3 * n, 6.03 + 0.034 * n), (-1.98, -0.3 * n, 6.03 + 0.034 * n), 0.014) for n in range(1, 9)]
    ladder += [rod((x, 0, 6.0), (x, -2.7, 6.3), 0.022) for x in (-2.34, -1.96)]
    for n, x in enumerate((2.6, 2.75, 2.95)):
        ladder.append(leaning((x, 0, 5.4), (x + 0.2 * n - 0.2, -2.2 - 0.2 * n, _WALL - 0.02), 0.1, 0.016))
    yield thing(crates, wood(31, 0.7, (0.7, 0.55, 0.38), (0.48, 0.34, 0.22)))
    yield thing(barrel, noise(32, (0.3, 0.4, 0.52), 0.07, 1.0, (3, 300), 0.7))
    yield thing(ladder, (0.62, 0.5, 0.3), thin=True)


def _fence() -> Things:
    heights = np.arange(0.05, _HEIGHT, _MESH)
    # wires pass before and behind their neighbours in turn
    odd = np.arange(len(heights)) % 2
    off = 0.002 * (2.0 * odd - 1)
    wires = [tube(_on_fence(_MESH * (n + odd), heights, off), 0.0019, 6) for n in range(int(_LENGTH / _MESH))]
    rows = ((0.08, 0.0), (0.75, 0.0), (1.43, 0.0), (1.54, 0.01), (1.66, 0.01))
    tension = [strand(_on_fence([0, _LENGTH], height), sag, 0.0022) for height, sag in rows]
    yield thing(wires + tension, Material((0.6, 0.63, 0.65), "glossy", 0.25), thin=True)
    posts = [_on_fence(along, [0.0, 1.72]) for along in (0.0, 1.62)]
    yield thing([rod(foot, top, 0.021, 20) for foot, top in posts], Material((0.25, 0.38, 0.3), "glossy", 0.2))


def _on_fence(along: npt.ArrayLike, height: npt.ArrayLike, off: npt.ArrayLike = 0.0) -> Points:
    """Points of the fence, which may stand off its plane."""
    axes = np.stack([_ALONG, [0.0, -1.0, 0.0], np.cross(_ALONG, [0.0, 1.0, 0.0])])
    return np.asarray(_POST + shapes.raster(along, height, off) @ axes)


def _cables() -> Things:
    spans = [
        ((-2.6, -2.35, 3.2), (3.0, -2.25, 4.6), 0.18, 0.007),
        ((-2.6, -2.25, 3.25), (3.0, -2.05, 4.65), 0.25, 0.005),
        ((-2.5, -1.75, 2.6), (2.0, -2.2, 2.9), 0.16, 0.005),
        ((-3.2, -3.0, 6.1), (3.6, -2.6, 6.2), 0.25, 0.01),
        ((-1.1, -2.2, 1.9), (1.4, -1.98, 5.6), 0.12, 0.004),
    ]
    cables = [strand((first, last), sag, radius) for first, last, sag, radius in spans]
    rng = np.random.default_rng(9)
    canes = []
    for x in np.linspace(-1.25, -0.1, 9):
        foot = np.array([x + rng.normal(0, 0.03), 0.0, 2.9 + rng.normal(0, 0.12)])
        top = foot + np.array([rng.normal(0, 0.05), -rng.uniform(1.0, 1.6), rng.normal(0, 0.05)])
        canes.append(rod(foot, top, rng.uniform(0.004, 0.007)))
    yield thing(cables, (0.07, 0.07, 0.08), thin=True)
    yield thing(canes, (0.6, 0.52, 0.3), thin=True)
