"""Real light fields in every form in which they arrive: the map depends on the views, not on the file they lie in."""

import time
from dataclasses import replace
from pathlib import Path

import cv2
import numpy as np
import scipy.io
from error_lines import done
from real_scenes import final_scores, part

from sepi.io.disparity_maps import read_pfm
from sepi.io.hdf5 import write_light_field
from sepi.lightfield import LightField
from sepi.pipeline import estimate_depth
from sepi.reading import read_light_field
from sepi.scoring.scores import score


def test_every_format_gives_the_same_light_field(hci: Path, tmp_path: Path) -> None:
    """A map must not change because the views were stored otherwise, and no reader may doubt the order of the views."""
    folder = part(hci / "antinous")
    np.save(tmp_path / "array.npy", folder.views)
    scipy.io.savemat(tmp_path / "matlab.mat", {"LF": folder.views})
    write_light_field(tmp_path / "own.h5", folder)
    crop = np.s_[:, :, 10:58, 40:104]
    expected = small_map(folder, folder.views[crop])
    for source in ("array.npy", "matlab.mat", "own.h5"):
        # a warning is an error in the tests
        found = read_light_field(tmp_path / source)
        assert found.views.dtype == folder.views.dtype
        np.testing.assert_array_equal(found.views, folder.views, err_msg=source)
        assert (found.reference_position, found.present.all()) == (folder.reference_position, True)
        if source == "matlab.mat":
            # whose values lie otherwise in memory
            np.testing.assert_array_equal(small_map(folder, found.views[crop]), expected)
    own = read_light_field(tmp_path / "own.h5")
    assert own.disparity_range == folder.disparity_range
    np.testing.assert_array_equal(own.ground_truth, folder.ground_truth)


def small_map(whole: LightField, views: np.ndarray) -> np.ndarray:
    """What variant best makes of a part of the views."""
    small = LightField(views, "small", disparity_range=whole.disparity_range)
    return estimate_depth(small, "best", {"initial": {"num_disparities": 31}, "occlusion": {"passes": 1}}).disparity


def mse(light_field: LightField, ground_truth: np.ndarray) -> float:
    return score(estimate_depth(light_field, "paper").disparity, ground_truth)["mse100"]


def test_a_star_of_views_is_nearly_as_good_as_the_grid(hci: Path) -> None:
    """Row 4, column 4 and both diagonals, 33 of 81 views: what some camera arrays have."""
    light_field = part(hci / "cotton")
    t, s = np.mgrid[:9, :9]
    star = (t == 4) | (s == 4) | (t == s) | (t + s == 8)
    assert star.sum() == 33
    # what is missing must not be looked at, whatever it is
    views = np.where(star[:, :, None, None, None], light_field.views, 77).astype(np.uint8)
    found = mse(replace(light_field, views=views, present=star), light_field.ground_truth)
    assert found <= 1.5 * final_scores(hci / "cotton", "paper", part)["mse100"]


def test_a_view_off_the_centre(hci: Path) -> None:
    """The ground truth belongs to row 4; with the first three rows cut off that is row 1 of 6, the centre row 3."""
    light_field = part(hci / "cotton")
    cut = LightField(light_field.views[3:], "cut", disparity_range=light_field.disparity_range)
    assert cut.reference_position == (3, 4)
    off_centre = mse(cut.seen_from((1, 4)), light_field.ground_truth)
    assert off_centre <= 1.5 * final_scores(hci / "cotton", "paper", part)["mse100"]
    # the map of the centre view belongs to another place: the check can tell
    assert mse(cut, light_field.ground_truth) > 1.4 * off_centre


def test_lytro_picture_with_one_command(real_data: Path, tmp_path: Path) -> None:
    """No parameters, no range, no flags: from a folder of pictures to disparity, point cloud and colours."""
    (tmp_path / "in").mkdir()
    for picture in (real_data / "lytro" / "2067").glob("*.png"):
        # most of what is looked at below, since larger pictures take longer
        cv2.imwrite(str(tmp_path / "in" / picture.name), cv2.imread(str(picture))[40:270, 40:400])
    started = time.process_time()
    words = ["depth", str(tmp_path / "in"), "-o", str(tmp_path / "out")]
    called = done(*words)
    # the order of real views is right, and no reader may doubt it
    assert called.stderr == ""
    assert time.process_time() - started <= 25
    disparity = read_pfm(tmp_path / "out/disparity.pfm")
    assert disparity.shape == (230, 360)
    head, back, wall = disparity[150:180, 20:80], disparity[110:210, 260:340], disparity[20:80, 20:160]
    assert np.median(head) > np.median(back) + 0.2
    assert np.median(back) > np.median(wall) + 0.3
    # the wall is one surface: what is far from its median is speckle
    assert np.mean(np.abs(wall - np.median(wall)) > 0.2) < 0.05
    for file in ("points.ply", "disparity.png", "disparity_16bit.png"):
        assert (tmp_path / "out" / file).stat().st_size > 40_000
