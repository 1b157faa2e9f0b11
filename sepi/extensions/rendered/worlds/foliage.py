"""Two shrubs before a plastered wall, and a bough that hangs in from near by, in the sun.

Thousands of leaves, alike in size and colour, each with its own depth: what lies between two of them is another one, or
the wall. The shrubs grow by a seed: stems fork into branches, branches into twigs, and twigs bear leaves on both sides.
"""

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from sepi.extensions.rendered.patterns import noise, stone
from sepi.extensions.rendered.shapes import Points, about_vertical, ball, copies, ground, leaf, thing, tube, wall
from sepi.extensions.rendered.staging import of_boards, seen_from
from sepi.extensions.rendered.world import Cameras, Light, Material, Mesh, Sun, Things, Vector, World

_WALL = 3.1
_UP = np.array([0.0, -1.0, 0.0])


class _Part(NamedTuple):
    """A stem, branch or twig, and where its leaves start and which way they go, ``(N, 3)``."""

    wood: Mesh
    places: Points
    directions: Points


class _Habit(NamedTuple):
    """How a plant grows: into how many parts each part forks, how long and thick they are, and its leaves."""

    forks: tuple[int, ...]
    lengths: tuple[float, ...]
    thickness: float
    spread: float
    upright: float
    leaves: int
    leaf: Mesh


def world() -> World:
    """The wall of a garden."""
    light = Light(sky=(0.75, 0.86, 1.0), suns=[Sun((0.6, 0.9, 0.75), (7.5, 6.9, 5.8))], exposure=0.85)
    garden = World([*_ground(), *_shrubs()], Cameras(1.13, 2.75, 2.2, -1.6, 42), light)
    return seen_from(garden, (-0.05, -0.92, 0.42), below=5)


def _ground() -> Things:
    blocks = [wall((-3 + 0.6 * n, -0.3, _WALL - 0.06), 0.592, 0.3) for n in range(10)]
    yield thing(wall((-3, -4, _WALL), 6, 4), noise(1, (0.72, 0.6, 0.44), 0.045, 1.3, (3, 500), 0.25))
    yield thing(wall((-3, -0.3, _WALL - 0.055), 6, 0.3), (0.3, 0.28, 0.26))
    plinth = [of_boards(blocks, 0.33, 0.2), ground((-3, -0.3, _WALL - 0.06), 6, 0.06)]
    yield thing(plinth, stone(2, 0.9, (0.66, 0.64, 0.6), (0.42, 0.4, 0.38)))
    yield thing(ground((-3, 0, -1), 6, 5), noise(3, (0.34, 0.26, 0.19), 0.08, 0.9, (3, 50), 0.2))


def _shrubs() -> Things:
    rng = np.random.default_rng(8)
    round_leaf, narrow, broad = leaf(0.062, 0.036, 0.5, 0.3), leaf(0.085, 0.016, 0.7, 0.4), leaf(0.085, 0.05, 0.6, 0.25)
    laurel = _Habit((9, 6, 4), (0.66, 0.4, 0.24), 0.011, 0.75, 0.22, 8, round_leaf)
    willow = _Habit((8, 5, 4), (0.5, 0.34, 0.22), 0.008, 0.6, 0.12, 10, narrow)
    bough = _Habit((1, 7, 3), (0.95, 0.3, 0.16), 0.012, 0.7, 0.0, 6, broad)
    plants = [
        (_grown(rng, laurel, (0.3, 0.0, 2.35), _UP), laurel, (0.28, 0.46, 0.17)),
        (_grown(rng, willow, (-0.62, 0.0, 2.35), _UP), willow, (0.5, 0.56, 0.38)),
        (_grown(rng, bough, (-0.8, -1.36, 1.68), np.array([0.9, 0.12, 0.1])), bough, (0.38, 0.5, 0.15)),
    ]
    bark = Material(noise(11, (0.34, 0.26, 0.2), 0.06, 0.2, (3, 40), 0.2))
    for number, (plant, habit, green) in enumerate(plants):
        yield thing([part.wood for part in plant], bark, thin=True)
        blades = noise(20 + 5 * number, green, 0.045, 0.5, (4, 200), 0.6)
        yield thing(_leaves(rng, plant, habit.leaf), blades)
    places = np.concatenate([part.places for part in plants[0][0]])[::14] + np.array([0, 0.012, 0])
    berries = copies(ball((0, 0, 0), 0.008, fineness=10), about_vertical(np.zeros(len(places))), places)
    yield thing(berries, Material((0.62, 0.07, 0.05), "glossy", 0.15))
    # and fallen ones
    places = np.stack([rng.uniform(-1.4, 1.4, 220), np.full(220, -0.008), rng.uniform(1.9, 2.95, 220)], axis=1)
    fallen = copies(round_leaf, about_vertical(rng.uniform(0, 2 * np.pi, 220)), places)
    yield thing(fallen, noise(41, (0.5, 0.33, 0.14), 0.06, 0.3, (4, 200), 0.6))


def _grown(rng: np.random.Generator, habit: _Habit, foot: Vector, direction: Points) -> list[_Part]:
    return [part for _ in range(habit.forks[0]) for part in _grow(rng, habit, np.array(foot), direction, 0)]


def _grow(rng: np.random.Generator, habit: _Habit, start: Points, along: Points, level: int) -> Iterator[_Part]:
    """One part of a plant, and all that springs from it."""
    step = habit.lengths[level] * rng.uniform(0.75, 1.2) / 7
    # the only part of a bough goes where it is sent
    spread = habit.spread if habit.forks[level] > 1 else 0.0
    along = _unit(along + spread * rng.standard_normal(3))
    path = [start]
    for _ in range(7):
        along = _unit(along + 0.1 * rng.standard_normal(3) + habit.upright * _UP)
        path.append(path[-1] + step * along)
    points, thick = np.array(path), habit.thickness * 0.55**level
    # nothing grows into the wall or the ground
    points[:, 2] = np.minimum(points[:, 2], _WALL - 0.08)
    points[:, 1] = np.minimum(points[:, 1], 0.02)
    wood = tube(points, np.linspace(thick, 0.5 * thick, 8), 8 if level < 2 else 5)
    if level + 1 < len(habit.forks):
        yield _Part(wood, np.empty((0, 3)), np.empty((0, 3)))
        for index in np.linspace(3, 7, habit.forks[level + 1]).round().astype(int):
            yield from _grow(rng, habit, points[index], points[index] - points[index - 1], level + 1)
        return
    shares = np.linspace(1.2, 7, habit.leaves)
    places = np.stack([np.interp(shares, np.arange(8), points[:, axis]) for axis in range(3)], axis=1)
    aside = _unit(np.cross(along, _unit(_UP + 0.5 * rng.standard_normal(3))))
    sides = np.where(np.arange(habit.leaves) % 2, 1.0, -1.0)[:, None] * aside
    yield _Part(wood, places, along + 1.2 * sides + 0.3 * rng.standard_normal(places.shape))


def _leaves(rng: np.random.Generator, plant: list[_Part], blade: Mesh) -> Mesh:
    """The leaves of a plant, their upper sides to the light as well as they can."""
    places = np.concatenate([part.places for part in plant])
    directions = _unit(np.concatenate([part.directions for part in plant]))
    above = _UP + 0.4 * rng.standard_normal(directions.shape)
    down = -_unit(above - np.sum(above * directions, axis=1, keepdims=True) * directions)
    axes = np.stack([directions, down, np.cross(directions, down)], axis=1)
    return copies(blade, axes, places, rng.uniform(0.7, 1.15, len(places)))


def _unit(vectors: Points) -> Points:
    return np.asarray(vectors / np.linalg.norm(vectors, axis=-1, keepdims=True))
