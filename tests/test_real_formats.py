"""Real light fields in every form in which they arrive: the map depends on the views, not on the file they lie in."""

import time
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import scipy.io
from click.testing import CliRunner

from sepi.cli import main
from sepi.evaluate import score
from sepi.ingest import settle_range
from sepi.io.hdf5 import write_light_field
from sepi.io.pfm import read_pfm
from sepi.lightfield import LightField
from sepi.pipeline import estimate_depth
from sepi.reading import read_light_field

pytestmark = pytest.mark.real

RANGES = {"cotton": ("-1.6", "1.5"), "antinous": ("-3.5", "3")}


def depth(*words: object) -> None:
    called = CliRunner().invoke(main, ["depth", *map(str, words)])
    assert called.exit_code == 0, called.output
    # the order of real views is right, and no reader may doubt it
    assert called.stderr == ""


# what does not name the source or need a camera
MAPS = [
    "confidence.png",
    "disparity.npy",
    "disparity.pfm",
    "disparity.png",
    "disparity_16bit.png",
    "mask_occluded.png",
    "mask_textureless.png",
]


@pytest.mark.parametrize("name", RANGES)
def test_equal_maps_from_every_format(hci: Path, name: str, tmp_path: Path) -> None:
    """Byte for byte: a map must not change because the views were stored otherwise."""
    light_field = read_light_field(hci / name)
    np.save(tmp_path / "array.npy", light_field.views)
    scipy.io.savemat(tmp_path / "matlab.mat", {"LF": light_field.views})
    write_light_field(tmp_path / "own.h5", light_field)
    maps = []
    for source in (hci / name, tmp_path / "array.npy", tmp_path / "matlab.mat", tmp_path / "own.h5"):
        out = tmp_path / f"{source.stem}-maps"
        # fewer candidates than usual take half the time and say as much about where bytes come from
        depth(source, "-o", out, "--disparity-range", *RANGES[name], "--set", "initial.semi_global.candidates=61")
        # all but what names the source, and metric depth, for which an array has no camera
        shared = sorted(
            path.name for path in out.iterdir() if path.name not in ("result.h5", "depth.pfm", "points.ply")
        )
        assert shared == MAPS
        maps.append({file: (out / file).read_bytes() for file in shared})
    assert maps[1] == maps[0]
    assert maps[2] == maps[0]
    assert maps[3] == maps[0]


def mse(light_field: LightField, truth: np.ndarray) -> float:
    return score(estimate_depth(light_field, "paper").disparity, truth)["mse100"]


@pytest.mark.parametrize("name", RANGES)
def test_a_star_of_views_is_nearly_as_good_as_the_grid(hci: Path, name: str) -> None:
    """Row 4, column 4 and both diagonals, 33 of 81 views: what some camera arrays have."""
    light_field = settle_range(read_light_field(hci / name))
    t, s = np.mgrid[:9, :9]
    star = (t == 4) | (s == 4) | (t == s) | (t + s == 8)
    assert star.sum() == 33
    # what is missing must not be looked at, whatever it is
    views = np.where(star[:, :, None, None, None], light_field.views, 77).astype(np.uint8)
    assert mse(replace(light_field, views=views, present=star), light_field.truth) <= 1.5 * mse(
        light_field, light_field.truth
    )


def test_a_view_off_the_centre(hci: Path) -> None:
    """The known truth belongs to row 4; with the first three rows cut off that is row 1 of 6, the centre row 3."""
    light_field = settle_range(read_light_field(hci / "cotton"))
    cut = LightField(light_field.views[3:], "cut", disparity_range=light_field.disparity_range)
    assert cut.reference == (3, 4)
    off_centre = mse(cut.seen_from((1, 4)), light_field.truth)
    assert off_centre <= 1.5 * mse(light_field, light_field.truth)
    # the map of the centre view belongs to another place: the check can tell
    assert mse(cut, light_field.truth) > 1.4 * off_centre


def test_lytro_picture_with_one_command(real_data: Path, tmp_path: Path) -> None:
    """No parameters, no range, no flags: from a folder of pictures to disparity, point cloud and colours."""
    started = time.monotonic()
    depth(real_data / "lytro" / "2067", "-o", tmp_path / "out")
    assert time.monotonic() - started <= 60
    disparity = read_pfm(tmp_path / "out/disparity.pfm")
    assert disparity.shape == (383, 552)
    head, back, wall = disparity[190:220, 60:120], disparity[150:250, 300:380], disparity[60:120, 60:200]
    assert np.median(head) > np.median(back) + 0.2
    assert np.median(back) > np.median(wall) + 0.3
    # the wall is one surface: what is far from its median is speckle
    assert np.mean(np.abs(wall - np.median(wall)) > 0.2) < 0.05
    for file in ("points.ply", "disparity.png", "disparity_16bit.png"):
        assert (tmp_path / "out" / file).stat().st_size > 100_000
