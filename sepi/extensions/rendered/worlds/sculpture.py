"""A bust: the surface on which a distance is zero.

Ellipsoids, capsules and cuts run into each other, as a sculptor adds clay and takes it away. In here ``y`` is up and
the face looks along ``z``; lengths are in metres.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
from skimage import measure

from sepi.extensions.rendered.world import Mesh, Vector

Array = npt.NDArray[np.float64]


def bust(finest: float = 0.002) -> Mesh:
    """Head, neck and chest, 0.55 m high: the face towards ``-z``, ``y`` down, the eyes at height 0."""
    low, count = np.array([-0.24, -0.48, -0.16]), np.array([60, 81, 38])
    step, distance = 4 * finest, np.zeros(count)
    for level in range(3):
        if level:
            # only near the surface is it worth while to look again
            step, distance = step / 2, distance.repeat(2, 0).repeat(2, 1).repeat(2, 2)
        near = np.nonzero(np.abs(distance) < 2.5 * step)
        distance[near] = _sculpture(low + step * (np.stack(near, -1) + 0.5))
    points, faces, _, _ = measure.marching_cubes(distance, 0.0)  # type: ignore[no-untyped-call]
    points = low + step * (points + 0.5)
    uv = np.stack([0.1 * np.arctan2(points[:, 0], points[:, 2]), -points[:, 1]], -1)
    upright = points * np.array([1, -1, -1])
    return Mesh(upright.astype(np.float32), faces.astype(np.uint32), uv.astype(np.float32), smooth=True)


def _ellipsoid(p: Array, centre: Vector, radii: Vector) -> Array:
    scaled = (p - np.array(centre)) / np.array(radii)
    length = np.linalg.norm(scaled, axis=-1)
    found: Array = length * (length - 1) / np.maximum(np.linalg.norm(scaled / np.array(radii), axis=-1), 1e-9)
    return found


def _capsule(p: Array, start: Vector, end: Vector, first: float, last: float) -> Array:
    """Distance to a line whose radius goes from ``first`` to ``last``."""
    a, along = np.array(start), np.array(end) - np.array(start)
    share = np.clip((p - a) @ along / (along @ along), 0, 1)
    found: Array = np.linalg.norm(p - a - share[..., None] * along, axis=-1) - first - share * (last - first)
    return found


def _blend(a: Array, b: Array, width: float) -> Array:
    """Both bodies, their meeting rounded."""
    over = np.maximum(width - np.abs(a - b), 0) / width
    found: Array = np.minimum(a, b) - over**2 * width / 4
    return found


def _without(a: Array, b: Array, width: float) -> Array:
    return -_blend(-a, b, width)


def _head(p: Array) -> Array:
    """Distance from the head, whose face looks along ``z``, ``y`` up; the ears are at height 0."""
    q = np.stack([np.abs(p[..., 0]), p[..., 1], p[..., 2]], axis=-1)
    d = _blend(
        _ellipsoid(q, (0, 0.03, -0.012), (0.074, 0.088, 0.1)),
        _ellipsoid(q, (0, -0.03, 0.03), (0.06, 0.085, 0.064)),
        0.02,
    )
    d = _blend(d, _ellipsoid(q, (0, -0.072, 0.035), (0.051, 0.042, 0.054)), 0.02)
    d = _blend(d, _ellipsoid(q, (0, -0.1, 0.077), (0.021, 0.017, 0.018)), 0.02)
    d = _blend(d, _ellipsoid(q, (0.044, -0.022, 0.06), (0.02, 0.016, 0.02)), 0.025)
    d = _without(d, _ellipsoid(q, (0.031, 0.001, 0.102), (0.021, 0.013, 0.022)), 0.014)
    d = _blend(d, _capsule(q, (0.01, 0.021, 0.091), (0.05, 0.018, 0.07), 0.006, 0.005), 0.014)
    d = np.minimum(d, _eye(q))
    d = _blend(d, _capsule(q, (0, 0.014, 0.094), (0, -0.036, 0.116), 0.0065, 0.0095), 0.008)
    d = _blend(d, _ellipsoid(q, (0.0125, -0.041, 0.1), (0.008, 0.008, 0.01)), 0.005)
    d = _without(d, _capsule(q, (0, -0.05, 0.103), (0, -0.06, 0.101), 0.003, 0.004), 0.006)
    d = _blend(d, _capsule(q, (0.004, -0.066, 0.0975), (0.022, -0.0705, 0.088), 0.0055, 0.002), 0.004)
    d = _blend(d, _capsule(q, (0, -0.0785, 0.096), (0.018, -0.0735, 0.089), 0.0065, 0.002), 0.003)
    return _blend(d, _ellipsoid(q, (0.076, -0.008, -0.012), (0.011, 0.03, 0.018)), 0.006)


def _eye(q: Array) -> Array:
    """The ball, and two lids that leave a slit."""
    centre = (0.031, 0.001, 0.073)
    ball = np.linalg.norm(q - np.array(centre), axis=-1) - 0.0125
    lids = np.linalg.norm(q - np.array(centre), axis=-1) - 0.0145
    width = (q[..., 0] - centre[0]) / 0.016
    slit = np.abs(q[..., 1] - centre[1]) - 0.0052 * (1 - width**2)
    found: Array = np.minimum(ball, np.maximum(lids, -slit))
    return found


def _body(p: Array) -> Array:
    q = np.stack([np.abs(p[..., 0]), p[..., 1], p[..., 2]], axis=-1)
    d = _capsule(q, (0, -0.06, -0.018), (0, -0.27, -0.035), 0.054, 0.06)
    d = _blend(d, _capsule(q, (0.016, -0.25, 0.03), (0.05, -0.06, -0.01), 0.012, 0.012), 0.02)
    d = _blend(d, _capsule(q, (0.02, -0.2, -0.05), (0.16, -0.275, -0.045), 0.05, 0.06), 0.05)
    d = _blend(d, _ellipsoid(q, (0, -0.36, -0.02), (0.17, 0.13, 0.1)), 0.06)
    d = _blend(d, _ellipsoid(q, (0.07, -0.37, 0.03), (0.075, 0.06, 0.06)), 0.05)
    d = -_blend(-d, -_ellipsoid(q, (0, -0.21, 0), (0.2, 0.25, 0.3)), 0.012)
    return d


def _sculpture(p: Array) -> Array:
    x, y, z = p[..., 0], p[..., 1], p[..., 2]
    # the head is far from what lies lower
    upper = y > -0.17
    d = np.full(y.shape, 1.0)
    d[upper] = _head(p[upper]) - _hair(p[upper])
    d = _blend(d, _body(p - np.array([0, 0.03, 0])), 0.022)
    fold = np.sin(75 * (y - 0.45 * x) + 5 * np.sin(14 * x + 3 * z))
    found: Array = d - np.clip((0.45 * x - 0.305 - y) / 0.008, 0, 1) * (0.006 + 0.005 * fold)
    return found


def _hair(p: Array) -> Array:
    """Height of the hair: it ends over the brow, before the ears and in the neck."""
    hairline = np.interp(p[..., 2], [-0.03, 0.0, 0.035, 0.07], [-0.09, 0.012, 0.03, 0.066])
    found: Array = np.clip((p[..., 1] - hairline) / 0.01, 0, 1) * (0.008 + 0.004 * _locks(p))
    return found


def _locks(p: Array) -> Array:
    """Waves of hair that run from the crown down, -1..1."""
    rng = np.random.default_rng(5)
    warp = sum(
        np.sin(p @ (frequency * rng.standard_normal(3)) + rng.uniform(0, 6)) * 40 / frequency
        for frequency in (40, 40, 60, 60, 110)
    )
    around = np.arctan2(p[..., 0], p[..., 2] + 0.01)
    found: Array = 1 - 2 * np.abs(np.sin(10 * around + 30 * p[..., 1] + warp))
    return found
