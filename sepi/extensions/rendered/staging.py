"""What scenes hold (books, furniture, vessels, fruit, houses, wires), and a world seen from any place in it."""

from collections.abc import Sequence

import numpy as np
import numpy.typing as npt
from scipy.interpolate import PchipInterpolator

from sepi.extensions.rendered import shapes
from sepi.extensions.rendered.shapes import Points, ball, box, joined, moved, plate, rod, thing, turned_body
from sepi.extensions.rendered.world import Lamp, Material, Mesh, Things, Vector, World


def seen_from(world: World, eye: Vector, below: float = 0.0, rightwards: float = 0.0) -> World:
    """A world in the axes of a reference camera anywhere in it.

    Parameters
    ----------
    world : World
        ``y`` points down; a panorama stays as it is.
    eye : (float, float, float)
        Position of the reference camera.
    below, rightwards : float
        Degrees by which it looks below the horizon, and to the right of ``z``.
    """
    pitch, yaw = np.radians(below), np.radians(rightwards)
    forward = np.array([np.sin(yaw) * np.cos(pitch), np.sin(pitch), np.cos(yaw) * np.cos(pitch)])
    right = np.array([np.cos(yaw), 0, -np.sin(yaw)])
    axes = np.stack([right, np.cross(forward, right), forward])

    def turned(mesh: Mesh) -> Mesh:
        vertices = (mesh.vertices.astype(np.float64) - np.array(eye)) @ axes.T
        return mesh._replace(vertices=vertices.astype(np.float32))

    lamps = [Lamp(axes @ np.subtract(at, eye), axes @ x, axes @ y, glow) for at, x, y, glow in world.light.lamps]
    suns = [sun._replace(direction=axes @ sun.direction) for sun in world.light.suns]
    things = [one._replace(mesh=turned(one.mesh)) for one in world.things]
    return world._replace(things=things, light=world.light._replace(lamps=lamps, suns=suns))


def lamp_towards(middle: Vector, target: Vector, size: float, radiance: Vector) -> Lamp:
    """A square lamp of a side's length that faces a point; not one straight above or below it."""
    facing = np.array(target) - np.array(middle)
    facing /= np.linalg.norm(facing)
    down = np.array([0.0, 1.0, 0.0]) - facing[1] * facing
    down *= size / np.linalg.norm(down)
    across = np.cross(down, facing)
    return Lamp(np.array(middle) - across / 2 - down / 2, across, down, radiance)


def book(size: Vector, cover: Material, paper: Material, turn: Vector, by: Vector) -> Things:
    """A closed book of width, thickness and depth that lies on y=0 with its back to the left."""
    w, h, d = size
    board = min(0.003, h / 6)
    middle = -h / 2
    covers = [box((0, y, 0), (w, board, d)) for y in (-h + board / 2, -board / 2)]
    covers.append(box((-w / 2 + board / 2, middle, 0), (board, h - 2 * board, d)))
    pages = box((0, middle, 0), (w - 2.5 * board, h - 2 * board, d - 3 * board))
    yield thing(moved(covers, turn, by), cover)
    yield thing(moved(pages, turn, by), paper)


def crate(size: Vector, rows: int, turn: float, by: Vector) -> Mesh:
    """An open crate of rows of slats and two ends, which stands on y=0, turned about the vertical."""
    w, h, d = size
    thickness, pitch = 0.014, h / rows
    places = [(0, -(row + 0.5) * pitch, side * (d / 2)) for row in range(rows) for side in (-1, 1)]
    slats = [box(place, (w, 0.84 * pitch, thickness)) for place in places]
    ends = [box((side * (w - thickness) / 2, -h / 2, 0), (thickness, h, d - thickness)) for side in (-1, 1)]
    bottom = box((0, -0.02, 0), (w - 2 * thickness, thickness, d - thickness))
    return moved(of_boards([*slats, *ends, bottom]), (0, turn, 0), by)


def of_boards(parts: Sequence[Mesh], across: float = 0.137, down: float = 0.091) -> Mesh:
    """Boards as one mesh, the pattern of each these metres further than that of the one before."""
    return joined([shapes.painted_from(part, across * n, down * n) for n, part in enumerate(parts)])


def chair(turn: float, by: Vector, slats: int = 4) -> Mesh:
    """A wooden chair on y=0 that faces -z, turned about the vertical."""
    wide, deep, seat, back, leg = 0.42, 0.42, 0.45, 0.9, 0.036
    x, z = wide / 2 - leg / 2, deep / 2 - leg / 2
    parts = [box((0, -seat + 0.011, 0), (wide, 0.022, deep))]
    parts += [box((side * x, -seat / 2 + 0.011, -z), (leg, seat - 0.022, leg)) for side in (-1, 1)]
    parts += [box((side * x, -back / 2, z + leg), (leg, back, leg)) for side in (-1, 1)]
    parts += [box((0, -height, z + leg), (wide - 2 * leg, 0.06, 0.02)) for height in (seat - 0.02, back - 0.04)]
    parts += [box((side * x, -0.2, leg / 2), (0.02, 0.025, 2 * z)) for side in (-1, 1)]
    parts += [box((0, -seat + 0.045, -z), (wide - 2 * leg, 0.045, 0.02))]
    places = np.linspace(-x, x, slats + 2)[1:-1]
    parts += [box((place, -(seat + back) / 2, z + leg), (0.03, back - seat - 0.08, 0.012)) for place in places.tolist()]
    return moved(of_boards(parts), (0, turn, 0), by)


def table(size: Vector, turn: float, by: Vector) -> Mesh:
    """A wooden table of width, height and depth on y=0, turned about the vertical."""
    w, h, d = size
    leg = 0.055
    x, z = w / 2 - leg, d / 2 - leg
    parts = [box((0, -h + 0.0125, 0), (w, 0.025, d))]
    parts += [box((i * x, -(h - 0.025) / 2, k * z), (leg, h - 0.025, leg)) for i in (-1, 1) for k in (-1, 1)]
    parts += [box((0, -h + 0.07, k * z), (2 * x - leg, 0.09, 0.022)) for k in (-1, 1)]
    parts += [box((i * x, -h + 0.07, 0), (0.022, 0.09, 2 * z - leg)) for i in (-1, 1)]
    return moved(of_boards(parts), (0, turn, 0), by)


def house(wide: float, deep: float, tall: float, rise: float) -> tuple[Mesh, Mesh, Mesh]:
    """Walls with gables, roof and chimney, and windows, of a house that stands on y=0."""
    gable = [[-deep / 2, -tall], [0, -tall - rise], [deep / 2, -tall]]
    ends = [moved(plate(gable, 0.0), (0, np.pi / 2, 0), (side * (wide / 2 - 0.01), 0, 0)) for side in (-1, 1)]
    body = joined([box((0, -tall / 2, 0), (wide, tall, deep)), *ends])
    slope, over = np.hypot(deep / 2, rise), 0.5
    pitch = np.arctan2(rise, deep / 2)
    roof = []
    for side in (-1, 1):
        plane = box((0, -0.12, side * (slope / 2 + over / 2)), (wide + 2 * over, 0.22, slope + over))
        roof.append(moved(plane, (-side * pitch, 0, 0), (0, -tall - rise, 0)))
    chimney = box((wide / 4, -tall - rise - 0.2, 0.6), (0.8, 2.4, 0.8))
    rows = np.arange(1.6, tall - 0.5, 2.4)
    spots = [(x, -y) for y in rows.tolist() for x in np.arange(-wide / 2 + 1.4, wide / 2 - 1, 2.1).tolist()]
    openings = [box((x, y, side * deep / 2), (0.9, 1.2, 0.08)) for x, y in spots for side in (-1, 1)]
    return body, joined([*roof, chimney]), joined(openings)


def leaning(foot: npt.ArrayLike, over: npt.ArrayLike, beyond: float, radius: float) -> Mesh:
    """A stick from its foot over a point that supports it, and ``beyond`` metres further."""
    start, rest = np.asarray(foot, float), np.asarray(over, float)
    along = (rest - start) / np.linalg.norm(rest - start)
    lift = np.array([0.0, -radius, 0.0])
    return rod(start + lift, rest + lift + beyond * along, radius)


def strand(ends: shapes.Outline, sag: float, radius: float) -> Mesh:
    """A wire between two points that hangs down by ``sag`` in its middle."""
    share, (first, last) = np.linspace(0, 1, 24)[:, None], np.asarray(ends, float)
    return shapes.tube(first + share * (last - first) + sag * 4 * share * (1 - share) * [0, 1, 0], radius, 8)


def profile(points: shapes.Outline, count: int = 120) -> Points:
    """A curve through points ``(radius, height)`` of a body of revolution, given from the top down."""
    given = np.array(points, float)
    length = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(given, axis=0), axis=1))])
    return np.asarray(PchipInterpolator(length, given)(np.linspace(0, length[-1], count)))


def vessel(points: shapes.Outline, wall: float, foot: Vector, floor: float = 0.006, sides: int = 96) -> Mesh:
    """An open vessel of an outline, its inside ``wall`` metres within and ``floor`` above ``foot``, where it stands."""
    outer = profile(points)
    low = outer[-1, 1]
    inner = np.stack([np.maximum(outer[:, 0] - wall, 1e-5), np.maximum(outer[:, 1], low + floor)], 1)
    shares = np.linspace(0, 1, 12, endpoint=False)[:, None]
    within = shares * [inner[-1, 0], 0] + [1e-5, low + floor]
    below = shares[::-1] * [outer[-1, 0], 0] + [1e-5, low]
    return turned_body(np.concatenate([within, inner[::-1], outer, below]), foot, sides)


def fruit(centre: Vector, radius: float, seed: int) -> Mesh:
    """A ball with dimples above and below, not quite round."""
    lean = np.random.default_rng(seed).normal(0, 0.03, 3)

    def relief(direction: Points) -> Points:
        dimple = np.exp(-(((np.arccos(np.clip(np.abs(direction[..., 1]), 0, 1))) / 0.25) ** 2))
        waves = 0.03 * np.cos(5 * direction[..., 0] + 3 * direction[..., 2])
        return np.asarray(direction @ lean - 0.12 * dimple + waves)

    return ball(centre, radius, relief, 40)
