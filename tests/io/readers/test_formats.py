"""What a path that is no light field may be, told to whom gave the wrong one of several."""

from pathlib import Path

import numpy as np
import pytest
from error_lines import reading_error

from sepi.errors import SepiError
from sepi.io.images import write_png
from sepi.io.readers.formats import format_of
from sepi.io.result_folder import write_result
from sepi.lightfield import LightField
from sepi.stage import StageMaps

VIEWS = np.random.default_rng(0).integers(0, 256, (3, 3, 12, 16, 3), np.uint8)


@pytest.fixture
def square(tmp_path: Path) -> Path:
    """A benchmark folder of nine views and nothing else."""
    (tmp_path / "square").mkdir()
    for number, view in enumerate(VIEWS.reshape(9, 12, 16, 3)):
        write_png(tmp_path / "square" / f"input_Cam{number:03d}.png", view)
    return tmp_path / "square"


def test_empty_folder_lists_the_known_formats(tmp_path: Path) -> None:
    message = reading_error(tmp_path, format_of)
    assert "HCI folder" in message
    assert "HDF5" in message


def test_folder_of_scenes_names_one(square: Path) -> None:
    assert f"such as {square}" in reading_error(square.parent, format_of)


def test_nothing_there(tmp_path: Path) -> None:
    assert reading_error(tmp_path / "absent", format_of).endswith("absent: no such file or folder")


def test_one_view_of_many(square: Path) -> None:
    assert "give the folder of all views" in reading_error(square / "input_Cam003.png", format_of)


def test_file_of_no_known_format(tmp_path: Path) -> None:
    (tmp_path / "notes.txt").write_text("hello")
    assert "not a light field of a known format" in reading_error(tmp_path / "notes.txt", format_of)


def test_raw_file_of_a_lytro_says_what_decodes_it(tmp_path: Path) -> None:
    (tmp_path / "IMG_0001.LFR").write_bytes(b"\x89LFP\r\n\x1a\n" + bytes(64))
    for path in (tmp_path / "IMG_0001.LFR", tmp_path):
        message = reading_error(path, format_of)
        assert message.startswith(f"{path}: raw data of a Lytro camera")
        assert "Light Field Toolbox" in message
        assert "PlenoptiCam" in message


def test_a_result_is_not_taken_for_a_light_field(tmp_path: Path) -> None:
    flat = np.zeros((12, 16), np.float32)
    write_result(tmp_path / "out", LightField(VIEWS, "toy"), StageMaps(flat, flat), {})
    for path in (tmp_path / "out", tmp_path / "out" / "result.h5"):
        assert "holds a disparity map, not a light field" in reading_error(path, format_of)


def test_an_empty_file_is_not_offered_as_a_light_field(tmp_path: Path) -> None:
    """A system's own files look so, too, and whoever reads them may wait for ever."""
    np.save(tmp_path / "full.npy", np.zeros((2, 2, 8, 9, 3), np.uint8))
    (tmp_path / "empty.npy").touch()
    with pytest.raises(SepiError, match=r"such as .*full\.npy$"):
        format_of(tmp_path)
