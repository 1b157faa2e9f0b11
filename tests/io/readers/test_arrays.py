"""Light fields that arrive as arrays: every pixel at its place, and a clear word where that cannot be known."""

from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pytest
import scipy.io
from hdf5_edits import changed

from sepi.errors import SepiError
from sepi.io.hdf5 import write_light_field
from sepi.io.images import write_png
from sepi.io.readers.arrays import light_field_from_array
from sepi.io.readers.formats import FORMATS, read
from sepi.io.readers.options import ReadOptions
from sepi.lightfield import LightField
from sepi.reading import read_light_field
from sepi.scenes import render

T, S, H, W = 2, 5, 12, 14
RNG = np.random.default_rng(7)
# no zeros: a view of zeros counts as missing
RGB = RNG.integers(1, 256, (T, S, H, W, 3), np.uint8)


def taken(array: np.ndarray, **options: object) -> LightField:
    return light_field_from_array(array, Path("toy.npy"), ReadOptions(**options))


def refused(array: np.ndarray, **options: object) -> str:
    with pytest.raises(SepiError) as caught:
        taken(array, **options)
    message = str(caught.value)
    assert message.startswith("toy.npy: ")
    assert "\n" not in message
    return message


def laid_out(array: np.ndarray, axes: str) -> np.ndarray:
    """The array (T, S, H, W[, C]) with its axes in another order."""
    return np.moveaxis(array, range(array.ndim), [axes.index(letter) for letter in "TSHWC"[: array.ndim]])


# --- axes


@pytest.mark.parametrize("axes", ["TSHWC", "HWTSC", "CTSHW", "TSCHW", "WSHTC", "CWHST"])
def test_named_axes_put_every_pixel_in_its_place(axes: str) -> None:
    """A wrong axis swaps views or transposes pictures, and depth is nonsense."""
    light_field = taken(laid_out(RGB, axes), axes=axes.lower())
    np.testing.assert_array_equal(light_field.views, RGB)
    assert not any("axes" in note for note in light_field.notes)


@pytest.mark.parametrize("axes", ["TSHWC", "HWTSC", "CTSHW", "CHWTS"])
def test_axes_of_colour_arrays_are_found_and_said(axes: str) -> None:
    """Users of the common layouts need no flag, and see what was assumed."""
    views = RNG.integers(1, 256, (5, 4, 12, 10, 3), np.uint8)[:, :2] if axes[0] == "C" else RGB
    light_field = taken(laid_out(views, axes))
    np.testing.assert_array_equal(light_field.views, views)
    assert f"axes taken as {' '.join(axes)}; --axes sets them otherwise" in light_field.notes


@pytest.mark.parametrize(
    ("axes", "shape", "views"),
    [
        ("NCHW", (81, 3, 64, 80), (1, 81, 64, 80, 3)),
        ("HWCN", (64, 80, 3, 81), (1, 81, 64, 80, 3)),
        ("HWN", (64, 80, 25), (1, 25, 64, 80, 1)),
        ("NHW", (25, 64, 80), (1, 25, 64, 80, 1)),
        ("TSHWC", (1, 5, 5, 64, 80, 3), (5, 5, 64, 80, 3)),
        ("TSCHW", (1, 1, 5, 5, 3, 64, 80), (5, 5, 64, 80, 3)),
    ],
)
def test_stacks_of_views_and_batches_of_one(axes: str, shape: tuple[int, ...], views: tuple[int, ...]) -> None:
    """As torch, MATLAB and networks' data sets have them."""
    light_field = taken(np.ones(shape, np.uint8))
    assert (light_field.views.shape, light_field.arranged) == (views, "N" not in axes)
    assert f"axes taken as {' '.join(axes)}; --axes sets them otherwise" in light_field.notes


@pytest.mark.parametrize("axes", ["NCHW", "HWCN", "TSHW"])
def test_the_views_tell_colours_from_a_row_of_views(axes: str, tmp_path: Path) -> None:
    """Three colours show no parallax: 25 pictures in colour were read as 25x3 grey views."""
    views = render("curved_occluders", size=64, views=7).views
    stack = views[1:6, 1:6].reshape(25, *views.shape[2:])
    array = views[:, 2:5, :, :, 1] if axes == "TSHW" else np.moveaxis(stack, range(4), [axes.index(a) for a in "NHWC"])
    np.save(tmp_path / "a.npy", array)
    found = read_light_field(tmp_path / "a.npy")
    assert found.grid == ((7, 3) if axes == "TSHW" else (5, 5))
    assert any(f"axes taken as {' '.join(axes)}, for which the views fit together" in note for note in found.notes)


def test_a_grid_that_is_given_tells_colours_from_a_row_of_views() -> None:
    assert taken(np.ones((25, 3, 64, 80), np.uint8), grid=(5, 5)).views.shape == (5, 5, 64, 80, 3)
    assert taken(np.ones((25, 3, 64, 80), np.uint8), grid=(25, 3)).views.shape == (25, 3, 64, 80, 1)


@pytest.mark.parametrize(
    "shape", [(9, 9, 9, 9, 3), (5, 5, 9, 9), (3, 3, 3, 20, 20), (20, 5, 5, 20, 3), (8, 9, 10, 11, 12)]
)
def test_shapes_that_do_not_tell_ask_for_axes(shape: tuple[int, ...]) -> None:
    """A guess here would be wrong half the time."""
    message = refused(np.ones(shape, np.uint8))
    assert "--axes" in message
    assert str(shape) in message


# --- views in one row


REFUSED: list[tuple[np.ndarray, dict[str, Any], str]] = [
    *(
        (RGB, {"axes": axes}, f"--axes {axes}: expected T, S, H and W once each")
        for axes in ("TSHWU", "TTHWC", "HWC", "", "T S H W")
    ),
    (RGB, {"axes": "TSHW"}, "--axes TSHW names 4 axes, the array has 5"),
    *((np.ones(shape, np.uint8), {}, "expected an array of views, of 4 or 5 axes") for shape in ((8,), (2,) * 6)),
    (RGB[:, :0], {"axes": "TSHWC"}, "empty"),
    *((np.ones(RGB.shape, kind), {}, f"values of type {np.dtype(kind)}; expected") for kind in (bool, complex, "U3")),
    # below zero, beyond 16 bit, or a little beyond 1: nobody can know what white is
    *((views, {}, "view 0,0") for views in (RGB * 1000.5, RGB - 130.0, RGB / 60.0, RGB.astype(np.int64) * 1000)),
    (np.full(RGB.shape, 1e300), {}, "0..255 or 0..65535"),
]


@pytest.mark.parametrize(("array", "options", "message"), REFUSED)
def test_what_is_no_light_field_is_refused(array: np.ndarray, options: dict[str, Any], message: str) -> None:
    assert message in refused(array, **options)


@pytest.mark.parametrize("count", [9, 12])
def test_views_in_a_row_wait_for_their_grid(count: int) -> None:
    """Of 12 views nobody knows by the array whether they are 3x4 or 4x3, of 9 not whether they are a cross."""
    views = RNG.integers(1, 256, (count, 20, 24, 3), np.uint8)
    light_field = taken(views, central=9, view=(3, 3), exclude=("4,4",), order="transpose")
    np.testing.assert_array_equal(light_field.views, views[None])
    assert not light_field.arranged
    assert light_field.view is None
    assert light_field.present.all()


def test_views_in_a_row_make_the_grid_that_is_given() -> None:
    views = RNG.integers(1, 256, (12, 20, 24, 3), np.uint8)
    light_field = taken(views, grid=(3, 4))
    assert light_field.arranged
    np.testing.assert_array_equal(light_field.views, views.reshape(3, 4, 20, 24, 3))
    assert "no grid of 5x5" in refused(views, grid=(5, 5))


# --- types and channels


@pytest.mark.parametrize("kind", ["u1", "<u2", ">u2"])
def test_integers_stay_as_they_are(kind: str) -> None:
    """16 bit must not lose its lower half, nor a foreign byte order turn into noise."""
    views = (RGB.astype(kind) * (1 if kind == "u1" else 257)).astype(kind)
    light_field = taken(views)
    assert light_field.views.dtype == (np.uint8 if kind == "u1" else np.uint16)
    np.testing.assert_array_equal(light_field.views, views)


@pytest.mark.parametrize("kind", ["<f2", "<f4", ">f4", "<f8", ">f8"])
def test_floats_become_float32(kind: str) -> None:
    views = (RGB / 255).astype(kind)
    light_field = taken(views)
    assert light_field.views.dtype == np.float32
    np.testing.assert_array_equal(light_field.views, views.astype(np.float32))


@pytest.mark.parametrize("kind", ["<f4", "f8", "i2", ">i4", "i8", "u4", "u8"])
@pytest.mark.parametrize(("integer", "factor"), [(np.uint8, 1), (np.uint16, 128)])
def test_whole_numbers_of_any_type_are_integers(kind: str, integer: type, factor: int) -> None:
    """MATLAB's doubles of 0 to 255, taken as 0..1, would be white all over; NumPy's integers are of 64 bit."""
    views = RGB.astype(integer) * integer(factor)
    light_field = taken(views.astype(kind))
    assert light_field.views.dtype == integer
    np.testing.assert_array_equal(light_field.views, views)
    assert any(f"taken as {8 * np.dtype(integer).itemsize} bit" in note for note in light_field.notes)


@pytest.mark.parametrize(("factor", "white"), [(0.9, 255), (200.5, 65535)])
def test_other_floats_beyond_1_are_parts_of_white(factor: float, white: int) -> None:
    """Resampled pictures are no whole numbers any more."""
    views = RGB * factor
    light_field = taken(views)
    assert light_field.views.dtype == np.float32
    np.testing.assert_allclose(light_field.views, views / white, rtol=1e-6)
    assert any(f"white being {white}" in note for note in light_field.notes)


@pytest.mark.parametrize("kind", ["u2", "i2", "i4", "f4", "f8"])
def test_white_that_is_given_is_the_full_scale(kind: str) -> None:
    """10 bits in wider numbers are nearly black otherwise."""
    views = (RGB * 4.0).astype(kind)
    light_field = taken(views, white=1023)
    full = 65535 if light_field.views.dtype == np.uint16 else 1
    assert full == (65535 if kind in ("u2", "i2") else 1)
    np.testing.assert_allclose(light_field.views / full, views / 1023, atol=1e-5)
    if kind != "f4":
        assert "view 0,0 has values" in refused(views * 2, white=1023)


def test_white_of_pictures_and_own_files(tmp_path: Path) -> None:
    """A flag that did nothing in some formats would leave their maps wrong without a word."""
    views = RGB.astype(np.uint16) * 4
    write_light_field(tmp_path / "own.h5", LightField(views, "own"))
    (tmp_path / "pictures").mkdir()
    for t, s in np.ndindex(T, S):
        write_png(tmp_path / "pictures" / f"{t}_{s}.png", views[t, s])
    expected = taken(views, white=1023).views
    for name in ("own.h5", "pictures"):
        np.testing.assert_array_equal(read(tmp_path / name, ReadOptions(white=1023)).views, expected)
    with pytest.raises(SepiError, match=r"own\.h5: view 0,0 has values from .* within 0 to 100, white being 100"):
        read(tmp_path / "own.h5", ReadOptions(white=100))
    with pytest.raises(SepiError, match=r"options\.white: .*greater than 0, got 0"):
        ReadOptions(white=0)


def test_fourth_channel_is_left_out_and_said() -> None:
    """The Light Field Toolbox's weight, or transparency, is no colour."""
    four = np.concatenate([RGB, RNG.integers(0, 256, (T, S, H, W, 1), np.uint8)], axis=4)
    light_field = taken(four, axes="TSHWC")
    np.testing.assert_array_equal(light_field.views, RGB)
    assert any("4th channel" in note for note in light_field.notes)
    assert not any("4th channel" in note for note in taken(RGB).notes)


# --- missing views


def grid_of(kind: type = np.uint8) -> np.ndarray:
    views = RNG.integers(1, 256, (3, 3, 8, 10, 3), np.uint8)
    return views if kind is np.uint8 else (views / 255).astype(kind)


@pytest.mark.parametrize("padding", [0, np.nan])
def test_views_of_zeros_or_nan_are_missing(padding: float) -> None:
    """Padding in the corners, taken as black pictures, would outvote the real views."""
    views = grid_of(np.float32)
    views[0, 0] = views[2, 2] = padding
    light_field = taken(views)
    assert np.argwhere(~light_field.present).tolist() == [[0, 0], [2, 2]]
    assert any("taken as missing: 0,0 2,2" in note for note in light_field.notes)
    np.testing.assert_array_equal(light_field.views[0, 0], 0)
    np.testing.assert_array_equal(light_field.views[1, 2], views[1, 2])


def test_a_black_centre_view_is_named_with_the_way_out() -> None:
    views = grid_of()
    views[1, 1] = 0
    message = refused(views)
    assert "view 1,1" in message
    assert "--view" in message
    assert taken(views, view=(1, 2)).reference_position == (1, 2)


def test_nan_in_a_view_names_it_and_excluding_it_mends_it() -> None:
    """One NaN spreads over the whole map; views left out must not bring theirs along."""
    views = grid_of(np.float64)
    views[0, 2, 3, 3, 1] = np.nan
    views[2, 0, 0, 0, 0] = np.inf
    assert "view 0,2 holds NaN or infinite values" in refused(views)
    assert "--exclude 0,2" in refused(views)
    assert "--exclude 2,0" in refused(views, exclude=("0,2",))
    light_field = taken(views, exclude=("0,2", "2,0"))
    assert np.argwhere(~light_field.present).tolist() == [[0, 2], [2, 0]]
    assert np.isfinite(light_field.views).all()


# --- arrangement


def test_order_puts_views_in_their_places() -> None:
    light_field = taken(RGB, order="transpose-flip-rows")
    np.testing.assert_array_equal(light_field.views, RGB.transpose(1, 0, 2, 3, 4)[::-1])


def test_the_reference_view_is_the_centre_of_the_grid_as_it_is_ordered() -> None:
    """An even grid has no exact middle; all formats must take the same one of the views about it."""
    views = RNG.integers(1, 256, (4, 4, 8, 10, 3), np.uint8)
    light_field = taken(views, order="flip-both")
    assert light_field.reference_position == (2, 2)
    np.testing.assert_array_equal(light_field.views[light_field.reference_position], views[1, 1])


def test_central_views_and_exclusions_count_in_the_new_grid() -> None:
    views = RNG.integers(1, 256, (5, 7, 16, 20, 3), np.uint8)
    light_field = taken(views, central=3, exclude=("0,1",), view=(2, 2))
    kept = np.delete(views[1:4, 2:5].reshape(9, 16, 20, 3), 1, axis=0)
    np.testing.assert_array_equal(light_field.views[light_field.present], kept)
    assert not light_field.present[0, 1]
    assert light_field.reference_position == (2, 2)


# --- this package's own files


@pytest.fixture
def own(tmp_path: Path) -> Path:
    views = grid_of(np.float32)
    ground_truth = np.arange(80, dtype=np.float32).reshape(8, 10)
    write_light_field(tmp_path / "own.h5", LightField(views, "own", ground_truth=ground_truth))
    return tmp_path / "own.h5"


def test_excluded_views_of_own_files_are_gone(own: Path) -> None:
    """What is left out must not reach a later stage by another way."""
    light_field = read(own, ReadOptions(exclude=("0,1",), order="flip-rows"))
    assert np.argwhere(~light_field.present).tolist() == [[0, 1]]
    assert not light_field.views[0, 1].any()
    with h5py.File(own) as file:
        np.testing.assert_array_equal(light_field.views[2], file["views"][0])
        np.testing.assert_array_equal(light_field.ground_truth, file["ground_truth"])


@pytest.mark.parametrize("name", ["views", "present", "ground_truth"])
def test_own_files_that_claim_more_than_they_hold(own: Path, name: str) -> None:
    """A file of 2 KB may claim terabytes of fill values."""
    with changed(own) as file:
        del file[name]
        file.create_dataset(name, (9, 9, 100_000, 100_000, 3), np.uint8)
    with pytest.raises(SepiError, match=f"own.h5: damaged HDF5 file: '{name}' .* cannot lie in 0 bytes"):
        read(own, ReadOptions())


# --- damaged files of every format


def _mat_7_3(path: Path) -> None:
    with h5py.File(path, "w", userblock_size=512) as file:
        file.create_dataset("LF", data=RGB.T, chunks=(3, 5, 4, 3, 2), compression="gzip")
        file["LF"].attrs["MATLAB_class"] = np.bytes_("uint8")
    with path.open("r+b") as file:
        file.write(b"MATLAB 7.3 MAT-file".ljust(124) + b"\x00\x02IM")


def _hci_2013(path: Path) -> None:
    with h5py.File(path, "w") as file:
        file["LF"] = RGB
        file["GT_DEPTH"] = np.ones(RGB.shape[:4], np.float32)
        file.attrs.update(dH=0.1, focalLength=100.0, shift=1.0)


WRITERS = {
    "a.npy": lambda path: np.save(path, RGB),
    "a.npz": lambda path: np.savez(path, LF=RGB, other=np.ones(3)),
    "compressed.npz": lambda path: np.savez_compressed(path, LF=RGB),
    "a.mat": lambda path: scipy.io.savemat(path, {"LF": RGB, "other": {"field": 1}}),
    "compressed.mat": lambda path: scipy.io.savemat(path, {"LF": RGB, "other": 2.0}, do_compression=True),
    "v73.mat": _mat_7_3,
    "old.h5": _hci_2013,
}
# an extension reads MATLAB's files and those of the first HCI benchmark
NAMES = [name for name in WRITERS if not (name.endswith(".mat") or name == "old.h5") or "matlab" in FORMATS]


@pytest.fixture(scope="module")
def whole(tmp_path_factory: pytest.TempPathFactory) -> dict[str, bytes]:
    """Small undamaged files."""
    folder = tmp_path_factory.mktemp("whole")
    for name, write in WRITERS.items():
        write(folder / name)
    return {name: (folder / name).read_bytes() for name in WRITERS}


@pytest.mark.parametrize("name", NAMES)
def test_flags_for_other_formats_are_refused(name: str, whole: dict[str, bytes], tmp_path: Path) -> None:
    """A flag that does nothing would make the user think it did."""
    path = tmp_path / name
    path.write_bytes(whole[name])
    with pytest.raises(SepiError, match="--pattern does not apply"):
        read(path, ReadOptions(pattern="view{number}.png"))


@pytest.mark.parametrize("name", NAMES)
def test_formats_are_told_by_content(name: str, whole: dict[str, bytes], tmp_path: Path) -> None:
    """The files that users have are not always named as their format wants it."""
    path = tmp_path / "unnamed"
    path.write_bytes(whole[name])
    np.testing.assert_array_equal(read(path, ReadOptions()).views, RGB)
