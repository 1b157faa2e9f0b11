"""The folder of a run: what a killed one left is put away, what another one does there is left alone."""

import os
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path

import pytest

from sepi.workflow import run_folder
from sepi.workflow.run_folder import note_run, put_away, say_if_full, take_over

# a run in a process of its own: it takes the folder, notes whose it is, and waits for its end
OTHER = """import sys
from pathlib import Path
from sepi.workflow.run_folder import note_run, take_over
print(take_over(Path(), [Path("results")]), flush=True)
note_run(well=False)
sys.stdin.read()
"""


@pytest.fixture(autouse=True)
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    """A folder with a lock of Snakemake's and a file that a job had begun to write; this process holds none before."""
    monkeypatch.chdir(tmp_path)
    held: list[object] = []
    monkeypatch.setattr(run_folder, "_held", held)
    (tmp_path / ".snakemake/locks").mkdir(parents=True)
    (tmp_path / ".snakemake/locks/0.output.lock").touch()
    (tmp_path / "results").mkdir()
    begun().touch()
    yield tmp_path
    for run in held:
        run.close()  # type: ignore[attr-defined]


def begun() -> Path:
    return Path("results/.map-0123456789ab.pfm")


def noted(*lines: str) -> None:
    """Say whose run was the last here, and how it ended."""
    Path(".snakemake/run_of_sepi").write_text("\n".join(lines))


def locked() -> bool:
    return any(Path(".snakemake/locks").iterdir())


def test_a_killed_run_of_this_machine_is_put_away() -> None:
    ahead = Path("results/ahead.h5")
    ahead.touch()
    os.utime(ahead, (time.time() + 1e6,) * 2)
    noted(run_folder.platform.node(), "")
    assert take_over(Path(), [Path("results")])
    assert not locked()
    assert not begun().exists()
    assert ahead.stat().st_mtime <= time.time()


@pytest.mark.parametrize("lines", [("another-machine", ""), ()], ids=["of another machine", "of nobody knows whom"])
def test_a_run_that_may_go_on_elsewhere_is_left_alone(lines: tuple[str, ...]) -> None:
    """Without its lock, two machines would write the same files."""
    noted(*lines)
    assert not take_over(Path(), [Path("results")])
    assert locked()
    assert begun().exists()


def test_after_a_run_that_ended_well_nothing_is_looked_for() -> None:
    """To go through all files takes long where there are many."""
    Path(".snakemake/locks/0.output.lock").unlink()
    noted(run_folder.platform.node(), "ended well")
    assert not take_over(Path(), [Path("results")])
    assert begun().exists()


def test_a_failed_run_puts_away_what_its_jobs_left() -> None:
    noted(run_folder.platform.node(), "")
    take_over(Path(), [])
    note_run(well=False)
    put_away([Path("results")])
    assert not begun().exists()


@pytest.mark.parametrize("first", [True, False])
def test_a_failed_run_leaves_files_of_another_that_goes_on(first: bool) -> None:
    """With --nolock, two go on in one folder: the one that fails took away what the other was writing."""
    Path(".snakemake/locks/0.output.lock").unlink()
    noted(run_folder.platform.node(), "ended well")
    if first:
        take_over(Path(), [])
    other = subprocess.Popen(
        [sys.executable, "-c", OTHER], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True, env=os.environ
    )
    assert other.stdout is not None
    assert other.stdout.readline() == "False\n"
    if not first:
        take_over(Path(), [])
    begun().touch()
    put_away([Path("results")])
    assert begun().exists()
    other.communicate("")
    put_away([Path("results")])
    assert not begun().exists()


def test_a_full_disk_is_told(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    """A job that found no room for its message fails without one."""
    for free, told in ((10**7, "only 10 MB are free on this disk"), (10**12, "")):
        monkeypatch.setattr(run_folder.shutil, "disk_usage", lambda _, free=free: type("Usage", (), {"free": free}))
        say_if_full(Path())
        assert told in (said := capsys.readouterr().err)
        assert bool(said) == bool(told)
