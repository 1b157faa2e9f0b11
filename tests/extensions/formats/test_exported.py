"""`sepi export`: what was set right by flags once is read without them, from one file or a folder of pictures."""

import json
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from error_lines import call, done, error_of, reading_error
from geometries import jittered

from sepi.camera import Camera
from sepi.extensions.formats.exported import write_exported
from sepi.io.hdf5 import write_light_field
from sepi.io.images import write_png
from sepi.io.provenance import digest_of
from sepi.io.readers.options import ReadOptions
from sepi.lightfield import LightField
from sepi.reading import read_light_field
from sepi.scenes import render

CAMERA = ("--focal-length", 35, "--baseline", 2, "--focus-distance", 3, "--sensor-size", 24)
VIEWS = render("pyramids", size=64, views=3)


def corrected() -> tuple[object, ...]:
    """Views whose rows are counted from below, a corner black, as turned.npy; the flags that set them right."""
    np.save("turned.npy", VIEWS.views[::-1])
    return ("turned.npy", "--order", "flip-rows", "--exclude", "0,0", "--row-spacing", "1.25", "--view", "1,2")


def placed() -> tuple[object, ...]:
    """Grey views of floats that stand off the grid, with ground truth, masks, and a camera at no focus distance."""
    grey = (VIEWS.views[..., :1] / 255).astype(np.float32)
    known = {
        "positions": jittered((3, 3)),
        "camera": Camera(30.0, -1 / 3, 90.0),
        "name": "Büste",
        "disparity_range": None,
    }
    write_light_field(Path("placed.h5"), replace(VIEWS, views=grey, **known))
    return ("placed.h5",)


def deep() -> tuple[object, ...]:
    """Colours of 10 bit whose rows seem to be farther apart than the flags say."""
    views = render("pyramids", size=96, views=5, row_spacing=2).views
    np.save("deep.npy", views.astype(np.uint16) * 4)
    return ("deep.npy", "--white", "1020", "--row-spacing", "1", "--disparity-range", "-1.5", "1.625", *CAMERA)


pytestmark = pytest.mark.usefixtures("here")


@pytest.mark.filterwarnings("ignore::sepi.SepiWarning")
@pytest.mark.parametrize("made", [corrected, placed, deep])
def test_all_that_flags_said_is_kept(made: Callable[[], tuple[object, ...]]) -> None:
    """What is not kept has to be said again, or depth is wrong without a word."""
    words = made()
    found: list[LightField] = []
    for out in ("one.h5", "many"):
        done("export", words[0], out, *words[1:])
        found.append(read_light_field(out, check_order=made is deep))
    one, many = found
    assert digest_of(one) == digest_of(many)
    for light_field, out in ((one, "one.h5"), (many, "many")):
        np.testing.assert_array_equal(light_field.baselines, one.baselines)
        np.testing.assert_array_equal(light_field.views, one.views)
        for field in ("name", "present", "view", "row_spacing", "disparity_range", "camera", "ground_truth"):
            np.testing.assert_equal(getattr(light_field, field), getattr(one, field))
        np.testing.assert_equal(dict(light_field.masks), dict(one.masks))
        assert (light_field.source, light_field.reading) == (out, "")
        assert light_field.notes[:1] == (f"exported from {words[0]}",)
    if made is corrected:
        options = ReadOptions(order="flip-rows", exclude=("0,0",), view=(1, 2))
        assert digest_of(one) == digest_of(read_light_field("turned.npy", options=options, check_order=False))
        assert (one.row_spacing, one.view) == (1.25, (1, 2))
    elif made is placed:
        given = read_light_field("placed.h5", check_order=False)
        assert digest_of(one) == digest_of(given)
        assert (one.camera, one.row_spacing) == (given.camera, given.row_spacing)
        np.testing.assert_array_equal(one.ground_truth, given.ground_truth)
        assert one.disparity_range.source == "estimated"
        assert set(one.masks) == {"occluded", "textureless"}
    else:
        assert read_light_field("deep.npy").row_spacing == pytest.approx(2, rel=0.05)
        assert one.row_spacing == 1
        assert one.views.max() > 60000
        assert one.camera.focal_px == 140
        assert one.disparity_range.maximum == 1.625


def test_the_same_depth_without_flags() -> None:
    words, fewer = corrected(), ("--set", "initial.semi_global.num_disparities=21")
    assert call("export", words[0], "saved", *words[1:], *CAMERA).exit_code == 0
    assert call("depth", *words, *fewer, *CAMERA, "-o", "by flags").exit_code == 0
    assert call("depth", "saved", *fewer, "-o", "without").exit_code == 0
    for name in ("disparity.pfm", "confidence.png", "depth.pfm"):
        assert Path("without", name).read_bytes() == Path("by flags", name).read_bytes()


def test_nothing_of_others_is_lost() -> None:
    words = corrected()
    Path("full").mkdir()
    for name in ("notes.txt", "row_07_col_07.png"):
        Path("full", name).write_text("mine")
    Path("old.h5").write_text("mine")
    Path("hci").mkdir()
    write_png(Path("hci/input_Cam000.png"), np.zeros((8, 8), np.uint8))
    for out, expected in (
        ("full", "full: holds files already (notes.txt, ...); choose another folder, or write into it with --force"),
        ("old.h5", "old.h5: exists already"),
        ("turned.npy", "turned.npy: is the light field itself"),
        ("new.mat", "new.mat: "),
        ("hci", "hci: holds the views of a light field"),
    ):
        assert expected in error_of(call("export", words[0], out, *words[1:]))
    assert {path.name for path in Path("full").iterdir()} == {"notes.txt", "row_07_col_07.png"}
    write_exported(Path("full"), VIEWS, force=True)
    assert Path("full/row_00_col_00.png").exists()
    assert call("export", words[0], "full", *words[1:], "--force").exit_code == 0
    # a view of the export before, which this one has not, is no user's own
    assert not Path("full/row_00_col_00.png").exists()
    assert Path("full/row_07_col_07.png").read_text() == Path("full/notes.txt").read_text() == "mine"
    assert int(read_light_field("full", check_order=False).present.sum()) == 8


def test_a_folder_that_was_exported_is_read_with_flags_too() -> None:
    write_exported(Path("saved"), VIEWS)
    options = ReadOptions(order="flip-rows", exclude=("row_00_col_01.png", "0,0"), view=(0, 1))
    light_field = read_light_field("saved", options=options, check_order=False)
    np.testing.assert_array_equal(light_field.views[1], VIEWS.views[1])
    assert np.argwhere(~light_field.present).tolist() == [[0, 0], [2, 1]]
    assert light_field.reference_position == (0, 1)


@pytest.mark.parametrize(
    ("key", "value", "expected"),
    [
        ("views", [["../a.png", "b.png"]], "names of files in its own folder, got '../a.png'"),
        ("view", [5, 5], "view 5,5 lies outside the grid"),
        ("spacing", 2, "unknown 'spacing'; did you mean 'row_spacing'?"),
        (None, None, "not a file of 'sepi export', or damaged"),
    ],
)
def test_a_file_that_was_edited_wrongly_is_one_line(key: str | None, value: object, expected: str) -> None:
    write_exported(Path("saved"), VIEWS)
    file = Path("saved/light_field.json")
    edited = file.read_text()[:-9] if key is None else json.dumps({**json.loads(file.read_text()), key: value})
    file.write_text(edited)
    message = reading_error(Path("saved"))
    assert message.startswith("saved")
    assert expected in message
