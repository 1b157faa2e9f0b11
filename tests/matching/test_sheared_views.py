"""The sheared views equal a plain NumPy twin, and show a plane's points where they are."""

import numpy as np
import pytest

from sepi.kernels import sheared_views
from sepi.lightfield import LightField, as_unit_float
from sepi.matching.sheared_views import ShearedViews, refocused
from sepi.scenes import render


def weight_twin(distance: float, cubic: bool) -> float:
    """Weight of a pixel this far from the sample: Keys' kernel, or a triangle."""
    x = abs(distance)
    if not cubic:
        return max(0.0, 1 - x)
    if x <= 1:
        return 1.5 * x**3 - 2.5 * x**2 + 1
    return -0.5 * x**3 + 2.5 * x**2 - 4 * x + 2 if x < 2 else 0.0


def matrix_twin(length: int, offset: float, cubic: bool) -> np.ndarray:
    """What each pixel, those beyond the ends being the last ones, gives to each sample; (length, length)."""
    matrix = np.zeros((length, length))
    for to in range(length):
        first = int(np.floor(to + offset)) - 1
        for pixel in range(first, first + 4):
            matrix[to, min(max(pixel, 0), length - 1)] += weight_twin(to + offset - pixel, cubic)
    return matrix


def sheared(views: np.ndarray, offsets: np.ndarray, cubic: bool = True) -> np.ndarray:
    out = np.full_like(views, np.nan)
    sheared_views.shear(views, offsets, cubic, out)
    return out


@pytest.fixture(scope="module")
def random_views() -> np.ndarray:
    return np.random.default_rng(0).random((7, 3, 11, 17), np.float32)


OFFSETS = np.array([[0.3, -0.7], [-2.25, 1.5], [4.9, 0], [0, -5.1], [-0.001, 0.999], [30.4, -25.6], [-11, 17.0]])
"""Small, of several pixels, along one axis, near whole numbers, and beyond the picture."""


@pytest.mark.parametrize("cubic", [True, False], ids=["cubic", "bilinear"])
def test_kernel_equals_a_plain_twin(random_views: np.ndarray, cubic: bool) -> None:
    """Every cost of the methods that shear views comes from these samples, those near the borders too."""
    found = sheared(random_views, OFFSETS, cubic)
    for n, (down, across) in enumerate(OFFSETS):
        rows, columns = matrix_twin(11, down, cubic), matrix_twin(17, across, cubic)
        np.testing.assert_allclose(found[n], rows @ random_views[n].astype(float) @ columns.T, atol=2e-6)


@pytest.fixture(scope="module")
def plane() -> LightField:
    return render("fronto_parallel", size=64, views=5)


def test_views_of_a_plane_agree_at_its_disparity(plane: LightField) -> None:
    """A wrong sign or a swapped axis would make no candidate fit."""
    true = float(plane.ground_truth[32, 32])
    views = ShearedViews(plane)

    def spread(disparity: float) -> float:
        return float(views.at(disparity)[..., 8:-8, 8:-8].std(axis=0).mean())

    assert spread(true) < 0.25 * min(spread(true - 0.5), spread(true + 0.5), spread(-true))


def test_missing_views_are_left_out(plane: LightField) -> None:
    """They hold anything, and none of it may be compared."""
    present = np.ones((5, 5), bool)
    present[0, 1] = present[3, 4] = False
    field = LightField(plane.views, "some", present=present, disparity_range=plane.disparity_range)
    views = ShearedViews(field)
    assert len(views.positions) == len(views.at(0.4)) == 23
    assert not {(0, 1), (3, 4)} & {tuple(position) for position in views.positions.tolist()}


def test_chosen_views_alone_are_sheared(plane: LightField) -> None:
    """Where the reference is not among them, methods must be told."""
    chosen = np.zeros((5, 5), bool)
    chosen[0, :2] = True
    views = ShearedViews(plane, chosen)
    np.testing.assert_array_equal(views.positions, [[0, 0], [0, 1]])
    assert views.reference == -1
    expected = as_unit_float(plane.views[0, 1]).transpose(2, 0, 1)
    np.testing.assert_array_equal(views.at(0)[1], expected)


def test_refocused_is_the_mean_of_the_views() -> None:
    """Defocus cues compare it with the reference view; weights need not sum to one."""
    views = np.random.default_rng(1).random((4, 3, 5, 6), np.float32)
    weights = np.array([1, 0, 2, 5], np.float32)
    np.testing.assert_allclose(refocused(views), views.mean(axis=0), rtol=1e-6)
    np.testing.assert_allclose(refocused(views, weights), np.average(views, axis=0, weights=weights), rtol=1e-5)
    assert refocused(views).dtype == refocused(views, weights).dtype == np.float32
