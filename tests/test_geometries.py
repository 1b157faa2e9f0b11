"""Light fields whose rows are closer together than columns, or whose views stand off the grid: depth and metres."""

from dataclasses import replace
from functools import cache

import numpy as np
import numpy.typing as npt
import pytest
from geometries import ROW_SPACING, jittered, standing

from sepi.camera import camera_from
from sepi.errors import SepiError
from sepi.initial import CHOICES
from sepi.lightfield import LightField
from sepi.pipeline import estimate_depth
from sepi.scenes import render
from sepi.stage import no_progress

pytestmark = pytest.mark.slow

SCENE, SIZE, VIEWS = "curved_occluders", 64, 5


@cache
def scene(geometry: str) -> LightField:
    return render(SCENE, size=SIZE, views=VIEWS, **standing(geometry, (VIEWS, VIEWS)))


def errors(light_field: LightField, variant: str) -> npt.NDArray[np.float32]:
    return np.abs(estimate_depth(light_field, variant).disparity - light_field.ground_truth)


@cache
def mean_on_the_grid(variant: str) -> float:
    return float(errors(scene("grid"), variant).mean())


@pytest.mark.parametrize("variant", ["paper", "best", "wang", "no_sepi"])
@pytest.mark.parametrize(("geometry", "worse"), [("closer rows", 10), ("off the grid", 1.4)])
def test_depth_is_as_good_as_on_the_grid(variant: str, geometry: str, worse: float) -> None:
    """Who knows where the cameras stood must get what an even grid gives; each stage has to use it.

    Taken for a grid, the same views give a depth that is so many times worse in the median: some variants guess at
    many pixels, and may guess well by chance.
    """
    right = scene(geometry)
    found = errors(right, variant)
    assert found.mean() < 1.3 * mean_on_the_grid(variant)
    as_grid = errors(replace(right, row_spacing=1.0, positions=None), variant)
    assert np.median(as_grid) > worse * np.median(found)


@pytest.mark.parametrize("row_spacing", [0.43, 1.0, 5.0])
def test_structure_tensor_shears_rows_by_their_own_spacing(row_spacing: float) -> None:
    """From vertical EPIs alone: shears that are whole per column only would miss what lies between them."""
    light_field = render("slanted_plane", size=64, views=7, row_spacing=row_spacing)
    column = np.zeros((7, 7), bool)
    column[:, 3] = True
    light_field = replace(light_field, present=column)
    choice = CHOICES["structure_tensor"]
    found = choice.run(light_field, None, choice.parameters(), no_progress).disparity
    error = np.abs(found - light_field.ground_truth)[8:-8]
    assert np.median(error) * max(row_spacing, 1) < 0.1


def test_structure_tensor_takes_views_that_stand_at_one_place() -> None:
    """A camera that took a picture twice would divide by zero."""
    positions = jittered((3, 5))
    positions[1, 4] = positions[1, 3]
    whole = render("slanted_plane", size=64, views=5)
    light_field = LightField(whole.views[1:4], "twice", disparity_range=whole.disparity_range, positions=positions)
    choice = CHOICES["structure_tensor"]
    found = choice.run(light_field, None, choice.parameters(), no_progress)
    assert np.isfinite(found.disparity).all()
    assert np.isfinite(found.confidence).all()


def test_metres_are_right_where_rows_are_closer() -> None:
    """The baseline is that of columns: taken for that of rows, everything would stand at the wrong distance."""
    baseline, focus, focal, sensor = 20.0, 2.0, 50.0, 36.0
    camera = camera_from(
        focal_length_mm=focal, baseline_mm=baseline, focus_distance_m=focus, sensor_size_mm=sensor, shape=(96, 96)
    )
    light_field = replace(render("slanted_plane", size=96, views=7, row_spacing=ROW_SPACING), camera=camera)
    depth = camera.depth(estimate_depth(light_field, "best").disparity)
    # similar triangles between the centre view and the lowest one, 3 rows down, in metres
    apart = 3 * ROW_SPACING * baseline / 1000
    focal_px = focal / sensor * 96
    moved = light_field.ground_truth * light_field.baselines[6, 3, 0]
    expected = apart * focal_px / (moved + apart * focal_px / focus)
    assert np.median(np.abs(depth / expected - 1)) < 5e-3


def test_a_part_of_a_picture_has_the_camera_of_the_whole() -> None:
    """The sensor's size is that of the whole picture: that of a part would be a longer lens, all depth too great."""
    known = {"focal_length_mm": 50, "baseline_mm": 20, "focus_distance_m": 4, "sensor_size_mm": 32}
    whole = camera_from(**known, shape=(64, 96))
    part = camera_from(**known, shape=(40, 30), crop_of=(96, 64, 60, 2))
    assert (part.focal_px, part.scale, part.offset) == (whole.focal_px, whole.scale, whole.offset)
    # the same ray through the same pixel: its place from the picture's middle and the principal point's
    assert (30 - 1) / 2 + part.right == (96 - 1) / 2 - 60
    assert (40 - 1) / 2 + part.down == (64 - 1) / 2 - 2
    with pytest.raises(SepiError, match=r"column 67, row 2 .*96x64"):
        camera_from(**known, shape=(40, 30), crop_of=(96, 64, 67, 2))


def test_the_longer_side_of_a_picture_is_that_of_the_sensor() -> None:
    """An upright picture has the depth of the same camera's wide one."""
    known = {"focal_length_mm": 50, "baseline_mm": 20, "focus_distance_m": 4, "sensor_size_mm": 32}
    assert camera_from(**known, shape=(96, 64)) == camera_from(**known, shape=(64, 96))
    assert camera_from(**known, shape=(96, 64)).focal_px == 150
