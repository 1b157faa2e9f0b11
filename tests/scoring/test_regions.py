"""Regions for evaluation, on scenes where the right answer is plain."""

from pathlib import Path

import cv2
import numpy as np
import pytest
from geometries import GEOMETRIES, grid_baselines, standing

from sepi.io.disparity_maps import read_pfm
from sepi.lightfield import LightField
from sepi.scoring.regions import MIN_AREA, occluded, textureless


def buffered(ground_truth: np.ndarray, baselines: np.ndarray) -> np.ndarray:
    """Plain twin: every pair of pixels; hidden where a nearer pixel lands within half a pixel."""
    height, width = ground_truth.shape
    y, x = np.mgrid[:height, :width]
    hidden = np.zeros(ground_truth.shape, bool)
    for v, u in baselines.reshape(-1, 2):
        row, column = (y - ground_truth * v).ravel(), (x - ground_truth * u).ravel()
        near = (abs(row[:, None] - row) <= 0.501) & (abs(column[:, None] - column) <= 0.501)
        covered = (near & (ground_truth.ravel() > ground_truth.ravel()[:, None])).any(1)
        inside = (row >= 0) & (row <= height - 1) & (column >= 0) & (column <= width - 1)
        hidden |= (covered & inside).reshape(ground_truth.shape)
    return hidden


def two_planes(near: float = 1.0, far: float = 0.0) -> np.ndarray:
    ground_truth = np.full((24, 30), far, np.float32)
    ground_truth[8:16, 10:20] = near
    return ground_truth


def test_views_that_are_missing_hide_nothing() -> None:
    """A pixel that only a missing view does not see is no harder than others."""
    ground_truth = np.zeros((24, 24), np.float32)
    ground_truth[8:16, 8:16] = 3
    present = np.zeros((5, 5), bool)
    present[2, :] = True
    row_only = occluded(ground_truth, np.where(present[..., None], grid_baselines((5, 5)), 0))
    assert row_only.any()
    assert not row_only[:8].any()
    assert occluded(ground_truth, grid_baselines((5, 5)))[:8].any()


@pytest.mark.parametrize(("near", "far"), [(1, 0), (2, 0), (0, -1), (1.5, -0.5), (0.5, 0.25)])
@pytest.mark.parametrize("geometry", GEOMETRIES)
def test_equals_comparing_every_pair_of_pixels(near: float, far: float, geometry: str) -> None:
    """A region of pixels that all views see would be scored as the occluded one."""
    views = np.zeros((5, 5, *two_planes().shape, 3), np.uint8)
    baselines = LightField(views, "planes", **standing(geometry, (5, 5))).baselines
    ground_truth = two_planes(near, far)
    found, expected = occluded(ground_truth, baselines), buffered(ground_truth, baselines)
    # the walk looks at whole pixels beside the sight line: off the grid a corner may be a pixel wider
    assert np.mean(found != expected) <= (0.015 if geometry == "off the grid" else 0)


def test_a_thin_bar_hides_stripes_and_not_all_that_lies_between() -> None:
    """Far behind a bar of one pixel each view misses one column; the pixels between two views' columns are seen."""
    ground_truth = np.zeros((9, 41), np.float32)
    ground_truth[:, 20] = 4
    hidden = np.flatnonzero(occluded(ground_truth, grid_baselines((1, 5)))[4])
    np.testing.assert_array_equal(hidden, [12, 16, 24, 28])


@pytest.mark.parametrize("slope", [0.01, 0.05, 0.1])
def test_a_slanted_plane_does_not_hide_itself(slope: float) -> None:
    """Rounding in a z-buffer marks slanted floors as occluded; this must not."""
    y, x = np.mgrid[:40, :60].astype(np.float32)
    assert not occluded(slope * x + np.float32(0.013) * y, grid_baselines((9, 9))).any()
    assert not occluded(-slope * y, grid_baselines((9, 9))).any()


def test_pixels_that_leave_the_view_are_not_counted() -> None:
    """At the image's edge the nearer plane pushes nothing out of sight: those pixels are outside that view."""
    ground_truth = np.zeros((10, 12), np.float32)
    ground_truth[:, 2:] = 2
    hidden = occluded(ground_truth, grid_baselines((1, 3)))
    # columns 0 and 1 are hidden in the view to the right only, and inside it
    np.testing.assert_array_equal(hidden[5], np.arange(12) < 2)
    shifted = occluded(ground_truth + np.float32(3), grid_baselines((1, 3)))
    assert not shifted.any()


def test_unknown_truth_neither_hides_nor_is_hidden() -> None:
    ground_truth = two_planes()
    ground_truth[8:16, 10:20] = np.nan
    assert not occluded(ground_truth, grid_baselines((5, 5))).any()
    assert not occluded(np.full((4, 4), np.nan, np.float32), grid_baselines((3, 3))).any()


def test_a_flat_wall_is_textureless_and_noise_is_not() -> None:
    centre = np.random.default_rng(2).random((60, 80, 3)).astype(np.float32)
    centre[:, 40:] = 0.5
    found = textureless(centre)
    assert found.dtype == bool
    assert not found[:, :40].any()
    assert found[:, 45:].all()


def test_shading_without_texture_is_textureless() -> None:
    """A wall that darkens by one of 255 steps per pixel gives no disparity; three steps are an edge to hold on to."""
    ramp = np.arange(80, dtype=np.float32) / 255
    weak, strong = (np.tile(step * ramp[:, None], (60, 1, 1)) for step in (1, 3))
    assert textureless(weak)[10:-10, 10:-10].all()
    assert not textureless(strong)[10:-10, 10:-10].any()


def test_small_patches_and_holes_are_cleaned_up() -> None:
    side = int(MIN_AREA**0.5)
    centre = np.full((90, 90, 1), 0.5, np.float32)
    centre[40, 40] = 0.6
    assert textureless(centre).all()
    noise = np.random.default_rng(2).random((90, 90, 1)).astype(np.float32)
    noise[30 : 30 + side, 30 : 30 + side] = 0.5
    assert not textureless(noise).any()


@pytest.mark.parametrize(("name", "hidden", "flat"), [("cotton", 0.038, 0.36), ("antinous", 0.092, 0.56)])
def test_real_scenes_have_plausible_regions(hci: Path, name: str, hidden: float, flat: float) -> None:
    """Parts of the map, checked by eye once: bands beside the busts' outlines; walls, shade and smooth stone."""
    ground_truth = read_pfm(hci / name / "gt_disp_lowres.pfm")
    centre = cv2.imread(str(hci / name / "input_Cam040.png")).astype(np.float32) / 255
    assert occluded(ground_truth, grid_baselines((9, 9))).mean() == pytest.approx(hidden, abs=0.002)
    assert textureless(centre).mean() == pytest.approx(flat, abs=0.01)
