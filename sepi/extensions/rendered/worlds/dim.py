"""A workbench with tools before a boarded wall, by one lamp: a tenth of the light, so noise is in the shadows.

The lamp hangs above the picture on the left; what the room sends back is little beside it.
"""

from __future__ import annotations

import numpy as np

from sepi.extensions.rendered import patterns, shapes, staging
from sepi.extensions.rendered.world import Cameras, Lamp, Light, Material, Mesh, Paths, Thing, Vector, World

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
    top = Material(patterns.wood(21, 0.9, (0.62, 0.47, 0.32), (0.36, 0.24, 0.15)))
    red = Material(patterns.noise(31, (0.55, 0.13, 0.1), 0.05, 0.3, finest=3), "glossy", 0.15)
    things = [
        Thing(_boards(), boards),
        Thing(shapes.box((0, BENCH + 0.03, 1.52), (2.6, 0.06, 0.9)), top),
        Thing(shapes.box((0, BENCH + 0.35, 1.5), (2.6, 0.6, 0.8)), boards),
        Thing(shapes.box((0.46, -0.28, WALL - 0.09), (0.66, 0.022, 0.17)), beech),
        Thing(shapes.box((-0.3, -0.05, HUNG), (0.62, 0.05, 0.03)), beech),
        *_shelf_ware(),
        *_chisels((-0.3, -0.05, HUNG - 0.02), beech),
        *_saw((0.43, -0.02, HUNG), beech),
        *_hammer((-0.14, BENCH - 0.014, 1.25), (np.pi / 2, 0.5, 0), beech),
        *_hammer((0.09, -0.12, HUNG), (0, 0, 0), beech),
        *_vice((-0.42, BENCH, 1.36), red),
        *_plane((0.3, BENCH, 1.36), beech),
        *(Thing(_spanner(length, (x, 0.05, HUNG), 0.08), STEEL) for x, length in _SPANNERS),
        Thing(staging.vessel(_CAN, 0.001, (0.03, BENCH, 1.6)), Material(kind="mirror", metal="Cu", roughness=0.2)),
        Thing(_cable((-0.68, -0.2, HUNG - 0.02)), IRON, thin=True),
        Thing(_plan(), Material(patterns.printed(51, 0.36, 18, (0.86, 0.82, 0.7), 0.25))),
        *_shavings(),
        *_blocks(beech),
        *_brushes((-0.16, BENCH, 1.66), beech),
    ]
    lamp = Lamp((-0.65, -0.88, 1.12), (0, 0, 0.42), (0.7, 0, 0), (4.6, 3.8, 2.7))
    light = Light(sky=(0.022, 0.025, 0.034), lamps=[lamp], exposure=4.5, share=0.1)
    return World(things, Cameras(1.1, WALL, 1.8, -1.8, 44), light, Paths(5))


def _boards() -> Mesh:
    """Upright boards, each a little before or behind the next, grain along them."""
    rng = np.random.default_rng(3)
    found = []
    for x in np.arange(-1.5, 1.5, 0.135):
        board = shapes.box((0, 0, 0), (3.0, 0.131, 0.03), (rng.normal(0, 0.01), 0, 0))
        shifted = shapes.painted_from(board, *rng.random(2).astype(np.float32))
        place = (float(x), -0.3, WALL + 0.015 + rng.uniform(-0.004, 0.004))
        found.append(shapes.moved(shifted, (0, 0, np.pi / 2), place))
    back = shapes.rectangle((-2, -2, WALL + 0.035), (4, 0, 0), (0, 4, 0))
    return shapes.joined([*found, back])


def _shelf_ware() -> list[Thing]:
    """Tins with stripes, and jars, on the shelf."""
    found, shelf, z = [], -0.291, WALL - 0.09
    colours = [
        ((0.7, 0.3, 0.16), (0.85, 0.8, 0.66)),
        ((0.2, 0.36, 0.5), (0.8, 0.8, 0.76)),
        ((0.36, 0.44, 0.22), (0.86, 0.74, 0.4)),
    ]
    for number, x in enumerate((0.2, 0.31, 0.53)):
        label = patterns.stripes(0.08, [*colours[number], colours[number][1]], across=False)
        found.append(Thing(staging.vessel(_TIN, 0.001, (x, shelf, z)), Material(label)))
    for number, x in enumerate((0.42, 0.64, 0.735)):
        colour = (0.5 - 0.1 * number, 0.4, 0.3 + 0.06 * number)
        content = patterns.noise(41 + 5 * number, colour, 0.12, 0.12, finest=3, coarsest=40)
        found.append(Thing(staging.vessel(_JAR, 0.002, (x, shelf, z)), Material(content, "glossy")))
    return found


def _plan() -> Mesh:
    """A sheet of paper, pinned above, that curls below."""
    x, y = np.meshgrid(np.linspace(0, 0.34, 30), np.linspace(0, 0.26, 30))
    lift = 0.004 + 0.05 * (y / 0.26) ** 3 * (0.3 + (x / 0.34 - 0.5) ** 2)
    return shapes.sheet(np.stack([-0.4 + x, -0.47 + 0.02 * x + y, HUNG + 0.028 - lift], -1))


def _cable(at: Vector) -> Mesh:
    """A coil on a nail."""
    turn = np.linspace(0, 14 * np.pi, 500)
    radius = 0.1 + 0.007 * np.sin(2.3 * turn) + 0.004 * np.cos(0.71 * turn)
    path = np.stack([radius * np.sin(turn), 1.2 * radius * np.cos(turn), 0.012 * np.sin(1.37 * turn)], 1)
    return shapes.moved(shapes.tube(path, 0.0035, 8), by=at)


def _shavings() -> list[Thing]:
    """Curls that lie about before the plane."""
    rng, curls = np.random.default_rng(7), []
    for _ in range(16):
        turn = np.linspace(0, rng.uniform(6, 14), 80)[:, None]
        radius = rng.uniform(0.008, 0.016) * (1 - 0.02 * turn)
        across = np.array([[-1.0, 1.0]]) * rng.uniform(0.006, 0.014)
        points = [across + 0.003 * turn, radius * np.cos(turn) + 0 * across, radius * np.sin(turn) + 0 * across]
        curl = shapes.sheet(np.stack(np.broadcast_arrays(*points), -1))
        place = (rng.uniform(0.0, 0.4), BENCH - 0.016, rng.uniform(1.16, 1.3))
        curls.append(shapes.moved(curl, (0, rng.uniform(0, 6), 0), place))
    return [Thing(shapes.joined(curls), Material(patterns.wood(61, 0.08, (0.86, 0.7, 0.48), (0.72, 0.54, 0.34))))]


def _blocks(wood: Material) -> list[Thing]:
    """Offcuts in a pile on the right."""
    laid = [((0.62, -0.02, 1.62), (0.34, 0.04, 0.09), 0.15), ((0.63, -0.02, 1.74), (0.4, 0.04, 0.08), 0.05)]
    laid += [((0.6, -0.065, 1.66), (0.28, 0.05, 0.1), -0.2), ((0.56, -0.105, 1.67), (0.2, 0.03, 0.07), 0.5)]
    boxes = [shapes.box((x, BENCH + y, z), size, (0, turn, 0)) for (x, y, z), size, turn in laid]
    return [Thing(shapes.joined(boxes), wood)]


def _brushes(foot: Vector, wood: Material) -> list[Thing]:
    """In a tin."""
    found = [Thing(staging.vessel(_TIN, 0.001, foot), STEEL)]
    sticks, hairs = [], []
    for angle, rise in ((0.3, 0.2), (2.2, 0.23), (4.0, 0.18), (5.2, 0.25)):
        out = np.array([np.cos(angle), 0, np.sin(angle)])
        ends = [0.01 * out, 0.03 * out + [0, -0.11, 0], 0.03 * out * rise / 0.1 + [0, -rise, 0]]
        path = np.array(foot) + np.array(ends)
        sticks.append(shapes.tube(path, 0.004, 8))
        tip = path[-1] + (path[-1] - path[-2]) / np.linalg.norm(path[-1] - path[-2]) * np.linspace(0, 0.04, 6)[:, None]
        hairs.append(shapes.tube(tip, np.array([0.006, 0.008, 0.009, 0.009, 0.006, 0.001])))
    found.append(Thing(shapes.joined(sticks), wood, thin=True))
    return [*found, Thing(shapes.joined(hairs), Material((0.3, 0.22, 0.16)))]


def _chisels(at: Vector, wood: Material) -> list[Thing]:
    """In a rack, blades down, each narrower than the one before."""
    handles, blades = [], []
    for number, x in enumerate(at[0] + np.linspace(-0.27, 0.27, 8)):
        handles.append(shapes.turned_body(staging.profile(_HANDLE, 40), (float(x), at[1] - 0.025, at[2]), 24))
        blades.append(shapes.box((float(x), at[1] + 0.06, at[2]), (0.026 - 0.002 * number, 0.17, 0.004)))
    return [Thing(shapes.joined(handles), wood), Thing(shapes.joined(blades), STEEL)]


def _saw(at: Vector, wood: Material) -> list[Thing]:
    """Hung by its grip: a tapered blade with teeth."""
    teeth = np.linspace(0, 0.42, 85)
    edge = np.stack([teeth, 0.05 + 0.003 * (np.arange(85) % 2)], 1)
    outline = np.concatenate([[[0, -0.06]], [[0.42, -0.01]], edge[::-1]])
    grip = [_bar((-0.01, -0.055, 0), (-0.07, -0.045, 0), 0.013), _bar((-0.07, -0.045, 0), (-0.08, 0.035, 0), 0.014)]
    grip += [_bar((-0.08, 0.035, 0), (0.0, 0.04, 0), 0.013), shapes.box((0.005, -0.005, 0), (0.03, 0.1, 0.018))]
    lean = (0, 0, 0.12)
    return [Thing(_set([shapes.plate(outline, 0.0015)], at, lean), STEEL), Thing(_set(grip, at, lean), wood)]


def _hammer(at: Vector, turn: Vector, wood: Material) -> list[Thing]:
    face = shapes.turned_body(np.array([[0.0005, 0.0], [0.015, 0.0], [0.015, -0.035]]), (0, 0, 0), 24)
    head = [shapes.box((0.01, -0.13, 0), (0.06, 0.026, 0.026))]
    head += [shapes.box((-0.035, -0.127, 0), (0.05, 0.012, 0.026), (0, 0, 0.15))]
    head += [shapes.moved(face, (0, 0, np.pi / 2), (0.065, -0.13, 0))]
    along = np.array([[0, -0.15, 0], [0, -0.05, 0], [0, 0.06, 0], [0, 0.14, 0]])
    handle = shapes.tube(along, np.array([0.009, 0.01, 0.012, 0.014]))
    return [Thing(_set(head, at, turn), IRON), Thing(_set([handle], at, turn), wood)]


def _spanner(length: float, at: Vector, lean: float) -> Mesh:
    angle = np.linspace(0.5, 2 * np.pi - 0.5, 30)
    jaw = 0.12 * length * np.stack([np.sin(angle), -np.cos(angle)], 1)
    end = shapes.plate(np.concatenate([jaw, [[0, 0.0]]]), 0.007)
    ends = [shapes.moved(end, (0, 0, np.pi * side), (0, length * (0.5 - side), 0)) for side in (0, 1)]
    return _set([*ends, shapes.box((0, 0, 0), (0.09 * length, 0.85 * length, 0.005))], at, (0, 0, lean))


def _vice(at: Vector, paint: Material) -> list[Thing]:
    """Jaws, a bed, a screw with its cross bar, towards the right."""
    body = [shapes.box((0, -0.02, 0), (0.16, 0.04, 0.13)), shapes.box((-0.03, -0.075, 0), (0.06, 0.09, 0.1))]
    body += [shapes.box((-0.025, -0.13, 0), (0.045, 0.04, 0.13)), shapes.box((0.075, -0.125, 0), (0.04, 0.05, 0.13))]
    body += [shapes.box((0.06, -0.075, 0), (0.12, 0.05, 0.06)), shapes.box((0.075, -0.09, 0), (0.035, 0.06, 0.09))]
    bright = [_bar((0.1, -0.075, 0), (0.2, -0.075, 0), 0.012)]
    bright += [_bar((0.185, -0.075, 0.09), (0.185, -0.075, -0.09), 0.006)]
    bright += [shapes.ball((0.185, -0.075, z), 0.01, None, 16) for z in (-0.09, 0.09)]
    turn = (0, 0.35, 0)
    return [Thing(_set(body, at, turn), paint), Thing(_set(bright, at, turn), STEEL)]


def _plane(at: Vector, wood: Material) -> list[Thing]:
    """A block with a slanting iron, a wedge, a knob before and a grip behind."""
    block = [shapes.box((0, -0.032, 0), (0.24, 0.064, 0.065))]
    block += [shapes.box((0.035, -0.085, 0), (0.012, 0.09, 0.045), (0, 0, 0.75))]
    block += [shapes.ball((-0.085, -0.085, 0), 0.02, None, 32), _bar((-0.085, -0.06, 0), (-0.085, -0.08, 0), 0.01)]
    block += [_bar((0.09, -0.06, 0), (0.105, -0.13, 0), 0.014)]
    iron = shapes.box((0.022, -0.09, 0), (0.005, 0.13, 0.05), (0, 0, 0.75))
    return [Thing(_set(block, at, (0, -0.5, 0)), wood), Thing(_set([iron], at, (0, -0.5, 0)), STEEL)]


def _bar(start: Vector, end: Vector, radius: float) -> Mesh:
    return shapes.tube(np.array([start, end]), radius, 16)


def _set(meshes: list[Mesh], at: Vector, turn: Vector = (0, 0, 0)) -> Mesh:
    return shapes.moved(shapes.joined(meshes), turn, at)
