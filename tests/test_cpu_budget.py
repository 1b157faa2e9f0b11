"""The budget of CPU time that the tests hold: a suite that grows past it fails, and names what takes the time."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

SLOW = """
import time

def test_quick():
    pass

def test_slow():
    while time.process_time() < 1.5:
        pass
"""


@pytest.mark.parametrize(("budget", "code"), [("0.2", 1), ("500", 0)])
def test_a_suite_beyond_its_budget_fails(tmp_path: Path, budget: str, code: int) -> None:
    (tmp_path / "test_some.py").write_text(SLOW)
    words = ["-m", "pytest", "-q", "-p", "cpu_budget", "-p", "no:cacheprovider", "--cpu-budget", budget]
    words += ["--note-long", "long.txt"]
    environment = os.environ | {"PYTHONPATH": str(Path(__file__).parent), "PYTEST_ADDOPTS": ""}
    done = subprocess.run(
        [sys.executable, *words], cwd=tmp_path, env=environment, capture_output=True, text=True, check=False
    )
    assert done.returncode == code, done.stdout
    told = [line for line in done.stdout.splitlines() if line.endswith("test_some.py::test_slow")]
    assert bool(told) == bool(code)
    # which ones `make check` is to leave out
    assert (tmp_path / "long.txt").read_text() == "test_some.py::test_slow\n"
    assert f"CPU seconds of {float(budget):.0f} (a loop of " in done.stdout
