"""Planes of walls without texture, by how light falls off along them: a tenth of a level per pixel, in noise."""

import numpy as np
import numpy.typing as npt
import pytest

from sepi.lightfield import BoolMap, DisparityRange, LightField
from sepi.matching.base_detail import BaseDetailParameters
from sepi.matching.gauss_newton import GaussNewton
from sepi.regularization.lit_planes import LitPlane, lit_planes
from sepi.regularization.regions import Region
from sepi.regularization.uniform_regions import UniformPlanesParameters, fill_uniform_regions
from sepi.stage import StageMaps

SIZE, VIEWS = 128, 5
ALL = (slice(0, SIZE), slice(0, SIZE))
# 1, x and y from the middle
WALL = np.array([-0.9, 0.002, -0.003])
NOISE = 3.0


def light(x: npt.NDArray[np.float64], y: npt.NDArray[np.float64]) -> npt.NDArray[np.float64]:
    """Of a lamp beside the picture, in levels: about 0.3 of them from pixel to pixel."""
    fall = 90 / (1 + ((x - 20) ** 2 + (y + 60) ** 2) / 120**2) ** 1.5
    return 60 + fall[..., None] * np.array([1.0, 0.8, 0.6])


def wall_of(plane: npt.NDArray[np.float64], noise: float = NOISE, brighter: float = 0, bend: float = 0) -> LightField:
    """A lit plane; ``brighter``: levels by which views differ; ``bend``: by how much its middle comes forward, px."""
    random = np.random.default_rng(3)
    middle = (SIZE - 1) / 2
    Y, X = np.mgrid[:SIZE, :SIZE] - middle
    views = np.empty((VIEWS, VIEWS, SIZE, SIZE, 3))
    for t, s in np.ndindex(VIEWS, VIEWS):
        v, u = t - VIEWS // 2, s - VIEWS // 2
        x, y = X, Y
        for _ in range(20):
            d = plane[0] + plane[1] * x + plane[2] * y + bend * np.exp(-(x**2 + y**2) / 20**2)
            x, y = X + d * u, Y + d * v
        views[t, s] = light(x, y) + random.normal(0, brighter) + random.normal(0, noise, (SIZE, SIZE, 3))
    pictures = np.clip(np.rint(views), 0, 255).astype(np.uint8)
    return LightField(pictures, "wall", disparity_range=DisparityRange(-2, 2, "given"))


def told_of(light_field: LightField, variance: float = NOISE**2) -> LitPlane | None:
    """What the whole picture tells, from the middle of the range."""
    matching = GaussNewton(light_field, BaseDetailParameters(use_detail=False), 0.15)
    region = Region(ALL, np.ones((SIZE, SIZE), bool))
    disparity = np.zeros((SIZE, SIZE), np.float32)
    known = np.full((SIZE, SIZE), variance / 255**2, np.float32)
    return lit_planes(light_field, matching, disparity, [region], [np.zeros(3)], known)[0]


def test_a_wall_without_texture_has_the_depth_that_its_light_tells() -> None:
    """Otherwise plain walls, half of the picture of a room, are a guess from what stands before them."""
    lit = told_of(wall_of(WALL))
    basis = Region(ALL, np.ones((SIZE, SIZE), bool)).basis
    error = np.sqrt(np.mean((basis @ (lit.plane - WALL)) ** 2))
    assert error < 0.04
    # and it says how far it may be off
    assert 0.3 * error < lit.deviation(basis) < 0.06
    assert lit.distance(WALL) < 4
    assert 0.3 < lit.misfit < 2


def test_noise_and_unlike_views_make_a_plane_less_sure() -> None:
    """If this fails, cameras of unlike exposure move walls."""
    basis = Region(ALL, np.ones((SIZE, SIZE), bool)).basis
    quiet, noisy, unlike = (
        told_of(light_field, variance)
        for light_field, variance in (
            (wall_of(WALL, 1.5), 1.5**2),
            (wall_of(WALL, 6), 6.0**2),
            (wall_of(WALL, 1.5, brighter=1), 1.5**2),
        )
    )
    assert noisy.deviation(basis) == pytest.approx(4 * quiet.deviation(basis), rel=0.35)
    assert unlike.deviation(basis) > 4 * quiet.deviation(basis)
    assert unlike.distance(WALL) < 4


def test_what_is_bent_is_no_plane() -> None:
    """Otherwise a column before a wall becomes a part of the wall."""
    straight, bent = told_of(wall_of(WALL, 1.0), 1.0), told_of(wall_of(WALL, 1.0, bend=0.6), 1.0)
    assert straight.misfit < 4 < bent.misfit


def test_a_plane_that_the_farthest_view_sees_from_behind_is_none() -> None:
    """A few pixels of noise would otherwise put a ramp through the whole range into a shelf."""

    def steep(slope: float) -> LightField:
        views = wall_of(np.array([0.0, slope, 0.0]), 0.5).views
        return LightField(views, "steep", disparity_range=DisparityRange(-40, 40, "given"))

    lit = told_of(steep(0.2), 0.25)
    assert lit.plane[1] == pytest.approx(0.2, abs=0.01)
    # two steps away, such a plane has shrunk to a fifth
    assert told_of(steep(0.4), 0.25) is None


def test_without_light_or_within_another_range_nothing_is_told() -> None:
    """A plane by noise alone would lie anywhere."""
    even = wall_of(WALL)
    dark = LightField(np.full_like(even.views, 80), "dark", disparity_range=even.disparity_range)
    assert told_of(dark) is None
    near = LightField(even.views, "near", disparity_range=DisparityRange(0.5, 2, "given"))
    assert told_of(near) is None


def test_a_wall_at_the_end_of_the_range_is_told() -> None:
    """Ranges end at the farthest wall; an error of a few hundredths beyond it would leave the wall a guess."""
    wall = wall_of(np.array([-0.9, 0, 0]))
    near = LightField(wall.views, "at the end", disparity_range=DisparityRange(-0.86, 2, "given"))
    lit = told_of(near)
    assert np.abs(Region(ALL, np.ones((SIZE, SIZE), bool)).basis @ lit.plane + 0.88).mean() < 0.06


@pytest.fixture(scope="module")
def room() -> tuple[LightField, StageMaps, BoolMap]:
    """The wall behind a board of strong texture, and a map that takes the wall for the board's."""
    noise = 2 * NOISE
    wall = wall_of(WALL, noise)
    board = np.s_[40:90, 50:100]
    random = np.random.default_rng(8)
    # repeated enough that the board is the same in all views: its disparity is 0
    texture = random.uniform(30, 220, (50, 50, 3))
    views = wall.views.astype(np.float64)
    views[:, :, *board] = texture + random.normal(0, noise, (VIEWS, VIEWS, 50, 50, 3))
    pictures = np.clip(np.rint(views), 0, 255).astype(np.uint8)
    light_field = LightField(pictures, "room", disparity_range=wall.disparity_range)
    of_wall = np.ones((SIZE, SIZE), bool)
    of_wall[board] = False
    maps = StageMaps(np.zeros((SIZE, SIZE), np.float32), np.full((SIZE, SIZE), 0.5, np.float32))
    return light_field, maps, of_wall


def test_a_noisy_wall_leaves_the_depth_of_what_stands_before_it(room: tuple[LightField, StageMaps, BoolMap]) -> None:
    light_field, maps, of_wall = room
    truth = (Region(ALL, np.ones((SIZE, SIZE), bool)).basis @ WALL).reshape(SIZE, SIZE)
    disparity, held, deviation = fill_uniform_regions(light_field, maps, UniformPlanesParameters())
    assert held[of_wall].mean() > 0.9
    assert 0 < np.median(deviation[held]) < 0.1
    assert not held[45:85, 55:95].any()
    assert np.abs(disparity - truth)[held].mean() < 0.1
    np.testing.assert_array_equal(disparity[~held], maps.disparity[~held])
    without, held, _ = fill_uniform_regions(light_field, maps, UniformPlanesParameters(light=False))
    assert np.abs(without - truth)[of_wall].mean() > 0.5
