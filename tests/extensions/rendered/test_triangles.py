"""Truth and masks are those of the triangle that a pixel's ray meets first: a wrong one is a wrong depth."""

import numpy as np

from sepi.kernels import triangles as kernels

NEAR = 0.1


def first_met(triangles: np.ndarray, *camera: np.ndarray, size: int) -> np.ndarray:
    found = np.zeros((size, size), np.int32)
    kernels.first_met(triangles, *camera, NEAR, found)
    return found


def met_by_solving(triangles: np.ndarray, frame: np.ndarray, size: int) -> np.ndarray:
    """For each ray and triangle the corners' weights and the depth by a linear system."""
    focal, row, column = frame
    nearest, found = np.full((size, size), np.inf), np.zeros((size, size), int)
    for y in range(size):
        for x in range(size):
            ray = np.array([(x + 0.5 - column) / focal, (y + 0.5 - row) / focal, 1.0])
            for number, triangle in enumerate(triangles[1:], start=1):
                # sum of weights times corners is depth times ray, weights sum to one
                weights = np.linalg.solve(triangle.T, ray)
                depth = 1 / weights.sum()
                if (weights * depth >= 0).all() and NEAR < depth < nearest[y, x]:
                    nearest[y, x], found[y, x] = depth, number
    return found


def test_each_ray_meets_the_nearest_triangle() -> None:
    """Those that reach behind the camera, or lie all behind it, too; and pictures higher than a band of rows."""
    rng = np.random.default_rng(10)
    triangles = rng.normal([0, 0, 1], [1, 1, 0.7], (16, 1, 3)) + rng.normal(0, 0.5, (16, 3, 3))
    size, frame = 40, np.array([15.0, 22.3, 17.1])
    behind, before = (triangles[1:, :, 2] < NEAR).sum(axis=1), np.arange(1, 16)
    met = first_met(triangles, np.zeros(3), np.eye(3), frame, size=size)
    assert np.array_equal(met, met_by_solving(triangles, frame, size))
    # the camera stands elsewhere, and is turned
    turned, origin = np.linalg.qr(rng.normal(size=(3, 3)))[0], np.array([0.3, -0.2, 0.5])
    assert np.array_equal(first_met(triangles @ turned.T + origin, origin, turned, frame, size=size), met)
    seen = set(np.unique(met))
    assert 0 in seen
    assert all(seen & set(before[behind == corners]) for corners in (0, 1, 2))


def test_no_ray_slips_through_a_side() -> None:
    """A fan of slivers without gaps about a corner that lies on a ray."""
    angle = np.linspace(0, 2 * np.pi, 400)
    rim = np.stack([3 * np.cos(angle), 3 * np.sin(angle), np.full(400, 2.0)], axis=1)
    fan = [np.stack([[0, 0, 2.0], first, second]) for first, second in zip(rim[:-1], [*rim[1:-1], rim[0]], strict=True)]
    triangles, frame = np.array([np.zeros((3, 3)), *fan]), np.array([20.0, 16.5, 16.5])
    met = first_met(triangles, np.zeros(3), np.eye(3), frame, size=33)
    assert (met > 0).all()
