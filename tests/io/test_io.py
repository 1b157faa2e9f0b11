"""Light fields in and results out: what is read is what lies on disk, and damaged input is one clear error."""

import contextlib
import shutil
from collections.abc import Callable
from pathlib import Path

import cv2
import h5py
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra import numpy as arrays

from sepi.errors import SepiError
from sepi.io.hdf5 import read_attributes, read_stage, write_light_field
from sepi.io.images import read_picture, read_views, write_png
from sepi.io.pfm import read_pfm, write_pfm
from sepi.io.result_folder import RESULT_FILES, colour_code, write_result
from sepi.lightfield import DisparityRange, LightField
from sepi.reading import read_light_field
from sepi.stage import StageMaps

CONFIG = """[intrinsics]
image_resolution_x_px = 16
image_resolution_y_px = 12
[extrinsics]
num_cams_x = 3
num_cams_y = 2
[meta]
scene = toy
disp_min = -1.5
disp_max = 2
"""


def pixels(number: int, kind: type = np.uint8) -> np.ndarray:
    """The RGB picture of a view, (12, 16, 3); each view has its own."""
    return np.random.default_rng(number).integers(0, np.iinfo(kind).max, (12, 16, 3), kind, endpoint=True)


def put(path: Path, rgb: np.ndarray) -> None:
    """Write a picture by OpenCV alone, so that this package's reader is not checked against its own writer."""
    assert cv2.imwrite(str(path), rgb[:, :, ::-1])


@pytest.fixture
def square(tmp_path: Path) -> Path:
    """Nine views and nothing else: a 3x3 grid."""
    folder = tmp_path / "square"
    folder.mkdir()
    for number in range(9):
        put(folder / f"input_Cam{number:03d}.png", pixels(number))
    return folder


@pytest.fixture
def full(tmp_path: Path) -> Path:
    """Two rows of three views with parameters, ground truth and masks."""
    folder = tmp_path / "full"
    folder.mkdir()
    for number in range(6):
        put(folder / f"input_Cam{number:03d}.png", pixels(number))
    (folder / "parameters.cfg").write_text(CONFIG)
    write_pfm(folder / "gt_disp_lowres.pfm", np.arange(192, dtype=np.float32).reshape(12, 16))
    mask = np.zeros((12, 16), np.uint8)
    mask[2:5, 3:9] = 255
    for name in ("occluded", "planes_lowres"):
        cv2.imwrite(str(folder / f"mask_{name}.png"), mask)
    return folder


def error_of(path: Path) -> str:
    with pytest.raises(SepiError) as caught:
        read_light_field(path)
    message = str(caught.value)
    assert "\n" not in message
    return message


# --- benchmark folders


def test_view_number_is_columns_times_row_plus_column(square: Path) -> None:
    """A transposed grid turns vertical parallax into horizontal and ruins every depth."""
    light_field = read_light_field(square)
    assert light_field.views.shape == (3, 3, 12, 16, 3)
    assert light_field.views.dtype == np.uint8
    for t in range(3):
        for s in range(3):
            np.testing.assert_array_equal(light_field.views[t, s], pixels(3 * t + s))


def test_without_parameters_the_range_is_unknown(square: Path) -> None:
    light_field = read_light_field(square)
    assert light_field.disparity_range is None
    assert light_field.ground_truth is None
    assert light_field.masks == {}
    assert light_field.name == "square"
    assert light_field.source == str(square)


def test_parameters_truth_and_masks_are_read(full: Path) -> None:
    light_field = read_light_field(full)
    assert light_field.grid == (2, 3)
    np.testing.assert_array_equal(light_field.views[1, 0], pixels(3))
    assert light_field.name == "toy"
    assert light_field.disparity_range == DisparityRange(-1.5, 2.0, "parameters")
    np.testing.assert_array_equal(light_field.ground_truth, np.arange(192, dtype=np.float32).reshape(12, 16))
    assert set(light_field.masks) == {"occluded", "planes_lowres"}
    assert light_field.masks["occluded"].sum() == 18
    assert light_field.masks["occluded"][2, 3]


def test_given_range_wins(full: Path) -> None:
    assert read_light_field(full, disparity_range=(-3, 3)).disparity_range == DisparityRange(-3, 3, "given")


def test_masks_that_are_no_regions_of_the_views_are_left_out(full: Path) -> None:
    """Benchmark folders hold masks at ten times the size, and pictures of labels."""
    cv2.imwrite(str(full / "mask_planes_highres.png"), np.zeros((120, 160), np.uint8))
    cv2.imwrite(str(full / "mask_labels.png"), np.arange(192, dtype=np.uint8).reshape(12, 16))
    assert set(read_light_field(full).masks) == {"occluded", "planes_lowres"}


def test_sixteen_bit_views_keep_their_depth(square: Path) -> None:
    for number in range(9):
        put(square / f"input_Cam{number:03d}.png", pixels(number, np.uint16))
    light_field = read_light_field(square)
    assert light_field.views.dtype == np.uint16
    np.testing.assert_array_equal(light_field.views[2, 2], pixels(8, np.uint16))
    assert light_field.reference_view.max() <= 1


def test_a_string_is_a_path(square: Path) -> None:
    assert read_light_field(str(square)).name == "square"


def cut(path: Path) -> None:
    data = path.read_bytes()
    path.write_bytes(data[: len(data) // 2])


def flip(path: Path) -> None:
    data = bytearray(path.read_bytes())
    data[100] ^= 255
    path.write_bytes(bytes(data))


def config(**changes: str) -> Callable[[Path], None]:
    def change(folder: Path) -> None:
        lines = CONFIG.splitlines()
        for key, value in changes.items():
            lines = [f"{key} = {value}" if line.startswith(f"{key} =") else line for line in lines]
        (folder / "parameters.cfg").write_text("\n".join(lines))

    return change


BAD_FOLDERS: dict[str, tuple[Callable[[Path], object], str, str]] = {
    "centre view missing": (
        lambda f: (f / "input_Cam004.png").unlink(),
        "full",
        "centre view (t, s) = (1, 1) is missing",
    ),
    "view beyond the grid": (lambda f: put(f / "input_Cam006.png", pixels(6)), "input_Cam006.png", "2x3 grid"),
    "view twice": (lambda f: put(f / "input_Cam2.png", pixels(2)), "input_Cam2.png", "twice"),
    "view without number": (lambda f: put(f / "input_Cam.png", pixels(2)), "input_Cam.png", "input_Cam007.png"),
    "view is a folder": (
        lambda f: ((f / "input_Cam001.png").unlink(), (f / "input_Cam001.png").mkdir()),
        "input_Cam001.png",
        "cannot be read",
    ),
    "truncated PNG": (lambda f: cut(f / "input_Cam003.png"), "input_Cam003.png", "damaged PNG"),
    "damaged PNG": (lambda f: flip(f / "input_Cam003.png"), "input_Cam003.png", "checksum"),
    "not a PNG": (lambda f: (f / "input_Cam003.png").write_text("hello"), "input_Cam003.png", "not a PNG"),
    "empty PNG": (lambda f: (f / "input_Cam000.png").write_bytes(b""), "input_Cam000.png", "not a PNG"),
    "other size": (lambda f: put(f / "input_Cam004.png", pixels(4)[1:]), "input_Cam004.png", "16x11"),
    "other depth": (lambda f: put(f / "input_Cam004.png", pixels(4, np.uint16)), "input_Cam004.png", "16 bit"),
    "grey among colour": (
        lambda f: cv2.imwrite(str(f / "input_Cam004.png"), pixels(4)[:, :, 0]),
        "input_Cam004.png",
        "grey",
    ),
    "range the wrong way round": (config(disp_min="3"), "parameters.cfg", "disp_min < disp_max"),
    "range of no width": (config(disp_min="2"), "parameters.cfg", "disp_min < disp_max"),
    "range not a number": (config(disp_max="near"), "parameters.cfg", "'near'"),
    "range NaN": (config(disp_max="nan"), "parameters.cfg", "finite"),
    "range infinite": (config(disp_max="inf"), "parameters.cfg", "finite"),
    "half a range": (
        lambda f: (f / "parameters.cfg").write_text("[meta]\ndisp_min = 1"),
        "parameters.cfg",
        "disp_max is not",
    ),
    "no cameras": (config(num_cams_x="0"), "parameters.cfg", "at least 1"),
    "half a camera": (config(num_cams_x="2.5"), "parameters.cfg", "whole numbers"),
    "fewer cameras than views": (config(num_cams_x="2"), "input_Cam005.png", "2x2 grid that parameters.cfg gives"),
    "parameters of another size": (config(image_resolution_x_px="512"), "parameters.cfg", "image_resolution"),
    "parameters without section": (
        lambda f: (f / "parameters.cfg").write_text("disp_min = 1"),
        "parameters.cfg",
        "section",
    ),
    "parameters twice": (
        lambda f: (f / "parameters.cfg").write_text(CONFIG + "disp_min = 0"),
        "parameters.cfg",
        "disp_min",
    ),
    "parameters not text": (
        lambda f: (f / "parameters.cfg").write_bytes(b"\xff\xfe\x00"),
        "parameters.cfg",
        "not a text file",
    ),
    "truth of another size": (
        lambda f: write_pfm(f / "gt_disp_lowres.pfm", np.zeros((12, 15), np.float32)),
        "gt_disp_lowres.pfm",
        "(12, 15)",
    ),
    "truth cut off": (lambda f: cut(f / "gt_disp_lowres.pfm"), "gt_disp_lowres.pfm", "bytes"),
    "mask of another size": (
        lambda f: cv2.imwrite(str(f / "mask_occluded.png"), np.zeros((5, 5), np.uint8)),
        "mask_occluded.png",
        "views' size",
    ),
    "mask not black and white": (
        lambda f: cv2.imwrite(str(f / "mask_textureless.png"), pixels(0)),
        "mask_textureless.png",
        "black and white",
    ),
    "mask damaged": (lambda f: cut(f / "mask_planes_lowres.png"), "mask_planes_lowres.png", "damaged PNG"),
}


@pytest.mark.parametrize("case", BAD_FOLDERS)
def test_bad_folder_is_one_line_that_names_the_file(full: Path, case: str, capfd: pytest.CaptureFixture[str]) -> None:
    spoil, file, word = BAD_FOLDERS[case]
    spoil(full)
    message = error_of(full)
    assert file in message
    assert word in message
    # neither OpenCV nor libpng adds lines of its own
    assert capfd.readouterr() == ("", "")


def test_a_missing_view_is_known_to_be_missing(square: Path) -> None:
    """A view taken for black, or the others moved up by one, spoils the depth everywhere."""
    (square / "input_Cam002.png").unlink()
    light_field = read_light_field(square)
    assert np.argwhere(~light_field.present).tolist() == [[0, 2]]
    np.testing.assert_array_equal(light_field.views[1, 0], pixels(3))


def test_missing_centre_view_without_parameters(square: Path) -> None:
    (square / "input_Cam004.png").unlink()
    assert "the centre view (t, s) = (1, 1) is missing" in error_of(square)


def test_count_that_makes_no_square(square: Path) -> None:
    """Without parameters the grid is taken to be square; eight views could be 2x4 or 4x2."""
    (square / "input_Cam008.png").unlink()
    message = error_of(square)
    assert "8, which is no square grid" in message
    assert "num_cams_x" in message


def test_one_view_is_no_light_field(square: Path) -> None:
    for path in sorted(square.glob("*.png"))[1:]:
        path.unlink()
    assert "at least two views" in error_of(square)


def test_empty_folder_lists_the_known_formats(tmp_path: Path) -> None:
    message = error_of(tmp_path)
    assert "HCI folder" in message
    assert "HDF5" in message


def test_folder_of_scenes_names_one(square: Path) -> None:
    assert f"such as {square}" in error_of(square.parent)


def test_nothing_there(tmp_path: Path) -> None:
    assert error_of(tmp_path / "absent").endswith("absent: no such file or folder")


def test_one_view_of_many(square: Path) -> None:
    assert "give the folder of all views" in error_of(square / "input_Cam003.png")


def test_file_of_no_known_format(tmp_path: Path) -> None:
    (tmp_path / "notes.txt").write_text("hello")
    assert "not a light field of a known format" in error_of(tmp_path / "notes.txt")


# --- pictures


def test_transparency_and_grey(tmp_path: Path) -> None:
    rgb = pixels(1)
    cv2.imwrite(str(tmp_path / "alpha.png"), np.dstack([rgb[:, :, ::-1], rgb[:, :, 0]]))
    cv2.imwrite(str(tmp_path / "grey.png"), rgb[:, :, 0])
    np.testing.assert_array_equal(read_picture(tmp_path / "alpha.png"), rgb)
    np.testing.assert_array_equal(read_picture(tmp_path / "grey.png"), rgb[:, :, :1])


def test_views_come_in_the_order_asked_for(square: Path) -> None:
    """Threads finish in any order."""
    order = [5, 1, 8, 0]
    views = read_views([square / f"input_Cam{number:03d}.png" for number in order])
    np.testing.assert_array_equal(views, np.stack([pixels(number) for number in order]))


@pytest.mark.parametrize("kind", [np.uint8, np.uint16])
def test_written_picture_is_read_back(tmp_path: Path, kind: type) -> None:
    write_png(tmp_path / "colour.png", pixels(3, kind))
    np.testing.assert_array_equal(cv2.imread(str(tmp_path / "colour.png"), -1)[:, :, ::-1], pixels(3, kind))


def test_mask_is_white_inside(tmp_path: Path) -> None:
    write_png(tmp_path / "mask.png", np.array([[True, False]]))
    assert read_picture(tmp_path / "mask.png")[:, :, 0].tolist() == [[255, 0]]


# --- PFM


@given(arrays.arrays(np.float32, arrays.array_shapes(min_dims=2, max_dims=2), elements=st.floats(width=32)))
def test_pfm_gives_back_every_map(tmp_path_factory: pytest.TempPathFactory, values: np.ndarray) -> None:
    path = tmp_path_factory.mktemp("pfm") / "map.pfm"
    write_pfm(path, values)
    np.testing.assert_array_equal(read_pfm(path), values)


def test_pfm_rows_lie_bottom_up(tmp_path: Path) -> None:
    """A map read upside down still looks plausible."""
    write_pfm(tmp_path / "map.pfm", np.array([[1, 2], [3, 4]], np.float32))
    assert np.frombuffer((tmp_path / "map.pfm").read_bytes()[-16:], "<f4").tolist() == [3, 4, 1, 2]


def test_pfm_of_the_other_byte_order(tmp_path: Path) -> None:
    (tmp_path / "map.pfm").write_bytes(b"Pf\n2 1\n1.0\n" + np.array([5, 6], ">f4").tobytes())
    assert read_pfm(tmp_path / "map.pfm").tolist() == [[5, 6]]


@given(st.binary(max_size=64).map(lambda tail: b"Pf\n2 2\n-1\n" + tail) | st.binary(max_size=64))
def test_no_bytes_crash_the_pfm_reader(tmp_path_factory: pytest.TempPathFactory, data: bytes) -> None:
    path = tmp_path_factory.mktemp("pfm") / "map.pfm"
    path.write_bytes(data)
    # anything but a map or this error fails the test
    with contextlib.suppress(SepiError):
        assert read_pfm(path).ndim == 2


NUMBERS = st.sampled_from(
    ["0", "1", "-1", "2", "1e9", "999999999", "-0.0", "nan", "1.0.0", "", "\u0663", "+2", "1e999"]
)


@given(st.sampled_from(["Pf", "PF", "P5", "pf"]), NUMBERS, NUMBERS, NUMBERS, st.sampled_from([" ", "\n", "\t\r\n"]))
def test_no_header_crashes_the_pfm_reader(
    tmp_path_factory: pytest.TempPathFactory, magic: str, width: str, height: str, scale: str, space: str
) -> None:
    path = tmp_path_factory.mktemp("pfm") / "map.pfm"
    path.write_bytes(space.join([magic, width, height, scale, ""]).encode() + bytes(8))
    with contextlib.suppress(SepiError):
        assert read_pfm(path).size == 2


KEYS = st.sampled_from(
    [
        *("disp_min", "disp_max", "num_cams_x", "num_cams_y", "image_resolution_x_px", "image_resolution_y_px"),
        *("focal_length_mm", "baseline_mm", "focus_distance_m", "sensor_size_mm", "scene", "[meta]", "other"),
    ]
)


@given(st.lists(st.tuples(KEYS, st.sampled_from(["=", ":", " "]), NUMBERS | st.text(max_size=9))), st.text(max_size=20))
def test_no_parameters_crash_the_reader(
    tmp_path_factory: pytest.TempPathFactory, lines: list[tuple[str, str, str]], start: str
) -> None:
    """A parameters.cfg from elsewhere may hold anything."""
    folder = tmp_path_factory.mktemp("cfg")
    for number in range(4):
        put(folder / f"input_Cam{number:03d}.png", pixels(number))
    text = start + "\n[extrinsics]\n" + "\n".join("".join(line) for line in lines)
    (folder / "parameters.cfg").write_bytes(text.encode("utf-8", "surrogatepass"))
    message = "cfg"
    try:
        assert read_light_field(folder, check_order=False).views.shape[2:] == (12, 16, 3)
    except SepiError as error:
        message = str(error)
    assert "cfg" in message
    assert "\n" not in message


# --- HDF5


@pytest.fixture
def light_field() -> LightField:
    present = np.ones((2, 3), bool)
    present[0, 0] = False
    return LightField(
        np.stack([pixels(number) for number in range(6)]).reshape(2, 3, 12, 16, 3),
        "toy",
        "somewhere",
        present,
        DisparityRange(-1, 2, "given"),
        np.linspace(-1, 2, 192, dtype=np.float32).reshape(12, 16),
        {"occluded": np.eye(12, 16, dtype=bool)},
    )


def test_light_field_file_gives_back_all_that_is_known(tmp_path: Path, light_field: LightField) -> None:
    write_light_field(tmp_path / "lf.h5", light_field)
    back = read_light_field(tmp_path / "lf.h5")
    np.testing.assert_array_equal(back.views, light_field.views)
    np.testing.assert_array_equal(back.present, light_field.present)
    np.testing.assert_array_equal(back.ground_truth, light_field.ground_truth)
    np.testing.assert_array_equal(back.masks["occluded"], light_field.masks["occluded"])
    assert (back.name, back.source) == ("toy", "somewhere")
    assert back.disparity_range == light_field.disparity_range


def test_equal_light_fields_give_equal_bytes(tmp_path: Path, light_field: LightField) -> None:
    for name in ("a.h5", "b.h5"):
        write_light_field(tmp_path / name, light_field)
    assert (tmp_path / "a.h5").read_bytes() == (tmp_path / "b.h5").read_bytes()


def spoiled(change: Callable[[h5py.File], object]) -> Callable[[Path], None]:
    def spoil(path: Path) -> None:
        with h5py.File(path, "r+") as file:
            change(file)

    return spoil


def replace(file: h5py.File, name: str, values: np.ndarray) -> None:
    del file[name]
    file[name] = values


BAD_FILES: dict[str, tuple[Callable[[Path], None], str]] = {
    "cut off": (cut, "not a readable HDF5 file"),
    "no name": (spoiled(lambda f: f.attrs.pop("name")), "name"),
    "no source": (spoiled(lambda f: f.attrs.pop("source")), "damaged"),
    "range of three numbers": (spoiled(lambda f: f.attrs.__setitem__("disparity_range", [1, 2, 3])), "damaged"),
    "range the wrong way round": (spoiled(lambda f: f.attrs.__setitem__("disparity_range", [2, 1])), "MIN < MAX"),
    "views of four axes": (
        spoiled(lambda f: replace(f, "views", np.zeros((3, 4, 4, 3), np.uint8))),
        "(T, S, H, W, C)",
    ),
    "views of text": (spoiled(lambda f: replace(f, "views", np.array(b"text"))), "(T, S, H, W, C)"),
    "NaN pixels": (
        spoiled(lambda f: replace(f, "views", np.full((2, 3, 12, 16, 3), np.nan, np.float32))),
        "finite and within 0..1",
    ),
    "floats of 0..255": (
        spoiled(lambda f: replace(f, "views", np.full((2, 3, 12, 16, 3), 200, np.float32))),
        "within 0..1",
    ),
    "centre view missing": (spoiled(lambda f: replace(f, "present", np.zeros((2, 3), bool))), "centre view"),
    "views are a group": (spoiled(lambda f: (f.pop("views"), f.create_group("views"))), "damaged"),
}


@pytest.mark.parametrize("case", BAD_FILES)
def test_bad_file_is_one_line_that_names_it(tmp_path: Path, light_field: LightField, case: str) -> None:
    spoil, word = BAD_FILES[case]
    write_light_field(tmp_path / "lf.h5", light_field)
    spoil(tmp_path / "lf.h5")
    message = error_of(tmp_path / "lf.h5")
    assert "lf.h5" in message
    assert word in message


def test_a_result_is_not_taken_for_a_light_field(tmp_path: Path, light_field: LightField) -> None:
    write_result(tmp_path / "out", light_field, maps_of(light_field), {})
    for path in (tmp_path / "out", tmp_path / "out" / "result.h5"):
        assert "holds a disparity map, not a light field" in error_of(path)


# --- results


def maps_of(light_field: LightField) -> StageMaps:
    rng = np.random.default_rng(0)
    disparity, confidence = rng.random((2, *light_field.shape), np.float32)
    return StageMaps(disparity, confidence, {"occluded": disparity > 0.8})


def test_result_holds_maps_and_what_made_them(tmp_path: Path, light_field: LightField) -> None:
    maps = maps_of(light_field)
    write_result(tmp_path / "out", light_field, maps, {"variant": "paper", "disparity_range": (-1.0, 2.0)})
    assert sorted(path.name for path in (tmp_path / "out").iterdir()) == sorted([*RESULT_FILES, "mask_occluded.png"])
    np.testing.assert_array_equal(read_pfm(tmp_path / "out/disparity.pfm"), maps.disparity)
    back = read_stage(tmp_path / "out/result.h5")
    np.testing.assert_array_equal(back.confidence, maps.confidence)
    np.testing.assert_array_equal(back.mask("occluded"), maps.extra["occluded"])
    assert read_attributes(tmp_path / "out/result.h5")["variant"] == "paper"
    assert read_picture(tmp_path / "out/disparity.png").shape == (12, 16, 3)
    grey = read_picture(tmp_path / "out/confidence.png")[:, :, 0]
    np.testing.assert_allclose(grey / 255, maps.confidence, atol=0.5 / 255 + 1e-6)


def test_equal_results_give_equal_bytes(tmp_path: Path, light_field: LightField) -> None:
    for name in ("a", "b"):
        write_result(tmp_path / name, light_field, maps_of(light_field), {"variant": "paper"})
    for file in RESULT_FILES:
        assert (tmp_path / "a" / file).read_bytes() == (tmp_path / "b" / file).read_bytes()


def test_other_files_in_the_result_folder_stay(tmp_path: Path, light_field: LightField) -> None:
    (tmp_path / "out").mkdir()
    (tmp_path / "out/notes.txt").write_text("mine")
    write_result(tmp_path / "out", light_field, maps_of(light_field), {})
    write_result(tmp_path / "out", light_field, maps_of(light_field), {})
    assert (tmp_path / "out/notes.txt").read_text() == "mine"
    assert len(list((tmp_path / "out").iterdir())) == 2 + len(RESULT_FILES)  # and the mask


def test_failed_result_leaves_no_folder(
    tmp_path: Path, light_field: LightField, monkeypatch: pytest.MonkeyPatch
) -> None:
    def fail(path: Path, *_: object) -> None:
        raise SepiError(f"{path}: no space")

    monkeypatch.setattr("sepi.io.result_folder.write_png", fail)
    with pytest.raises(SepiError, match="no space"):
        write_result(tmp_path / "out", light_field, maps_of(light_field), {})
    assert list(tmp_path.iterdir()) == []


def test_result_needs_a_folder(tmp_path: Path, light_field: LightField) -> None:
    (tmp_path / "out").write_text("mine")
    for target in (tmp_path / "out", tmp_path / "out" / "below"):
        with pytest.raises(SepiError, match="out"):
            write_result(target, light_field, maps_of(light_field), {})
    assert (tmp_path / "out").read_text() == "mine"


def test_maps_of_another_scene_are_refused(tmp_path: Path, light_field: LightField) -> None:
    maps = StageMaps(np.zeros((3, 4), np.float32), np.zeros((3, 4), np.float32))
    with pytest.raises(SepiError, match=r"\(12, 16\)"):
        write_result(tmp_path / "out", light_field, maps, {})


def test_colours_show_finite_values_whatever_else_is_there() -> None:
    """One infinite pixel must not flatten the picture; a missing one must be seen as missing."""
    values = np.linspace(-1, 1, 400, dtype=np.float32).reshape(20, 20)
    clean = colour_code(values)
    values[0, 0], values[5, 5], values[9, 9] = np.nan, np.inf, -np.inf
    spoilt = colour_code(values)
    assert (spoilt[[0, 5, 9], [0, 5, 9]] == 0).all()
    finite = np.isfinite(values)
    assert np.abs(spoilt[finite].astype(int) - clean[finite]).max() <= 6
    assert len(np.unique(clean.reshape(-1, 3), axis=0)) > 200


@pytest.mark.parametrize("value", [0.7, np.nan])
def test_colours_of_a_map_without_contrast(value: float) -> None:
    picture = colour_code(np.full((4, 5), value, np.float32))
    assert (picture == picture[0, 0]).all()


# --- real scenes


@pytest.mark.parametrize(("name", "low", "high"), [("cotton", -1.465, 1.364), ("antinous", -3.131, 2.689)])
def test_real_scene(hci: Path, name: str, low: float, high: float) -> None:
    """Numbers, ground truth and parameters as the benchmark publishes them; antinous comes without parameters here."""
    light_field = read_light_field(hci / name)
    assert light_field.views.shape == (9, 9, 512, 512, 3)
    assert light_field.name == name
    assert light_field.ground_truth is not None
    assert light_field.ground_truth.min() == pytest.approx(low, abs=1e-3)
    assert light_field.ground_truth.max() == pytest.approx(high, abs=1e-3)
    own = DisparityRange(-1.6, 1.5, "parameters") if name == "cotton" else None
    assert light_field.disparity_range == own


def test_real_scene_with_a_view_missing(hci: Path, tmp_path: Path) -> None:
    """What is left of an incomplete download is used; only the view whose depth is made must be there."""
    shutil.copytree(hci / "cotton", tmp_path / "cotton")
    (tmp_path / "cotton/input_Cam003.png").unlink()
    light_field = read_light_field(tmp_path / "cotton")
    assert np.argwhere(~light_field.present).tolist() == [[0, 3]]
    assert light_field.ground_truth is not None
    (tmp_path / "cotton/input_Cam040.png").unlink()
    assert "the centre view (t, s) = (4, 4) is missing" in error_of(tmp_path / "cotton")
