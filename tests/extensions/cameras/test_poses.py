"""`sepi poses` and `sepi convert`: what they write and print, and one clear line when something is wrong."""

import json
from dataclasses import replace
from pathlib import Path

import cv2
import numpy as np
import pytest
import tifffile
from click.testing import Result
from error_lines import call, done, error_of
from geometries import ROW_SPACING, jittered

from sepi.camera import Camera
from sepi.io.hdf5 import write_light_field
from sepi.io.images import read_picture
from sepi.io.readers.options import ReadOptions
from sepi.io.result_folder import write_result
from sepi.lightfield import LightField
from sepi.reading import read_light_field
from sepi.scenes import render
from sepi.stage import StageMaps

CAMERA = Camera(scale=30.0, offset=6.0, focal_px=90.0)
FLAGS = ("--focal-length", 35, "--baseline", 2, "--focus-distance", 3, "--sensor-size", 24)


def put(light_field: LightField) -> None:
    """A light field as ``scene.h5`` and a result of it as ``maps``, in the current folder."""
    write_light_field(Path("scene.h5"), light_field)
    size = light_field.shape
    disparity = np.random.default_rng(0).uniform(-1, 1, size).astype(np.float32)
    disparity[0, 0] = np.nan
    confidence = np.random.default_rng(1).random(size, np.float32)
    unknown = np.zeros(size, bool)
    unknown[-9:] = True
    maps = StageMaps(disparity, np.where(unknown, np.float32(0), confidence), {"unknown": unknown})
    write_result("maps", light_field, maps)


@pytest.fixture
def scene(here: Path) -> LightField:
    """A light field with a camera, and its result, in the current folder."""
    light_field = replace(render("pyramids", size=64, views=3), camera=CAMERA)
    put(light_field)
    return light_field


def files_in(folder: str) -> set[str]:
    return {str(path.relative_to(folder)) for path in Path(folder).rglob("*") if path.is_file()}


# --- poses


@pytest.mark.usefixtures("scene")
def test_poses_writes_a_model_of_colmap_unless_told() -> None:
    called = done("poses", "scene.h5", "maps")
    assert called.stderr == ""
    names = {f"view_{t:02}_{s:02}.png" for t in range(3) for s in range(3)}
    assert files_in("scene-colmap") == {
        *(f"images/{name}" for name in names),
        *(f"stereo/depth_maps/{name}.geometric.bin" for name in names),
        *(f"stereo/normal_maps/{name}.geometric.bin" for name in names),
        "stereo/fusion.cfg",
        *(f"sparse/{folder}{name}.txt" for folder in ("", "0/") for name in ("cameras", "images", "points3D")),
    }
    points = [line for line in Path("scene-colmap/sparse/points3D.txt").read_text().splitlines() if line[0] != "#"]
    # the surer half of what is known
    assert len(points) == pytest.approx(64 * 55 / 2, abs=2)
    assert called.stdout == f"written: scene-colmap/ (9 views, {len(points)} points, metres)\n"


@pytest.mark.usefixtures("scene")
def test_poses_writes_for_nerfstudio() -> None:
    done("poses", "scene.h5", "maps", "--to", "nerfstudio", "-o", "set", "--points", 50)
    content = json.loads(Path("set/transforms.json").read_text())
    assert len(content["frames"]) == 9
    assert files_in("set") == {
        "transforms.json",
        "points.ply",
        *(frame[key] for frame in content["frames"] for key in ("file_path", "depth_file_path")),
    }
    # as the result has it, in millimetres, and 0 where that says nothing
    depth = np.load("set/depths/view_01_01.npy")
    assert (depth[-9:] == 0).all()
    assert depth[0, 0] == 0
    expected = CAMERA.depth(np.load("maps/disparity.npy"))[1:-9]
    np.testing.assert_allclose(depth[1:-9], 1000 * expected, rtol=1e-6)


def test_poses_without_a_camera_are_told_to_be_nominal(scene: LightField) -> None:
    """Whoever takes these numbers for metres builds on sand."""
    put(replace(scene, camera=None))
    called = done("poses", "scene.h5", "maps")
    first, last = called.stdout.splitlines()
    assert "nominal" in first
    assert "neither in metres nor to scale" in first
    assert last.endswith("nominal units)")
    assert "# units: nominal units" in Path("scene-colmap/sparse/images.txt").read_text()
    known = call("poses", "scene.h5", "maps", "-o", "known", *FLAGS)
    assert known.stdout.endswith("metres)\n")
    # 35 / 24 * 64 pixels
    assert " 93.33333333333333 " in Path("known/sparse/cameras.txt").read_text()


def test_poses_stand_where_the_views_of_the_result_stood(scene: LightField) -> None:
    """Rows closer together, which 'sepi depth' found out or was told; views off the grid; the result's own view."""
    for known in ({"row_spacing": ROW_SPACING}, {"positions": jittered((3, 3)), "view": (0, 2)}):
        moved = replace(scene, ground_truth=None, masks={}, **known)
        put(moved)
        folder = f"at-{moved.reference_position[0]}"
        done("poses", "scene.h5", "maps", "--to", "nerfstudio", "-o", folder)
        frames = json.loads(Path(folder, "transforms.json").read_text())["frames"]
        places = np.array([frame["transform_matrix"] for frame in frames])[:, :3, 3]
        down, across = moved.baselines.reshape(-1, 2).T * 30 / 90
        np.testing.assert_allclose(places, np.column_stack([across, 0 * across, -down]), atol=1e-12)


def test_a_result_of_another_light_field_is_refused(scene: LightField) -> None:
    """Depth on pictures that it does not belong to looks like depth."""
    bare = replace(scene, ground_truth=None, masks={})
    write_light_field(Path("other.h5"), replace(scene, views=scene.views[:, ::-1].copy()))
    write_light_field(Path("grid.h5"), replace(bare, views=scene.views[:2], present=None))
    write_light_field(Path("moved.h5"), replace(bare, positions=jittered((3, 3))))
    for path, more, expected in (
        ("other.h5", ("--view", "0,0"), "depth of view 1,1 of 3x3 views, not of view 0,0 of 3x3, as other.h5 is read"),
        ("grid.h5", (), "not of view 1,1 of 2x3"),
        ("other.h5", (), "depth of another light field, or of its views in another order"),
        ("moved.h5", (), "depth of another light field"),
        ("scene.h5", ("--order", "flip-rows"), "in another order"),
        ("scene.h5", ("--row-spacing", "0.5"), "made with rows of views 1 steps apart, not 0.5"),
    ):
        line = error_of(call("poses", path, "maps", "-o", "out", *more))
        assert "sepi: maps: " in line
        assert expected in line
        assert not Path("out").exists()


@pytest.fixture
def turned(here: Path) -> LightField:
    """Views whose rows are counted from below, without two of them, as turned.npy; the result of them read so, maps."""
    np.save("turned.npy", render("pyramids", size=64, views=3).views[::-1])
    options = ReadOptions(order="flip-rows", exclude=("0,0", "2,1"), row_spacing=0.5)
    light_field = read_light_field("turned.npy", options=options)
    maps = StageMaps(np.zeros((64, 64), np.float32), np.ones((64, 64), np.float32))
    write_result("maps", light_field, maps)
    return light_field


def test_a_result_is_used_with_the_light_field_as_it_was_read(turned: LightField) -> None:
    """The centre view of a grid of odd sides is the same in most orders: poses were wrong, and nobody was told."""
    done("poses", "turned.npy", "maps", "--to", "nerfstudio", "-o", "set")
    assert (len(files_in("set/images")), Path("set/images/view_00_00.png").exists()) == (7, False)
    np.testing.assert_array_equal(read_picture(Path("set/images/view_00_01.png")), turned.views[0, 1])
    raw = np.load("turned.npy")
    # a file of the light field in order needs none of it, one of the files that it came from needs it as they do
    for file in ("ordered.h5", "raw.h5"):
        write_light_field(Path(file), turned if file == "ordered.h5" else replace(turned, views=raw, present=None))
        assert call("poses", file, "maps", "--to", "nerfstudio", "-o", file[:3]).exit_code == 0
        assert Path(file[:3], "transforms.json").read_bytes() == Path("set/transforms.json").read_bytes()
    assert "in another order" in error_of(call("poses", "turned.npy", "maps", "--order", "flip-columns", "-o", "out"))
    assert not Path("out").exists()


@pytest.mark.parametrize("command", ["refocus", "evaluate", "compare"])
def test_every_command_binds_a_result_to_its_light_field(turned: LightField, command: str) -> None:
    """Pyramids' map focused or scored dots without a word."""
    write_light_field(Path("dots.h5"), render("dots", size=64, views=3))
    truth = np.zeros((64, 64), np.float32)
    write_light_field(Path("own.h5"), replace(turned, reading="", row_spacing=1.0, ground_truth=truth))
    words = {"refocus": ("--steps", "1", "-o", "out"), "evaluate": (), "compare": ("-o", "out")}[command]

    def bound(path: str, result: str) -> Result:
        order = {"refocus": (path, result), "evaluate": (result, path), "compare": (result, result, path)}
        return call(command, *order[command], *words)

    refused = error_of(bound("dots.h5", "maps"))
    assert "depth of another light field" in refused
    assert "disparity.pfm" in refused
    assert not Path("out").exists()
    assert bound("own.h5", "maps").exit_code == 0
    assert bound("dots.h5", "maps/disparity.pfm").exit_code == 0


@pytest.mark.usefixtures("scene")
def test_names_are_those_that_were_given(tmp_path: Path) -> None:
    """A link names what is made of it, not what it leads to; and it may be where there is room."""
    Path("scene.h5").rename("data_0042.h5")
    Path("cotton.h5").symlink_to("data_0042.h5")
    assert call("poses", "cotton.h5", "maps").exit_code == 0
    assert call("refocus", "cotton.h5", "maps", "--steps", 1).exit_code == 0
    assert {"cotton-colmap", "cotton-refocused"} <= {path.name for path in tmp_path.iterdir()}


# --- convert


@pytest.mark.usefixtures("scene")
def test_tiff_is_read_by_other_programs() -> None:
    done("convert", "maps", "map.TIFF")
    disparity = np.load("maps/disparity.npy")
    for values in (tifffile.imread("map.TIFF"), cv2.imread("map.TIFF", cv2.IMREAD_UNCHANGED)):
        assert values.dtype == np.float32
        np.testing.assert_array_equal(values, disparity)
    call("convert", "maps", "depth.tif", "--map", "depth")
    np.testing.assert_array_equal(tifffile.imread("depth.tif"), CAMERA.depth(disparity))
    with tifffile.TiffFile("depth.tif") as file:
        assert file.pages[0].description == "depth: metres"


@pytest.mark.usefixtures("scene")
def test_exr_has_the_channels_that_compositing_programs_know() -> None:
    exr = pytest.importorskip("OpenEXR")
    done("convert", "maps", "all.exr")
    disparity = np.load("maps/disparity.npy")
    with exr.File("all.exr") as file:
        channels = {name: channel.pixels for name, channel in file.channels().items()}
    assert {pixels.dtype for pixels in channels.values()} == {np.dtype("f4")}
    np.testing.assert_array_equal(channels["disparity"], disparity)
    np.testing.assert_array_equal(channels["Z"], CAMERA.depth(disparity))
    call("convert", "maps", "one.exr", "--map", "disparity")
    with exr.File("one.exr") as file:
        assert set(file.channels()) == {"Y"}
        np.testing.assert_array_equal(file.channels()["Y"].pixels, disparity)


def test_error_bars_are_maps_to_convert_as_well(scene: LightField) -> None:
    disparity = np.zeros(scene.shape, np.float32)
    sigma = np.random.default_rng(2).uniform(0.01, 0.1, scene.shape).astype(np.float32)
    bars = {"sigma": sigma, "low": disparity - sigma, "high": disparity + 3 * sigma}
    assert "maps: no sigma" in error_of(call("convert", "maps", "x.tif", "--map", "sigma"))
    write_result("maps", scene, StageMaps(disparity, disparity, bars))
    # 30 / 6^2 metres for each pixel per view step
    for name, expected in {**bars, "depth_sigma": sigma * 30 / 36}.items():
        done("convert", "maps", "x.tif", "--map", name)
        np.testing.assert_allclose(tifffile.imread("x.tif"), expected, rtol=1e-6)


def test_convert_says_what_is_wrong(scene: LightField) -> None:
    assert "ends with .exr, .tif, .tiff or .pfm" in error_of(call("convert", "maps", "map.jpg"))
    put(replace(scene, camera=None))
    assert "maps: no depth" in error_of(call("convert", "maps", "depth.tif", "--map", "depth"))
    assert call("convert", "maps", "depth.tif", "--map", "depth", *FLAGS).exit_code == 0
    assert "gone" in error_of(call("convert", "gone", "depth.tif"))


def test_colour_and_depth_side_by_side(scene: LightField) -> None:
    """Displays of light fields take one picture; near is white."""
    done("convert", "maps", "rgbd.png", "--to", "rgbd")
    picture = cv2.imread("rgbd.png")[:, :, ::-1]
    width = scene.shape[1]
    np.testing.assert_array_equal(picture[:, :width], np.rint(255 * scene.reference_view))
    grey = picture[:, width:]
    assert (np.ptp(grey, axis=2) == 0).all()
    levels, disparity = grey[:-9, :, 0].astype(int).ravel(), np.load("maps/disparity.npy")[:-9].ravel()
    assert levels[np.nanargmax(disparity)] == 255
    assert levels[np.nanargmin(disparity)] == 0
    assert (np.diff(levels[np.argsort(disparity)][:-1]) >= 0).all()
    assert "expected NAME.png, and no --map" in error_of(call("convert", "maps", "rgbd.tif", "--to", "rgbd"))
