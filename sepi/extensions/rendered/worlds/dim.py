"""A workbench with tools before a boarded wall, by one lamp: a tenth of the light, so noise is in the shadows.

The lamp hangs above the picture on the left; what the room sends back is little beside it.
"""

import numpy as np

from sepi.extensions.rendered import patterns, shapes
from sepi.extensions.rendered.shapes import ball, box, moved, raster, thing, tube, turned_body
from sepi.extensions.rendered.staging import profile, vessel
from sepi.extensions.rendered.world import Cameras, Lamp, Light, Material, Mesh, Things, Vector, World

BENCH, WALL = 0.33, 1.95
HUNG = WALL - 0.035
_TIN = [(0.045, 0.12), (0.047, 0.118), (0.045, 0.112), (0.045, 0.006), (0.046, 0.0)]
_JAR = [(0.034, 0.115), (0.034, 0.1), (0.04, 0.09), (0.041, 0.01), (0.038, 0.0)]
_CAN = [(0.003, 0.2), (0.004, 0.17), (0.011, 0.11), (0.014, 0.1), (0.045, 0.075), (0.05, 0.06), (0.05, 0.004),
        (0.049, 0.0)]  # fmt: skip

STEEL = Material(kind="mirror", metal="Cr", roughness=0.3)
IRON = Material((0.16, 0.16, 0.17), "glossy", 0.2)
_SPANNERS = [(0.19, 0.2), (0.235, 0.165), (0.275, 0.13)]
_HANDLE = [(0.0005, 0.1), (0.008, 0.099), (0.014, 0.09), (0.015, 0.07), (0.0105, 0.045), (0.014, 0.015), (0.01, 0.0)]


def world() -> World:
    """At night; the door behind stands ajar."""
    boards = Material(patterns.wood(1, 0.7, (0.58, 0.44, 0.31), (0.36, 0.25, 0.17)))
    beech = Material(patterns.wood(11, 0.3, (0.74, 0.56, 0.37), (0.52, 0.36, 0.22)))
    top = patterns.wood(21, 0.9, (0.62, 0.47, 0.32), (0.36, 0.24, 0.15))
    red = Material(patterns.noise(31, (0.55, 0.13, 0.1), 0.05, 0.3, (3, 256)), "glossy", 0.15)
    things = [
        thing(_boards(), boards),
        thing(box((0, BENCH + 0.03, 1.52), (2.6, 0.06, 0.9)), top),
        thing(box((0, BENCH + 0.35, 1.5), (2.6, 0.6, 0.8)), boards),
        thing(box((0.46, -0.28, WALL - 0.09), (0.66, 0.022, 0.17)), beech),
        thing(box((-0.3, -0.05, HUNG), (0.62, 0.05, 0.03)), beech),
        *_shelf_ware(),
        *_chisels((-0.3, -0.05, HUNG - 0.02), beech),
        *_saw((0.43, -0.02, HUNG), beech),
        *_hammer((-0.14, BENCH - 0.014, 1.25), (np.pi / 2, 0.5, 0), beech),
        *_hammer((0.09, -0.12, HUNG), (0, 0, 0), beech),
        *_vice((-0.42, BENCH, 1.36), red),
        *_plane((0.3, BENCH, 1.36), beech),
        *(thing(_spanner(length, (x, 0.05, HUNG), 0.08), STEEL) for x, length in _SPANNERS),
        thing(vessel(_CAN, 0.001, (0.03, BENCH, 1.6)), Material(kind="mirror", metal="Cu", roughness=0.2)),
        thing(_cable((-0.68, -0.2, HUNG - 0.02)), IRON, thin=True),
        thing(_plan(), patterns.printed(51, 0.36, 18, (0.86, 0.82, 0.7), 0.25)),
        *_shavings(),
        *_blocks(beech),
        *_brushes((-0.16, BENCH, 1.66), beech),
    ]
    lamp = Lamp((-0.65, -0.88, 1.12), (0, 0, 0.42), (0.7, 0, 0), (4.6, 3.8, 2.7))
    light = Light(sky=(0.022, 0.025, 0.034), lamps=[lamp], exposure=4.5, share=0.1, depth=5)
    return World(things, Cameras(1.1, WALL, 1.8, -1.8, 44), light)


def _boards() -> list[Mesh]:
    """Upright boards, each a little before or behind the next, grain along them."""
    rng, found = np.random.default_rng(3), []
    for x in np.arange(-1.5, 1.5, 0.135):
        board = box((0, 0, 0), (3.0, 0.131, 0.03), (rng.normal(0, 0.01), 0, 0))
        shifted = shapes.painted_from(board, *rng.random(2).astype(np.float32))
        found.append(moved(shifted, (0, 0, np.pi / 2), (x, -0.3, WALL + 0.015 + rng.uniform(-0.004, 0.004))))
    return [*found, shapes.wall((-2, -2, WALL + 0.035), 4, 4)]


def _shelf_ware() -> Things:
    """Tins with stripes, and jars, on the shelf."""
    shelf, z = -0.291, WALL - 0.09
    tins = [
        (0.2, (0.7, 0.3, 0.16), (0.85, 0.8, 0.66)),
        (0.31, (0.2, 0.36, 0.5), (0.8, 0.8, 0.76)),
        (0.53, (0.36, 0.44, 0.22), (0.86, 0.74, 0.4)),
    ]
    for x, dark, pale in tins:
        yield thing(vessel(_TIN, 0.001, (x, shelf, z)), patterns.stripes(0.08, [dark, pale, pale], across=False))
    for number, x in enumerate((0.42, 0.64, 0.735)):
        colour = (0.5 - 0.1 * number, 0.4, 0.3 + 0.06 * number)
        content = patterns.noise(41 + 5 * number, colour, 0.12, 0.12, (3, 40))
        yield thing(vessel(_JAR, 0.002, (x, shelf, z)), Material(content, "glossy"))


def _plan() -> Mesh:
    """A sheet of paper, pinned above, that curls below."""
    x, y = np.meshgrid(np.linspace(0, 0.34, 30), np.linspace(0, 0.26, 30))
    lift = 0.004 + 0.05 * (y / 0.26) ** 3 * (0.3 + (x / 0.34 - 0.5) ** 2)
    return shapes.sheet(raster(-0.4 + x, -0.47 + 0.02 * x + y, HUNG + 0.028 - lift))


def _cable(at: Vector) -> Mesh:
    """A coil on a nail."""
    turn = np.linspace(0, 14 * np.pi, 500)
    radius = 0.1 + 0.007 * np.sin(2.3 * turn) + 0.004 * np.cos(0.71 * turn)
    path = np.stack([radius * np.sin(turn), 1.2 * radius * np.cos(turn), 0.012 * np.sin(1.37 * turn)], 1)
    return moved(tube(path, 0.0035, 8), by=at)


def _shavings() -> Things:
    """Curls that lie about before the plane."""
    rng, curls = np.random.default_rng(7), []
    for _ in range(16):
        turn = np.linspace(0, rng.uniform(6, 14), 80)[:, None]
        radius = rng.uniform(0.008, 0.016) * (1 - 0.02 * turn)
        across = np.array([[-1.0, 1.0]]) * rng.uniform(0.006, 0.014)
        curl = shapes.sheet(raster(across + 0.003 * turn, radius * np.cos(turn), radius * np.sin(turn)))
        place = (rng.uniform(0.0, 0.4), BENCH - 0.016, rng.uniform(1.16, 1.3))
        curls.append(moved(curl, (0, rng.uniform(0, 6), 0), place))
    yield thing(curls, patterns.wood(61, 0.08, (0.86, 0.7, 0.48), (0.72, 0.54, 0.34)))


def _blocks(wood: Material) -> Things:
    """Offcuts in a pile on the right."""
    laid = [((0.62, -0.02, 1.62), (0.34, 0.04, 0.09), 0.15), ((0.63, -0.02, 1.74), (0.4, 0.04, 0.08), 0.05)]
    laid += [((0.6, -0.065, 1.66), (0.28, 0.05, 0.1), -0.2), ((0.56, -0.105, 1.67), (0.2, 0.03, 0.07), 0.5)]
    yield thing([box((x, BENCH + y, z), size, (0, turn, 0)) for (x, y, z), size, turn in laid], wood)


def _brushes(foot: Vector, wood: Material) -> Things:
    """In a tin."""
    sticks, hairs = [], []
    for angle, rise in ((0.3, 0.2), (2.2, 0.23), (4.0, 0.18), (5.2, 0.25)):
        out = np.array([np.cos(angle), 0, np.sin(angle)])
        path = np.add(foot, [0.01 * out, 0.03 * out + [0, -0.11, 0], 0.03 * out * rise / 0.1 + [0, -rise, 0]])
        sticks.append(tube(path, 0.004, 8))
        tip = path[-1] + (path[-1] - path[-2]) / np.linalg.norm(path[-1] - path[-2]) * np.linspace(0, 0.04, 6)[:, None]
        hairs.append(tube(tip, np.array([0.006, 0.008, 0.009, 0.009, 0.006, 0.001])))
    yield thing(vessel(_TIN, 0.001, foot), STEEL)
    yield thing(sticks, wood, thin=True)
    yield thing(hairs, (0.3, 0.22, 0.16))


def _chisels(at: Vector, wood: Material) -> Things:
    """In a rack, blades down, each narrower than the one before."""
    places = list(enumerate(at[0] + np.linspace(-0.27, 0.27, 8)))
    yield thing([turned_body(profile(_HANDLE, 40), (x, at[1] - 0.025, at[2]), 24) for _, x in places], wood)
    yield thing([box((x, at[1] + 0.06, at[2]), (0.026 - 0.002 * n, 0.17, 0.004)) for n, x in places], STEEL)


def _saw(at: Vector, wood: Material) -> Things:
    """Hung by its grip: a tapered blade with teeth."""
    teeth = np.linspace(0, 0.42, 85)
    edge = np.stack([teeth, 0.05 + 0.003 * (np.arange(85) % 2)], 1)
    outline = np.concatenate([[[0, -0.06]], [[0.42, -0.01]], edge[::-1]])
    grip = [_bar((-0.01, -0.055, 0), (-0.07, -0.045, 0), 0.013), _bar((-0.07, -0.045, 0), (-0.08, 0.035, 0), 0.014)]
    grip += [_bar((-0.08, 0.035, 0), (0.0, 0.04, 0), 0.013), box((0.005, -0.005, 0), (0.03, 0.1, 0.018))]
    yield thing(moved(shapes.plate(outline, 0.0015), (0, 0, 0.12), at), STEEL)
    yield thing(moved(grip, (0, 0, 0.12), at), wood)


def _hammer(at: Vector, turn: Vector, wood: Material) -> Things:
    face = turned_body([[0.0005, 0.0], [0.015, 0.0], [0.015, -0.035]], (0, 0, 0), 24)
    head = [box((0.01, -0.13, 0), (0.06, 0.026, 0.026))]
    head += [box((-0.035, -0.127, 0), (0.05, 0.012, 0.026), (0, 0, 0.15))]
    head += [moved(face, (0, 0, np.pi / 2), (0.065, -0.13, 0))]
    along = np.array([[0, -0.15, 0], [0, -0.05, 0], [0, 0.06, 0], [0, 0.14, 0]])
    yield thing(moved(head, turn, at), IRON)
    yield thing(moved(tube(along, np.array([0.009, 0.01, 0.012, 0.014])), turn, at), wood)


def _spanner(length: float, at: Vector, lean: float) -> Mesh:
    angle = np.linspace(0.5, 2 * np.pi - 0.5, 30)
    jaw = 0.12 * length * np.stack([np.sin(angle), -np.cos(angle)], 1)
    end = shapes.plate(np.concatenate([jaw, [[0, 0.0]]]), 0.007)
    ends = [moved(end, (0, 0, np.pi * side), (0, length * (0.5 - side), 0)) for side in (0, 1)]
    return moved([*ends, box((0, 0, 0), (0.09 * length, 0.85 * length, 0.005))], (0, 0, lean), at)


def _vice(at: Vector, paint: Material) -> Things:
    """Jaws, a bed, a screw with its cross bar, towards the right."""
    body = [box((0, -0.02, 0), (0.16, 0.04, 0.13)), box((-0.03, -0.075, 0), (0.06, 0.09, 0.1))]
    body += [box((-0.025, -0.13, 0), (0.045, 0.04, 0.13)), box((0.075, -0.125, 0), (0.04, 0.05, 0.13))]
    body += [box((0.06, -0.075, 0), (0.12, 0.05, 0.06)), box((0.075, -0.09, 0), (0.035, 0.06, 0.09))]
    bright = [_bar((0.1, -0.075, 0), (0.2, -0.075, 0), 0.012)]
    bright += [_bar((0.185, -0.075, 0.09), (0.185, -0.075, -0.09), 0.006)]
    bright += [ball((0.185, -0.075, z), 0.01, None, 16) for z in (-0.09, 0.09)]
    yield thing(moved(body, (0, 0.35, 0), at), paint)
    yield thing(moved(bright, (0, 0.35, 0), at), STEEL)


def _plane(at: Vector, wood: Material) -> Things:
    """A block with a slanting iron, a wedge, a knob before and a grip behind."""
    block = [box((0, -0.032, 0), (0.24, 0.064, 0.065))]
    block += [box((0.035, -0.085, 0), (0.012, 0.09, 0.045), (0, 0, 0.75))]
    block += [ball((-0.085, -0.085, 0), 0.02, None, 32), _bar((-0.085, -0.06, 0), (-0.085, -0.08, 0), 0.01)]
    block += [_bar((0.09, -0.06, 0), (0.105, -0.13, 0), 0.014)]
    iron = box((0.022, -0.09, 0), (0.005, 0.13, 0.05), (0, 0, 0.75))
    yield thing(moved(block, (0, -0.5, 0), at), wood)
    yield thing(moved(iron, (0, -0.5, 0), at), STEEL)


def _bar(start: Vector, end: Vector, radius: float) -> Mesh:
    return tube(np.array([start, end]), radius, 16)
