"""Houses with striped, chequered and brick fronts, roofs in rows, and wires and aerials before a bare sky.

Periods are 3 to 12 pixels at 512, so several lie within the disparity range. Fronts face the cameras, and the walls
behind them are plain: at a slant a period would be finer than a pixel.
"""

import numpy as np

from sepi.extensions.rendered.patterns import bricks, noise, stripes, tiles
from sepi.extensions.rendered.shapes import ground, moved, rod, thing, wall
from sepi.extensions.rendered.staging import house, seen_from, strand
from sepi.extensions.rendered.world import Cameras, Light, Material, Sun, Things, World

_SKY = 150.0
_DEEP = 8.0
_PALE, _RED, _BLUE, _SLATE = (0.86, 0.83, 0.74), (0.58, 0.2, 0.15), (0.3, 0.42, 0.52), (0.3, 0.3, 0.33)
# of each house: right and away of its middle, width, height to the eaves, height and period of the roof
_PLACES = [
    (-6.0, 19.0, 6.6, 3.0, 2.4, 0.34),
    (5.6, 21.0, 7.0, 3.6, 2.4, 0.24),
    (-0.6, 31.0, 6.5, 5.4, 2.8, 0.5),
    (-11.5, 40.0, 9.0, 12.0, 3.4, 0.5),
    (12.5, 44.0, 9.5, 12.5, 3.4, 0.9),
    (4.5, 60.0, 11.0, 18.0, 4.0, 1.4),
    (-9.0, 66.0, 11.0, 20.0, 4.0, 0.9),
]


def world() -> World:
    """The street on a clear morning."""
    light = Light(sky=(0.6, 0.7, 0.85), suns=[Sun((0.5, 0.75, 0.6), (5.0, 4.7, 4.1))], exposure=0.9)
    street = World([*_street(), *_houses(), *_wires()], Cameras(11.0, _SKY, 2.1, -1.6, 40), light)
    return seen_from(street, (0.0, -3.2, 0.0), below=-4)


def _street() -> Things:
    yield thing(wall((-_SKY, -_SKY, _SKY), 2 * _SKY, _SKY), (0.5, 0.66, 0.88))
    yield thing(ground((-_SKY, 0, 0), 2 * _SKY, _SKY), noise(1, (0.4, 0.45, 0.26), 0.06, 20.0, (12, 400)))


def _houses() -> Things:
    fronts = [
        stripes(0.15, [_PALE, _BLUE]),
        tiles(11, 1.76, 16, _PALE, _RED),
        bricks(12, 2.0, 14),
        stripes(0.22, [_PALE, (0.5, 0.44, 0.3)], across=False),
        stripes(0.65, [_PALE, _RED]),
        tiles(13, 5.6, 16, _PALE, _BLUE),
        stripes(0.3, [_PALE, _SLATE]),
    ]
    plaster, glass = Material(noise(21, (0.74, 0.7, 0.62), 0.03, 9.0, (12, 300))), Material((0.1, 0.11, 0.13), "glossy")
    for (x, z, wide, tall, rise, row), front in zip(_PLACES, fronts, strict=True):
        body, roof, windows = (moved(part, by=(x, 0, z)) for part in house(wide, _DEEP, tall, rise))
        yield thing(body, plaster)
        yield thing(wall((x - wide / 2, -tall, z - _DEEP / 2 - 0.01), wide, tall), front)
        yield thing(roof, stripes(row, [(0.5, 0.26, 0.2), _SLATE], across=False))
        yield thing(windows, glass)


def _wires() -> Things:
    """Cables from pole to pole, and an aerial on each roof."""
    poles = [(-6.4, 12.4), (2.6, 14.0), (11.6, 15.6)]
    yield thing([rod((x, 0, z), (x, -8.4, z), 0.09) for x, z in poles], noise(31, (0.4, 0.32, 0.25), 0.05, 2.0))
    ends = [((-20, 10.0), poles[0]), (poles[0], poles[1]), (poles[1], poles[2]), ((-13.0, 24.0), (15.0, 27.0))]
    cables = [strand([(a, -y, b), (c, -y, d)], 0.4, 0.002 * y) for (a, b), (c, d) in ends for y in (8.3, 7.9, 7.4, 5.8)]
    for x, z, wide, tall, rise, _ in _PLACES:
        foot, size = np.array([x - wide / 4, -tall - rise, z]), np.array([0.035 * z, 0, 0])
        cables.append(rod(foot, foot - [0, 1 + 0.055 * z, 0], 0.0012 * z))
        for n in range(4):
            bar = foot - [0, 1 + 0.012 * n * z, 0]
            cables.append(rod(bar - size, bar + size, 0.0007 * z))
    yield thing(cables, (0.1, 0.1, 0.11), thin=True)
