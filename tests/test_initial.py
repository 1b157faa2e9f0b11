"""Initial depth on scenes whose depth is known exactly."""

import cv2
import numpy as np
import pytest

from sepi.initial import CHOICES
from sepi.lightfield import DisparityRange, LightField
from sepi.scenes import render
from sepi.stage import no_progress


def depth(light_field, choice="sepi", **values):
    parameters = CHOICES[choice].parameters(**values)
    return CHOICES[choice].run(light_field, None, parameters, no_progress)


def test_still_views_have_exactly_zero_disparity():
    """A picture at infinity must not come out with specks of depth."""
    centre = render("curved_occluders", size=64, views=3).views[1, 1]
    views = np.broadcast_to(centre, (5, 5, *centre.shape)).copy()
    light_field = LightField(views, "still", disparity_range=DisparityRange(-1, 1, "given"))
    maps = depth(light_field, num_disparities=21)
    assert np.all(maps.disparity == 0)
    np.testing.assert_allclose(maps.confidence, 1, atol=1e-6)


@pytest.mark.parametrize(
    ("scene", "size", "most"), [("fronto_parallel", 96, 1e-3), ("slanted_plane", 96, 0.02), ("pyramids", 160, 0.02)]
)
def test_surfaces_to_a_fiftieth_of_a_pixel(scene, size, most):
    light_field = render(scene, size=size)
    maps = depth(light_field)
    assert np.abs(maps.disparity - light_field.ground_truth).mean() < most


def test_finer_than_the_candidates():
    """With 31 candidates over 3 pixels the step is 0.1; the parabola must do better than the 0.025 of rounding."""
    light_field = render("slanted_plane", size=96)
    error = np.abs(depth(light_field, num_disparities=31).disparity - light_field.ground_truth)
    step = np.ptp(light_field.require_disparity_range().candidates(31)) / 30
    assert np.median(error) < step / 8


def test_confidence_is_low_where_there_is_no_texture():
    """Later stages lean on it: textureless pixels must not look certain."""
    light_field = render("wall", size=128, views=5)
    maps = depth(light_field, num_disparities=61)
    bare = light_field.masks["textureless"]
    inner = bare & np.roll(bare, 6, axis=0) & np.roll(bare, -6, axis=0)
    assert maps.confidence[inner].mean() < 0.6 * maps.confidence[~bare].mean()
    assert maps.confidence.min() >= 0
    assert maps.confidence.max() <= 1


def test_structure_tensor_follows_the_slope():
    """The ablation is honest only if its stand-in works as far as the method goes."""
    light_field = render("slanted_plane", size=96)
    maps = depth(light_field, "structure_tensor")
    error = np.abs(maps.disparity - light_field.ground_truth)
    assert np.median(error) < 0.08
    still = LightField(
        np.repeat(np.repeat(light_field.views[4:5, 4:5], 5, axis=0), 5, axis=1),
        "still",
        disparity_range=DisparityRange(-1, 1, "given"),
    )
    assert np.abs(depth(still, "structure_tensor").disparity).max() < 1e-6


@pytest.mark.parametrize("disparity", [-3, 2])
def test_structure_tensor_follows_a_parallax_of_pixels(disparity):
    """Beyond a pixel from view to view the EPI is sheared first; the wrong way it would find anything but this."""
    texture = cv2.GaussianBlur(np.random.default_rng(4).random((60, 90)).astype(np.float32), (0, 0), 1.5)
    texture = (texture - texture.min()) / np.ptp(texture)
    row = [np.roll(texture, -disparity * s, axis=1) for s in range(-3, 4)]
    views = np.array([[np.roll(view, -disparity * t, axis=0) for view in row] for t in range(-3, 4)])[..., None]
    known = DisparityRange(min(disparity, 0) - 1.0, max(disparity, 0) + 1.0, "given")
    maps = depth(LightField(views, "shifted", disparity_range=known), "structure_tensor")
    assert np.median(np.abs(maps.disparity - disparity)[15:-15, 15:-15]) < 0.02
