"""`sepi refocus`: the folder of pictures, its index, and one line for whatever is wrong."""

import csv
import io
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from error_lines import call, done, error_of, everything_in
from PIL import Image

import sepi
from sepi.extensions.views import refocusing
from sepi.extensions.views.refocus import stack_names
from sepi.io.disparity_maps import write_pfm
from sepi.io.hdf5 import write_light_field
from sepi.io.images import read_picture
from sepi.io.result_folder import write_result
from sepi.lightfield import LightField
from sepi.scenes import render, write_hci
from sepi.stage import StageMaps

SHAPE = (64, 64)


@pytest.fixture(scope="module")
def light_field(tmp_path_factory: pytest.TempPathFactory) -> LightField:
    """A scene as it is read, with the camera that its folder states."""
    folder = tmp_path_factory.mktemp("scene") / "pyramids"
    write_hci(render("pyramids", size=64, views=3), folder)
    return sepi.read_light_field(folder)


@pytest.fixture
def scene(light_field: LightField, here: Path) -> LightField:
    """The scene as lf.h5, and as maps its exact disparity, in the current folder."""
    write_light_field(Path("lf.h5"), light_field)
    write_result("maps", light_field, maps_of(light_field))
    return light_field


def maps_of(light_field: LightField, **extra: Any) -> StageMaps:
    return StageMaps(light_field.ground_truth, np.ones(light_field.shape, np.float32), extra)


def index(folder: str) -> list[dict[str, str]]:
    return list(csv.DictReader(io.StringIO((Path(folder) / "focus.csv").read_text())))


def levels(picture: np.ndarray, full: int = 255) -> np.ndarray:
    return np.rint(picture.astype(float) * full)


def test_a_stack_and_the_picture_in_focus_everywhere(scene: LightField) -> None:
    """What people compute a map for: the files hold what the Python functions give, and the index says of what."""
    called = call("refocus", "lf.h5", "maps", "--steps", 3)
    assert (called.exit_code, called.stderr) == (0, "")
    names = ["all_in_focus.png", *stack_names(3)]
    assert set(everything_in("lf-refocused")) == {*names, "focus.csv"}
    assert f"written to lf-refocused/: {' '.join(names)} focus.csv\n" in called.stdout
    rows = index("lf-refocused")
    assert [row["file"] for row in rows] == names
    assert (rows[0]["disparity"], rows[0]["depth_m"]) == ("", "")
    truth, camera = scene.ground_truth, scene.camera
    sharp = sepi.all_in_focus(scene, truth)
    np.testing.assert_array_equal(read_picture(Path("lf-refocused/all_in_focus.png")), levels(sharp))
    disparities = refocusing.focal_stack(truth, 3)
    assert disparities == sorted(disparities, reverse=True)
    for row, disparity in zip(rows[1:], disparities, strict=True):
        assert float(row["disparity"]) == pytest.approx(disparity, rel=1e-5)
        depth = camera.depth(np.array([disparity], np.float32))[0]
        assert float(row["depth_m"]) == pytest.approx(float(depth), rel=1e-5)
        picture = read_picture(Path("lf-refocused") / row["file"])
        np.testing.assert_array_equal(picture, levels(sepi.refocus(scene, disparity, truth)))


def test_a_click_focuses_on_what_is_there(scene: LightField) -> None:
    """Column first, as picture viewers tell it; the surface clicked on is sharper than in the other pictures."""
    near, far = (19, 14), (48, 17)
    done("refocus", "lf.h5", "maps", "--at", *far, "--at", *near, "--disparity", 0.125, "-o", "out")
    rows = {(row["x"], row["y"]): row for row in index("out")[1:]}
    assert set(rows) == {("19", "14"), ("48", "17"), ("", "")}
    assert rows["", ""]["disparity"] == "0.125"
    for x, y in (near, far):
        row = rows[str(x), str(y)]
        assert float(row["disparity"]) == pytest.approx(float(scene.ground_truth[y, x]), rel=1e-5)
        around = np.s_[y - 2 : y + 3, x - 2 : x + 3]
        off = {
            other["file"]: np.abs(
                read_picture(Path("out") / other["file"])[around].astype(float) - 255 * scene.reference_view[around]
            ).mean()
            for other in rows.values()
        }
        assert min(off, key=lambda file: off[file]) == row["file"]
    assert [row["file"] for row in index("out")[1:]] == stack_names(3)


def test_without_a_map_the_stack_goes_through_the_range(scene: LightField) -> None:
    """No map is computed behind the user's back, and the output says what is missing."""
    called = done("refocus", "lf.h5", "--steps", 2)
    assert "no all_in_focus.png" in called.stdout
    limits = scene.require_disparity_range()
    assert [float(row["disparity"]) for row in index("lf-refocused")] == [limits.maximum, limits.minimum]
    picture = read_picture(Path("lf-refocused/focus_01.png"))
    np.testing.assert_array_equal(picture, levels(sepi.refocus(scene, limits.maximum)))
    assert not Path("lf-refocused/all_in_focus.png").exists()


@pytest.mark.parametrize(
    ("kind", "channels", "held"), [("uint16", 3, "uint16"), ("float32", 1, "uint16"), ("uint8", 1, "uint8")]
)
def test_pictures_are_as_deep_as_the_views(scene: LightField, kind: str, channels: int, held: str) -> None:
    """16 bit stay 16 bit, and grey stays grey; float views are written as 16 bit."""
    unit = scene.views[..., :channels] / 255
    views = unit.astype(np.float32) if kind == "float32" else np.rint(unit * np.iinfo(kind).max).astype(kind)
    write_light_field(Path("wide.h5"), replace(scene, views=views))
    done("refocus", "wide.h5", "maps/disparity.pfm", "--disparity", 0.5, "--animation")
    for name in ("all_in_focus.png", "focus_01.png"):
        picture = read_picture(Path("wide-refocused") / name)
        assert (picture.dtype, picture.shape) == (held, (*SHAPE, channels))
        full = np.iinfo(held).max
        assert np.abs(picture.mean(axis=(0, 1)) / full - unit[1, 1].mean(axis=(0, 1))).max() < 0.01


def test_running_again_leaves_nothing_of_the_run_before(scene: LightField) -> None:
    """A picture that the index does not name would be taken for one of this run; a user's own files stay."""
    words = ("lf.h5", "maps", "-o", "out")
    assert call("refocus", *words, "--steps", 4, "--animation").exit_code == 0
    for name in ("notes.txt", "focus_99.png", "focus_stacked.png"):
        Path("out", name).write_text("mine")
    assert call("refocus", "lf.h5", "--steps", 2, "-o", "out").exit_code == 0
    kept = {"notes.txt", "focus_99.png", "focus_stacked.png"}
    assert set(everything_in("out")) == {*stack_names(2), "focus.csv", *kept}
    assert Path("out/focus_99.png").read_text() == "mine"


@pytest.mark.parametrize(
    "own", ["file,x\n../lf.h5,1\n", "file,disparity,depth_m,x,y\n../lf.h5,,,,\nmaps,,,,\n", "\xe4"]
)
def test_an_index_of_others_removes_nothing(scene: LightField, own: str) -> None:
    """A table of this name, damaged or made by others, must not cost a file outside the folder."""
    Path("out").mkdir()
    Path("out/focus.csv").write_text(own, encoding="utf-8")
    before = Path("lf.h5").read_bytes()
    called = call("refocus", "lf.h5", "--steps", 1, "-o", "out")
    assert Path("lf.h5").read_bytes() == before
    if own.startswith("file,disparity"):
        assert called.exit_code == 0
        assert set(everything_in("out")) == {"focus_01.png", "focus.csv"}
    else:
        assert "out: focus.csv there was not written by 'sepi refocus'" in error_of(called)


def test_an_animation_goes_there_and_back(scene: LightField) -> None:
    """From near to far and back, for ever, without a jump."""
    assert call("refocus", "lf.h5", "maps", "--steps", 4, "--animation").exit_code == 0
    with Image.open("lf-refocused/focus.webp") as animation:
        assert (animation.n_frames, animation.info["loop"], animation.size) == (6, 0, SHAPE)
        frames = []
        for number in range(6):
            animation.seek(number)
            frames.append(np.asarray(animation.convert("RGB"), float))
    pictures = [read_picture(Path("lf-refocused") / name).astype(float) for name in stack_names(4)]
    for frame, shown in zip(frames, (0, 1, 2, 3, 2, 1), strict=True):
        off = [np.abs(frame - picture).mean() for picture in pictures]
        assert int(np.argmin(off)) == shown
    assert index("lf-refocused")[-1]["file"] == "focus.webp"


def test_a_result_knows_its_view(scene: LightField) -> None:
    """A map of another view than the centre is used with that view; flags that contradict it are told."""
    side = scene.seen_from((0, 1))
    maps = StageMaps(scene.ground_truth, np.ones(SHAPE, np.float32))
    write_result("side", side, maps)
    assert call("refocus", "lf.h5", "side", "--disparity", 0, "-o", "out").exit_code == 0
    picture = read_picture(Path("out/all_in_focus.png")).astype(float)
    own, centre = (np.abs(picture - scene.views[view]).mean() for view in ((0, 1), (1, 1)))
    assert own < 0.5 * centre
    message = error_of(call("refocus", "lf.h5", "side", "--view", "1,1"))
    assert "side: depth of view 0,1 of 3x3 views, not of view 1,1 of 3x3, as lf.h5 is read here" in message


def test_the_camera_may_come_from_the_result_or_the_flags(scene: LightField) -> None:
    """Depths in the index, also where the light field itself does not know its camera."""
    write_light_field(Path("bare.h5"), replace(scene, camera=None))
    for flags, expected in (
        ((), scene.camera.depth(np.array([0.5], np.float32))[0]),
        (("--focal-length", 50, "--baseline", 10, "--focus-distance", "inf", "--sensor-size", 32), 2.0),
    ):
        assert call("refocus", "bare.h5", "maps", "--disparity", 0.5, "-o", "out", *flags).exit_code == 0
        assert float(index("out")[1]["depth_m"]) == pytest.approx(float(expected), rel=1e-5)


def test_what_no_view_knows_is_not_focused_on(scene: LightField) -> None:
    """The disparity there is a guess."""
    unknown = np.zeros(SHAPE, bool)
    unknown[10:20, 30:40] = True
    write_result("dark", scene, maps_of(scene, unknown=unknown))
    message = error_of(call("refocus", "lf.h5", "dark", "--at", 35, 15))
    assert message.startswith("sepi: --at 35 15: dark has no disparity")
    assert call("refocus", "lf.h5", "dark", "--at", 15, 35).exit_code == 0


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (("absent",), "absent: no such file or folder"),
        (("lf.h5", "small.pfm"), "small.pfm: is (5, 5), but the views of lf.h5 are (64, 64) (height, width)"),
        (("lf.h5", "empty.pfm"), "empty.pfm: the map has no pixel"),
        (("lf.h5", "--at", "3", "4"), "--at: needs RESULT"),
        (("lf.h5", "maps", "--at", "64", "4"), "--at 64 4: outside the picture; X goes from 0 to 63, Y from 0 to 63"),
        (("lf.h5", "--disparity", "nan"), "--disparity nan: expected a finite number of pixels per view step"),
        (("lf.h5", "maps", "--aperture", "0.5"), "an aperture of 0.5 view steps"),
        (("lf.h5", "maps", "-o", "lf.h5"), "lf.h5: is a file; expected a folder to write to"),
    ],
)
def test_what_is_wrong_is_one_line(scene: LightField, words: tuple[str, ...], message: str) -> None:
    """And nothing is written."""
    write_pfm(Path("small.pfm"), np.zeros((5, 5), np.float32))
    write_pfm(Path("empty.pfm"), np.full(SHAPE, np.nan, np.float32))
    before = {path.name for path in Path.cwd().iterdir()}
    assert message in error_of(call("refocus", *words))
    assert {path.name for path in Path.cwd().iterdir()} == before
