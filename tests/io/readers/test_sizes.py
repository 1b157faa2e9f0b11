"""Sizes from headers: what the workflow asks memory for must hold the views, however small they are packed."""

import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import h5py
import numpy as np
import pytest
import scipy.io
from PIL import Image

from sepi.io.hdf5 import write_light_field
from sepi.io.readers.formats import FORMATS, Size, size_of
from sepi.lightfield import LightField
from sepi.workflow.datasets import own_scene


def matlab_7_3(path: Path, views: np.ndarray) -> None:
    with h5py.File(path, "w") as file:
        file.create_dataset("LF", data=views.T, chunks=True, compression="gzip")
        file["LF"].attrs["MATLAB_class"] = np.bytes_({"f": "double", "u": "uint8"}[views.dtype.kind])


def hci_2013(path: Path, views: np.ndarray) -> None:
    with h5py.File(path, "w") as file:
        file.create_dataset("LF", data=views, compression="gzip")


WRITERS: dict[str, Callable[[Path, np.ndarray], object]] = {
    "a.npy": np.save,
    "a.npz": lambda path, views: np.savez_compressed(path, small=np.ones((2, 2, 3, 3)), LF=views),
    "v5.mat": lambda path, views: scipy.io.savemat(path, {"LF": views, "text": "a"}, do_compression=True),
    "v73.mat": matlab_7_3,
    "old.h5": hci_2013,
    "own.h5": lambda path, views: write_light_field(path, LightField(views.astype(np.float32), "a")),
}
# an extension reads MATLAB's files and those of the first HCI benchmark
NAMES = [name for name in WRITERS if not (name.endswith(".mat") or name == "old.h5") or "matlab" in FORMATS]


def compressible(*shape: int) -> np.ndarray:
    """Views of float64 that shrink to a hundredth of their size."""
    return np.broadcast_to(np.linspace(0, 1, shape[3])[:, None], shape).copy()


@pytest.mark.parametrize("name", NAMES)
def test_arrays_are_as_large_as_they_are_unpacked(tmp_path: Path, name: str) -> None:
    WRITERS[name](tmp_path / name, compressible(3, 5, 60, 64, 3))
    assert size_of([tmp_path / name]) == Size(15, 60, 64, 12 if name == "own.h5" else 24)


@pytest.mark.parametrize(
    ("shape", "expected"),
    [
        ((60, 64, 5, 7, 3), Size(35, 60, 64, 3)),
        ((9, 60, 64, 3), Size(9, 60, 64, 3)),
        ((60, 64, 9, 9), Size(81, 60, 64, 1)),
    ],
)
def test_axes_of_any_order(tmp_path: Path, shape: tuple[int, ...], expected: Size) -> None:
    np.save(tmp_path / "a.npy", np.zeros(shape, np.uint8))
    assert size_of([tmp_path / "a.npy"]) == expected


def test_pictures_of_views(tmp_path: Path) -> None:
    files = [tmp_path / f"view{number}.png" for number in range(4)]
    for path in files:
        Image.fromarray(np.zeros((30, 40), np.uint16)).save(path)
    assert size_of(files) == Size(4, 30, 40, 2)


@pytest.mark.parametrize("content", [b"", b"\x93NUMPY", b"PK\x03\x04", b"MATLAB 5.0 MAT-file", b"\x89HDF\r\n\x1a\n"])
@pytest.mark.parametrize("ending", ["npy", "npz", "mat", "h5", "png"])
def test_what_is_not_understood_is_left_to_the_reader(tmp_path: Path, content: bytes, ending: str) -> None:
    (tmp_path / f"a.{ending}").write_bytes(content + bytes(3 * 81 * 100))
    assert size_of([tmp_path / f"a.{ending}"]) == Size(81, 10, 10)
    assert size_of([tmp_path / f"a.{ending}"] * 2).height >= 10


def test_a_size_that_the_file_cannot_hold_is_not_believed(tmp_path: Path) -> None:
    """A job that asks for terabytes never runs, and nobody learns what is wrong with the file."""
    with h5py.File(tmp_path / "huge.h5", "w") as file:
        file.create_dataset("LF", (9, 9, 100_000, 100_000, 3), np.uint8)
    assert size_of([tmp_path / "huge.h5"]).height < 10_000


# the package is loaded once; what a fork of it holds at most begins at what it holds at first
PEAK = """
import os
import sys
from sepi.process.command import peak_memory_mb
from sepi.io.readers.formats import read
from sepi.io.readers.options import ReadOptions
from pathlib import Path
import scipy.io
for pair in zip(sys.argv[1::2], sys.argv[2::2]):
    child = os.fork()
    if child == 0:
        for name in pair:
            read(Path(name), ReadOptions())
            print(peak_memory_mb(), flush=True)
        os._exit(0)
    assert os.waitpid(child, 0)[1] == 0
"""


@pytest.mark.slow
def test_reading_takes_no_more_than_ingest_asks_for(tmp_path: Path) -> None:
    """Killed for want of memory, a job says nothing about why; the numbers are those of ``rules/ingest.smk``."""
    large = compressible(5, 5, 240, 240, 3)
    names = [name for name in NAMES if name != "own.h5"]
    pairs = [(tmp_path / f"small-{name}", tmp_path / f"large-{name}") for name in names]
    for name, pair in zip(names, pairs, strict=True):
        for path, views in zip(pair, (large[:2, :2, :16, :16], large), strict=True):
            WRITERS[name](path, views)
    words = [str(path) for pair in pairs for path in pair]
    done = subprocess.run([sys.executable, "-c", PEAK, *words], capture_output=True, text=True, check=True)
    peaks = list(map(float, done.stdout.split()))
    unpacked = large.nbytes / 2**20
    for (_, path), before, after in zip(pairs, peaks[::2], peaks[1::2], strict=True):
        scene = own_scene("a", path, (), "config")
        assert scene.samples * scene.pixel_bytes == large.nbytes, path
        # beside what Python and its libraries take; the least that there can be shows that the peak was seen
        assert unpacked < after - before < scene.memory_mb(12, copies=3) - 300, path
