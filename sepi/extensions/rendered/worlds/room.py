"""A living room: shelves with books, a table with chairs, pictures and a lamp between plain walls.

Walls and ceiling are painted in one colour, or nearly so, and all of them are seen at a slant: there is nothing to
match but shading and borders. Daylight comes through a window on the left and from behind the cameras.
"""

from __future__ import annotations

import numpy as np

from sepi.extensions.rendered import patterns
from sepi.extensions.rendered.shapes import ball, bevelled, box, joined, moved, rectangle, rod, turned_body
from sepi.extensions.rendered.staging import book, chair, of_boards, seen_from, table
from sepi.extensions.rendered.world import Cameras, Lamp, Light, Material, Mesh, Thing, Vector, World

_LEFT, _RIGHT, _BACK, _HIGH = -2.4, 2.2, 4.3, 2.6
_WHITE = Material((0.8, 0.79, 0.76))


def world() -> World:
    """The room in daylight."""
    things = [*_walls(), *_door(), *_pictures(), *_shelves(), *_table(), *_lamp()]
    light = Light(
        lamps=[
            Lamp((_LEFT + 0.01, -2.3, 0.4), (0.0, 1.5, 0.0), (0.0, 0.0, 2.4), (6.0, 6.2, 6.6)),
            Lamp((_LEFT, -_HIGH, -1.5), (_RIGHT - _LEFT, 0.0, 0.0), (0.0, _HIGH, 0.0), (0.9, 0.95, 1.0)),
        ],
        exposure=2.1,
    )
    room = World(things, Cameras(2.05, 4.8, 2.0, -1.6, 60), light)
    return seen_from(room, (-0.85, -1.35, 0.4), below=5, rightwards=24)


def _walls() -> list[Thing]:
    wide, deep, front = _RIGHT - _LEFT, _BACK + 1.5, -1.5
    carpet = patterns.noise(1, (0.5, 0.49, 0.5), 0.012, 1.0, finest=3, coarsest=40, chroma=0.1)
    roller = patterns.noise(2, (0.78, 0.72, 0.6), 0.004, 0.6, finest=4, coarsest=60, chroma=0.0)
    rug = patterns.tiles(3, 1.2, 12, (0.62, 0.3, 0.24), (0.22, 0.26, 0.4))
    skirting = [box((_RIGHT - 0.008, -0.05, _BACK / 2), (0.016, 0.1, _BACK))]
    skirting += [box((_LEFT / 2 + _RIGHT / 2, -0.05, _BACK - 0.008), (wide, 0.1, 0.016))]
    skirting += [box((_LEFT / 2 + _RIGHT / 2, -_HIGH + 0.03, _BACK - 0.03), (wide, 0.06, 0.06))]
    skirting += [box((_RIGHT - 0.03, -_HIGH + 0.03, _BACK / 2), (0.06, 0.06, _BACK))]
    return [
        Thing(rectangle((_LEFT, 0, front), (wide, 0, 0), (0, 0, deep)), Material(carpet)),
        Thing(rectangle((_LEFT, -_HIGH, front), (wide, 0, 0), (0, 0, deep)), Material((0.85, 0.85, 0.83))),
        Thing(rectangle((_LEFT, -_HIGH, _BACK), (wide, 0, 0), (0, _HIGH, 0)), Material((0.55, 0.64, 0.6))),
        Thing(rectangle((_RIGHT, -_HIGH, front), (0, 0, deep), (0, _HIGH, 0)), Material(roller)),
        Thing(rectangle((_LEFT, -_HIGH, front), (0, 0, deep), (0, _HIGH, 0)), Material((0.8, 0.78, 0.72))),
        Thing(joined(skirting), _WHITE),
        Thing(moved(box((0, -0.005, 0), (1.7, 0.01, 1.15)), (0, 0.12, 0), (0.35, 0, 2.75)), Material(rug)),
    ]


def _door() -> list[Thing]:
    x, front = -0.72, _BACK - 0.02
    leaf = [box((x, -1.02, front), (0.82, 2.04, 0.04))]
    raised = [(-0.19, -1.52), (0.19, -1.52), (-0.19, -0.55), (0.19, -0.55)]
    leaf += [box((x + across, down, front - 0.02), (0.26, 0.76, 0.016)) for across, down in raised]
    leaf += [box((x + side * 0.45, -1.04, front - 0.005), (0.08, 2.08, 0.06)) for side in (-1, 1)]
    leaf += [box((x, -2.12, front - 0.005), (0.98, 0.08, 0.06))]
    knob = joined([ball((x + 0.34, -1.03, front - 0.075), 0.027, fineness=24)])
    return [Thing(joined(leaf), _WHITE), Thing(knob, Material(kind="mirror", metal="Cu", roughness=0.15))]


def _pictures() -> list[Thing]:
    prints = [
        patterns.noise(11, (0.5, 0.42, 0.4), 0.16, 0.7, finest=4, coarsest=300, chroma=0.8),
        patterns.stone(12, 0.6, (0.85, 0.8, 0.7), (0.2, 0.3, 0.42)),
        patterns.printed(13, 0.5, 12),
    ]
    found = []
    places = ((0.22, -1.62, 0.42, 0.56), (0.84, -1.68, 0.5, 0.38), (1.42, -1.6, 0.34, 0.48))
    for (x, y, w, h), pattern in zip(places, prints, strict=True):
        rails = [box((x, y + side * h / 2, _BACK - 0.015), (w + 0.03, 0.03, 0.03)) for side in (-1, 1)]
        rails += [box((x + side * w / 2, y, _BACK - 0.015), (0.03, h - 0.03, 0.03)) for side in (-1, 1)]
        inner = (0.7 * w, 0.7 * h)
        mount = rectangle((x - w / 2, y - h / 2, _BACK - 0.008), (w, 0, 0), (0, h, 0))
        sheet = rectangle((x - inner[0] / 2, y - inner[1] / 2, _BACK - 0.01), (inner[0], 0, 0), (0, inner[1], 0))
        found += [Thing(joined(rails), Material((0.18, 0.13, 0.1), "glossy", 0.15)), Thing(mount, _WHITE)]
        found.append(Thing(sheet, Material(pattern)))
    return found


def _shelves() -> list[Thing]:
    w, h, d, board, pitch = 1.2, 1.96, 0.3, 0.022, 0.322
    parts = [box((side * (w - board) / 2, -h / 2, 0), (board, h, d)) for side in (-1, 1)]
    parts += [box((0, -0.04 - pitch * n, 0), (w - 2 * board, board, d)) for n in range(7)]
    parts += [box((0, -h / 2, d / 2 - 0.004), (w - 2 * board, h, 0.008))]
    rng = np.random.default_rng(21)
    rows: list[list[Mesh]] = [[] for _ in range(6)]
    for level in range(6):
        x, end = -w / 2 + 0.04, float(rng.uniform(0.1, w / 2 - 0.06))
        while x < end:
            thick, tall, deep = (float(rng.uniform(*span)) for span in ((0.018, 0.05), (0.17, 0.27), (0.14, 0.2)))
            y = -0.04 - pitch * level - board / 2 - tall / 2
            spine = box((x + thick / 2, y, deep / 2 - 0.12), (thick, tall, deep))
            rows[int(rng.integers(6))].append(spine)
            x += thick + 0.001
    colours: list[Vector] = [(0.5, 0.14, 0.12), (0.14, 0.25, 0.4), (0.72, 0.64, 0.44), (0.2, 0.34, 0.24)]
    colours += [(0.76, 0.75, 0.7), (0.14, 0.13, 0.14)]
    vase = np.array([[0.03, 0.22], [0.026, 0.2], [0.05, 0.14], [0.06, 0.08], [0.035, 0.0], [0, 0]])
    vases = [turned_body(bevelled(vase, 0.008), (0.42, -0.051 - pitch * n, -0.02)) for n in (1, 3, 5)]
    turn, place = (0.0, np.pi / 2, 0.0), (_RIGHT - d / 2 - 0.02, 0.0, 3.35)
    pine = patterns.wood(22, 1.1, (0.74, 0.6, 0.42), (0.6, 0.45, 0.29))
    found = [Thing(moved(of_boards(parts), turn, place), Material(pine))]
    for colour, books in zip(colours, rows, strict=True):
        found.append(Thing(moved(joined(books), turn, place), Material(colour, "glossy", 0.25)))
    found.append(Thing(moved(joined(vases), turn, place), Material((0.62, 0.3, 0.2), "glossy", 0.1)))
    return found


def _table() -> list[Thing]:
    oak = patterns.wood(31, 1.2, (0.62, 0.44, 0.28), (0.42, 0.27, 0.16))
    dark = patterns.wood(32, 0.8, (0.4, 0.26, 0.18), (0.24, 0.15, 0.1))
    chairs = [chair(-0.5, (-0.12, 0.01, 3.35)), chair(-2.2, (1.1, 0.01, 2.45)), chair(0.25, (0.75, 0.01, 3.45))]
    top = -0.76
    bowl = np.array([[0.15, 0.075], [0.12, 0.03], [0.06, 0.006], [0.05, 0], [0, 0]])
    fruit = [(0.0, -0.05, 0.0), (0.075, -0.052, 0.02), (-0.02, -0.055, 0.075), (0.02, -0.115, 0.03)]
    mug = bevelled(np.array([[0, 0.006], [0.037, 0.006], [0.037, 0.1], [0.041, 0.1], [0.041, 0], [0, 0]]), 0.001)
    white = Material((0.82, 0.82, 0.8), "glossy", 0.08)
    cover = Material(patterns.printed(33, 0.2, 10, (0.15, 0.3, 0.38), 0.8))
    return [
        Thing(table((1.25, 0.75, 0.75), 0.12, (0.35, 0.01, 2.75)), Material(oak)),
        Thing(of_boards(chairs), Material(dark)),
        Thing(turned_body(bowl, (0.35, top, 2.8)), white),
        Thing(turned_body(mug, (-0.02, top, 2.6)), white),
        Thing(
            joined([ball((0.35 + x, top + y, 2.8 + z), 0.038, fineness=32) for x, y, z in fruit]),
            Material(patterns.noise(34, (0.78, 0.42, 0.1), 0.02, 0.1, finest=4, coarsest=20)),
        ),
        *book((0.15, 0.03, 0.22), cover, _WHITE, (0, 0.5, 0), (0.68, top, 2.62)),
    ]


def _lamp() -> list[Thing]:
    x, z = 1.82, 4.0
    foot = turned_body(bevelled(np.array([[0, 0.025], [0.15, 0.025], [0.15, 0], [0, 0]]), 0.003), (x, 0, z))
    shade = turned_body(np.array([[0.14, 1.78], [0.22, 1.45]]), (x, 0, z))
    hanging = turned_body(np.array([[0.02, 0.2], [0.05, 0.18], [0.14, 0.1], [0.18, 0.0]]), (0.35, -1.72, 2.75))
    return [
        Thing(joined([foot, rod((x, -0.02, z), (x, -1.6, z), 0.012)]), Material((0.12, 0.12, 0.12), "glossy", 0.2)),
        Thing(shade, Material((0.84, 0.8, 0.7))),
        Thing(hanging, Material((0.75, 0.28, 0.16), "glossy", 0.2)),
        Thing(rod((0.35, -1.9, 2.75), (0.35, -_HIGH, 2.75), 0.003), Material((0.08, 0.08, 0.08)), thin=True),
    ]
