"""TIFFs whose pages are the views, as the programs write them that microscopes and scripts use."""

from pathlib import Path

import numpy as np
import pytest
import tifffile
from error_lines import refused
from PIL import Image

from sepi.errors import SepiError
from sepi.io.readers.formats import format_of, read, size_of
from sepi.io.readers.options import ReadOptions
from sepi.reading import read_light_field
from sepi.scenes import render

VIEWS = np.random.default_rng(0).integers(1, 256, (2, 4, 20, 30, 3), np.uint8)
ROW = VIEWS.reshape(8, 20, 30, 3)
GREY = VIEWS[..., 0].astype(np.uint16) * 257

COUNTED = {
    "tifffile": (VIEWS, {"photometric": "rgb"}),
    "ImageJ": (GREY, {"imagej": True, "metadata": {"axes": "TZYX"}}),
    "ImageJ, channels apart": (VIEWS.transpose(0, 1, 4, 2, 3), {"imagej": True, "metadata": {"axes": "TZCYX"}}),
    "OME": (GREY, {"ome": True, "metadata": {"axes": "TZYX"}}),
    "floats": ((VIEWS / 255).astype(np.float32), {"photometric": "rgb", "compression": "zlib", "byteorder": ">"}),
}
SEQUENCES = {
    "tifffile": (ROW, {"photometric": "rgb", "metadata": None}),
    "ImageJ": (GREY.reshape(8, 20, 30), {"imagej": True}),
}


@pytest.mark.parametrize("kind", COUNTED)
def test_pages_that_are_counted_along_two_axes_are_a_grid(tmp_path: Path, kind: str) -> None:
    image, how = COUNTED[kind]
    tifffile.imwrite(tmp_path / "scene.tif", image, **how)
    assert format_of(tmp_path / "scene.tif").name == "TIFF stack"
    light_field = read(tmp_path / "scene.tif", ReadOptions(exclude=("0,0",)))
    expected = image.transpose(0, 1, 3, 4, 2) if kind.endswith("apart") else image.reshape(*image.shape[:4], -1)
    np.testing.assert_array_equal(light_field.views[1], expected[1])
    assert light_field.views.dtype == image.dtype
    assert (light_field.name, light_field.grid, light_field.present.sum()) == ("scene", (2, 4), 7)
    assert " 2x4 " in light_field.notes[0]
    other = read(tmp_path / "scene.tif", ReadOptions(grid=(4, 2)))
    np.testing.assert_array_equal(other.views.reshape(expected.shape), expected)


@pytest.mark.parametrize("kind", SEQUENCES)
def test_other_pages_are_a_sequence_whose_grid_is_given(tmp_path: Path, kind: str) -> None:
    image, how = SEQUENCES[kind]
    tifffile.imwrite(tmp_path / "a.tif", image, **how)
    assert not read(tmp_path / "a.tif", ReadOptions()).arranged
    light_field = read(tmp_path / "a.tif", ReadOptions(grid=(2, 4)))
    np.testing.assert_array_equal(light_field.views, image.reshape(2, 4, 20, 30, -1))
    assert "make no grid of 3x3" in refused(tmp_path / "a.tif", grid=(3, 3))
    assert size_of([tmp_path / "a.tif"]) == (8, 20, 30, 3 if kind == "tifffile" else 2)


def test_the_grid_of_a_sequence_is_found_in_the_views(tmp_path: Path) -> None:
    views = render("pyramids", size=64, views=3).views
    pages = [Image.fromarray(view) for view in views.reshape(9, 64, 64, 3)]
    pages[0].save(tmp_path / "a.tif", save_all=True, append_images=pages[1:])
    light_field = read_light_field(tmp_path / "a.tif", check_order=False)
    assert light_field.grid == (3, 3)
    np.testing.assert_array_equal(light_field.views, views)


def test_what_is_no_stack_says_so(tmp_path: Path) -> None:
    """A small copy beside a picture is no view, and of pages that cannot be read the page is named."""
    path = tmp_path / "a.tif"
    with tifffile.TiffWriter(path) as file:
        for size in (40, 20):
            file.write(np.zeros((size, size), np.uint8))
    with pytest.raises(SepiError, match="--format mosaic or eslf"):
        format_of(path)
    with tifffile.TiffWriter(path) as file:
        for size in (40, 40, 20):
            file.write(np.zeros((size, size), np.uint8))
    assert "page 3 is unlike the first; all views must be alike" in refused(path)
    pages = [Image.fromarray(view) for view in ROW]
    pages[0].save(path, save_all=True, append_images=pages[1:], compression="tiff_lzw")
    np.testing.assert_array_equal(read(path, ReadOptions()).views[0], ROW)
    tifffile.imwrite(path, ROW, photometric="rgb", compression="zstd")
    assert "page 1: a TIFF " in refused(path)
    tifffile.imwrite(path, ROW, photometric="rgb")
    content = path.read_bytes()
    for cut in range(100, 2000, 180):
        path.write_bytes(content[:-cut])
        assert "damaged" in refused(path)
