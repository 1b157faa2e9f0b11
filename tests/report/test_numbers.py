"""The numbers of a report: all that its inputs say, and nothing from elsewhere."""

import hashlib
import json
import re
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from click.testing import CliRunner
from report_results import MACHINE, SIZE, cells_of, light_field, linked, renamed

from sepi.errors import SepiError
from sepi.report import numbers, tables
from sepi.report.numbers import collect
from sepi.report.plan import Plan
from sepi.report.runs import TENTHS, Runs, read_numbers


@pytest.mark.parametrize("parts", [False, True])
def test_numbers_read_their_declared_inputs_and_no_others(parts: bool, complete: Plan, tmp_path: Path) -> None:
    """The workflow collects them when these are there; one that is not read would make it run again for nothing."""
    there = linked(complete.parts_of_best() if parts else complete.main(), tmp_path)
    collect(there)
    for path in there.number_inputs():
        away = path.rename(path.with_name("away"))
        with pytest.raises(SepiError, match=re.escape(str(path))):
            collect(there)
        away.rename(path)


@pytest.mark.parametrize("ending", ["lightfield.h5", "truth.h5", "scores.h5", "time.json", "external.h5"])
@pytest.mark.parametrize("content", [None, b"", b"[1]"])
def test_a_missing_or_broken_file_is_told(ending: str, content: bytes | None, complete: Plan, tmp_path: Path) -> None:
    there = linked(complete.main(), tmp_path / "results")
    path = next(path for path in there.number_inputs() if path.name.endswith(ending))
    path.unlink()
    if content is not None:
        path.write_bytes(content)
    about = tmp_path / "plan.json"
    about.write_text(there.to_json())
    places = [word for to in ("output", "tables", "charts") for word in (f"--{to}", str(tmp_path / "out.json"))]
    result = CliRunner().invoke(tables.command, ["--results", str(there.results), "--plan", str(about), *places])
    assert result.exit_code == 1
    assert result.output.startswith(f"sepi: {path}: ")
    assert len(result.output.splitlines()) == 1
    assert not (tmp_path / "out.json").exists()


def test_numbers_say_what_they_are_of(complete: Plan, tmp_path: Path) -> None:
    """Versions and parameters are those that the maps were made with, wherever and whenever they are collected."""
    there = linked(complete.main(), tmp_path)
    path = there.stage_file("hci", "cotton", "paper", "optimize", "time.json")
    changed = json.loads(path.read_text()) | {"machine": {**MACHINE, "sepi": "0.0.2"}, "parameters": {"words": 1}}
    path.unlink()
    path.write_text(json.dumps(changed))
    runs = collect(there)
    found = runs.facts
    assert re.fullmatch(r"\d{4}-\d\d-\d\dT\d\d:\d\d:\d\d[+-]\d\d:\d\d", found["made"]["date"])
    assert found["made"]["machines"] == [MACHINE, {**MACHINE, "sepi": "0.0.2"}]
    assert found["plan"]["external"] == ["SPO", "zhou"]
    assert found["parameters"]["initial"]["sepi"] == [{"words": 7}]
    assert found["parameters"]["optimize"]["wls"] == [{"words": 1}]
    (scene,) = found["scenes"]
    known = light_field("cotton")
    told = scene["light_field"]
    assert (told["grid"], told["shape"], told["range"], told["range_source"]) == (
        [3, 3],
        [SIZE] * 2,
        [-1.5, 1.5],
        "given",
    )
    assert told["sha256"] == hashlib.sha256(known.views.tobytes()).hexdigest()
    assert told["ground_truth_sha256"] == hashlib.sha256(known.ground_truth.tobytes()).hexdigest()
    first = runs.maps.xs(("paper", "initial"), level=("variant", "stage"))
    assert [*first.xs("", level="protocol")[["seconds", "peak_memory_mb"]].iloc[0]] == [1.5, 270]
    assert [*first.xs(("paper", "all"), level=("protocol", "region"))["mse100"]] == pytest.approx([16])
    assert not first.index.isin([TENTHS], level="protocol").any(), "no final map"
    pixels, said, shares = runs.reliability("best", [("hci", "cotton")])
    assert (pixels[5], said[5], shares[5]) == (SIZE**2, 0.5, 1.0)
    spo = scene["external"]["SPO"]
    assert (spo["problem"], spo["source"], spo["sha256"]) == ("", "/maps/some.pfm", 64 * "a")
    assert [
        *runs.maps.xs(("SPO", "benchmark", "all"), level=("variant", "protocol", "region"))["mse100"]
    ] == pytest.approx([4])


def test_numbers_of_the_parts_hold_only_these(complete: Plan) -> None:
    runs = collect(complete.parts_of_best())
    assert runs.facts["scenes"] == [{"dataset": "hci", "scene": "cotton"}]
    assert set(runs.numbers["variant"]) == {"best", "best_wls"}
    assert set(runs.numbers.loc[runs.numbers["score"] == "mse100", "stage"]) == {"optimize"}
    assert len(runs.numbers[runs.numbers["score"] == "seconds"]) == 2 * len(complete.stages)


def test_a_stage_that_hands_its_maps_on_has_scores_and_no_time(found: Runs) -> None:
    of_variant = found.maps.xs(("cotton", "no_occlusion"), level=("scene", "variant"))
    before, handed_on = (
        of_variant.xs((stage, "paper"), level=("stage", "protocol")).reset_index(drop=True)
        for stage in ("initial", "occlusion")
    )
    pd.testing.assert_frame_equal(handed_on, before)
    took = found.times.sort_index().loc[("hci", "cotton", "no_occlusion"), "seconds"]
    assert [*took.reindex(found.plan.stages, fill_value=0)] == [1.5, 0, 1.5, 1.5]


def test_a_score_over_no_pixels_comes_back(found: Runs) -> None:
    assert np.isnan(found.of("mse100", "builtin", "occluded").at["flat", "ours"])
    cells = cells_of(found, "table4_ablation", "builtin", "flat")
    assert cells["paper"][:2] == ("4.00/n/a/4.00", 4)


def test_files_hold_every_digit(found: Runs, tmp_path: Path) -> None:
    """Tables made of files are those of the run; names that look like numbers or like nothing stay names."""
    names = {"cotton": "007", "mine": "nan", "dots": ' a,"b"\r\n\x85'}
    runs = renamed(found, names)
    numbers.write_numbers(runs, tmp_path / "a.json")
    again = read_numbers(tmp_path / "a.json")
    pd.testing.assert_frame_equal(again.numbers, runs.numbers, check_exact=True)
    assert again.facts == runs.facts
