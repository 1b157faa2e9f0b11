"""Lytro lenslet pictures: the view (t, s) is the pixel (t, s) under every lenslet; any other reading mixes views."""

from collections.abc import Callable
from pathlib import Path

import cv2
import numpy as np
import pytest
from PIL import Image

from sepi.errors import SepiError
from sepi.io.readers.formats import FORMATS, format_of, read, size_of
from sepi.io.readers.options import ReadOptions


def stack(
    grid: tuple[int, int], size: tuple[int, int] = (5, 7), channels: int = 3, kind: type = np.uint8
) -> np.ndarray:
    """Views (T, S, H, W, C) of random pixels."""
    shape = (*grid, *size, channels)
    return np.random.default_rng(0).integers(0, np.iinfo(kind).max, shape, kind, endpoint=True)


def lenslets(views: np.ndarray, beyond: tuple[int, int] = (0, 0)) -> np.ndarray:
    """Picture with the views' pixels under its lenslets, and further rows and columns beyond them."""
    T, S, H, W, C = views.shape
    picture = np.full((T * H + beyond[0], S * W + beyond[1], C), 99, views.dtype)
    for t in range(T):
        for s in range(S):
            for y in range(H):
                picture[y * T + t, s : S * W : S] = views[t, s, y]
    return picture


def put(path: Path, picture: np.ndarray) -> Path:
    assert cv2.imwrite(str(path), picture[:, :, ::-1] if picture.shape[2] > 1 else picture)
    return path


@pytest.mark.parametrize("name", ["IMG_1_eslf.png", "flower.ESLF.PNG", "eslf.tif"])
def test_the_middle_views_are_read_pixel_for_pixel(tmp_path: Path, name: str) -> None:
    views = stack((14, 14))
    path = put(tmp_path / name, lenslets(views))
    assert format_of(path) == FORMATS["eslf"]
    light_field = read(path, ReadOptions())
    np.testing.assert_array_equal(light_field.views, views[3:12, 3:12])
    assert light_field.present.all()
    assert light_field.reference_position == (4, 4)
    np.testing.assert_array_equal(light_field.views[light_field.reference_position], views[7, 7])
    assert light_field.name == Path(name).stem
    assert light_field.source == str(path)
    assert light_field.notes == ("the 9x9 views in the middle of 14x14; --central N takes another odd number",)


READ: dict[str, tuple[tuple[int, int], ReadOptions, Callable[[np.ndarray], np.ndarray]]] = {
    "3x3": ((14, 14), ReadOptions(central=3), lambda views: views[6:9, 6:9]),
    "15 pixels under a lenslet": ((15, 15), ReadOptions(grid=(15, 15)), lambda views: views[3:12, 3:12]),
    "a small grid": ((4, 5), ReadOptions(grid=(4, 5)), lambda views: views[1:4, 1:4]),
    "a row": ((1, 5), ReadOptions(grid=(1, 5)), lambda views: views),
    "flipped": ((14, 14), ReadOptions(order="flip-rows", central=3), lambda views: views[6:9, 6:9][::-1]),
}


@pytest.mark.parametrize("case", READ)
def test_other_views_are_read_when_asked_for(tmp_path: Path, case: str) -> None:
    grid, options, expected = READ[case]
    views = stack(grid)
    light_field = read(put(tmp_path / "a_eslf.png", lenslets(views)), options)
    np.testing.assert_array_equal(light_field.views, expected(views))


def test_pixels_beyond_the_last_whole_lenslet_are_left_out_with_a_note(tmp_path: Path) -> None:
    """The archive's pictures do not end with a whole lenslet."""
    views = stack((14, 14))
    light_field = read(put(tmp_path / "a_eslf.png", lenslets(views, (3, 13))), ReadOptions())
    np.testing.assert_array_equal(light_field.views, views[3:12, 3:12])
    assert "3 pixel rows and 13 columns beyond the last whole lenslet were left out" in light_field.notes


def test_dark_views_are_named_with_the_flag_that_leaves_them_out(tmp_path: Path) -> None:
    """They spoil the matching, but which views are used is the user's to say."""
    views = stack((14, 14))
    views[3, 3] //= 10
    views[3, 11] = 1
    views[7, 7] = np.maximum(views[7, 7], 60)
    path = put(tmp_path / "a_eslf.png", lenslets(views))
    light_field = read(path, ReadOptions())
    assert light_field.present.all()
    assert light_field.notes[-1].startswith("2 views are darker")
    assert light_field.notes[-1].endswith("to leave out: --exclude 0,0 --exclude 0,8")
    lighter = read(path, ReadOptions(exclude=("0,0", "0,8")))
    assert not lighter.present[0, 0]
    assert not lighter.present[0, 8]
    assert lighter.present.sum() == 79
    assert len(lighter.notes) == 1


BAD: dict[str, tuple[tuple[int, int], ReadOptions, str]] = {
    "too low": ((27, 100), ReadOptions(), "views of 7x1 pixels"),
    "grid too large": ((100, 100), ReadOptions(grid=(60, 60)), "views of 1x1 pixels"),
    "huge grid": ((100, 100), ReadOptions(grid=(999_999, 999_999)), "a grid of 2 to 10000 views"),
    "even middle": ((100, 100), ReadOptions(central=14), "odd number"),
}


@pytest.mark.parametrize("case", BAD)
def test_what_does_not_fit_is_one_line_that_names_the_file(tmp_path: Path, case: str) -> None:
    size, options, word = BAD[case]
    path = put(tmp_path / "a_eslf.png", np.full((*size, 3), 100, np.uint8))
    with pytest.raises(SepiError) as caught:
        read(path, options)
    assert str(path) in str(caught.value)
    assert word in str(caught.value)
    assert "\n" not in str(caught.value)


def test_the_size_counts_the_default_views_and_all_that_is_decoded(tmp_path: Path) -> None:
    Image.new("RGB", (14 * 50, 14 * 40)).save(tmp_path / "a_eslf.png")
    found = size_of([tmp_path / "a_eslf.png"])
    assert found[:3] == (81, 40, 50)
    assert 81 * 40 * 50 * found.pixel_bytes >= 14 * 50 * 14 * 40 * 3
