"""Files appear whole or not at all, whatever stops the program: an error, a full disk, Ctrl-C at any moment."""

import os
import signal
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from types import FrameType
from typing import Any

import numpy as np
import pytest

from sepi.errors import SepiError, SepiWarning
from sepi.io import files
from sepi.io.disparity_maps import read_pfm
from sepi.io.files import atomic_folder, atomic_path
from sepi.io.hdf5 import create_hdf5, open_hdf5

SOURCE = Path(__file__).parents[2]


def names_in(folder: Path) -> list[str]:
    return sorted(str(path.relative_to(folder)) for path in folder.rglob("*"))


def write_file(target: Path) -> None:
    with atomic_path(target) as temporary:
        temporary.write_text("new")


def write_folder(target: Path) -> None:
    with atomic_folder(target) as temporary:
        (temporary / "a").write_text("new")
        (temporary / "b").write_text("new")


class Interrupt:
    """Raises KeyboardInterrupt before the n-th line that runs in ``sepi/io/files.py``."""

    def __init__(self, moment: int) -> None:
        self.left = moment

    def __call__(self, frame: FrameType, event: str, _: Any) -> Any:
        if frame.f_code.co_filename != files.__file__:
            return None
        if event == "line":
            self.left -= 1
            if self.left == 0:
                sys.settrace(None)
                raise KeyboardInterrupt
        return self


@pytest.mark.parametrize("write", [write_file, write_folder])
def test_interrupted_at_any_line_nothing_is_half_written(tmp_path: Path, write: Any) -> None:
    """A half-written map that looks finished is worse than none."""
    interrupted = 0
    for moment in range(1, 200):
        folder = tmp_path / str(moment)
        target = folder / "out.txt"
        before = sys.gettrace()
        sys.settrace(Interrupt(moment))
        try:
            write(target)
            finished = True
        except KeyboardInterrupt:
            interrupted += 1
            finished = False
        finally:
            sys.settrace(before)
        # what the interpreter does when it ends
        files._remove_unfinished()
        found = names_in(folder) if folder.exists() else []
        assert found in ([], ["out.txt"], ["out.txt", "out.txt/a", "out.txt/b"]), moment
        if finished:
            assert found != []
            break
    assert interrupted >= 10
    assert finished


def test_a_failure_leaves_what_was_there(tmp_path: Path) -> None:
    (tmp_path / "map.txt").write_text("old")

    def fail() -> None:
        with atomic_path(tmp_path / "map.txt") as temporary:
            temporary.write_text("half")
            raise ValueError("oops")

    with pytest.raises(ValueError, match="oops"):
        fail()
    assert names_in(tmp_path) == ["map.txt"]
    assert (tmp_path / "map.txt").read_text() == "old"


def test_a_link_is_replaced_and_not_followed(tmp_path: Path) -> None:
    """A result folder with links must not let a rerun overwrite files elsewhere."""
    (tmp_path / "precious.txt").write_text("mine")
    (tmp_path / "out.txt").symlink_to(tmp_path / "precious.txt")
    write_file(tmp_path / "out.txt")
    assert (tmp_path / "precious.txt").read_text() == "mine"
    assert (tmp_path / "out.txt").read_text() == "new"
    assert not (tmp_path / "out.txt").is_symlink()


def test_files_have_the_users_permissions(tmp_path: Path) -> None:
    """Maps that nobody else in the group may read would be of no use on a shared machine."""
    mask = os.umask(0o027)
    try:
        write_file(tmp_path / "map.txt")
        write_folder(tmp_path / "maps")
    finally:
        os.umask(mask)
    assert (tmp_path / "map.txt").stat().st_mode & 0o777 == 0o640
    assert (tmp_path / "maps").stat().st_mode & 0o777 == 0o750


def test_a_device_is_not_replaced_by_a_file(tmp_path: Path) -> None:
    """``-o /dev/stdout`` as root would take standard output away from every program."""
    os.mkfifo(tmp_path / "pipe")
    (tmp_path / "link").symlink_to(tmp_path / "pipe")
    for name in ("pipe", "link"):
        with pytest.raises(SepiError, match=rf"{name}: cannot be written \(not a file\)"):
            write_file(tmp_path / name)
    assert names_in(tmp_path) == ["link", "pipe"]
    assert (tmp_path / "link").is_symlink()


def test_a_folder_is_not_overwritten_by_a_file(tmp_path: Path) -> None:
    (tmp_path / "map.txt").mkdir()
    with pytest.raises(SepiError, match=r"map\.txt: cannot be written"):
        write_file(tmp_path / "map.txt")
    assert names_in(tmp_path) == ["map.txt"]


# what a full disk does to each kind of file; the limit on a file's size stands for the disk
FULL = """
import resource, signal, sys
from pathlib import Path
import numpy as np
from sepi.errors import SepiError
from sepi.io.hdf5 import create_hdf5
from sepi.io.disparity_maps import write_pfm
from sepi.io.images import write_png

signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
resource.setrlimit(resource.RLIMIT_FSIZE, (5000, 5000))
noise = np.random.default_rng(0).random((99, 99), np.float32)

def hdf5(path):
    with create_hdf5(path) as file:
        file["x"] = noise

kinds = {
    "map.pfm": lambda path: write_pfm(path, noise),
    "map.png": lambda path: write_png(path, (255 * noise).astype(np.uint8)),
    "map.h5": hdf5,
}
for name, write in kinds.items():
    try:
        write(Path(name))
    except SepiError as error:
        print(" ".join(str(error).split()))
"""


def test_a_full_disk_is_one_line_for_each_kind_of_file(tmp_path: Path) -> None:
    done = subprocess.run(
        [sys.executable, "-c", FULL],
        cwd=tmp_path,
        env=os.environ | {"PYTHONPATH": str(SOURCE)},
        capture_output=True,
        text=True,
        timeout=60,
        check=False,
    )
    assert (done.returncode, done.stderr) == (0, "")
    names = ["map.pfm", "map.png", "map.h5"]
    assert done.stdout.splitlines() == [f"{name}: cannot be written (File too large)" for name in names]
    assert names_in(tmp_path) == []


@pytest.fixture
def ctrl_c() -> Iterator[None]:
    """As at a terminal: a background process of a shell ignores SIGINT."""
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    yield
    found = signal.signal(signal.SIGINT, before)
    assert found is signal.default_int_handler


@pytest.mark.usefixtures("ctrl_c")
def test_an_interrupt_waits_while_hdf5_reads_and_a_second_one_does_not(tmp_path: Path) -> None:
    with create_hdf5(tmp_path / "x.h5") as file:
        file["x"] = np.arange(4)
    read: list[int] = []

    def interrupted(times: int) -> None:
        with open_hdf5(tmp_path / "x.h5") as file:
            for _ in range(times):
                signal.raise_signal(signal.SIGINT)
            read.append(int(file["x"][3]))

    with pytest.raises(KeyboardInterrupt):
        interrupted(1)
    assert read == [3]
    with pytest.raises(KeyboardInterrupt):
        interrupted(2)
    assert read == [3], "read once more after the second"


def test_an_error_is_one_line_whatever_is_in_a_name(tmp_path: Path) -> None:
    """A file's name may hold what clears a terminal, or ends a line of a log."""
    path = tmp_path / "a\x1b[2J\nb.pfm"
    path.write_bytes(b"Pf")
    with pytest.raises(SepiError) as caught:
        read_pfm(path)
    assert str(caught.value).isprintable()
    assert str(caught.value).startswith(f"{tmp_path}/a?[2J b.pfm: not a one-channel PFM")
    # who follows its causes comes to an end
    assert caught.value.__cause__ is not caught.value
    assert str(SepiWarning("a\tb\x00")) == "a b?"
