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


def test_what_is_no_light_field_is_told_with_what_would_be_one(square: Path, tmp_path: Path) -> None:
    (tmp_path / "empty").mkdir()
    (tmp_path / "notes.txt").write_text("hello")
    (tmp_path / "lytro").mkdir()
    (tmp_path / "lytro/IMG_0001.LFR").write_bytes(b"\x89LFP\r\n\x1a\n" + bytes(64))
    for name, words in {
        "empty": ("HCI folder", "HDF5"),
        "": (f"such as {square}",),
        "absent": ("absent: no such file or folder",),
        "square/input_Cam003.png": ("give the folder of all views",),
        "notes.txt": ("not a light field of a known format",),
        "lytro": ("lytro: raw data of a Lytro camera", "Light Field Toolbox", "PlenoptiCam"),
        "lytro/IMG_0001.LFR": ("LFR: raw data of a Lytro camera",),
    }.items():
        message = reading_error(tmp_path / name, format_of)
        assert all(word in message for word in words), message


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
