"""What several scenes set things up with: books, crates, sticks that lean; and worlds seen from any place in them."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import numpy.typing as npt

from sepi.rendered.shapes import box, joined, moved, painted_from, rod
from sepi.rendered.world import Lamp, Material, Mesh, Sun, Thing, Vector, World


def seen_from(world: World, eye: Vector, below: float = 0.0, rightwards: float = 0.0) -> World:
    """A world that was built elsewhere, as the reference camera sees it.

    Parameters
    ----------
    world : World
        ``y`` points down; a panorama stays as it is.
    eye : (float, float, float)
        Where the reference camera stands in it.
    below, rightwards : float
        Degrees by which it looks below the horizon, and to the right of ``z``.
    """
    pitch, yaw = np.radians(below), np.radians(rightwards)
    forward = np.array([np.sin(yaw) * np.cos(pitch), np.sin(pitch), np.cos(yaw) * np.cos(pitch)])
    right = np.array([np.cos(yaw), 0, -np.sin(yaw)])
    axes = np.stack([right, np.cross(forward, right), forward])

    def turned(vector: Vector) -> Vector:
        x, y, z = (axes @ np.array(vector)).tolist()
        return x, y, z

    def shifted(point: Vector) -> Vector:
        return turned((point[0] - eye[0], point[1] - eye[1], point[2] - eye[2]))

    def mesh(old: Mesh) -> Mesh:
        vertices = (old.vertices.astype(np.float64) - np.array(eye)) @ axes.T
        return replace(old, vertices=vertices.astype(np.float32))

    return replace(
        world,
        things=[replace(thing, mesh=mesh(thing.mesh)) for thing in world.things],
        lamps=[
            Lamp(shifted(lamp.corner), turned(lamp.across), turned(lamp.down), lamp.radiance) for lamp in world.lamps
        ],
        suns=[Sun(turned(sun.direction), sun.irradiance) for sun in world.suns],
    )


def book(size: Vector, cover: Material, paper: Material, turn: Vector, by: Vector) -> list[Thing]:
    """A closed book of width, thickness and depth that lies on y=0 with its back to the left."""
    w, h, d = size
    board = min(0.003, h / 6)
    middle = -h / 2
    covers = [
        box((0, -h + board / 2, 0), (w, board, d)),
        box((0, -board / 2, 0), (w, board, d)),
        box((-w / 2 + board / 2, middle, 0), (board, h - 2 * board, d)),
    ]
    pages = box((0, middle, 0), (w - 2.5 * board, h - 2 * board, d - 3 * board))
    return [
        Thing(moved(joined(covers), turn, by), cover),
        Thing(moved(pages, turn, by), paper),
    ]


def crate(size: Vector, rows: int, turn: float, by: Vector) -> Mesh:
    """An open crate of rows of slats and two ends, which stands on y=0, turned about the vertical."""
    w, h, d = size
    thickness, pitch = 0.014, h / rows
    slats = [
        box((0, -(row + 0.5) * pitch, side * (d / 2)), (w, 0.84 * pitch, thickness))
        for row in range(rows)
        for side in (-1, 1)
    ]
    ends = [box((side * (w - thickness) / 2, -h / 2, 0), (thickness, h, d - thickness)) for side in (-1, 1)]
    bottom = box((0, -0.02, 0), (w - 2 * thickness, thickness, d - thickness))
    parts = [painted_from(part, 0.13 * n, 0.09 * n) for n, part in enumerate([*slats, *ends, bottom])]
    return moved(joined(parts), (0, turn, 0), by)


def leaning(foot: npt.ArrayLike, over: npt.ArrayLike, beyond: float, radius: float) -> Mesh:
    """A stick from its foot that lies upon a point and goes on for so many metres."""
    start, rest = np.asarray(foot, float), np.asarray(over, float)
    along = (rest - start) / np.linalg.norm(rest - start)
    lift = np.array([0.0, -radius, 0.0])
    return rod(start + lift, rest + lift + beyond * along, radius)
