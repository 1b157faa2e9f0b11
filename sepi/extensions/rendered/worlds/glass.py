"""Panes in frames, tumblers, a bottle and a ball of glass before posters with print: two depths in each pixel.

Panes are thin, the vessels solid glass with an inner and an outer surface; pencils and a twig stand in some of them.
"""

import numpy as np

from sepi.extensions.rendered import patterns, shapes
from sepi.extensions.rendered.shapes import ball, box, moved, thing, wall
from sepi.extensions.rendered.staging import vessel
from sepi.extensions.rendered.world import Cameras, Lamp, Light, Material, Mesh, Pattern, Things, Vector, World

COUNTER, WALL = 0.25, 1.75
GLASS, PANE = Material(kind="glass"), Material(kind="glass", pane=True)
FRAME = Material(patterns.wood(11, 0.3, (0.45, 0.3, 0.2), (0.28, 0.18, 0.12)))
# foot, width, height and turn of each pane
_PANES = [((-0.24, COUNTER, 1.45), 0.32, 0.4, -0.3), ((0.31, COUNTER, 1.52), 0.26, 0.32, 0.35)]
_POSTERS = [(-0.64, -0.42, (0.2, 0.42, 0.6)), (-0.19, -0.45, (0.75, 0.28, 0.18)), (0.25, -0.41, (0.3, 0.5, 0.3))]
_TUMBLER = [(0.037, 0.1), (0.0385, 0.1005), (0.0395, 0.099), (0.036, 0.05), (0.033, 0.004), (0.03, 0.0)]
_BOTTLE = [(0.012, 0.27), (0.017, 0.269), (0.017, 0.255), (0.0135, 0.25), (0.0135, 0.2), (0.02, 0.18), (0.04, 0.15),
           (0.043, 0.12), (0.043, 0.01), (0.038, 0.0)]  # fmt: skip
_JUG = [(0.05, 0.2), (0.053, 0.201), (0.054, 0.198), (0.042, 0.16), (0.05, 0.11), (0.068, 0.06), (0.06, 0.01),
        (0.05, 0.0)]  # fmt: skip
_PENCILS = [(0.024, 0.0, 0.03), (-0.012, 0.021, -0.02), (-0.014, -0.02, 0.0)]


def world() -> World:
    """In a bright kitchen: light from everywhere, most of it from the left."""
    lamp = Lamp((-2.4, -1.6, -0.6), (0, 0, 2.2), (1.4, -1.2, 0), (3.0, 2.9, 2.7))
    light = Light(sky=(0.45, 0.46, 0.48), lamps=[lamp], exposure=1.75, depth=10, roulette=6, gloss=0.66)
    things = [*_kitchen(), *_panes(), *_vessels(), *_twig((-0.24, COUNTER, 1.22))]
    return World(things, Cameras(0.95, WALL, 2.1, -1.6, 33), light)


def _kitchen() -> Things:
    paint = Material(patterns.noise(21, (0.62, 0.68, 0.62), 0.03, 0.8))
    yield thing(box((0, COUNTER + 0.02, 1.4), (3.2, 0.04, 0.9)), patterns.wood(1, 0.5))
    yield thing(wall((-2, COUNTER, 0.951), 4, 1), paint)
    yield thing(wall((-2, -1.6, WALL), 4, 2.2), paint)
    yield thing(box((0.02, COUNTER - 0.012, 1.2), (0.32, 0.024, 0.18), (0, 0.1, 0)), FRAME)
    for number, (left, top, tint) in enumerate(_POSTERS):
        hung = shapes.rectangle((left, top, WALL - 0.004), (0.4, 0, 0), (0.004, 0.56, 0))
        yield thing(hung, _poster(number, tint))


def _panes() -> Things:
    for foot, width, height, turn in _PANES:
        yield thing(_frame(foot, width, height, turn), FRAME)
        yield thing(_upright(foot, width, height, turn), PANE)
    # a screen without a frame, before all else
    yield thing(_upright((0.15, COUNTER, 1.06), 0.2, 0.22, 0.15), PANE)
    yield thing(box((0.15, COUNTER - 0.008, 1.06), (0.24, 0.016, 0.03), (0, 0.15, 0)), FRAME)


def _vessels() -> Things:
    board = COUNTER - 0.024
    for foot in ((-0.08, board, 1.2), (0.02, board, 1.16), (0.12, board, 1.22)):
        yield thing(vessel(_TUMBLER, 0.003, foot, 0.014), GLASS)
    yield thing(vessel(_BOTTLE, 0.0035, (-0.24, COUNTER, 1.22), 0.01), GLASS)
    yield thing(vessel(_JUG, 0.004, (0.27, COUNTER, 1.28), 0.012), GLASS)
    yield thing(ball((-0.13, COUNTER - 0.035, 1.07), 0.035), GLASS)
    colours = [(0.75, 0.2, 0.15), (0.2, 0.35, 0.6), (0.85, 0.7, 0.2)]
    for (x, z, lean), colour in zip(_PENCILS, colours, strict=True):
        path = np.array([[0.12 + x, board - 0.012, 1.22 + z], [0.12 + x * 1.3 + lean, board - 0.17, 1.22 + 1.2 * z]])
        yield thing(shapes.tube(path, 0.0035, 8), colour, thin=True)


def _poster(number: int, tint: Vector) -> Pattern:
    """A headline, a picture and small print."""
    seed = 30 + 10 * number
    paper = patterns.printed(seed, 1.0, 40).raster.copy()
    paper[:780] = paper[0, 0]
    paper[40:190, 60:964] = patterns.printed(seed + 1, 1.0, 6).raster[20:170, :904]
    y, x = np.mgrid[:520, :904] / 904
    rings = np.sin(60 * np.hypot(x - 0.4, y - 0.3))
    motif = (rings, np.sin(40 * (x + y)) * np.sin(40 * (x - y)), np.sin(70 * y + 6 * np.sin(9 * x)))[number] > 0
    hills = np.floor(2.2 * patterns.field(seed + 2, 20, 400)[60:580, 60:964]) % 3
    ground = np.array(tint) * (0.6 + 0.3 * hills[..., None])
    grain = 0.05 * patterns.field(seed + 3, 2, 20)[60:580, 60:964, None]
    paper[220:740, 60:964] = np.where((motif & (hills == 1))[..., None], [0.93, 0.88, 0.7], ground) + grain
    return patterns.painted(paper, 0.4, 0.56)


def _upright(foot: Vector, width: float, height: float, turn: float) -> Mesh:
    return moved(wall((-width / 2, -height, 0), width, height), (0, turn, 0), foot)


def _frame(foot: Vector, width: float, height: float, turn: float) -> Mesh:
    """Four bars, and two feet that hold them upright."""
    bar, w, h = 0.018, width / 2, height / 2
    bars = [box((x, -h, 0), (bar, height + bar, bar)) for x in (-w, w)]
    bars += [box((0, y, 0), (width - bar, bar, bar)) for y in (-height, -bar / 2)]
    bars += [box((x, -bar / 2, 0), (bar, bar, 0.1)) for x in (-w + bar, w - bar)]
    return moved(bars, (0, turn, 0), foot)


def _twig(foot: Vector) -> Things:
    """Stands in the bottle, with leaves above."""
    rise = np.linspace(0, 1, 40)
    bend = 0.05 * np.maximum(rise - 0.5, 0)
    path = np.array(foot) + np.stack([0.012 - 0.02 * rise + 2 * bend, -0.012 - 0.42 * rise, bend], 1)
    angle = np.linspace(0, 2 * np.pi, 24, endpoint=False)
    outline = np.stack([0.022 + 0.022 * np.cos(angle), 0.009 * np.sin(angle) * (1 + 0.4 * np.cos(angle))], 1)
    leaves = []
    for number, place in enumerate(path[28:]):
        turn = (0.5 * np.sin(3.0 * number), 2.4 * number, -0.5 - 0.3 * np.cos(5.0 * number))
        leaves.append(moved(shapes.plate(outline, 0.0), turn, place))
    yield thing(shapes.tube(path, 0.0022, 8), (0.35, 0.3, 0.2), thin=True)
    yield thing(leaves, patterns.noise(91, (0.3, 0.45, 0.22), 0.05, 0.1))
