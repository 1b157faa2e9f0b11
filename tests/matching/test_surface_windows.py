"""Steps over windows of one surface: against plain NumPy, and at a depth step."""

import numpy as np
import pytest

from sepi.matching.gauss_newton import ANY_SURFACE, BESIDE_NEARER, OF_OTHER_COLOUR, Surfaces, windowed_step

MARGIN, COLOUR_WIDTH = 0.15, 0.1


BY_DEPTH = Surfaces(MARGIN)


def by_colour(colours):
    return Surfaces(MARGIN, colours, COLOUR_WIDTH)


def alike(apart):
    """1 up to a margin, 0 from three on."""
    return np.clip((3 * MARGIN - np.abs(apart)) / (2 * MARGIN), 0, 1)


def plain_step(gradient, curvature, disparity, colours, radius, max_update):
    H, W = disparity.shape
    share = np.ones((H, W))
    for y, x in np.ndindex(H, W):
        about = disparity[max(0, y - 1) : y + 2, max(0, x - 1) : x + 2]
        share[y, x] = max(alike(about.max() - disparity[y, x]), BESIDE_NEARER)
    update, weight = np.zeros((2, H, W))
    for y, x in np.ndindex(H, W):
        window = np.s_[max(0, y - radius) : y + radius + 1, max(0, x - radius) : x + radius + 1]
        apart = np.linalg.norm(colours[(slice(None), *window)] - colours[:, y, x, None, None], axis=0)
        coloured = np.clip(1.5 - apart / COLOUR_WIDTH, 0, 1)
        counting = alike(disparity[window] - disparity[y, x]) * share[window]
        counting = counting * (OF_OTHER_COLOUR + (1 - OF_OTHER_COLOUR) * coloured)
        weight[y, x] = (counting * curvature[window]).mean()
        update[y, x] = (counting * gradient[window]).mean() / (weight[y, x] + 1e-9)
    return update.clip(-max_update, max_update), weight


@pytest.mark.parametrize(
    ("shape", "radius"), [((7, 19), 1), ((1, 5), 2), ((6, 1), 0), ((3, 4), 6)], ids=["inner", "row", "column", "all"]
)
def test_steps_are_those_of_the_pixels_of_one_surface(shape, radius) -> None:
    """At any size, and beside every border."""
    rng = np.random.default_rng(3)
    gradient, curvature = rng.normal(size=shape).astype(np.float32), rng.uniform(1, 9, shape).astype(np.float32)
    disparity = rng.choice(np.float32([0, 0.1, 0.3, 1]), shape) + rng.uniform(0, 0.04, shape).astype(np.float32)
    # both alike and not, and some on the way
    colours = rng.uniform(0, 0.15, (3, *shape)).astype(np.float32)
    for asked, told in ((BY_DEPTH, 0 * colours), (by_colour(colours), colours)):
        step, weight = windowed_step(gradient, curvature, disparity, asked, radius, 0.2)
        expected, expected_weight = plain_step(gradient, curvature, disparity, told, radius, 0.2)
        np.testing.assert_allclose(step, expected, rtol=1e-4, atol=1e-6)
        np.testing.assert_allclose(weight, expected_weight, rtol=1e-5)
        assert {step.dtype, weight.dtype} == {np.dtype(np.float32)}


def test_a_well_known_edge_does_not_hold_the_wall_behind_it() -> None:
    """A plain wall beside a box was held where matching had it wrong, as if the views knew it as well as the box."""
    disparity = np.full((9, 20), -1, np.float32)
    disparity[:, 10:] = 1
    # the views know the wall faintly, the box well, and its edge reaches a pixel into the wall
    curvature = np.where(disparity > 0, np.float32(100), np.float32(1))
    curvature[:, 9] = 100
    # by them the wall is 0.1 farther away; beside the box the slope is of the edge, and tells nothing
    gradient = np.where(disparity > 0, np.float32(0), np.float32(-0.1))
    gradient[:, 9] = 0
    step, weight = windowed_step(gradient, curvature, disparity, BY_DEPTH, 1, 0.2)
    assert step[:, :8].max() < -0.09
    assert step[4, 9] < -0.03
    assert weight[4, 9] < 2
    np.testing.assert_allclose(weight[4, 12:-1], 100, rtol=1e-5)
    assert np.abs(step[:, 10:]).max() == 0
    # that is what the ablation shows
    held, _ = windowed_step(gradient, curvature, disparity, Surfaces(ANY_SURFACE), 1, 0.2)
    assert held[4, 9] == pytest.approx(-0.3 / (6 * 100 + 3), rel=1e-4)


def test_a_wall_drawn_as_near_as_the_box_before_it_is_led_by_its_own_colour() -> None:
    """By its disparity it belongs to the box, which the views know better: it would stay there."""
    disparity = np.ones((9, 20), np.float32)
    wall = np.arange(20) < 10
    colours = np.where(wall, np.float32(0.8), np.float32(0.3)) * np.ones((3, 9, 1), np.float32)
    curvature = np.where(wall, np.float32(1), np.float32(20)) * np.ones((9, 1), np.float32)
    # by them the wall is farther away by 0.1
    gradient = np.where(wall, np.float32(-0.1), np.float32(0)) * np.ones((9, 1), np.float32)
    step, _ = windowed_step(gradient, curvature, disparity, by_colour(colours), 1, 0.2)
    assert step[:, 9].max() < -0.04
    assert windowed_step(gradient, curvature, disparity, BY_DEPTH, 1, 0.2)[0][4, 9] > -0.02
