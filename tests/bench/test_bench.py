"""The benchmark measures what it says, its plain implementations compute the same, its tables add up."""

import json
import subprocess
import sys
from importlib.metadata import version
from pathlib import Path

import cv2
import numpy as np
import pytest
from error_lines import done

from bench.__main__ import _all_measured, main
from bench.measure import Case, Measurement, Prepared, Result, command, measured
from bench.plain import WARPS, Warp, by_opencv, plain_sweep
from sepi.errors import SepiError
from sepi.matching.plane_sweep import SweepParameters, sweep
from sepi.scenes import render

pytestmark = pytest.mark.slow


def holding(megabytes: int) -> Prepared:
    return Prepared(lambda: np.ones(megabytes * 2**17), lambda array: {"sum": float(array.sum())})


def failing() -> Prepared:
    def call() -> None:
        raise ValueError("too\nbright")

    return Prepared(call)


def measurement(group: str, name: str, seconds: float, **figures: float) -> Measurement:
    return Measurement(group, name, (seconds, seconds, 9 * seconds), 100.0, figures)


def result(*measurements: Measurement) -> Result:
    return Result({"processor": "abacus"}, {"scene": "dots", "num_disparities": 10, "threads": 1}, measurements)


class TestMeasuring:
    def test_memory_is_of_the_case_alone(self) -> None:
        """Memory left over from another case would hide what a stage needs."""
        large, small = (measured(Case("g", "n", holding, (megabytes,)), 1) for megabytes in (300, 1))
        assert large.peak_memory_mb - small.peak_memory_mb == pytest.approx(300, abs=30)
        assert large.figures["sum"] == 300 * 2**17

    def test_command_is_timed_from_start_to_end(self) -> None:
        """Its memory is its own too, not that of the process that starts it."""
        found = measured(Case("g", "n", command, ("timeit", "-n1", "-r1", "import time; time.sleep(0.3)")), 2)
        assert len(found.seconds) == 2
        assert 0.3 < found.median < 5
        assert found.figures == {}
        large = measured(Case("g", "n", command, ("timeit", "-n1", "-r1", "b'x' * 300 * 2**20")), 1)
        assert large.peak_memory_mb - found.peak_memory_mb == pytest.approx(300, abs=30)
        with pytest.raises(SepiError, match=r"benchmark g, n: .*no such thing"):
            measured(Case("g", "n", command, ("timeit", "raise SystemExit('no such thing')")), 1)


@pytest.mark.parametrize("warp", WARPS.values(), ids=list(WARPS))
def test_plain_implementations_give_the_compiled_costs(warp: Warp) -> None:
    """A yardstick that computes something else measures nothing. Bounds the compiled sweep's rounding, too."""
    if warp is by_opencv and int(version("opencv-python-headless").split(".")[0]) < 5:
        pytest.skip("warpAffine of OpenCV 4 rounds positions to a 32nd of a pixel")
    light_field = render("stripes", size=64, views=5)
    parameters = SweepParameters(num_disparities=13)
    disparity, lowest = plain_sweep(light_field, parameters, warp)
    own = sweep(light_field, parameters)
    # costs of 0..1, summed over 24 views in single precision
    assert np.abs(lowest - own.cost[0]).max() < 1e-5
    step = 2 * np.diff(light_field.require_disparity_range().candidates(13))[0]
    # the compiled sweep refines by a parabola; two candidates may tie
    assert np.mean(np.abs(disparity - own.disparity[0]) > step) < 0.002


class TestCompare:
    @pytest.fixture
    def files(self, tmp_path: Path) -> tuple[Path, Path]:
        before, after = tmp_path / "before.json", tmp_path / "after.json"
        before.write_text(
            result(measurement("stages", "initial", 2.0, mse100=1.5), measurement("stages", "gone", 1.0)).as_json()
        )
        after.write_text(
            result(measurement("stages", "initial", 1.0, mse100=1.5), measurement("stages", "new", 1.0)).as_json()
        )
        return before, after

    def test_ratio_of_what_both_measured(self, files: tuple[Path, Path]) -> None:
        called = done("compare", *map(str, files), of=main)
        assert "| stages: initial | 2.00 | 1.00 | 0.50 | 100 | 100 | 1.50 | 1.50 |" in " ".join(called.stdout.split())
        assert "gone" not in called.stdout
        assert called.stderr == ""


@pytest.mark.system
def test_small_run_measures_everything(tmp_path: Path) -> None:
    """The command of `make bench`, on a tiny scene: files to read, to compute with, and to look at."""
    words = [sys.executable, "-m", "bench", "run", "--small", "--output", str(tmp_path)]
    called = subprocess.run(words, capture_output=True, text=True, check=False)
    assert called.returncode == 0, called.stderr
    assert called.stderr == "", "quiet in a pipe"
    content = json.loads((tmp_path / "bench.json").read_text())
    groups = {m["group"] for m in content["measurements"]}
    assert groups >= {"whole", "stages", "variants"}
    assert all(min(m["seconds"]) > 0 and m["peak_memory_mb"] > 0 for m in content["measurements"])
    stages = {m["name"]: m["figures"] for m in content["measurements"] if m["group"] == "stages"}
    assert content["settings"]["views"] == "5x5"
    assert stages["initial"]["samples"] == 24 * 21 * 64 * 64
    variants = {m["name"]: m["figures"] for m in content["measurements"] if m["group"] == "variants"}
    assert 0 < variants["fast: optimize"]["mse100"] == variants["fast: once more in a process"]["mse100"]
    assert 0 < stages["optimize"]["mse100"] < stages["initial"]["mse100"]
    assert "## Steps\n" in (tmp_path / "bench.md").read_text()
    assert cv2.imread(str(tmp_path / "bench.png")) is not None
    again = done("compare", *[str(tmp_path / "bench.json")] * 2, of=main)
    assert " ".join(again.stdout.split()).count("| 1.00 |") >= len(content["measurements"])


def test_failing_cases_do_not_lose_the_others(capsys: pytest.CaptureFixture) -> None:
    found, failed = _all_measured([Case("g", "bad", failing), Case("g", "good", holding, (1,))], 1, 1)
    assert [m.name for m in found] == ["good"]
    assert failed == 1
    assert "sepi: warning: benchmark g, bad: ValueError: too bright" in capsys.readouterr().err
