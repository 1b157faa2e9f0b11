"""HDF5 files of the first HCI benchmark: views, the ground truth of the view whose depth is wanted, and the camera."""

import functools
from pathlib import Path

import error_lines
import h5py
import numpy as np
import pytest

from sepi.camera import Camera
from sepi.io.readers.formats import format_of, read
from sepi.io.readers.options import ORDERS, ReadOptions
from sepi.lightfield import LightField

T, S, H, W = 3, 5, 8, 10
RNG = np.random.default_rng(11)
LF = RNG.integers(1, 256, (T, S, H, W, 3), np.uint8)
DEPTH = RNG.uniform(5, 20, (T, S, H, W)).astype(np.float32)
GEOMETRY = {"dH": 0.05, "focalLength": 300.0, "shift": 1.25}
TRUTH = 0.05 * 300 / DEPTH.astype(np.float64) - 1.25


def write(path: Path, *, depth: np.ndarray | None = DEPTH, views: np.ndarray = LF, **attributes: object) -> Path:
    with h5py.File(path, "w") as file:
        file["LF"] = views
        if depth is not None:
            file["GT_DEPTH"] = depth
        file.attrs.update({**GEOMETRY, **attributes})
    return path


def taken(path: Path, **options: object) -> LightField:
    assert format_of(path).name == "HCI 2013 HDF5"
    return read(path, ReadOptions(**options))


refused = functools.partial(error_lines.refused, file_format="hci-2013")


def test_views_truth_and_camera(tmp_path: Path) -> None:
    light_field = taken(write(tmp_path / "buddha.h5"))
    np.testing.assert_array_equal(light_field.views, LF)
    np.testing.assert_allclose(light_field.ground_truth, TRUTH[1, 2], rtol=1e-5, atol=1e-6)
    assert light_field.ground_truth.dtype == np.float32
    assert light_field.camera == Camera(scale=15.0, offset=1.25, focal_px=300.0)
    np.testing.assert_allclose(light_field.camera.depth(light_field.ground_truth), DEPTH[1, 2], rtol=1e-4)
    assert light_field.name == "buddha"
    assert light_field.notes == ()


def test_the_range_of_the_truth_is_not_taken(tmp_path: Path) -> None:
    """Truth that told the method where to look would make its scores worthless."""
    assert taken(write(tmp_path / "a.h5")).disparity_range is None


@pytest.mark.parametrize("order", ORDERS)
@pytest.mark.parametrize("view", [None, (0, 1), (2, 2)])
def test_truth_is_of_the_view_that_is_wanted(tmp_path: Path, order: str, view: tuple[int, int] | None) -> None:
    """Truth of another view is shifted by its parallax: every score would be wrong."""
    light_field = taken(write(tmp_path / "a.h5"), order=order, view=view, exclude=("0,0",))
    own = light_field.views[light_field.reference_position]
    t, s = next((t, s) for t in range(T) for s in range(S) if np.array_equal(LF[t, s], own))
    assert view is not None or (t, s) == (1, 2)
    np.testing.assert_allclose(light_field.ground_truth, TRUTH[t, s], rtol=1e-5, atol=1e-6)


def test_truth_of_the_centre_view_alone(tmp_path: Path) -> None:
    path = write(tmp_path / "a.h5", depth=DEPTH[1, 2])
    for options in ({}, {"central": 3}, {"order": "flip-both"}, {"view": (1, 2)}):
        np.testing.assert_allclose(taken(path, **options).ground_truth, TRUTH[1, 2], rtol=1e-5, atol=1e-6)
    assert taken(path, view=(1, 1)).ground_truth is None


def test_truth_is_unknown_where_the_depth_is_none(tmp_path: Path) -> None:
    """Holes in the depth are no surfaces; scoring leaves out what is not finite."""
    depth = DEPTH.copy()
    depth[1, 2, 0, :5] = [0, -1, np.nan, np.inf, 1e-45]
    ground_truth = taken(write(tmp_path / "a.h5", depth=depth)).ground_truth
    assert np.isnan(ground_truth[0, :5]).all()
    np.testing.assert_allclose(ground_truth[1:], TRUTH[1, 2, 1:], rtol=1e-5, atol=1e-6)


def test_missing_attributes_are_named(tmp_path: Path) -> None:
    path = write(tmp_path / "a.h5")
    with h5py.File(path, "a") as file:
        del file.attrs["dH"], file.attrs["shift"]
    light_field = taken(path)
    assert light_field.ground_truth is None
    assert light_field.notes == ("no metric depth and no ground truth: the file has no attribute dH, shift",)
