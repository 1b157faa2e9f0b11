"""A heap in a store room: books, boxes and balls on floor boards before a wall, and sticks leaning on all of it.

Many depths meet in a small window, and thin things stand before them. Boxes and books are stacked one by one, from
lists of places; sticks stand in a bucket, lean against the wall, or lie over the edges of boxes, placed by a seed.
"""

from __future__ import annotations

import numpy as np

from sepi.extensions.rendered import patterns
from sepi.extensions.rendered.shapes import ball, bevelled, box, joined, moved, rectangle, rod, turned_body
from sepi.extensions.rendered.staging import book, crate, leaning, of_boards, seen_from
from sepi.extensions.rendered.world import Cameras, Lamp, Light, Material, Thing, Vector, World

_WALL = 3.0
_LIFT = 0.002


def world() -> World:
    """The heap, by a window on the left."""
    lamp = Lamp((-1.9, -2.9, 2.4), (-0.6, 0.0, -2.2), (-0.4, 1.5, 0.0), (22.0, 20.5, 18.5))
    things = [*_room(), *_boxes(), *_books(), *_balls(), *_sticks()]
    light = Light(sky=(0.75, 0.78, 0.83), lamps=[lamp])
    heap = World(things, Cameras(1.46, 2.86, 1.9, -1.8, 38), light)
    return seen_from(heap, (0.02, -1.0, 0.3), below=19)


def _room() -> list[Thing]:
    planks = [rectangle((-3 + 0.14 * n, 0, -1), (0, 0, 4), (0.137, 0, 0)) for n in range(44)]
    under = rectangle((-4, _LIFT, -1), (0, 0, 4.1), (8, 0, 0))
    wall = rectangle((-4, -4, _WALL), (8, 0, 0), (0, 4, 0))
    skirting = box((0, -0.05, _WALL - 0.009), (8, 0.1, 0.018))
    plaster = patterns.noise(11, (0.62, 0.6, 0.52), 0.06, 1.1, finest=3, coarsest=300, chroma=0.25)
    boards = patterns.wood(12, 1.3, (0.6, 0.45, 0.3), (0.38, 0.26, 0.17))
    return [
        Thing(of_boards(planks, 0.37, 0.14), Material(boards)),
        Thing(under, Material((0.08, 0.06, 0.05))),
        Thing(wall, Material(plaster)),
        Thing(skirting, Material((0.75, 0.73, 0.68))),
    ]


def _boxes() -> list[Thing]:
    card = patterns.noise(21, (0.66, 0.5, 0.34), 0.035, 0.5, finest=3, coarsest=120, chroma=0.2)
    label = patterns.printed(22, 0.16, 20)
    planks = patterns.wood(23, 0.5, (0.75, 0.6, 0.4), (0.55, 0.4, 0.24))
    cartons: list[tuple[Vector, Vector, float]] = [
        ((-0.52, 0, 2.55), (0.46, 0.38, 0.34), 0.25),
        ((-0.5, -0.38, 2.57), (0.34, 0.25, 0.26), -0.2),
        ((0.62, 0, 2.5), (0.4, 0.3, 0.4), -0.35),
        ((0.08, 0, 2.72), (0.42, 0.52, 0.34), 0.06),
    ]
    bodies, labels, tapes = [], [], []
    for (x, y, z), (w, h, d), turn in cartons:
        at: Vector = (x, y, z)
        bodies.append(moved(box((0, -h / 2, 0), (w, h, d)), (0, turn, 0), at))
        front = -d / 2 - _LIFT
        labels.append(moved(rectangle((-0.4 * w, -0.8 * h, front), (0.16, 0, 0), (0, 0.1, 0)), (0, turn, 0), at))
        tapes.append(moved(box((0, -h, 0), (0.05, _LIFT, d + _LIFT)), (0, turn, 0), at))
    chest = crate((0.5, 0.28, 0.3), 3, 0.5, (-0.12, 0, 1.95))
    return [
        Thing(joined(bodies), Material(card)),
        Thing(joined(labels), Material(label)),
        Thing(joined(tapes), Material((0.72, 0.6, 0.36), "glossy", 0.2)),
        Thing(chest, Material(planks)),
    ]


def _books() -> list[Thing]:
    rng = np.random.default_rng(3)
    colours: list[Vector] = [(0.5, 0.12, 0.1), (0.12, 0.26, 0.42), (0.16, 0.34, 0.22), (0.75, 0.66, 0.42)]
    inks = (0.85, 0.85, 0.85, 0.2)
    covers = [Material(patterns.printed(30 + n, 0.24, 16, colours[n], ink)) for n, ink in enumerate(inks)]
    paper = Material(patterns.noise(35, (0.82, 0.78, 0.68), 0.05, 0.2, finest=3, coarsest=12, chroma=0.1))
    found = []
    for x, y, z, count in ((-0.6, 0.0, 1.98, 5), (0.38, 0.0, 1.98, 7), (0.64, -0.3, 2.5, 5), (0.06, -0.52, 2.72, 3)):
        for n in range(count):
            thickness = float(rng.uniform(0.022, 0.045))
            size = (float(rng.uniform(0.15, 0.19)), thickness, float(rng.uniform(0.21, 0.26)))
            turn = float(rng.normal(np.pi / 2, 0.35))
            off = rng.normal(0, 0.008, 2)
            found += book(size, covers[n % 4], paper, (0, turn, 0), (x + float(off[0]), y, z + float(off[1])))
            y -= thickness
    return found


def _balls() -> list[Thing]:
    felt = patterns.noise(41, (0.68, 0.74, 0.2), 0.05, 0.12, finest=3, coarsest=40)
    leather = patterns.noise(42, (0.62, 0.3, 0.14), 0.06, 0.15, finest=4, coarsest=24, chroma=0.1)
    rubber = patterns.stripes(0.22, [(0.75, 0.15, 0.12), (0.85, 0.82, 0.76), (0.14, 0.3, 0.55), (0.85, 0.82, 0.76)])
    tennis: list[Vector] = [(0.1, -0.033, 1.62), (0.19, -0.033, 1.7), (-0.36, -0.033, 1.6), (-0.52, -0.663, 2.5)]
    return [
        Thing(joined([ball(place, 0.033, fineness=32) for place in tennis]), Material(felt)),
        Thing(ball((0.6, -0.12, 2.12), 0.12), Material(leather)),
        Thing(moved(ball((0, 0, 0), 0.1), (0.5, 0.3, 0.7), (-0.1, -0.11, 1.95)), Material(rubber, "glossy", 0.15)),
    ]


def _sticks() -> list[Thing]:
    rng = np.random.default_rng(5)
    draws = [rng.uniform(-1.3, 1.3, 16), rng.normal(0, 0.25, 16)]
    draws += [rng.uniform(*span, 16) for span in ((0.1, 0.3), (0.9, 1.7), (0.005, 0.012))]
    wall = [
        leaning((x, 0, _WALL - back), (x + lean, -height, _WALL - 0.02), 0.01, radius)
        for x, lean, back, height, radius in zip(*draws, strict=True)
    ]
    # upper edges on which sticks can lie: two points of each
    edges = [((-0.66, -0.63, 2.43), (-0.32, -0.63, 2.46)), ((-0.14, -0.52, 2.54), (0.28, -0.52, 2.56))]
    edges += [((0.4, -0.3, 2.25), (0.75, -0.3, 2.38)), ((-0.32, -0.29, 1.92), (0.02, -0.29, 1.75))]
    over = []
    for number in range(26):
        first, last = (np.array(point) for point in edges[number % 4])
        rest = first + rng.uniform(0, 1) * (last - first)
        back = min(float(rng.uniform(0.12, 0.5)), rest[2] - 1.5)
        foot = (rest[0] + rng.normal(0, 0.35), 0, rest[2] - back)
        over.append(leaning(foot, rest, rng.uniform(0.1, 0.5), rng.uniform(0.003, 0.007)))
    bamboo = patterns.noise(51, (0.66, 0.56, 0.32), 0.08, 0.3, finest=3, coarsest=100)
    bark = patterns.noise(52, (0.36, 0.27, 0.2), 0.08, 0.2, finest=3, coarsest=40, chroma=0.2)
    return [
        Thing(joined(wall), Material(bamboo), thin=True),
        Thing(joined(over), Material(bark), thin=True),
        *_bucket(rng),
    ]


def _bucket(rng: np.random.Generator) -> list[Thing]:
    x, z, height, rim = -0.34, 2.22, 0.26, 0.1
    outline = bevelled(np.array([[0.07, 0.01], [rim - 0.004, height], [rim, height], [0.075, 0], [0, 0]]), 0.002)
    canes = []
    for angle in rng.uniform(0, 2 * np.pi, 14):
        out = np.array([np.cos(angle), 0, np.sin(angle)])
        foot = np.array([x, -0.02, z]) - 0.05 * out
        top = np.array([x, -height, z]) + (rim - 0.02) * out
        end = foot + (top - foot) * rng.uniform(1.8, 3.0)
        canes.append(rod(foot, end, rng.uniform(0.003, 0.006)))
    zinc = patterns.noise(61, (0.55, 0.57, 0.6), 0.05, 0.4, finest=4, coarsest=60, chroma=0.1)
    green = patterns.noise(62, (0.3, 0.42, 0.22), 0.08, 0.2, finest=3, coarsest=60)
    return [
        Thing(turned_body(outline, (x, 0, z)), Material(zinc, "glossy", 0.25)),
        Thing(joined(canes), Material(green), thin=True),
    ]
