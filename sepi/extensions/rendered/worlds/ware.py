"""Vessels and fruit that more than one path-traced scene has on its tables."""

from __future__ import annotations

import numpy as np
from scipy.interpolate import PchipInterpolator

from sepi.extensions.rendered import shapes
from sepi.extensions.rendered.shapes import Points
from sepi.extensions.rendered.world import Mesh, Vector


def profile(points: list[tuple[float, float]], count: int = 120) -> Points:
    """A curve through points ``(radius, height)`` of a body of revolution, given from the top down."""
    given = np.array(points, float)
    length = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(given, axis=0), axis=1))])
    found: Points = PchipInterpolator(length, given)(np.linspace(0, length[-1], count))
    return found


def vessel(points: list[tuple[float, float]], wall: float, foot: Vector, floor: float = 0.006, sides: int = 96) -> Mesh:
    """An open vessel of an outline, its inside ``wall`` metres within and ``floor`` above ``foot``, where it stands."""
    outer = profile(points)
    low = outer[-1, 1]
    inner = np.stack([np.maximum(outer[:, 0] - wall, 1e-5), np.maximum(outer[:, 1], low + floor)], 1)
    shares = np.linspace(0, 1, 12, endpoint=False)[:, None]
    within = shares * [inner[-1, 0], 0] + [1e-5, low + floor]
    below = shares[::-1] * [outer[-1, 0], 0] + [1e-5, low]
    return shapes.turned_body(np.concatenate([within, inner[::-1], outer, below]), foot, sides)


def fruit(centre: Vector, radius: float, seed: int) -> Mesh:
    """A ball with dimples above and below, not quite round."""
    lean = np.random.default_rng(seed).normal(0, 0.03, 3)

    def relief(direction: Points) -> Points:
        dimple = np.exp(-(((np.arccos(np.clip(np.abs(direction[..., 1]), 0, 1))) / 0.25) ** 2))
        found: Points = direction @ lean - 0.12 * dimple + 0.03 * np.cos(5 * direction[..., 0] + 3 * direction[..., 2])
        return found

    return shapes.ball(centre, radius, relief, 40)
