"""One picture of all views side by side: each pixel in its view, and quilts in the order of their cameras."""

from pathlib import Path

import numpy as np
import pytest
from error_lines import reading_error

from sepi.io.images import write_png
from sepi.io.readers.formats import format_of, read
from sepi.io.readers.options import ReadOptions

VIEWS = np.random.default_rng(2).integers(1, 256, (3, 4, 12, 14, 3), np.uint8)
MOSAIC = VIEWS.transpose(0, 2, 1, 3, 4).reshape(36, 56, 3)


def test_a_mosaic_is_cut_into_the_grid_that_is_given(tmp_path: Path) -> None:
    write_png(tmp_path / "a.png", MOSAIC)
    np.testing.assert_array_equal(read(tmp_path / "a.png", ReadOptions(grid=(3, 4)), "mosaic").views, VIEWS)
    assert "hold no 5x4 views of one size" in reading_error(
        tmp_path / "a.png", lambda path: read(path, ReadOptions(grid=(5, 4)), "mosaic")
    )
    assert "needs --grid ROWSxCOLUMNS" in reading_error(
        tmp_path / "a.png", lambda path: read(path, ReadOptions(), "mosaic")
    )
    assert "--format mosaic" in reading_error(tmp_path / "a.png", format_of)


@pytest.mark.parametrize("name", ["a_qs4x3a1.17.png", "A_QS4x3a0.75.png"])
def test_a_quilt_is_a_row_of_views_from_the_lower_left(tmp_path: Path, name: str) -> None:
    """From the upper left, as a mosaic, the upper row of views would be that on the left."""
    write_png(tmp_path / name, MOSAIC)
    assert format_of(tmp_path / name).name == "mosaic of views"
    light_field = read(tmp_path / name, ReadOptions())
    np.testing.assert_array_equal(light_field.views, VIEWS[::-1].reshape(1, 12, 12, 14, 3))
    assert light_field.arranged
