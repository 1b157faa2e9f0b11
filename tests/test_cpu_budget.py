"""The budget of CPU time that the tests hold: a suite that grows past it fails, and names what takes the time."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

# several times what makes a test long, on whatever core
SLOW = """
from cpu_budget import LONG, LOOP, calibration

def test_quick():
    pass

def test_slow():
    for _ in range(int(5 * LONG / LOOP)):
        calibration()
"""


@pytest.mark.parametrize(("budget", "code"), [("0.2", 1), ("500", 0)])
def test_a_suite_beyond_its_budget_fails(tmp_path: Path, budget: str, code: int) -> None:
    (tmp_path / "test_some.py").write_text(SLOW)
    words = ["-m", "pytest", "-q", "-p", "cpu_budget", "-p", "no:cacheprovider", "--cpu-budget", budget]
    words += ["--note-long", "long.txt"]
    environment = os.environ | {"PYTHONPATH": str(Path(__file__).parent), "PYTEST_ADDOPTS": ""}
    environment["PYTEST_DISABLE_PLUGIN_AUTOLOAD"] = "1"
    done = subprocess.run(
        [sys.executable, *words], cwd=tmp_path, env=environment, capture_output=True, text=True, check=False
    )
    assert done.returncode == code, done.stdout
    told = [line for line in done.stdout.splitlines() if line.endswith("test_some.py::test_slow")]
    assert bool(told) == bool(code)
    # which ones `make check` is to leave out
    assert (tmp_path / "long.txt").read_text() == "test_some.py::test_slow\n"
    assert f"CPU seconds of {float(budget):.0f} (a loop of " in done.stdout
