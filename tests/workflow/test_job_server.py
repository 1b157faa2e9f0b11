"""Jobs as forks of one process: they do what a Python of their own would, and nothing outlives the run."""

import json
import os
import signal
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import NamedTuple

import pytest
from workflow_copy import wait_for

from sepi.workflow import job_client
from sepi.workflow.job_server import start_job_server

pytestmark = [pytest.mark.workflow, pytest.mark.skipif(sys.platform != "linux", reason="jobs are forks on Linux alone")]

WORDS = {"WORD": "kälte\n=", "CODE": "3"}
TOLD = """import json, os, sys
print(json.dumps([sys.argv[1:], os.getcwd(), os.environ["WORD"], __name__, sys.stdin.read()]))
print("to stderr", file=sys.stderr)
sys.exit(int(os.environ["CODE"]))
"""
# it removes its file when it is told to end, as unfinished files are
WAITS = """import pathlib, signal, sys, time
for number in (signal.SIGTERM, signal.SIGHUP):
    signal.signal(number, lambda number, _: sys.exit(128 + number))
begun = pathlib.Path("begun")
begun.touch()
try:
    time.sleep(60)
finally:
    begun.unlink()
"""


class Jobs(NamedTuple):
    """A server's socket, and where its jobs' modules are."""

    address: str
    modules: Path

    def job(self, folder: Path, module: str, *words: str) -> subprocess.Popen[str]:
        """A job as its shell begins it."""
        return subprocess.Popen(
            [sys.executable, "-IS", job_client.__file__, "-m", module, *words],
            cwd=folder,
            env=WORDS | {"PYTHONPATH": str(self.modules), job_client.SERVER: self.address},
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
        )

    def told(self, folder: Path) -> None:
        """Run a job that tells what it was given, and compare."""
        run = self.job(folder, "told", "a word", "ß", "")
        out, error = run.communicate("input", timeout=60)
        assert json.loads(out) == [["a word", "ß", ""], str(folder), WORDS["WORD"], "__main__", "input"]
        assert (error, run.returncode) == ("to stderr\n", 3)

    @contextmanager
    def waiting(self, folder: Path) -> Iterator[subprocess.Popen[str]]:
        """A job that goes on until it is told to end, and then has cleaned up."""
        run = self.job(folder, "waits")
        wait_for((folder / "begun").exists)
        with run:
            yield run
            wait_for(lambda: not (folder / "begun").exists())


@pytest.fixture(scope="module")
def modules(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Folder of the jobs' modules."""
    folder = tmp_path_factory.mktemp("modules")
    (folder / "told.py").write_text(TOLD)
    (folder / "waits.py").write_text(WAITS)
    return folder


@pytest.fixture(scope="module")
def jobs(modules: Path) -> Iterator[Jobs]:
    """Those of a server of this process."""
    server = start_job_server(os.pathsep.join([str(modules), *sys.path]))
    assert server is not None
    yield Jobs(server.address, modules)
    server.end()
    assert not Path(server.address).parent.exists()


def test_a_job_is_run_as_python_would_run_it(jobs: Jobs, tmp_path: Path) -> None:
    """Else a rule's command means something else where there is a server."""
    jobs.told(tmp_path)


@pytest.mark.parametrize(("number", "code"), [(signal.SIGTERM, 143), (signal.SIGHUP, 129), (signal.SIGKILL, -9)])
def test_a_job_that_is_ended_puts_its_files_away(jobs: Jobs, tmp_path: Path, number: int, code: int) -> None:
    """A fork that goes on after its job has failed would write into the next run."""
    with jobs.waiting(tmp_path) as run:
        run.send_signal(number)
    assert run.returncode == code


def test_a_folder_that_takes_no_socket_is_no_failure(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    """Else no workflow runs where the folder for temporary files is full, or has a long path."""
    deep = tmp_path / ("deep" * 30)
    deep.mkdir()
    monkeypatch.setattr(tempfile, "tempdir", str(deep))
    assert start_job_server("") is None
    assert not list(deep.iterdir())
    deep.rmdir()
    assert start_job_server("") is None


def test_jobs_end_with_the_run_whatever_ends_it(modules: Path, tmp_path: Path) -> None:
    """A run that was killed leaves nothing behind; a job that finds no server is one of Python's own."""
    program = f"""import os, sys; from sepi.workflow.job_server import start_job_server
server = start_job_server(os.pathsep.join([{str(modules)!r}, *sys.path]))
print(server.address, flush=True); sys.stdin.read()"""
    words, pipe = [sys.executable, "-c", program], subprocess.PIPE
    with subprocess.Popen(words, stdin=pipe, stdout=pipe, text=True) as run:
        assert run.stdout is not None
        jobs = Jobs(run.stdout.readline().strip(), modules)
        with jobs.waiting(tmp_path) as job:
            run.kill()
        assert job.returncode != 0
    wait_for(lambda: not Path(jobs.address).parent.exists())
    jobs.told(tmp_path)
