"""Arrays whose sizes leave their axes open, read as their pictures fit together."""

from pathlib import Path

import numpy as np
import pytest

import sepi
from sepi.errors import SepiError
from sepi.scenes import render


def read(folder: Path, array: np.ndarray, axes: str) -> sepi.LightField:
    """The array (N or T, S, H, W, C) with its axes in another order, read without a word about them."""
    known = "TSHWC" if array.ndim == 5 else "NHWC" if "N" in axes else "TSHW"
    np.save(folder / "a.npy", np.moveaxis(array, range(array.ndim), [axes.index(letter) for letter in known]))
    return sepi.read_light_field(folder / "a.npy")


@pytest.mark.parametrize(("axes", "side"), [("NCHW", 3), ("HWCN", 3), ("CNHW", 3), ("HWNC", 3), ("NCHW", 5)])
def test_views_in_colour_are_no_grid_of_grey_ones(tmp_path: Path, axes: str, side: int) -> None:
    """Torch and MATLAB stack pictures so; as 25x3 grey views nearly every pixel of the map is wrong."""
    views = render("pyramids", size=96, views=side).views
    light_field = read(tmp_path, views.reshape(side**2, *views.shape[2:]), axes)
    np.testing.assert_array_equal(light_field.views, views)
    assert f"axes taken as {' '.join(axes)}," in light_field.notes[0]


@pytest.mark.parametrize("axes", ["TSHW", "HWTS"])
@pytest.mark.parametrize(("rows", "columns"), [(3, 3), (5, 3), (3, 5), (4, 4)])
def test_grids_of_grey_views_as_narrow_as_colours(tmp_path: Path, axes: str, rows: int, columns: int) -> None:
    """The other way round, three columns mixed to colours would blur the scene."""
    views = render("pyramids", size=96, views=5).views[:rows, :columns, ..., 1]
    np.testing.assert_array_equal(read(tmp_path, views, axes).views, views[..., None])


def test_three_views_in_colour_are_no_grid_of_three_by_three(tmp_path: Path) -> None:
    views = render("pyramids", size=96, views=3).views[1]
    np.testing.assert_array_equal(read(tmp_path, views, "NCHW").views, views[None])


def test_pictures_that_do_not_tell_ask_for_axes(tmp_path: Path) -> None:
    """A guess would be wrong half the time."""
    stripes = np.broadcast_to(np.arange(96, dtype=np.uint8), (25, 3, 96, 96))
    with pytest.raises(
        SepiError, match="does not tell which axis is which; say it with --axes, such as --axes TSHW or"
    ):
        read(tmp_path, stripes, "TSHW")
