"""Files of OpenLF: each view comes out of its place in the picture of all; other groups are called what they are."""

from pathlib import Path

import h5py
import numpy as np
import pytest

from sepi.errors import SepiError
from sepi.io.readers.formats import format_of, read, size_of
from sepi.io.readers.options import ReadOptions

RNG = np.random.default_rng(5)
VIEWS = RNG.uniform(0.1, 1, (3, 4, 8, 10, 3)).astype(np.float32)


def written(path: Path, views: np.ndarray, kind: int = 1, grey: bool = False, **attributes: object) -> Path:
    """A file as OpenLF writes it."""
    rows, columns, height, width, _ = views.shape
    picture = views.transpose(0, 2, 1, 3, 4).reshape(rows * height, columns * width, 3)
    with h5py.File(path, "w") as file:
        group = file.create_group("LF")
        for channel, name in enumerate(["bw"] if grey else "rgb"):
            group[name] = picture[:, :, channel]
        group.attrs.update(
            {"LF_TYPE": kind, "cams_h": columns, "cams_v": rows, "width": columns * width, "height": rows * height}
            | attributes
        )
    return path


@pytest.mark.parametrize("grey", [False, True])
def test_views_are_cut_out_of_the_picture(tmp_path: Path, grey: bool) -> None:
    path = written(tmp_path / "a.h5", VIEWS, grey=grey)
    assert format_of(path).name == "OpenLF HDF5"
    light_field = read(path, ReadOptions())
    np.testing.assert_array_equal(light_field.views, VIEWS[..., :1] if grey else VIEWS)
    assert light_field.row_spacing == 1
    assert size_of([path]) == (12, 8, 10, 4 if grey else 12)


@pytest.mark.parametrize(("order", "spacing"), [("as-given", 0.5), ("transpose", 2.0)])
def test_the_baselines_give_the_row_spacing(tmp_path: Path, order: str, spacing: float) -> None:
    """A light field of rows half as far apart as columns would not match at all."""
    path = written(tmp_path / "a.h5", VIEWS, baseline_h=0.4, baseline_v=0.2)
    assert read(path, ReadOptions(order=order)).row_spacing == pytest.approx(spacing)
    none = written(tmp_path / "b.h5", VIEWS, baseline_h=0.0, baseline_v=0.2)
    assert read(none, ReadOptions()).row_spacing == 1


def test_a_row_and_a_column_of_views(tmp_path: Path) -> None:
    row = written(tmp_path / "row.h5", VIEWS[:1], kind=2, baseline_h=0.4, baseline_v=0.2)
    light_field = read(row, ReadOptions())
    np.testing.assert_array_equal(light_field.views, VIEWS[:1])
    assert light_field.row_spacing == 1
    column = written(tmp_path / "column.h5", VIEWS[:, :1], kind=3)
    np.testing.assert_array_equal(read(column, ReadOptions()).views, VIEWS[:, :1])
    # the picture on its side
    with h5py.File(column, "a") as file:
        for name in "rgb":
            picture = file["LF"][name][...]
            del file["LF"][name]
            file["LF"][name] = picture.T
    np.testing.assert_array_equal(read(column, ReadOptions()).views, VIEWS[:, :1])


BAD = {
    "cross": ({"kind": 4}, "LF_TYPE 4, "),
    "row of several rows": ({"kind": 2}, r"3x4 views \(cams_v x cams_h\) do not fit LF_TYPE 2"),
    "views of no size": ({"cams_h": 7}, "hold no 3x7 views of one size"),
    "a huge number": ({"cams_v": 2**62}, "expected the attribute 'cams_v' to be a whole number"),
}


@pytest.mark.parametrize("case", BAD)
def test_what_is_no_grid_is_one_line_that_says_why(tmp_path: Path, case: str) -> None:
    attributes, message = BAD[case]
    path = written(tmp_path / "a.h5", VIEWS, **attributes)
    with pytest.raises(SepiError, match=message) as caught:
        read(path, ReadOptions())
    assert str(caught.value).startswith(f"{path}: ")
    # the memory of its job is reckoned all the same
    assert size_of([path]).views > 0


def test_another_group_is_not_called_damaged(tmp_path: Path) -> None:
    """Who has a file of another program should not download it again."""
    with h5py.File(tmp_path / "a.h5", "w") as file:
        file["LF/pictures"] = VIEWS
    np.testing.assert_array_equal(read(tmp_path / "a.h5", ReadOptions()).views, VIEWS)
    with pytest.raises(SepiError, match="'LF' is a group, not an array"):
        read(tmp_path / "a.h5", ReadOptions(), "hci-2013")
    with h5py.File(tmp_path / "b.h5", "w") as file:
        file["LF"] = VIEWS
    with pytest.raises(SepiError, match="expected a group 'LF' as OpenLF writes it"):
        read(tmp_path / "b.h5", ReadOptions(), "openlf")
