"""Planes in regions without texture: a region's plane is its own, whatever else there is and however it lies."""

import numpy as np
import pytest
from scipy.ndimage import gaussian_filter

from sepi.lightfield import DisparityRange, LightField
from sepi.regularization.border_planes import support
from sepi.regularization.regions import parts_of, together
from sepi.regularization.uniform_regions import (
    UniformPlanesParameters,
    fill_uniform_regions,
    plain_pixels,
    spread_over_plain,
    squared_gradients,
    uniform_regions,
)
from sepi.stage import StageMaps

SHAPE = (60, 90)
PARAMETERS = UniformPlanesParameters(window_radius=1, growth=0, ransac_iterations=40)


def scene(*regions: tuple[slice, slice]) -> tuple[LightField, StageMaps]:
    """Three equal views of a texture with these bare regions, and a doubtful depth map of a slanted plane."""
    random = np.random.default_rng(5)
    # detail wider than a pixel, so that it is not taken for noise of the camera
    texture = gaussian_filter(random.normal(0, 400, (*SHAPE, 3)), (1.5, 1.5, 0))
    view = np.clip(128 + texture, 0, 255).astype(np.uint8)
    noise = random.normal(0, 0.04, SHAPE)
    for number, region in enumerate(regions):
        view[region] = 120 + 10 * number
    y, x = np.mgrid[: SHAPE[0], : SHAPE[1]]
    disparity = (0.004 * x - 0.003 * y + noise).astype(np.float32)
    # what stands before the background, and must not pull a plane nearer
    disparity[:, 40:46] += 0.5
    views = np.broadcast_to(view, (1, 3, *view.shape)).copy()
    light_field = LightField(views, "bare", disparity_range=DisparityRange(-2, 2, "given"))
    return light_field, StageMaps(disparity, np.full(SHAPE, 0.7, np.float32))


def mirrored(light_field: LightField, maps: StageMaps, axis: int) -> tuple[LightField, StageMaps]:
    views = np.flip(light_field.views, (axis, axis + 2)).copy()
    field = LightField(views, "mirrored", disparity_range=light_field.disparity_range)
    return field, StageMaps(np.flip(maps.disparity, axis).copy(), np.flip(maps.confidence, axis).copy())


NEAR, FAR, SMALL = np.s_[10:34, 8:38], np.s_[36:56, 60:86], np.s_[8:12, 44:48]


@pytest.mark.parametrize("axis", [0, 1])
def test_a_mirrored_scene_has_mirrored_planes(axis: int) -> None:
    """A picture taken through a mirror must not have another depth."""
    light_field, maps = scene(NEAR, FAR)
    disparity, filled, _ = fill_uniform_regions(light_field, maps, PARAMETERS)
    other, other_filled, _ = fill_uniform_regions(*mirrored(light_field, maps, axis), PARAMETERS)
    assert filled[NEAR].mean() > 0.8
    assert filled[FAR].mean() > 0.8
    np.testing.assert_array_equal(np.flip(other_filled, axis), filled)
    np.testing.assert_allclose(np.flip(other, axis), disparity, atol=1e-5)


@pytest.mark.parametrize(("near", "far"), [(NEAR, FAR), (FAR, NEAR)])
def test_a_far_region_does_not_change_a_near_ones_plane(near: tuple[slice, slice], far: tuple[slice, slice]) -> None:
    alone, *_ = fill_uniform_regions(*scene(near), PARAMETERS)
    beside, *_ = fill_uniform_regions(*scene(near, far), PARAMETERS)
    np.testing.assert_array_equal(beside[near], alone[near])


@pytest.mark.parametrize("refused", [np.s_[35:41, 8:38], np.s_[3:9, 8:38]], ids=["later", "earlier"])
def test_a_refused_region_counts_the_same_before_and_after(refused: tuple[slice, slice]) -> None:
    """Regions are numbered from the top: one that is refused must be no border of others, wherever it lies."""
    light_field, maps = scene(NEAR, refused)
    # nothing agrees round the second region, and its own depth would spoil the plane of the first
    maps.disparity[refused] = np.random.default_rng(1).uniform(-2, 2, maps.disparity[refused].shape)
    around = tuple(slice(max(side.start - 4, 0), side.stop + 4) for side in refused)
    rim = np.zeros(SHAPE, bool)
    rim[around] = True
    rim[refused] = rim[NEAR] = False
    maps.disparity[rim] = np.random.default_rng(2).uniform(-2, 2, rim.sum())
    disparity, filled, _ = fill_uniform_regions(light_field, maps, PARAMETERS)
    assert not filled[refused].any()
    flipped, other, _ = fill_uniform_regions(*mirrored(light_field, maps, 0), PARAMETERS)
    np.testing.assert_array_equal(np.flip(other, 0), filled)
    np.testing.assert_allclose(np.flip(flipped, 0), disparity, atol=1e-5)


def test_planes_stay_within_the_range() -> None:
    """A plane that its border holds at one side only would lead behind what was searched."""
    light_field, maps = scene(NEAR)
    narrow = light_field.with_range(DisparityRange(0.0, 0.05, "given"))
    whole, filled, _ = fill_uniform_regions(light_field, maps, PARAMETERS)
    cut, *_ = fill_uniform_regions(narrow, maps, PARAMETERS)
    assert whole[filled].min() < -0.01
    assert whole[filled].max() > 0.06
    np.testing.assert_array_equal(cut[filled], np.clip(whole[filled], 0, np.float32(0.05)))


def test_a_wall_in_steps_of_integers_is_bare() -> None:
    """Light that falls off along a wall changes by one grey level here and there: no texture, though no noise."""
    light_field, maps = scene()
    # upright bars and level steps, in which no noise is found
    light_field.views[:] = light_field.views[..., :1, :, :]
    light_field.views[..., 10:40, 10:60, :] = 120 + np.arange(30)[:, None, None] // 12
    _, filled, _ = fill_uniform_regions(light_field, maps, UniformPlanesParameters(growth=0, ransac_iterations=40))
    assert filled[16:34, 16:54].mean() > 0.95


def test_a_gap_between_pixels_of_a_wall_belongs_to_it() -> None:
    """Between a box and a ball a wall is too narrow to be plain: a few rows there kept the ball's depth."""
    plain = np.zeros((60, 30), bool)
    plain[:10] = plain[[34, 37], 15] = True
    grey, doubt = np.full((*plain.shape, 3), 0.5, np.float32), np.zeros(plain.shape, np.float32)
    found = uniform_regions(grey, plain, 1e-6, doubt, UniformPlanesParameters(window_radius=4, growth=8), 2)
    # one plain pixel is within reach of rows 22 to 24, and of rows 47 to 49, where the wall may end
    assert np.flatnonzero(found[:, 15]).tolist() == list(range(47))


def test_what_is_found_in_one_region_does_not_move_the_plane_of_the_next() -> None:
    """Two walls with a cable between them: the depth of one is no border of the other, since nobody knows it."""
    left, right = np.s_[10:40, 10:39], np.s_[10:40, 40:70]
    light_field, maps = scene(left, right)
    light_field.views[..., 10:40, 39, :] = 40
    # the cable stays sharp in the mean of the views, so that the walls reach it from both sides
    maps.disparity[:, 35:44] = 0
    parameters = UniformPlanesParameters(window_radius=1, growth=8, ransac_iterations=40)
    usual, filled, _ = fill_uniform_regions(light_field, maps, parameters)
    assert filled[left].mean() > 0.9
    assert filled[right].mean() > 0.9
    maps.disparity[right] = 1
    moved, *_ = fill_uniform_regions(light_field, maps, parameters)
    np.testing.assert_array_equal(moved[left], usual[left])


def test_planes_are_held_by_the_pixels_that_lie_on_them() -> None:
    """Where behind counts as before, or a pixel more or less, a wall gets the plane of what hangs on it."""
    random = np.random.default_rng(5)
    positions = np.column_stack([np.ones(200), random.uniform(0, 50, (200, 2))])
    planes = random.normal(0, (1, 0.02, 0.02), (30, 3))
    values = positions @ planes[0] + random.normal(0, 0.3, 200)
    residual = values - planes @ positions.T
    expected = (abs(residual) < 0.2).sum(axis=1) - 0.7 * (residual < -0.2).sum(axis=1)
    np.testing.assert_allclose(support(positions, values, planes, 0.2, 0.7), expected)


def test_a_bare_region_spreads_through_a_gap_that_no_window_fits_into() -> None:
    """The sky between two houses had the houses' depth; what is as faint as noise is bare, what is textured is not."""
    random, variance = np.random.default_rng(3), np.full((90, 80), 1e-6, np.float32)
    mean = random.uniform(0, 1, (90, 80, 3)).astype(np.float32)
    sky = np.zeros((90, 80), bool)
    sky[:30] = sky[:70, 40:48] = True
    mean[sky] = 0.5 + random.normal(0, 1e-3, (sky.sum(), 3))
    doubtful, parameters = np.full((90, 80), 0.5, np.float32), UniformPlanesParameters()
    gradients = squared_gradients(mean)
    inner = uniform_regions(mean, plain_pixels(gradients, variance, parameters), variance, doubtful, parameters, 2)
    spread = spread_over_plain(mean, gradients, inner, variance, doubtful, parameters)
    assert not inner[50:65, 40:48].any()
    assert spread[30:65, 42:46].all()
    assert not spread[~sky].any()


@pytest.mark.parametrize(
    ("below", "colour", "joined"),
    [
        (np.s_[25:45, :], 0.5, True),
        (np.s_[25:45, :], 0.6, False),
        (np.s_[29:45, :], 0.5, False),
        (np.s_[25:45, 30:33], 0.5, False),
    ],
    ids=["wire", "other colour", "wide", "short side"],
)
def test_parts_behind_something_thin_are_one(below: tuple[slice, slice], colour: float, joined: bool) -> None:
    """Sky above a wire had the wire's depth; a dark fold beside a dark wall is no part of the wall."""
    mask, colours = np.zeros((50, 60), bool), np.zeros((50, 60, 3), np.float32)
    mask[:20] = mask[below] = True
    colours[:20], colours[below] = 0.5, colour
    # noise may change from row to row, and a mirrored picture has the same parts
    most = np.linspace(0.6e-3, 1.4e-3, 50, dtype=np.float32)[:, None].repeat(60, 1)
    for turn in (slice(None), slice(None, None, -1)):
        groups = together(parts_of(mask[turn]), colours[turn], most[turn])
        assert len(groups) == (1 if joined else 2)
