"""Runs of Snakemake that need not wait for its import, which takes longer than what most tests ask it.

Each is a child of a process that has imported Snakemake's libraries, and none of the package.
"""

import multiprocessing
import os
import signal
import subprocess
import sys
import tempfile
from collections.abc import Mapping, Sequence
from multiprocessing.context import ForkServerProcess
from pathlib import Path

_LIBRARIES = ("pytest", "snakemake.cli", "snakemake.report", "pulp", "psutil", "jinja2", "requests", "h5py", "click")
_SECONDS = 1200
# CPU seconds of each run and its jobs
_taken: list[float] = []
_context = multiprocessing.get_context("forkserver")
_context.set_forkserver_preload([*_LIBRARIES])


def run_snakemake(
    words: Sequence[str], folder: Path, environment: Mapping[str, str], python: str = sys.executable
) -> subprocess.CompletedProcess[str]:
    """Run Snakemake to its end, its jobs by this Python; stdout holds its messages too."""
    with tempfile.TemporaryDirectory() as name:
        out, taken = Path(name, "out"), Path(name, "taken")
        process = begin_snakemake(words, folder, environment, out, taken, python)
        process.join(_SECONDS)
        assert process.exitcode is not None, f"still running after {_SECONDS} s"
        _taken.append(float(taken.read_text(encoding="utf-8")))
        return subprocess.CompletedProcess(words, process.exitcode, out.read_text(encoding="utf-8"))


def begin_snakemake(
    words: Sequence[str],
    folder: Path,
    environment: Mapping[str, str],
    out: Path,
    taken: Path,
    python: str = sys.executable,
) -> ForkServerProcess:
    """Begin a run in a session of its own, as a terminal does; files for its messages and its CPU seconds."""
    process = _context.Process(target=_run, args=(list(words), str(folder), dict(environment), out, taken, python))
    process.start()
    return process


def cpu_seconds_of_runs() -> float:
    """What the runs have taken, with all their jobs that have ended."""
    return sum(_taken)


def _run(words: list[str], folder: str, environment: dict[str, str], out: Path, taken: Path, python: str) -> None:
    os.setsid()
    # a background process of a shell ignores it
    signal.signal(signal.SIGINT, signal.default_int_handler)
    os.environ.clear()
    os.environ.update(environment)
    os.chdir(folder)
    file = os.open(out, os.O_WRONLY | os.O_CREAT | os.O_APPEND)
    for number in (1, 2):
        os.dup2(file, number)
    sys.path[:0] = ["", *filter(None, environment.get("PYTHONPATH", "").split(os.pathsep))]
    sys.argv, sys.executable = ["snakemake", *words], python
    from snakemake.cli import main

    try:
        main()
    finally:
        taken.write_text(str(sum(os.times()[:4])), encoding="utf-8")
