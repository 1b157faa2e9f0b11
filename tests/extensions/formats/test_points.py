"""The command ``sepi points``: the cloud of a finished map, as other programs read it."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from clouds import H, W, cloud_of, light_field, read_back
from error_lines import call, done, error_of
from plyfile import PlyData

from sepi.camera import Camera
from sepi.errors import SepiError
from sepi.io.point_cloud import point_cloud
from sepi.io.result_folder import write_result
from sepi.stage import StageMaps


@pytest.fixture
def result(tmp_path: Path) -> Path:
    """Folder of a result for the view (0, 6), without a camera."""
    rng = np.random.default_rng(6)
    maps = StageMaps(rng.random((H, W), np.float32), rng.random((H, W), np.float32))
    write_result(tmp_path / "toy-depth", light_field(view=(0, 6)), maps, {"scene": "toy"})
    return tmp_path / "toy-depth"


def test_result_folder_holds_its_cloud(result: Path) -> None:
    written = (result / "points.ply").read_bytes()
    (result / "points.ply").unlink()
    called = done("points", result)
    assert f"{result / 'points.ply'} ({H * W} points, relief" in called.stdout
    assert (result / "points.ply").read_bytes() == written
    positions, colours, data = read_back(result / "points.ply")
    assert "pixels" in " ".join(data.comments)
    assert len(positions) == H * W
    np.testing.assert_array_equal(colours, light_field().views[0, 6].reshape(-1, 3))


def test_camera_flags_give_metres(result: Path, tmp_path: Path) -> None:
    camera = ("--focal-length", 50, "--baseline", 10, "--focus-distance", 2, "--sensor-size", 31)
    done("points", result / "result.h5", "-o", tmp_path / "a.ply", *camera, "--min-confidence", 0.5, "--max-depth", 1)
    positions, _, data = read_back(tmp_path / "a.ply")
    assert "metres" in " ".join(data.comments)
    # focal length 50 px, baseline 0.01 m: b f = 0.5, b f / F = 0.25; the view is 2 rows above, 3 columns right
    whole = replace(light_field(view=(0, 6)), camera=Camera(0.5, 0.25, 50.0))
    rng = np.random.default_rng(6)
    disparity, confidence = rng.random((H, W), np.float32), rng.random((H, W), np.float32)
    kept = np.where((confidence >= 0.5) & (0.5 / (disparity + 0.25) <= 1), disparity, np.nan).astype(np.float32)
    np.testing.assert_array_equal(positions, cloud_of(whole, kept).positions)
    assert 0 < len(positions) < (confidence >= 0.5).sum()


def test_points_know_their_error_in_the_units_of_the_cloud(result: Path, tmp_path: Path) -> None:
    """Pixels per view step in a relief, metres with a camera: the same number leaves out other points."""
    line = error_of(call("points", result, "--max-sigma", 0.1))
    assert "toy-depth: --max-sigma: the result has no error bars" in line
    rng = np.random.default_rng(8)
    disparity, sigma = (rng.uniform(*ends, (H, W)).astype(np.float32) for ends in ((0, 1), (0.1, 0.3)))
    bars = {"sigma": sigma, "low": disparity - sigma, "high": disparity + sigma}
    write_result(tmp_path / "out", light_field(), StageMaps(disparity, 0 * disparity, bars))
    data = PlyData.read(str(tmp_path / "out" / "points.ply"))
    assert data.comments[-1] == "sigma: standard deviation of the disparity, pixels per view step"
    np.testing.assert_array_equal(data["vertex"]["sigma"], sigma.ravel())
    camera = ("--focal-length", 50, "--baseline", 10, "--focus-distance", 2, "--sensor-size", 31)
    metres = 0.5 / (disparity.astype(float) + 0.25) ** 2 * sigma
    for flags, expected, unit in (((), sigma, "pixels per view step"), (camera, metres, "metres")):
        done("points", tmp_path / "out", "-o", tmp_path / "sure.ply", "--max-sigma", 0.2, *flags)
        data = PlyData.read(str(tmp_path / "sure.ply"))
        assert data.comments[-1].endswith(unit)
        found = data["vertex"]["sigma"]
        assert 0 < len(found) < H * W
        np.testing.assert_allclose(found, expected[expected <= 0.2], rtol=1e-5)


def test_unknown_pixels_have_no_point_unless_asked_for(tmp_path: Path) -> None:
    """The surface that stands over a black background is a guess; a sheet of points there spoils the cloud."""
    rng = np.random.default_rng(6)
    unknown = rng.random((H, W)) > 0.6
    maps = StageMaps(rng.random((H, W), np.float32), rng.random((H, W), np.float32), {"unknown": unknown})
    write_result(tmp_path / "out", light_field(), maps)
    picture = light_field().views[2, 3]
    _, colours, _ = read_back(tmp_path / "out" / "points.ply")
    np.testing.assert_array_equal(colours, picture[~unknown])
    assert call("points", tmp_path / "out").exit_code == 0
    np.testing.assert_array_equal(read_back(tmp_path / "out" / "points.ply")[1], picture[~unknown])
    assert call("points", tmp_path / "out", "--keep-unknown").exit_code == 0
    np.testing.assert_array_equal(read_back(tmp_path / "out" / "points.ply")[1], picture.reshape(-1, 3))
    write_result(
        tmp_path / "none", light_field(), maps.updated(maps.disparity, maps.confidence, unknown=unknown | True)
    )
    called = call("points", tmp_path / "none")
    assert called.exit_code == 1
    assert "give --keep-unknown" in called.stderr
    with pytest.raises(SepiError, match="unknown is"):
        point_cloud(picture, maps.disparity, unknown=unknown[1:])


def test_clear_line_where_no_cloud_can_be_made(result: Path, tmp_path: Path) -> None:
    cases = {
        (tmp_path / "gone",): "no such file",
        (tmp_path,): "result.h5",
        (result, "--max-depth", 3): "camera's geometry",
        (result, "--min-confidence", 2): "0..1",
        (result, "--min-confidence", 1): "no point is left",
        (result, "-o", result): "toy-depth: expected a name that ends with .ply",
    }
    for words, expected in cases.items():
        called = call("points", *words)
        assert called.exit_code == 1, words
        (line,) = called.stderr.splitlines()
        assert line.startswith("sepi: ")
        assert expected in line
    assert call("points", result, "--focal-length", 50).exit_code == 2
