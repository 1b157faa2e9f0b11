"""A living room: shelves with books, a table with chairs, pictures and a lamp between plain walls.

Walls and ceiling are painted in one colour, or nearly so, and all of them are seen at a slant: there is nothing to
match but shading and borders. Daylight comes through a window on the left and from behind the cameras.
"""

import numpy as np

from sepi.extensions.rendered.patterns import noise, printed, stone, tiles, wood
from sepi.extensions.rendered.shapes import ball, bevelled, box, ground, moved, rectangle, rod, thing, turned_body, wall
from sepi.extensions.rendered.staging import book, chair, of_boards, seen_from, table
from sepi.extensions.rendered.world import Cameras, Lamp, Light, Material, Mesh, Things, World

_LEFT, _RIGHT, _BACK, _HIGH = -2.4, 2.2, 4.3, 2.6
_WHITE = Material((0.8, 0.79, 0.76))


def world() -> World:
    """The room in daylight."""
    things = [*_walls(), *_door(), *_pictures(), *_shelves(), *_table(), *_lamp()]
    window = Lamp((_LEFT + 0.01, -2.3, 0.4), (0.0, 1.5, 0.0), (0.0, 0.0, 2.4), (6.0, 6.2, 6.6))
    behind = Lamp((_LEFT, -_HIGH, -1.5), (_RIGHT - _LEFT, 0.0, 0.0), (0.0, _HIGH, 0.0), (0.9, 0.95, 1.0))
    room = World(things, Cameras(2.05, 4.8, 2.0, -1.6, 60), Light(lamps=[window, behind], exposure=2.1))
    return seen_from(room, (-0.85, -1.35, 0.4), below=5, rightwards=24)


def _walls() -> Things:
    wide, deep, front, middle = _RIGHT - _LEFT, _BACK + 1.5, -1.5, _LEFT / 2 + _RIGHT / 2
    carpet = noise(1, (0.5, 0.49, 0.5), 0.012, 1.0, (3, 40), 0.1)
    roller = noise(2, (0.78, 0.72, 0.6), 0.004, 0.6, (4, 60), 0.0)
    yield thing(ground((_LEFT, 0, front), wide, deep), carpet)
    yield thing(ground((_LEFT, -_HIGH, front), wide, deep), (0.85, 0.85, 0.83))
    yield thing(wall((_LEFT, -_HIGH, _BACK), wide, _HIGH), (0.55, 0.64, 0.6))
    yield thing(rectangle((_RIGHT, -_HIGH, front), (0, 0, deep), (0, _HIGH, 0)), roller)
    yield thing(rectangle((_LEFT, -_HIGH, front), (0, 0, deep), (0, _HIGH, 0)), (0.8, 0.78, 0.72))
    skirting = [box((_RIGHT - 0.008, -0.05, _BACK / 2), (0.016, 0.1, _BACK))]
    skirting += [box((middle, -0.05, _BACK - 0.008), (wide, 0.1, 0.016))]
    skirting += [box((middle, -_HIGH + 0.03, _BACK - 0.03), (wide, 0.06, 0.06))]
    skirting += [box((_RIGHT - 0.03, -_HIGH + 0.03, _BACK / 2), (0.06, 0.06, _BACK))]
    yield thing(skirting, _WHITE)
    rug = tiles(3, 1.2, 12, (0.62, 0.3, 0.24), (0.22, 0.26, 0.4))
    yield thing(moved(box((0, -0.005, 0), (1.7, 0.01, 1.15)), (0, 0.12, 0), (0.35, 0, 2.75)), rug)


def _door() -> Things:
    x, front = -0.72, _BACK - 0.02
    leaf = [box((x, -1.02, front), (0.82, 2.04, 0.04))]
    raised = [(-0.19, -1.52), (0.19, -1.52), (-0.19, -0.55), (0.19, -0.55)]
    leaf += [box((x + across, down, front - 0.02), (0.26, 0.76, 0.016)) for across, down in raised]
    leaf += [box((x + side * 0.45, -1.04, front - 0.005), (0.08, 2.08, 0.06)) for side in (-1, 1)]
    leaf += [box((x, -2.12, front - 0.005), (0.98, 0.08, 0.06))]
    yield thing(leaf, _WHITE)
    knob = ball((x + 0.34, -1.03, front - 0.075), 0.027, fineness=24)
    yield thing(knob, Material(kind="mirror", metal="Cu", roughness=0.15))


def _pictures() -> Things:
    hung = [
        ((0.22, -1.62, 0.42, 0.56), noise(11, (0.5, 0.42, 0.4), 0.16, 0.7, (4, 300), 0.8)),
        ((0.84, -1.68, 0.5, 0.38), stone(12, 0.6, (0.85, 0.8, 0.7), (0.2, 0.3, 0.42))),
        ((1.42, -1.6, 0.34, 0.48), printed(13, 0.5, 12)),
    ]
    for (x, y, w, h), pattern in hung:
        rails = [box((x, y + side * h / 2, _BACK - 0.015), (w + 0.03, 0.03, 0.03)) for side in (-1, 1)]
        rails += [box((x + side * w / 2, y, _BACK - 0.015), (0.03, h - 0.03, 0.03)) for side in (-1, 1)]
        yield thing(rails, Material((0.18, 0.13, 0.1), "glossy", 0.15))
        yield thing(wall((x - w / 2, y - h / 2, _BACK - 0.008), w, h), _WHITE)
        yield thing(wall((x - 0.7 * w / 2, y - 0.7 * h / 2, _BACK - 0.01), 0.7 * w, 0.7 * h), pattern)


def _shelves() -> Things:
    w, h, d, board, pitch = 1.2, 1.96, 0.3, 0.022, 0.322
    turn, place = (0.0, np.pi / 2, 0.0), (_RIGHT - d / 2 - 0.02, 0.0, 3.35)
    parts = [box((side * (w - board) / 2, -h / 2, 0), (board, h, d)) for side in (-1, 1)]
    parts += [box((0, -0.04 - pitch * n, 0), (w - 2 * board, board, d)) for n in range(7)]
    parts += [box((0, -h / 2, d / 2 - 0.004), (w - 2 * board, h, 0.008))]
    yield thing(moved(of_boards(parts), turn, place), wood(22, 1.1, (0.74, 0.6, 0.42), (0.6, 0.45, 0.29)))
    rng = np.random.default_rng(21)
    colours = [(0.5, 0.14, 0.12), (0.14, 0.25, 0.4), (0.72, 0.64, 0.44), (0.2, 0.34, 0.24), (0.76, 0.75, 0.7)]
    books: dict[tuple[float, ...], list[Mesh]] = {colour: [] for colour in (*colours, (0.14, 0.13, 0.14))}
    for level in range(6):
        x, end = -w / 2 + 0.04, rng.uniform(0.1, w / 2 - 0.06)
        while x < end:
            thick, tall, deep = (rng.uniform(*span) for span in ((0.018, 0.05), (0.17, 0.27), (0.14, 0.2)))
            y = -0.04 - pitch * level - board / 2 - tall / 2
            spine = box((x + thick / 2, y, deep / 2 - 0.12), (thick, tall, deep))
            list(books.values())[rng.integers(6)].append(spine)
            x += thick + 0.001
    for colour, spines in books.items():
        yield thing(moved(spines, turn, place), Material(colour, "glossy", 0.25))
    vase = bevelled([[0.03, 0.22], [0.026, 0.2], [0.05, 0.14], [0.06, 0.08], [0.035, 0.0], [0, 0]], 0.008)
    vases = [turned_body(vase, (0.42, -0.051 - pitch * n, -0.02)) for n in (1, 3, 5)]
    yield thing(moved(vases, turn, place), Material((0.62, 0.3, 0.2), "glossy", 0.1))


def _table() -> Things:
    oak = wood(31, 1.2, (0.62, 0.44, 0.28), (0.42, 0.27, 0.16))
    yield thing(table((1.25, 0.75, 0.75), 0.12, (0.35, 0.01, 2.75)), oak)
    chairs = [chair(-0.5, (-0.12, 0.01, 3.35)), chair(-2.2, (1.1, 0.01, 2.45)), chair(0.25, (0.75, 0.01, 3.45))]
    yield thing(of_boards(chairs), wood(32, 0.8, (0.4, 0.26, 0.18), (0.24, 0.15, 0.1)))
    top, white = -0.76, Material((0.82, 0.82, 0.8), "glossy", 0.08)
    bowl = np.array([[0.15, 0.075], [0.12, 0.03], [0.06, 0.006], [0.05, 0], [0, 0]])
    yield thing(turned_body(bowl, (0.35, top, 2.8)), white)
    mug = bevelled([[0, 0.006], [0.037, 0.006], [0.037, 0.1], [0.041, 0.1], [0.041, 0], [0, 0]], 0.001)
    yield thing(turned_body(mug, (-0.02, top, 2.6)), white)
    places = [(0.0, -0.05, 0.0), (0.075, -0.052, 0.02), (-0.02, -0.055, 0.075), (0.02, -0.115, 0.03)]
    fruit = [ball((0.35 + x, top + y, 2.8 + z), 0.038, fineness=32) for x, y, z in places]
    yield thing(fruit, noise(34, (0.78, 0.42, 0.1), 0.02, 0.1, (4, 20)))
    cover = Material(printed(33, 0.2, 10, (0.15, 0.3, 0.38), 0.8))
    yield from book((0.15, 0.03, 0.22), cover, _WHITE, (0, 0.5, 0), (0.68, top, 2.62))


def _lamp() -> Things:
    x, z = 1.82, 4.0
    foot = turned_body(bevelled([[0, 0.025], [0.15, 0.025], [0.15, 0], [0, 0]], 0.003), (x, 0, z))
    yield thing([foot, rod((x, -0.02, z), (x, -1.6, z), 0.012)], Material((0.12, 0.12, 0.12), "glossy", 0.2))
    yield thing(turned_body([[0.14, 1.78], [0.22, 1.45]], (x, 0, z)), (0.84, 0.8, 0.7))
    hanging = turned_body([[0.02, 0.2], [0.05, 0.18], [0.14, 0.1], [0.18, 0.0]], (0.35, -1.72, 2.75))
    yield thing(hanging, Material((0.75, 0.28, 0.16), "glossy", 0.2))
    yield thing(rod((0.35, -1.9, 2.75), (0.35, -_HIGH, 2.75), 0.003), (0.08, 0.08, 0.08), thin=True)
