"""Bad input of every kind, given to ``sepi depth`` as a user would: one clear line, exit code 1, nothing written."""

import os
import tempfile
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import cv2
import h5py
import numpy as np
import pytest
import scipy.io
from click.testing import CliRunner
from error_lines import done, error_of, reading_error

from sepi.cli.main import main
from sepi.report.runs import read_numbers
from sepi.scenes import render

SCENE = render("dots", size=64, views=3)
VIEWS = SCENE.views

Spoil = Callable[[], object]


def pictures(names: str = "view_{t}_{s}.png", views: np.ndarray = VIEWS, folder: str = "in") -> list[Path]:
    """A folder of views, written by OpenCV."""
    Path(folder).mkdir()
    paths = []
    for t, s in np.ndindex(views.shape[:2]):
        paths.append(Path(folder, names.format(t=t, s=s, n=t * views.shape[1] + s)))
        assert cv2.imwrite(str(paths[-1]), views[t, s][:, :, ::-1])
    return paths


def cut(path: Path, part: float = 0.5) -> None:
    path.write_bytes(path.read_bytes()[: int(path.stat().st_size * part)])


def npy(array: np.ndarray = VIEWS, name: str = "in.npy") -> Path:
    np.save(name, array)
    return Path(name)


def mat(name: str = "in.mat", **arrays: Any) -> Path:
    scipy.io.savemat(name, arrays or {"LF": VIEWS}, do_compression=True)
    return Path(name)


def hdf5(make: Callable[[h5py.File], object], name: str = "in.h5") -> Path:
    with h5py.File(name, "w") as file:
        make(file)
    return Path(name)


def one_view_only() -> None:
    for path in pictures()[1:]:
        path.unlink()


# what is made, the words after `sepi depth`, and what the one line must say. Of each kind of input some: its reader has
# tests of all that may be wrong with it
CASES: dict[str, tuple[Spoil, str, tuple[str, ...]]] = {
    # pictures
    "picture cut off": (lambda: cut(pictures()[4]), "in", ("view_1_1.png", "cut off")),
    # names and grids
    "nothing there": (lambda: None, "in", ("in: no such file or folder",)),
    "one view": (one_view_only, "in", ("in", "known format")),
    "grid that is no grid of that many": (lambda: pictures("img{n}.png"), "in --grid 2x3", ("in", "2x3")),
    # what the views show
    "all black": (lambda: pictures(views=np.zeros_like(VIEWS)), "in", ("in", "black")),
    "of one colour": (lambda: pictures(views=np.full_like(VIEWS, 90)), "in", ("in", "one colour")),
    "copies of one view": (
        lambda: pictures(views=np.broadcast_to(VIEWS[1, 1], VIEWS.shape)),
        "in",
        ("in", "all 9 views are the same picture"),
    ),
    # arrays
    "npy cut off": (lambda: cut(npy()), "in.npy", ("in.npy",)),
    # HDF5
    "HDF5 cut off": (lambda: cut(hdf5(lambda f: f.create_dataset("LF", data=VIEWS))), "in.h5", ("in.h5",)),
    # flags
    "unknown format": (npy, "in.npy --format nmupy", ("did you mean 'numpy'",)),
    "reference view left out": (npy, "in.npy --exclude 1,1", ("in.npy", "(1, 1) is missing")),
    "file left out that is not there": (pictures, "in --exclude x.png", ("x.png",)),
    "middle larger than the grid": (npy, "in.npy --central 5", ("in.npy", "5x5")),
    "flag of another format": (pictures, "in --axes TSHWC", ("in", "--axes")),
    "inverted range": (npy, "in.npy --disparity-range 2 1", ("MIN < MAX",)),
    "unknown variant": (npy, "in.npy --variant papr", ("did you mean 'paper'",)),
    "unknown parameter": (npy, "in.npy --set initial.semi_global.candidate=9", ("did you mean",)),
    "parameter of another variant": (npy, "in.npy --set occlusion.wang.x=9", ("best: unknown 'occlusion.wang'",)),
    # where the maps go
    "target is a file": (lambda: (npy(), Path("out").touch()), "in.npy -o out", ("out: is a file",)),
    "target is the light field": (
        lambda: pictures("input_Cam{n:03}.png"),
        "in -o in",
        ("in: holds the views of a light field",),
    ),
    "target is a folder of views": (pictures, "in -o in", ("in: is the light field itself; choose another folder",)),
}


def everything() -> dict[str, bytes]:
    return {str(path): path.read_bytes() for path in Path().rglob("*") if path.is_file()}


@pytest.mark.parametrize("case", CASES)
def test_bad_input(case: str, here: Path, capfd: pytest.CaptureFixture[str]) -> None:
    make, words, expected = CASES[case]
    make()
    before = everything()
    folders = sorted(path for path in Path().rglob("*") if path.is_dir())
    called = CliRunner().invoke(main, ["depth", *words.split()])
    assert called.exit_code == 1, called.output
    assert isinstance(called.exception, SystemExit)
    assert called.stdout == ""
    (line,) = called.stderr.splitlines()
    assert line.startswith("sepi: ")
    for text in expected:
        assert text in line
    assert len(line) < 600
    # libraries print nothing of their own, and nothing is written or left over
    assert capfd.readouterr() == ("", "")
    assert everything() == before
    assert sorted(path for path in Path().rglob("*") if path.is_dir()) == folders


@pytest.fixture
def as_nobody(monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    """An open folder to work in, without the rights of root, who may read and write everywhere."""
    with tempfile.TemporaryDirectory(prefix="sepi-test-") as folder:
        monkeypatch.chdir(folder)
        Path(folder).chmod(0o777)
        root = os.geteuid() == 0
        if root:
            # all that the command imports when it runs, from places that nobody may not read
            assert CliRunner().invoke(main, ["depth", str(npy(name="first.npy"))]).exit_code == 0
            os.seteuid(65534)
        try:
            yield Path(folder)
        finally:
            if root:
                os.seteuid(0)


@pytest.mark.parametrize(
    ("words", "message"),
    [
        ("in", "in/view_1_1.png: cannot be read (Permission denied)"),
        ("in.npy", "in.npy: cannot be read (Permission denied)"),
        ("closed/in", "closed/in"),
        ("open.npy -o locked/out", "locked/out: cannot be written"),
    ],
)
def test_unreadable_input_and_unwritable_target(as_nobody: Path, words: str, message: str) -> None:
    pictures()[4].chmod(0)
    npy().chmod(0)
    npy(name="open.npy")
    Path("closed").mkdir(mode=0o000)
    Path("locked").mkdir(mode=0o500)
    called = CliRunner().invoke(main, ["depth", *words.split()])
    assert isinstance(called.exception, SystemExit), called.exception
    assert called.exit_code == 1
    (line,) = called.stderr.splitlines()
    assert message in line
    Path("closed").chmod(0o700)
    assert list(Path("locked").iterdir()) == []


@pytest.mark.parametrize("name", ["mit Leerzeichen", "Größe-光場", "-minus", "a.b.c", "%s{x}"])
def test_names_of_any_letters(name: str, here: Path) -> None:
    """People name folders as they like, and their maps must come out beside them."""
    for path in pictures("{t} é {s}.png"):
        path.rename(path.with_name(path.name.replace("é", name.replace("/", "").replace("-", ""))))
    Path("in").rename(name)
    done("depth", "--set", "initial.semi_global.num_disparities=11", "--", name)
    assert Path(f"{name}-depth/disparity.pfm").is_file()


def test_values_that_lie_too_deep_in_each_other_are_one_line(tmp_path: Path) -> None:
    """Python's parser of JSON gives up with a traceback of its own."""
    deep = "[" * 100_000
    (tmp_path / "numbers.json").write_text(deep)
    assert "not a file of a report's numbers" in reading_error(tmp_path / "numbers.json", read_numbers)
    setting = f"initial.sepi.num_disparities={deep}"
    called = CliRunner().invoke(main, ["depth", str(tmp_path), "--variant", "paper", "--set", setting])
    assert "num_disparities: input should be a valid integer" in error_of(called)


def test_a_path_that_the_system_refuses_is_shown_without_what_commands_a_terminal() -> None:
    """A name from elsewhere, given by a pattern of the shell, must not clear the screen."""
    called = CliRunner().invoke(main, ["info", "\x1b[2J" + "a" * 300])
    assert error_of(called).startswith("sepi: ?[2Ja")
