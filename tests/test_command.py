"""The command of a stage, as the workflow calls it: what it writes, and what it leaves behind when it fails."""

import json
import os
import subprocess
import sys
import time
from pathlib import Path

import h5py
import numpy as np
import pytest
from error_lines import call, done, error_of
from pydantic import Field

from sepi.errors import SepiError
from sepi.io.hdf5 import read_attributes, read_stage, write_light_field
from sepi.io.provenance import history_of
from sepi.lightfield import DisparityRange, LightField
from sepi.process.command import stage_command
from sepi.stage import Choice, NoParameters, Parameters, Progress, StageMaps


class Shift(Parameters):
    amount: float = Field(0.5, description="pixels per view step")


def constant(light_field: LightField, previous: StageMaps | None, parameters: Shift, progress: Progress) -> StageMaps:
    progress(0.5)
    start = 0.0 if previous is None else previous.disparity
    disparity = (np.zeros(light_field.shape) + start + parameters.amount).astype(np.float32)
    return StageMaps(disparity, np.ones(light_field.shape, np.float32))


def failing(
    light_field: LightField, previous: StageMaps | None, parameters: Parameters, progress: Progress
) -> StageMaps:
    raise SepiError(f"{light_field.name}: too dark\nby far")


FIRST = stage_command(
    "first", {"constant": Choice(Shift, constant, own_steps=True), "failing": Choice(NoParameters, failing)}
)
SECOND = stage_command("second", {"constant": Choice(Shift, constant, own_steps=True)})


@pytest.fixture
def light_field(tmp_path: Path) -> Path:
    views = np.zeros((3, 3, 8, 10, 3), np.uint8)
    path = tmp_path / "in" / "lightfield.h5"
    write_light_field(path, LightField(views, "toy", "built-in", disparity_range=DisparityRange(-1, 2, "given")))
    return path


def files(folder: Path) -> list[str]:
    """Names of all files, hidden ones too."""
    return sorted(path.name for path in folder.rglob("*") if path.is_file())


class TestStageFile:
    def test_it_holds_the_maps_and_what_made_them(self, light_field: Path, tmp_path: Path) -> None:
        one, two = tmp_path / "a" / "one.h5", tmp_path / "b" / "two.h5"
        base = ["--light-field", light_field, "--choice", "constant"]
        assert call(*base, "--output", one, of=FIRST).exit_code == 0
        second = done(*base, "--previous", one, "--parameters", '{"amount": 1.5}', "--output", two, of=SECOND)
        assert second.output == ""
        assert np.all(read_stage(two).disparity == 2.0)
        attributes = read_attributes(two)
        assert (attributes["stage"], attributes["choice"], attributes["scene"]) == ("second", "constant", "toy")
        assert attributes["parameters"] == '{"amount": 1.5}'
        assert list(attributes["disparity_range"]) == [-1, 2]
        assert attributes["disparity_range_source"] == "given"
        assert attributes["version"]
        assert [step["stage"] for step in history_of(two)] == ["first", "second"]
        assert history_of(two)[0]["parameters"] == {"amount": 0.5}

    def test_seconds_memory_and_threads_are_written(self, light_field: Path, tmp_path: Path) -> None:
        """The run time table is made from them."""
        base = ["--light-field", light_field, "--choice", "constant", "--output", tmp_path / "o.h5", "--threads", 2]
        assert call(*base, "--timing", tmp_path / "t.json", of=FIRST).exit_code == 0
        timing = json.loads((tmp_path / "t.json").read_text())
        assert 0 < timing["seconds"] < 60
        assert 10 < timing["peak_memory_mb"] < 100_000
        assert timing["threads"] == 2


class TestErrors:
    def test_an_error_is_one_line_and_leaves_no_file(self, light_field: Path, tmp_path: Path) -> None:
        out = tmp_path / "out" / "one.h5"
        result = call("--light-field", light_field, "--choice", "failing", "--output", out, of=FIRST)
        assert error_of(result) == "sepi: toy: too dark by far"
        assert files(tmp_path) == ["lightfield.h5"]

    @pytest.mark.parametrize(
        ("parameters", "expected"),
        [
            ('{"amuont": 1}', "first.constant: unknown 'amuont'; did you mean 'amount'? known: amount"),
            ('{"amount": "much"}', "first.constant.amount: input should be a valid number, got 'much'"),
            ("[1]", "--parameters: expected a JSON object"),
            ("{amount}", "--parameters: expected a JSON object"),
        ],
    )
    def test_wrong_parameters_are_named(
        self, light_field: Path, tmp_path: Path, parameters: str, expected: str
    ) -> None:
        base = ["--light-field", light_field, "--choice", "constant", "--output", tmp_path / "o.h5"]
        assert expected in error_of(call(*base, "--parameters", parameters, of=FIRST))

    def test_maps_of_another_size_are_refused(self, light_field: Path, tmp_path: Path) -> None:
        with h5py.File(tmp_path / "small.h5", "w") as file:
            file["disparity"] = file["confidence"] = np.zeros((4, 4), np.float32)
        base = ["--light-field", light_field, "--choice", "constant", "--output", tmp_path / "o.h5"]
        error = error_of(call(*base, "--previous", tmp_path / "small.h5", of=SECOND))
        assert "small.h5: maps have shape (4, 4); expected" in error


# a stage that says when it has begun and then waits inside the writing of its file
SLOW = """
import sys, time
from pathlib import Path
from sepi.process.command import stage_command
from sepi.stage import Choice, NoParameters, StageMaps
import numpy as np
from sepi.io import hdf5
from sepi.io.files import atomic_path

def slow(light_field, previous, parameters, progress):
    return StageMaps(np.zeros((8, 10), np.float32), np.zeros((8, 10), np.float32))

def write_slowly(path, maps, attributes):
    with atomic_path(path) as temporary:
        temporary.write_bytes(b"half")
        print("writing", flush=True)
        # a signal just before a sleep begins does not end that sleep
        for _ in range(600):
            time.sleep(0.1)

hdf5.write_stage = write_slowly
stage_command("slow", {"slow": Choice(NoParameters, slow, own_steps=True)})()
"""


def test_a_stopped_command_leaves_no_half_file(light_field: Path, tmp_path: Path) -> None:
    """Snakemake stops its jobs by SIGTERM."""
    words = ["--light-field", str(light_field), "--choice", "slow", "--output", str(tmp_path / "out" / "slow.h5")]
    process = subprocess.Popen(
        [sys.executable, "-c", SLOW, *words],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        env=os.environ | {"PYTHONPATH": str(Path(__file__).parents[1])},
    )
    assert process.stdout.readline() == "writing\n"
    assert len(files(tmp_path / "out")) == 1
    started = time.monotonic()
    process.terminate()
    _, stderr = process.communicate(timeout=30)
    assert time.monotonic() - started < 20
    assert process.returncode != 0
    assert "Traceback" not in stderr
    assert files(tmp_path / "out") == []
