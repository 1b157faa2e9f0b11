"""A heap in a store room: books, boxes and balls on floor boards before a wall, and sticks leaning on all of it.

Many depths meet in a small window, and thin things stand before them. Boxes and books are stacked one by one, from
lists of places; sticks stand in a bucket, lean against the wall, or lie over the edges of boxes, placed by a seed.
"""

import numpy as np

from sepi.extensions.rendered.patterns import noise, printed, stripes, wood
from sepi.extensions.rendered.shapes import ball, bevelled, box, moved, rectangle, rod, thing, turned_body, wall
from sepi.extensions.rendered.staging import book, crate, leaning, of_boards, seen_from
from sepi.extensions.rendered.world import Cameras, Lamp, Light, Material, Mesh, Things, World

_WALL = 3.0
_LIFT = 0.002


def world() -> World:
    """The heap, by a window on the left."""
    lamp = Lamp((-1.9, -2.9, 2.4), (-0.6, 0.0, -2.2), (-0.4, 1.5, 0.0), (22.0, 20.5, 18.5))
    things = [*_room(), *_boxes(), *_books(), *_balls(), *_sticks()]
    light = Light(sky=(0.75, 0.78, 0.83), lamps=[lamp])
    return seen_from(World(things, Cameras(1.46, 2.86, 1.9, -1.8, 38), light), (0.02, -1.0, 0.3), below=19)


def _room() -> Things:
    planks = [rectangle((-3 + 0.14 * n, 0, -1), (0, 0, 4), (0.137, 0, 0)) for n in range(44)]
    yield thing(of_boards(planks, 0.37, 0.14), wood(12, 1.3, (0.6, 0.45, 0.3), (0.38, 0.26, 0.17)))
    yield thing(rectangle((-4, _LIFT, -1), (0, 0, 4.1), (8, 0, 0)), (0.08, 0.06, 0.05))
    yield thing(wall((-4, -4, _WALL), 8, 4), noise(11, (0.62, 0.6, 0.52), 0.06, 1.1, (3, 300), 0.25))
    yield thing(box((0, -0.05, _WALL - 0.009), (8, 0.1, 0.018)), (0.75, 0.73, 0.68))


def _boxes() -> Things:
    cartons = [
        ((-0.52, 0, 2.55), (0.46, 0.38, 0.34), 0.25),
        ((-0.5, -0.38, 2.57), (0.34, 0.25, 0.26), -0.2),
        ((0.62, 0, 2.5), (0.4, 0.3, 0.4), -0.35),
        ((0.08, 0, 2.72), (0.42, 0.52, 0.34), 0.06),
    ]
    bodies, labels, tapes = list[Mesh](), list[Mesh](), list[Mesh]()
    for at, (w, h, d), turn in cartons:
        bodies.append(moved(box((0, -h / 2, 0), (w, h, d)), (0, turn, 0), at))
        labels.append(moved(wall((-0.4 * w, -0.8 * h, -d / 2 - _LIFT), 0.16, 0.1), (0, turn, 0), at))
        tapes.append(moved(box((0, -h, 0), (0.05, _LIFT, d + _LIFT)), (0, turn, 0), at))
    yield thing(bodies, noise(21, (0.66, 0.5, 0.34), 0.035, 0.5, (3, 120), 0.2))
    yield thing(labels, printed(22, 0.16, 20))
    yield thing(tapes, Material((0.72, 0.6, 0.36), "glossy", 0.2))
    yield thing(crate((0.5, 0.28, 0.3), 3, 0.5, (-0.12, 0, 1.95)), wood(23, 0.5, (0.75, 0.6, 0.4), (0.55, 0.4, 0.24)))


def _books() -> Things:
    rng = np.random.default_rng(3)
    colours = [(0.5, 0.12, 0.1), (0.12, 0.26, 0.42), (0.16, 0.34, 0.22), (0.75, 0.66, 0.42)]
    inks = (0.85, 0.85, 0.85, 0.2)
    covers = [Material(printed(30 + n, 0.24, 16, colours[n], ink)) for n, ink in enumerate(inks)]
    paper = Material(noise(35, (0.82, 0.78, 0.68), 0.05, 0.2, (3, 12), 0.1))
    for x, y, z, count in ((-0.6, 0.0, 1.98, 5), (0.38, 0.0, 1.98, 7), (0.64, -0.3, 2.5, 5), (0.06, -0.52, 2.72, 3)):
        for n in range(count):
            thickness = rng.uniform(0.022, 0.045)
            size = (rng.uniform(0.15, 0.19), thickness, rng.uniform(0.21, 0.26))
            turn = rng.normal(np.pi / 2, 0.35)
            off = rng.normal(0, 0.008, 2)
            yield from book(size, covers[n % 4], paper, (0, turn, 0), (x + off[0], y, z + off[1]))
            y -= thickness


def _balls() -> Things:
    tennis = [(0.1, -0.033, 1.62), (0.19, -0.033, 1.7), (-0.36, -0.033, 1.6), (-0.52, -0.663, 2.5)]
    felt = noise(41, (0.68, 0.74, 0.2), 0.05, 0.12, (3, 40))
    yield thing([ball(place, 0.033, fineness=32) for place in tennis], felt)
    yield thing(ball((0.6, -0.12, 2.12), 0.12), noise(42, (0.62, 0.3, 0.14), 0.06, 0.15, (4, 24), 0.1))
    rubber = stripes(0.22, [(0.75, 0.15, 0.12), (0.85, 0.82, 0.76), (0.14, 0.3, 0.55), (0.85, 0.82, 0.76)])
    yield thing(moved(ball((0, 0, 0), 0.1), (0.5, 0.3, 0.7), (-0.1, -0.11, 1.95)), Material(rubber, "glossy", 0.15))


def _sticks() -> Things:
    rng = np.random.default_rng(5)
    draws = [rng.uniform(-1.3, 1.3, 16), rng.normal(0, 0.25, 16)]
    draws += [rng.uniform(*span, 16) for span in ((0.1, 0.3), (0.9, 1.7), (0.005, 0.012))]
    places = zip(*draws, strict=True)
    against = [leaning((x, 0, _WALL - b), (x + lean, -h, _WALL - 0.02), 0.01, r) for x, lean, b, h, r in places]
    # upper edges on which sticks can lie: two points of each
    edges = [((-0.66, -0.63, 2.43), (-0.32, -0.63, 2.46)), ((-0.14, -0.52, 2.54), (0.28, -0.52, 2.56))]
    edges += [((0.4, -0.3, 2.25), (0.75, -0.3, 2.38)), ((-0.32, -0.29, 1.92), (0.02, -0.29, 1.75))]
    over = []
    for number in range(26):
        first, last = (np.array(point) for point in edges[number % 4])
        rest = first + rng.uniform(0, 1) * (last - first)
        back = min(rng.uniform(0.12, 0.5), rest[2] - 1.5)
        foot = (rest[0] + rng.normal(0, 0.35), 0, rest[2] - back)
        over.append(leaning(foot, rest, rng.uniform(0.1, 0.5), rng.uniform(0.003, 0.007)))
    yield thing(against, noise(51, (0.66, 0.56, 0.32), 0.08, 0.3, (3, 100)), thin=True)
    yield thing(over, noise(52, (0.36, 0.27, 0.2), 0.08, 0.2, (3, 40), 0.2), thin=True)
    yield from _bucket(rng)


def _bucket(rng: np.random.Generator) -> Things:
    x, z, height, rim = -0.34, 2.22, 0.26, 0.1
    outline = bevelled([[0.07, 0.01], [rim - 0.004, height], [rim, height], [0.075, 0], [0, 0]], 0.002)
    canes = []
    for angle in rng.uniform(0, 2 * np.pi, 14):
        out = np.array([np.cos(angle), 0, np.sin(angle)])
        foot = np.array([x, -0.02, z]) - 0.05 * out
        top = np.array([x, -height, z]) + (rim - 0.02) * out
        canes.append(rod(foot, foot + (top - foot) * rng.uniform(1.8, 3.0), rng.uniform(0.003, 0.006)))
    zinc = Material(noise(61, (0.55, 0.57, 0.6), 0.05, 0.4, (4, 60), 0.1), "glossy", 0.25)
    yield thing(turned_body(outline, (x, 0, z)), zinc)
    yield thing(canes, noise(62, (0.3, 0.42, 0.22), 0.08, 0.2, (3, 60)), thin=True)
