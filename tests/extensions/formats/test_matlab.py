"""MATLAB files of both kinds: what MATLAB shows is what is read, pixel for pixel."""

import resource
import struct
import zlib
from pathlib import Path

import h5py
import numpy as np
import pytest
import scipy.io
from error_lines import refused

from sepi.errors import SepiError
from sepi.io.readers.formats import format_of, read, size_of
from sepi.io.readers.options import ReadOptions
from sepi.lightfield import LightField

RNG = np.random.default_rng(3)
LF = RNG.integers(1, 256, (2, 5, 12, 14, 3), np.uint8)


def taken(path: Path, **options: object) -> LightField:
    assert format_of(path).name == "MATLAB file"
    return read(path, ReadOptions(**options))


def save_7_3(path: Path, arrays: dict[str, np.ndarray], *, header: bool = True, classes: bool = True) -> None:
    """Write by h5py what MATLAB writes: axes in reverse, a class for each array, a header in the first 512 bytes."""
    names = {"float64": "double", "float32": "single"}
    with h5py.File(path, "w", userblock_size=512 if header else 0) as file:
        for name, array in arrays.items():
            file.create_dataset(name, data=array.T, chunks=True, compression="gzip", compression_opts=3)
            if classes:
                file[name].attrs["MATLAB_class"] = np.bytes_(names.get(array.dtype.name, array.dtype.name))
    if header:
        with path.open("r+b") as file:
            text = b"MATLAB 7.3 MAT-file, Platform: GLNXA64, Created on: Thu Jan  1 00:00:00 2015 HDF5 schema 1.00 ."
            file.write(text.ljust(124) + b"\x00\x02IM")


SAVERS = {
    "5": lambda path, arrays: scipy.io.savemat(path, arrays),
    "5 compressed": lambda path, arrays: scipy.io.savemat(path, arrays, do_compression=True),
    "7.3": save_7_3,
    "7.3 without header": lambda path, arrays: save_7_3(path, arrays, header=False),
    "7.3 without classes": lambda path, arrays: save_7_3(path, arrays, classes=False),
}
saver = pytest.mark.parametrize("save", SAVERS.values(), ids=SAVERS)

CASES = {
    "TSHWC": (LF, None),
    "HWTSC": (LF.transpose(2, 3, 0, 1, 4), None),
    "SCWHT": (LF.transpose(1, 4, 3, 2, 0), "SCWHT"),
    "double": (LF / 255, None),
    "single": ((LF / 255).astype(np.float32), None),
}


@saver
@pytest.mark.parametrize("case", CASES)
def test_what_matlab_shows_is_read(tmp_path: Path, save, case: str) -> None:
    """Axes in reverse, or values of another type, make depth nonsense."""
    array, axes = CASES[case]
    save(tmp_path / "scene.mat", {"LF": array})
    light_field = taken(tmp_path / "scene.mat", axes=axes)
    order = {"HWTSC": (2, 3, 0, 1, 4), "SCWHT": (4, 0, 3, 2, 1)}.get(case, (0, 1, 2, 3, 4))
    expected = array.transpose(order)
    np.testing.assert_array_equal(light_field.views, expected.astype(light_field.views.dtype))
    assert light_field.views.dtype == (np.float32 if array.dtype.kind == "f" else array.dtype)
    assert light_field.name == "scene"


@saver
def test_light_field_toolbox(tmp_path: Path, save) -> None:
    """The toolbox saves 16 bit with a weight as fourth channel, and zeros in the corners of the grid."""
    views = RNG.integers(1, 2**16, (5, 5, 12, 14, 4), np.uint16)
    views[0, 0] = views[4, 0] = 0
    save(tmp_path / "IMG__Decoded.mat", {"LF": views, "RectOptions": np.ones((3, 3))})
    light_field = taken(tmp_path / "IMG__Decoded.mat")
    np.testing.assert_array_equal(light_field.views, views[..., :3])
    assert np.argwhere(~light_field.present).tolist() == [[0, 0], [4, 0]]
    assert [note.split(" (")[0] for note in light_field.notes] == [
        "axes taken as T S H W C; --axes sets them otherwise",
        "4th channel",
        "views that are all zeros taken as missing: 0,0 4,0",
    ]


@saver
def test_grey_views_have_no_axis_of_colours(tmp_path: Path, save) -> None:
    """MATLAB drops axes of size 1 at the end, whatever the user calls them."""
    save(tmp_path / "grey.mat", {"LF": LF[..., 0]})
    for axes in (None, "TSHW", "TSHWC"):
        np.testing.assert_array_equal(taken(tmp_path / "grey.mat", axes=axes).views, LF[..., :1])


@saver
def test_one_of_several_arrays(tmp_path: Path, save) -> None:
    """Which array is read must not be a matter of chance."""
    other = 255 - LF // 2
    save(tmp_path / "one.mat", {"views": LF, "matrix": np.ones((3, 3))})
    np.testing.assert_array_equal(taken(tmp_path / "one.mat").views, LF)
    save(tmp_path / "two.mat", {"before": other, "LF": LF})
    np.testing.assert_array_equal(taken(tmp_path / "two.mat").views, LF)
    np.testing.assert_array_equal(taken(tmp_path / "two.mat", variable="before").views, other)
    assert "did you mean 'before'?" in refused(tmp_path / "two.mat", variable="befor")
    save(tmp_path / "unclear.mat", {"left": LF, "right": other})
    assert "--variable: left 2x5x12x14x3, right 2x5x12x14x3" in refused(tmp_path / "unclear.mat")
    save(tmp_path / "none.mat", {"matrix": np.ones((3, 3))})
    assert "no array of numbers of 4 or 5 axes (found: matrix 3x3)" in refused(tmp_path / "none.mat")


def test_other_classes_are_passed_over(tmp_path: Path) -> None:
    """Text, structures, cells and logical arrays stand beside the views in real files."""
    others = {
        "text": "words",
        "cell": np.array([1, "a"], object),
        "struct": {"LF": LF},
        "mask": np.ones((2, 3, 8, 10), bool),
        "complex": LF[..., 0] * 1j,
    }
    for compressed in (False, True):
        scipy.io.savemat(tmp_path / "mixed.mat", {**others, "views": LF}, do_compression=compressed)
        np.testing.assert_array_equal(taken(tmp_path / "mixed.mat").views, LF)
    save_7_3(tmp_path / "mixed73.mat", {"views": LF})
    with h5py.File(tmp_path / "mixed73.mat", "a") as file:
        file["structure/LF"] = LF.T
        file["mask"] = np.ones((10, 8, 3, 2), np.uint8)
        file["mask"].attrs["MATLAB_class"] = np.bytes_("logical")
        file["gone"] = h5py.SoftLink("/nowhere")
    np.testing.assert_array_equal(taken(tmp_path / "mixed73.mat").views, LF)


def in_structures(arrays: dict[str, np.ndarray]) -> dict[str, object]:
    """Arrays by paths, as structures of version 5 are written."""
    found: dict[str, object] = {}
    for path, array in arrays.items():
        *above, name = path.split("/")
        inner = found
        for group in above:
            inner = inner.setdefault(group, {})
        inner[name] = array
    return found


@pytest.mark.parametrize("kind", SAVERS)
def test_structures_hold_the_light_field(tmp_path: Path, kind: str) -> None:
    """Toolboxes save all that they know in one structure."""
    path = tmp_path / "a.mat"

    def put(arrays: dict[str, np.ndarray]) -> None:
        SAVERS[kind](path, arrays if "7.3" in kind else in_structures(arrays))

    small = {"scene/time": np.ones((1, 1)), "scene/lf/dark": np.zeros((8, 10), np.uint8), "matrix": np.eye(3)}
    put({**small, "scene/lf/views": LF / 255})
    np.testing.assert_array_equal(taken(path).views, (LF / 255).astype(np.float32))
    assert size_of([path]) == (10, 12, 14, 24)
    other = LF[::-1, ..., 0].astype(np.uint16) * 257
    put({**small, "scene/lf/views": LF, "scene/lf/right": other})
    np.testing.assert_array_equal(taken(path, variable="scene/lf/right").views[..., 0], other)
    listed = refused(path)
    assert "choose one with --variable" in listed
    assert {"scene/lf/views 2x5x12x14x3", "scene/lf/right 2x5x12x14"} == set(
        listed.split("--variable: ")[1].split(", ")
    )
    put({**small, "scene/LF": LF, "scene/GT": other})
    np.testing.assert_array_equal(taken(path).views, LF)


def save_cells(path: Path, cells: np.ndarray) -> None:
    """A cell array as MATLAB writes it in version 7.3: references, in reverse order as all axes are."""
    save_7_3(path, {"gain": np.ones((2, 2))})
    with h5py.File(path, "r+") as file:
        entry = file.create_dataset("views", cells.shape[::-1], h5py.ref_dtype)
        entry.attrs["MATLAB_class"] = np.bytes_("cell")
        for place in np.ndindex(cells.shape):
            name = "#refs#/" + "_".join(map(str, place))
            file[name] = cells[place].T
            file[name].attrs["MATLAB_class"] = np.bytes_("uint8")
            entry[place[::-1]] = file[name].ref


@pytest.mark.parametrize("save", [save_cells, lambda path, cells: scipy.io.savemat(path, {"views": cells})])
@pytest.mark.parametrize("row", [False, True])
def test_cells_of_pictures_are_a_light_field(tmp_path: Path, save, row: bool) -> None:
    """MATLAB's users keep views so; each must come out at its own place."""
    cells = np.empty((1, 10) if row else (2, 5), object)
    for place in np.ndindex(2, 5):
        cells[(0, place[0] * 5 + place[1]) if row else place] = LF[place]
    save(tmp_path / "a.mat", cells)
    light_field = taken(tmp_path / "a.mat")
    np.testing.assert_array_equal(light_field.views, LF.reshape(1, 10, *LF.shape[2:]) if row else LF)
    assert light_field.arranged is not row
    cells[0, 1] = cells[0, 1][:-1]
    save(tmp_path / "a.mat", cells)
    assert "no array of numbers" in refused(tmp_path / "a.mat")


def test_structures_of_version_5_hold_anything(tmp_path: Path) -> None:
    """Text, cells, empty and complex values, and several structures in one."""
    scene = {"text": "words", "cell": np.array([1, "a"], object), "none": np.zeros((0, 0)), "z": LF[..., 0] * 1j}
    for compressed in (False, True):
        scipy.io.savemat(tmp_path / "a.mat", {"scene": {**scene, "v": LF, "end": 1.5}}, do_compression=compressed)
        np.testing.assert_array_equal(taken(tmp_path / "a.mat").views, LF)
    several = np.zeros((1, 2), [("v", object), ("n", object)])
    several[0, 0], several[0, 1] = (LF, 1), (LF[::-1], "b")
    scipy.io.savemat(tmp_path / "a.mat", {"scenes": several})
    assert "--variable: scenes(1)/v 2x5x12x14x3, scenes(2)/v 2x5x12x14x3" in refused(tmp_path / "a.mat")
    np.testing.assert_array_equal(taken(tmp_path / "a.mat", variable="scenes(2)/v").views, LF[::-1])
    content = (tmp_path / "a.mat").read_bytes()
    dims = struct.pack("<5i", *LF.shape)
    (tmp_path / "a.mat").write_bytes(content.replace(dims, struct.pack("<5i", 9, *LF.shape[1:])))
    assert "damaged" in refused(tmp_path / "a.mat", variable="scenes(2)/v")


@pytest.mark.parametrize("name", ["views", "disparity", "LF/data", "light_field"])
def test_a_name_that_this_package_uses_is_no_sign_of_its_files(tmp_path: Path, name: str) -> None:
    """Others call their arrays so; a file is known by its attributes, and with a map beside by its axes."""
    with h5py.File(tmp_path / "a.h5", "w") as file:
        file[name] = LF.transpose(0, 1, 4, 2, 3)[None]
        file["label"] = np.ones((1, 12, 14), np.float32)
    np.testing.assert_array_equal(read(tmp_path / "a.h5", ReadOptions()).views, LF)
    with h5py.File(tmp_path / "b.h5", "w") as file:
        file["Hr_SAI_y"] = np.ones((60, 70), np.float32)
    with pytest.raises(SepiError, match=r"b\.h5: holds no array .* Hr_SAI_y 60x70.* --format mosaic"):
        format_of(tmp_path / "b.h5")


@pytest.mark.parametrize("name", ["lightfield", "data/views"])
def test_hdf5_of_other_programs_with_one_array(tmp_path: Path, name: str) -> None:
    """Names are each program's own; only MATLAB's axes are in reverse."""
    with h5py.File(tmp_path / "a.h5", "w") as file:
        file[name] = LF
        file["calibration"] = np.ones((3, 3))
    assert format_of(tmp_path / "a.h5").name == "HDF5 file"
    np.testing.assert_array_equal(read(tmp_path / "a.h5", ReadOptions()).views, LF)
    assert size_of([tmp_path / "a.h5"]) == (10, 12, 14, 3)
    with h5py.File(tmp_path / "a.h5", "a") as file:
        file[f"{name}2"] = LF[::-1]
    assert "choose one with --variable" in refused(tmp_path / "a.h5")
    np.testing.assert_array_equal(read(tmp_path / "a.h5", ReadOptions(variable=f"{name}2")).views, LF[::-1])


def test_other_programs_hdf5_is_as_they_show_it(tmp_path: Path) -> None:
    """An HDF5 file that is only called .mat was not written in reverse."""
    with h5py.File(tmp_path / "python.mat", "w") as file:
        file["LF"] = LF
    np.testing.assert_array_equal(taken(tmp_path / "python.mat").views, LF)


def element(order: str, kind: int, data: bytes) -> bytes:
    return struct.pack(order + "II", kind, len(data)) + data + bytes(-len(data) % 8)


def version_5(order: str, *, dims: tuple[int, ...], kind: int, stored: int, data: bytes, packed: bool) -> bytes:
    """A file with one variable LF, made by hand from the format's description."""
    matrix = element(order, 6, struct.pack(order + "II", kind, 0))
    matrix += element(order, 5, struct.pack(f"{order}{len(dims)}i", *dims))
    # a name of up to four letters stands in the tag itself
    matrix += struct.pack(order + "I", 2 << 16 | 1) + b"LF\0\0"
    matrix += element(order, stored, data)
    content = element(order, 14, matrix)
    if packed:
        content = struct.pack(order + "II", 15, len(zlib.compress(content))) + zlib.compress(content)
    mark = b"\x00\x01IM" if order == "<" else b"\x01\x00MI"
    return b"MATLAB 5.0 MAT-file, by hand".ljust(124) + mark + content


@pytest.mark.parametrize("packed", [False, True])
@pytest.mark.parametrize("order", ["<", ">"])
def test_small_16_bit_values_stored_as_bytes_stay_16_bit(tmp_path: Path, order: str, packed: bool) -> None:
    """MATLAB stores dark 16 bit pictures in 8 bits each; read as 8 bit they would be 256 times too bright."""
    content = version_5(order, dims=LF.shape, kind=11, stored=2, data=LF.tobytes("F"), packed=packed)
    (tmp_path / "dark.mat").write_bytes(content)
    light_field = taken(tmp_path / "dark.mat")
    assert light_field.views.dtype == np.uint16
    np.testing.assert_array_equal(light_field.views, LF)


@pytest.mark.parametrize("packed", [False, True])
def test_shape_and_length_that_agree_on_a_lie(tmp_path: Path, packed: bool) -> None:
    """Both stand in the header; what counts is the file."""
    honest = version_5("<", dims=LF.shape, kind=9, stored=2, data=LF.tobytes("F"), packed=False)[128:]
    claimed = (2, 3, 8000, 10000, 3)
    lie = honest.replace(struct.pack("<5i", *LF.shape), struct.pack("<5i", *claimed))
    lie = lie.replace(struct.pack("<I", LF.size), struct.pack("<I", np.prod(claimed)))
    if packed:
        lie = struct.pack("<II", 14, 2_000_000_000) + lie[8:]
        lie = struct.pack("<II", 15, len(zlib.compress(lie))) + zlib.compress(lie)
    (tmp_path / "lie.mat").write_bytes(b"MATLAB 5.0 MAT-file".ljust(124) + b"\x00\x01IM" + lie)
    before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    assert "not a MATLAB file, or damaged" in refused(tmp_path / "lie.mat")
    assert resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before < 500_000  # KB


def test_values_in_another_file_are_refused(tmp_path: Path) -> None:
    """A file from elsewhere must not make this program read others."""
    np.tile(LF, 1).tofile(tmp_path / "secret")
    with h5py.File(tmp_path / "external.mat", "w") as file:
        file.create_dataset("LF", LF.shape, np.uint8, external=[(str(tmp_path / "secret"), 0, LF.size)])
    assert "lie in another file" in refused(tmp_path / "external.mat")
    with h5py.File(tmp_path / "other.h5", "w") as file:
        file["LF"] = LF
    with h5py.File(tmp_path / "linked.mat", "w") as file:
        file["LF"] = h5py.ExternalLink("other.h5", "/LF")
    assert "lie in another file" in refused(tmp_path / "linked.mat")


CHANNELS = {
    "lower case": ("lfr", "lfg", "lfb"),
    "words": ("red_views", "green_views", "blue_views"),
}


@pytest.mark.parametrize("case", CHANNELS)
def test_three_arrays_may_be_the_colours_of_one_light_field(tmp_path: Path, case: str) -> None:
    """Taken one by one they are three grey light fields, each with a third of what tells surfaces apart."""
    names = CHANNELS[case]
    views = np.random.default_rng(1).integers(1, 255, (2, 5, 12, 14, 3), np.uint8)
    # not in the order of the channels
    arrays = {name: views[..., channel].astype(float) for channel, name in reversed(list(enumerate(names)))}
    scipy.io.savemat(tmp_path / "a.mat", arrays)
    light_field = read(tmp_path / "a.mat", ReadOptions())
    np.testing.assert_array_equal(light_field.views, views)
    assert f"the arrays {', '.join(names)} are taken as red, green and blue" in light_field.notes
    one = read(tmp_path / "a.mat", ReadOptions(variable=names[1]))
    np.testing.assert_array_equal(one.views, views[..., 1:2])
    turned = {name: array.transpose(2, 3, 0, 1) for name, array in arrays.items()}
    np.savez(tmp_path / "a.npz", **turned)
    np.testing.assert_array_equal(read(tmp_path / "a.npz", ReadOptions(axes="HWTS")).views, views)
