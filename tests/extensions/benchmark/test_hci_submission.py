"""Submissions to the benchmark: packed is what it reads, and what it would refuse is found before."""

import os
import struct
import tracemalloc
import warnings
import zipfile
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from error_lines import call, done, error_of

from sepi.errors import SepiError
from sepi.extensions.benchmark.hci_submission import SCENES, problems_of
from sepi.io.result_folder import write_result
from sepi.lightfield import LightField
from sepi.stage import StageMaps

Files = dict[str, bytes]


def pfm(height: int = 512, width: int = 512, *, magic: str = "Pf", value: float = 0.5) -> bytes:
    """A map of one value by NumPy alone."""
    channels = 3 if magic == "PF" else 1
    return f"{magic}\n{width} {height}\n-1.0\n".encode() + np.full(channels * height * width, value, "<f4").tobytes()


GOOD_MAP = pfm()


def good() -> Files:
    """Name to content of a submission that is right."""
    maps = {f"disp_maps/{scene}.pfm": GOOD_MAP for scene in SCENES}
    return maps | {f"runtimes/{scene}.txt": f"{12.5 + at}\n".encode() for at, scene in enumerate(SCENES)}


def zipped(path: Path, files: Files) -> Path:
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED, compresslevel=1) as archive:
        for name, data in files.items():
            archive.writestr(name, data)
    return path


def laid_out(path: Path, files: Files) -> Path:
    for name, data in files.items():
        (path / name).parent.mkdir(parents=True, exist_ok=True)
        (path / name).write_bytes(data)
    return path


@pytest.fixture(params=[zipped, laid_out], ids=["zip", "folder"])
def made(request: pytest.FixtureRequest, tmp_path: Path) -> Callable[[Files], Path]:
    """Function that makes a submission of some files, as an archive and as a folder."""
    return lambda files: request.param(tmp_path / "mine.zip", files)


# --- check


def test_a_right_submission_has_no_problems(made: Callable[[Files], Path]) -> None:
    path = made(good())
    assert problems_of(path) == []
    called = call("check-submission", path)
    assert (called.exit_code, called.stdout) == (0, f"{path}: no problems\n")


def without(*names: str) -> Callable[[Files], Files]:
    return lambda files: {name: data for name, data in files.items() if not name.startswith(names)}


def having(name: str, data: bytes) -> Callable[[Files], Files]:
    return lambda files: files | {name: data}


def spotted(count: int, value: float) -> bytes:
    """A map with some values that are not finite."""
    values = np.full(512 * 512, 0.5, "<f4")
    values[:count] = value
    return b"Pf\n512 512\n-1.0\n" + values.tobytes()


MAP, TIME = "disp_maps/cotton.pfm", "runtimes/cotton.txt"

WRONG = {
    "no map": (without(MAP), MAP, "missing"),
    "no run time": (without(TIME), TIME, "missing"),
    "small map": (having(MAP, pfm(64, 64)), MAP, "64x64 pixels; expected 512x512"),
    "truncated map": (having(MAP, GOOD_MAP[:-1]), MAP, "expected 1048576 bytes"),
    "NaN": (having(MAP, spotted(3, np.nan)), MAP, "3 of 262144 values are not finite"),
    "no number": (having(TIME, b"fast\n"), TIME, "as a number, got 'fast'"),
    "stray file": (having("readme.md", b"hi"), "readme.md", "does not belong"),
}


@pytest.mark.parametrize("case", WRONG)
def test_each_problem_is_one_line_that_begins_with_the_file(made: Callable[[Files], Path], case: str) -> None:
    spoil, name, word = WRONG[case]
    path = made(spoil({name: data for name, data in good().items() if "boxes" in name or "cotton" in name}))
    called = call("check-submission", path, "--partial")
    assert called.exit_code == 1
    (line,) = called.stdout.splitlines()
    assert called.stdout == line + "\n"
    assert line.startswith(name)
    assert word in line
    assert line.isprintable()


def test_part_of_the_scenes_must_be_asked_for(made: Callable[[Files], Path]) -> None:
    path = made({MAP: GOOD_MAP, TIME: b"3\n"})
    assert len(problems_of(path)) == 22
    assert problems_of(path, partial=True) == []
    assert call("check-submission", path, "--partial").exit_code == 0


@pytest.mark.parametrize("name", ["disp_maps/../../a", "a\n\x1b[2Jb"])
def test_unsafe_names_are_named_and_nothing_is_written_there(tmp_path: Path, name: str) -> None:
    (tmp_path / "in").mkdir()
    (line,) = problems_of(zipped(tmp_path / "in/a.zip", good() | {name: b"boo"}))
    assert "does not belong" in line
    assert line.isprintable()
    assert os.listdir(tmp_path) == ["in"]
    assert os.listdir(tmp_path / "in") == ["a.zip"]


def test_a_name_given_twice_is_a_problem(tmp_path: Path) -> None:
    """Which of the two counts depends on who unpacks."""
    path = zipped(tmp_path / "a.zip", good())
    with warnings.catch_warnings(), zipfile.ZipFile(path, "a") as archive:
        warnings.simplefilter("ignore", UserWarning)
        archive.writestr(MAP, pfm(value=0.7))
    assert problems_of(path) == [f"{MAP}: 2 files of this name"]


def test_a_bomb_is_not_unpacked(tmp_path: Path) -> None:
    """Neither many zeros in few bytes nor a header that claims the right size cost memory."""
    path = tmp_path / "a.zip"
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, data in without(MAP)(good()).items():
            archive.writestr(name, data)
        with archive.open(MAP, "w") as file:
            for _ in range(64):
                file.write(bytes(2**20))
    tracemalloc.start()
    lines = problems_of(path)
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert lines == [f"{MAP}: {2**26} bytes are too many for a map of 512x512 pixels"]
    assert peak < 2**25
    data = path.read_bytes()
    assert data.count(struct.pack("<I", 2**26)) == 2
    path.write_bytes(data.replace(struct.pack("<I", 2**26), struct.pack("<I", len(GOOD_MAP))))
    (line,) = problems_of(path)
    assert line.startswith(f"{MAP}: cannot be unpacked")


def test_nothing_there_is_an_error(tmp_path: Path) -> None:
    assert "gone.zip: no such file" in error_of(call("check-submission", tmp_path / "gone.zip"))


# --- pack


def result(folder: Path, scene: str, *, seconds: str | None = "12.5\n", shape: tuple[int, int] = (512, 512)) -> Path:
    """The parts of a result that a submission is made of."""
    (folder / scene).mkdir(parents=True)
    light_field = LightField(views=np.zeros((3, 3, 4, 4, 1), np.uint8), name=scene)
    zeros = np.zeros((4, 4), np.float32)
    write_result(folder / scene, light_field, StageMaps(zeros, zeros), {"scene": scene})
    (folder / scene / "disparity.pfm").write_bytes(pfm(*shape, value=SCENES.index(scene) if scene in SCENES else 0))
    if seconds is not None:
        (folder / scene / "runtime.txt").write_text(seconds)
    return folder / scene


def test_packed_are_all_maps_and_run_times(tmp_path: Path) -> None:
    folders = [result(tmp_path, scene) for scene in SCENES]
    output = tmp_path / "new/mine.zip"
    called = done("submission", *folders, "-o", output, "--runtime", "dots=0.0625")
    assert called.stdout == f"written: {output} (12 scenes)\n"
    with zipfile.ZipFile(output) as archive:
        assert archive.testzip() is None
        assert sorted(archive.namelist()) == sorted(good())
        assert {info.date_time for info in archive.infolist()} == {(1980, 1, 1, 0, 0, 0)}
        for at, scene in enumerate(SCENES):
            assert archive.read(f"disp_maps/{scene}.pfm") == pfm(value=at)
            assert float(archive.read(f"runtimes/{scene}.txt")) == (0.0625 if scene == "dots" else 12.5)
    assert problems_of(output) == []
    again = tmp_path / "again.zip"
    assert call("submission", *reversed(folders), "-o", again, "--runtime", "dots=0.0625").exit_code == 0
    assert again.read_bytes() == output.read_bytes()


def test_fewer_scenes_are_packed_if_asked_for(tmp_path: Path) -> None:
    folder = result(tmp_path, "cotton")
    line = error_of(call("submission", folder, "-o", tmp_path / "a.zip"))
    assert "a.zip: not written: disp_maps/backgammon.pfm: missing (and 21 more)" in line
    assert not (tmp_path / "a.zip").exists()
    assert call("submission", folder, "-o", tmp_path / "a.zip", "--partial").exit_code == 0
    with zipfile.ZipFile(tmp_path / "a.zip") as archive:
        assert archive.namelist() == [MAP, TIME]


def test_what_the_benchmark_would_refuse_is_not_packed(tmp_path: Path) -> None:
    good_one = result(tmp_path, "cotton")
    (tmp_path / "a.zip").write_text("before")
    small = result(tmp_path / "small", "cotton", shape=(64, 64))
    untimed = result(tmp_path / "untimed", "cotton", seconds=None)
    slow = result(tmp_path / "slow", "cotton", seconds="slow")
    strange = result(tmp_path, "coton")
    side = tmp_path / "side"
    views = LightField(views=np.zeros((3, 3, 4, 4, 1), np.uint8), name="cotton", view=(0, 0))
    zeros = np.zeros((4, 4), np.float32)
    write_result(side, views, StageMaps(zeros, zeros), {"scene": "cotton"})
    cases = {
        (small,): "disp_maps/cotton.pfm: 64x64 pixels",
        (untimed,): "runtime.txt: no such file; run 'sepi depth --timing', or give --runtime cotton=SECONDS",
        (slow,): "runtime.txt: expected the run time in seconds as a number",
        (strange,): "did you mean 'cotton'?",
        (side,): "side: depth of another view",
        (good_one, small): "small/cotton: scene cotton is given twice",
        (good_one, "--runtime", "dots=3"): "--runtime dots: no result of this scene",
        (good_one, "--runtime", "cotton=-1"): "--runtime cotton=-1: expected the run time in seconds",
        (tmp_path / "gone",): "gone: no such folder",
    }
    for words, expected in cases.items():
        assert expected in error_of(call("submission", *words, "--partial", "-o", tmp_path / "a.zip")), words
        assert (tmp_path / "a.zip").read_text() == "before"
    os.mkfifo(tmp_path / "pipe")
    assert "pipe: cannot be written" in error_of(call("submission", good_one, "--partial", "-o", tmp_path / "pipe"))
    assert (tmp_path / "pipe").is_fifo()
    (good_one / "disparity.pfm").unlink()
    assert "cotton/disparity.pfm: no such file" in error_of(call("submission", good_one, "--partial"))
    with pytest.raises(SepiError, match="gone"):
        problems_of(tmp_path / "gone")


def test_a_file_compressed_in_an_unusual_way_is_a_problem(tmp_path: Path) -> None:
    """The benchmark may not unpack it."""
    path = zipped(tmp_path / "mine.zip", without("disp_maps/cotton")(good()))
    with zipfile.ZipFile(path, "a", zipfile.ZIP_BZIP2) as archive:
        archive.writestr("disp_maps/cotton.pfm", GOOD_MAP)
    assert problems_of(path) == ["disp_maps/cotton.pfm: compressed by method 12; expected 'deflated' or none"]
