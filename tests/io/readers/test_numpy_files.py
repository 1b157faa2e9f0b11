"""NumPy files: the arrays in them, pixel for pixel, and nothing taken on the word of a header."""

import functools
import resource
import struct
import zipfile
from pathlib import Path

import error_lines
import numpy as np
import pytest

from sepi.io.readers.formats import format_of, read
from sepi.io.readers.options import ReadOptions
from sepi.lightfield import LightField

RNG = np.random.default_rng(5)
LF = RNG.integers(1, 256, (2, 5, 12, 14, 3), np.uint8)

SAVERS = {
    "npy": lambda path, array: np.save(path, array),
    "npz": lambda path, array: np.savez(path, views=array, angles=np.ones(5)),
    "compressed npz": lambda path, array: np.savez_compressed(path, views=array),
}
saver = pytest.mark.parametrize("kind", SAVERS)

CASES = {
    "TSHWC": LF,
    "Fortran order": np.asfortranarray(LF),
    "HWTSC": LF.transpose(2, 3, 0, 1, 4),
    "grey": LF[..., 0],
    "big-endian": LF.astype(">u2") * 257,
    "float32": (LF / 255).astype(np.float32),
    "float64": LF / 255,
}


def taken(path: Path, **options: object) -> LightField:
    assert format_of(path).name == "NumPy file"
    return read(path, ReadOptions(**options))


refused = functools.partial(error_lines.refused, file_format="numpy")


@saver
@pytest.mark.parametrize("case", CASES)
def test_every_pixel_is_read(tmp_path: Path, kind: str, case: str) -> None:
    path = tmp_path / f"scene.{kind[-3:]}"
    array = CASES[case]
    SAVERS[kind](path, array)
    light_field = taken(path)
    expected = array.transpose(2, 3, 0, 1, 4) if case == "HWTSC" else array
    np.testing.assert_array_equal(light_field.views.squeeze(), expected.astype(light_field.views.dtype))
    assert light_field.views.dtype == (np.float32 if array.dtype.kind == "f" else array.dtype.newbyteorder("="))
    assert light_field.views.flags.c_contiguous
    assert light_field.name == "scene"


def test_one_of_several_arrays(tmp_path: Path) -> None:
    other = 255 - LF // 2
    np.savez(tmp_path / "two.npz", left=LF, right=other, meta=np.array({"a": 1}, object))
    assert "--variable: left 2x5x12x14x3, right 2x5x12x14x3" in refused(tmp_path / "two.npz")
    np.testing.assert_array_equal(taken(tmp_path / "two.npz", variable="right").views, other)
    assert "known: left, right" in refused(tmp_path / "two.npz", variable="middle")
    assert "Python objects" in refused(tmp_path / "two.npz", variable="meta")
    np.savez(tmp_path / "lf.npz", LF=LF, right=other)
    np.testing.assert_array_equal(taken(tmp_path / "lf.npz").views, LF)
    np.savez(tmp_path / "none.npz", angles=np.ones((3, 4)))
    assert "found: angles 3x4" in refused(tmp_path / "none.npz")
    np.save(tmp_path / "one.npy", LF)
    assert "--variable: unknown 'LF'" in refused(tmp_path / "one.npy", variable="LF")


class _Trap:
    """What runs when it is unpickled."""

    def __reduce__(self) -> tuple[object, tuple[str]]:
        return Path.touch, (Path("trapped"),)


def test_pickles_are_never_opened(here: Path) -> None:
    """A file of Python objects can run any program."""
    trap = np.array([_Trap()], object).reshape(1, 1, 1, 1)
    np.save(here / "trap.npy", trap)
    np.savez(here / "trap.npz", LF=trap)
    assert "Python objects, which may be any program" in refused(here / "trap.npy")
    assert "Python objects, which may be any program" in refused(here / "trap.npz", variable="LF")
    refused(here / "trap.npz")
    assert not (here / "trapped").exists()


def header(shape: tuple[int, ...], descr: str = "|u1", version: int = 1) -> bytes:
    text = f"{{'descr': '{descr}', 'fortran_order': False, 'shape': {shape}, }}\n".encode()
    return b"\x93NUMPY" + bytes([version, 0]) + struct.pack("<H" if version == 1 else "<I", len(text)) + text


@pytest.mark.parametrize(
    "shape", [(9, 9, 100_000, 100_000, 3), (2, 5, 12, 14, 4), (2, 5, -12, -14, 3), (2**62, 2**62, 4, 4, 3)]
)
def test_shapes_that_the_file_does_not_hold(tmp_path: Path, shape: tuple[int, ...]) -> None:
    """No memory may be taken on the word of a header."""
    content = header(shape) + LF.tobytes()
    before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    (tmp_path / "lie.npy").write_bytes(content)
    assert "not a NumPy file, or damaged" in refused(tmp_path / "lie.npy")
    for method in (zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED):
        with zipfile.ZipFile(tmp_path / "lie.npz", "w", method) as archive:
            archive.writestr("LF.npy", content)
        assert "not a NumPy file, or damaged" in refused(tmp_path / "lie.npz")
    assert resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before < 500_000  # KB


def test_records_and_other_content_are_refused(tmp_path: Path) -> None:
    np.save(tmp_path / "records.npy", np.zeros((2, 3, 8, 10), [("r", "u1"), ("g", "u1")]))
    assert "found: records 2x3x8x10 of [" in refused(tmp_path / "records.npy")
    for name, content in {"text.npy": b"views\n", "empty.npy": b"", "text.npz": b"views\n", "empty.npz": b""}.items():
        (tmp_path / name).write_bytes(content)
        assert "not a NumPy file" in refused(tmp_path / name)
    with zipfile.ZipFile(tmp_path / "pictures.npz", "w") as archive:
        archive.writestr("readme.txt", "views")
    assert "found: nothing" in refused(tmp_path / "pictures.npz")
