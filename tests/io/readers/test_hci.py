"""Benchmark folders: what is read is what lies on disk, and damaged input is one clear error that names the file."""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import cv2
import numpy as np
import pytest
from error_lines import reading_error

from sepi.errors import SepiError, SepiWarning
from sepi.io.disparity_maps import write_pfm
from sepi.io.readers.formats import read_truth
from sepi.io.readers.options import ReadOptions
from sepi.lightfield import DisparityRange
from sepi.reading import read_light_field
from sepi.scenes import render, write_hci

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


def test_view_number_is_columns_times_row_plus_column(square: Path) -> None:
    """A transposed grid turns vertical parallax into horizontal and ruins every depth."""
    light_field = read_light_field(square)
    assert light_field.views.shape == (3, 3, 12, 16, 3)
    assert light_field.views.dtype == np.uint8
    for t in range(3):
        for s in range(3):
            np.testing.assert_array_equal(light_field.views[t, s], pixels(3 * t + s))


def test_a_crop_is_told_and_keeps_the_camera_of_the_scene(tmp_path: Path) -> None:
    """Its disparities are those of the whole scene, and so are its metres; only the principal point moves."""
    camera = {"focal_length_mm": 100, "baseline_mm": 40, "focus_distance_m": 4, "sensor_size_mm": 35}
    scene = render("dots", size=64, views=3)
    write_hci(scene, tmp_path / "scene", camera=camera)
    whole = read_light_field(tmp_path / "scene")
    for path in (tmp_path / "scene").glob("*.p[nf][gm]"):
        path.unlink()
    for number in range(9):
        put(tmp_path / f"scene/input_Cam{number:03d}.png", scene.views[number // 3, number % 3, 10:50, 4:60])
    message = reading_error(tmp_path / "scene")
    assert "64x64, but the views are 56x40" in message
    assert "--crop-of 64x64+X+Y" in message
    part = read_light_field(tmp_path / "scene", options=ReadOptions(crop_of="64x64+4+10"))
    assert part.disparity_range == whole.disparity_range
    assert part.camera is not None
    assert part.camera == replace(whole.camera, right=0.0, down=2.0)
    with pytest.raises(SepiError, match=r"parameters\.cfg: .* column 9, row 10 .*64x64"):
        read_light_field(tmp_path / "scene", options=ReadOptions(crop_of="64x64+9+10"))
    with pytest.raises(SepiError, match="crop_of: expected WIDTHxHEIGHT"):
        ReadOptions(crop_of="64x64")


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


def test_masks_that_are_no_regions_of_the_views_are_left_out(full: Path) -> None:
    """Benchmark folders hold masks at ten times the size, and pictures of labels."""
    cv2.imwrite(str(full / "mask_planes_highres.png"), np.zeros((120, 160), np.uint8))
    cv2.imwrite(str(full / "mask_labels.png"), np.arange(192, dtype=np.uint8).reshape(12, 16))
    assert set(read_light_field(full).masks) == {"occluded", "planes_lowres"}


def config(**changes: str) -> Callable[[Path], None]:
    def change(folder: Path) -> None:
        lines = CONFIG.splitlines()
        for key, value in changes.items():
            lines = [f"{key} = {value}" if line.startswith(f"{key} =") else line for line in lines]
        (folder / "parameters.cfg").write_text("\n".join(lines))

    return change


def parameters(text: str) -> Callable[[Path], object]:
    return lambda folder: (folder / "parameters.cfg").write_bytes(text.encode("latin-1"))


def mask(name: str, values: np.ndarray) -> Callable[[Path], object]:
    return lambda folder: cv2.imwrite(str(folder / f"mask_{name}.png"), values)


BAD_FOLDERS: dict[str, tuple[Callable[[Path], object], str, str]] = {
    "centre view missing": (lambda f: (f / "input_Cam004.png").unlink(), "full", "(1, 1) is missing"),
    "view beyond the grid": (lambda f: put(f / "input_Cam006.png", pixels(6)), "input_Cam006.png", "2x3 grid"),
    "other size": (lambda f: put(f / "input_Cam004.png", pixels(4)[1:]), "input_Cam004.png", "16x11"),
    "range the wrong way round": (config(disp_min="3"), "parameters.cfg", "MIN < MAX"),
    "half a range": (parameters("[meta]\ndisp_min = 1"), "parameters.cfg", "both disp_min and disp_max"),
    "parameters of another size": (config(image_resolution_x_px="512"), "parameters.cfg", "image_resolution"),
    "truth of another size": (
        lambda f: write_pfm(f / "gt_disp_lowres.pfm", np.zeros((12, 15), np.float32)),
        "gt_disp_lowres.pfm",
        "(12, 15)",
    ),
    "mask not black and white": (mask("textureless", pixels(0)), "mask_textureless.png", "black and white"),
}


@pytest.mark.parametrize("case", BAD_FOLDERS)
def test_bad_folder_is_one_line_that_names_the_file(full: Path, case: str, capfd: pytest.CaptureFixture[str]) -> None:
    spoil, file, word = BAD_FOLDERS[case]
    spoil(full)
    message = reading_error(full)
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


def test_count_that_makes_no_square(square: Path) -> None:
    """Without parameters the grid is taken to be square; eight views could be 2x4 or 4x2."""
    (square / "input_Cam008.png").unlink()
    message = reading_error(square)
    assert "input_Cam007.png make 8" in message
    assert "num_cams_x" in message


@pytest.mark.parametrize(("name", "low", "high"), [("cotton", -1.465, 1.364), ("antinous", -3.131, 2.689)])
def test_real_scene(hci: Path, name: str, low: float, high: float) -> None:
    """Numbers, ground truth and parameters as the benchmark publishes them; antinous comes without parameters here."""
    light_field = read_light_field(hci / name)
    assert light_field.views.shape == (9, 9, 512, 512, 3)
    assert light_field.name == name
    assert light_field.ground_truth.min() == pytest.approx(low, abs=1e-3)
    assert light_field.ground_truth.max() == pytest.approx(high, abs=1e-3)
    own = DisparityRange(-1.6, 1.5, "parameters") if name == "cotton" else None
    assert light_field.disparity_range == own


def test_ground_truth_can_be_read_apart(full: Path) -> None:
    """The workflow's maps must not depend on it: not if it comes later, not if it is damaged."""
    whole = read_light_field(full)
    ground_truth, masks = read_truth(full, ReadOptions())
    np.testing.assert_array_equal(ground_truth, whole.ground_truth)
    np.testing.assert_equal(dict(masks), dict(whole.masks))
    # with two rows, the centre view of the flipped grid is another
    flipped = ReadOptions(order="flip-rows")
    with pytest.warns(SepiWarning, match="its ground truth is of view 0,1, the depth of view 1,1; --view 0,1 scores"):
        assert read_truth(full, flipped) == (None, {})
    np.testing.assert_array_equal(read_truth(full, replace(flipped, view=(0, 1)))[0], whole.ground_truth)
    (full / "gt_disp_lowres.pfm").write_bytes(b"Pf")
    views = read_light_field(full, truth=False)
    assert (views.ground_truth, views.masks) == (None, {})
    np.testing.assert_array_equal(views.views, whole.views)
    with pytest.raises(SepiError, match=r"gt_disp_lowres\.pfm"):
        read_truth(full, ReadOptions())


@pytest.mark.parametrize("encoding", ["utf-8-sig", "latin-1"])
def test_parameters_saved_by_an_editor_of_another_system_are_read(tmp_path: Path, encoding: str) -> None:
    """A byte order mark, or an umlaut in a comment, is no damage."""
    write_hci(render("dots", size=64, views=3), tmp_path / "scene")
    file = tmp_path / "scene" / "parameters.cfg"
    file.write_text(file.read_text(encoding="utf-8") + "# Größe in Pixeln\n", encoding=encoding)
    assert read_light_field(tmp_path / "scene", check_order=False).disparity_range is not None
