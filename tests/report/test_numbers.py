"""The numbers of a report: all that its inputs say, and nothing from elsewhere."""

import hashlib
import json
import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from click.testing import CliRunner
from report_results import MACHINE, SIZE, cells_of, light_field, linked

from sepi.errors import SepiError
from sepi.io.scores import read_evaluations, write_scores
from sepi.report import numbers
from sepi.report.numbers import collect
from sepi.report.plan import PARTS_TABLES, TABLES, Plan
from sepi.report.runs import Runs


@pytest.mark.parametrize("parts", [False, True])
def test_numbers_read_their_declared_inputs_and_no_others(parts: bool, complete: Plan, tmp_path: Path) -> None:
    """The workflow collects them when these are there; one that is not read would make it run again for nothing."""
    there = linked(complete, tmp_path, parts)
    assert set(collect(there, parts=parts)["tables"]) == {name for name in TABLES if (name in PARTS_TABLES) == parts}
    for path in there.number_inputs(parts):
        away = path.rename(path.with_name("away"))
        with pytest.raises(SepiError, match=re.escape(str(path))):
            collect(there, parts=parts)
        away.rename(path)


@pytest.mark.parametrize("ending", ["lightfield.h5", "truth.h5", "scores.h5", "time.json", "external.h5"])
@pytest.mark.parametrize("content", [None, b"", b"[1]"])
def test_a_missing_or_broken_file_is_one_line(
    ending: str, content: bytes | None, complete: Plan, tmp_path: Path
) -> None:
    there = linked(complete, tmp_path / "results")
    path = next(path for path in there.number_inputs() if path.name.endswith(ending))
    path.unlink()
    if content is not None:
        path.write_bytes(content)
    about = tmp_path / "plan.json"
    about.write_text(there.to_json())
    arguments = ["--results", str(there.results), "--plan", str(about), "--output", str(tmp_path / "out.json")]
    result = CliRunner().invoke(numbers.command, arguments)
    assert result.exit_code == 1
    assert result.output.startswith(f"sepi: {path}: ")
    assert len(result.output.splitlines()) == 1
    assert not (tmp_path / "out.json").exists()


def test_a_map_without_scores_is_named(plan: Plan, tmp_path: Path) -> None:
    """Scores of an earlier configuration, say: a table must not go on without a row."""
    there = linked(plan, tmp_path / "results")
    path = there.scores_file("hci", "cotton")
    scored = read_evaluations(path)
    path.unlink()
    write_scores(path, {"sepi": scored["sepi"]}, {"scene": "cotton"})
    with pytest.raises(SepiError, match=r"cotton/scores.h5: no scores of 'sepi/half_sepi'; it holds: sepi$"):
        collect(there)


def test_numbers_say_what_they_are_of(complete: Plan, tmp_path: Path) -> None:
    """Versions and parameters are those that the maps were made with, wherever and whenever they are collected."""
    there = linked(complete, tmp_path)
    path = there.stage_file("hci", "cotton", "paper", "optimize", "time.json")
    changed = json.loads(path.read_text()) | {"machine": {**MACHINE, "sepi": "0.0.2"}, "parameters": {"words": 1}}
    path.unlink()
    path.write_text(json.dumps(changed))
    found = collect(there)
    assert re.fullmatch(r"\d{4}-\d\d-\d\dT\d\d:\d\d:\d\d[+-]\d\d:\d\d", found["made"]["date"])
    assert found["made"]["machines"] == [MACHINE, {**MACHINE, "sepi": "0.0.2"}]
    assert found["protocols"] == {"paper": 0, "benchmark": 15}
    assert found["plan"]["external"] == ["SPO", "zhou"]
    assert found["parameters"]["initial"]["sepi"] == [{"words": 7}]
    assert found["parameters"]["optimize"]["wls"] == [{"words": 1}]
    (scene,) = found["scenes"]
    known = light_field("cotton")
    assert known.ground_truth is not None
    expected = {
        "grid": [3, 3],
        "row_spacing": 1.0,
        "positions": "grid",
        "baselines": None,
        "shape": [SIZE, SIZE],
        "channels": 3,
        "dtype": "uint8",
        "source": "test",
        "range": [-1.5, 1.5],
        "range_source": "given",
        "ground_truth": True,
        "masks": ["occluded", "textureless"],
        "notes": [],
        "camera": None,
        "sha256": hashlib.sha256(known.views.tobytes()).hexdigest(),
        "ground_truth_sha256": hashlib.sha256(known.ground_truth.tobytes()).hexdigest(),
    }
    assert scene["light_field"] == expected
    assert list(scene["stages"])[:2] == ["sepi", "sepi/half_sepi"]
    first = scene["stages"]["sepi"]
    assert (first["stage"], first["seconds"], first["peak_memory_mb"]) == ("initial", 1.5, 270)
    assert first["scores"]["paper"]["all"]["mse100"] == pytest.approx(16)
    pixels, said, shares = scene["stages"][complete.stage_key("best", "optimize")]["reliability"]
    assert (pixels[5], said[5], shares[5]) == (SIZE**2, 0.5, 1.0)
    assert first["reliability"] is None, "no final map"
    spo = scene["external"]["SPO"]
    assert (spo["problem"], spo["source"], spo["sha256"]) == ("", "/maps/some.pfm", 64 * "a")
    assert spo["scores"]["benchmark"]["all"]["mse100"] == pytest.approx(4)


def test_numbers_of_the_parts_hold_only_these(complete: Plan) -> None:
    (scene,) = collect(complete, parts=True)["scenes"]
    assert set(scene) == {"dataset", "scene", "stages"}
    assert set(scene["stages"]) == {
        *(complete.stage_key("best", stage) for stage in complete.stages),
        complete.stage_key("best_wls", "optimize"),
    }
    assert [stage["scores"] is None for stage in scene["stages"].values()] == [True, True, True, False, False]


def test_a_stage_that_hands_its_maps_on_has_scores_and_no_time(found: dict[str, Any]) -> None:
    runs = Runs(found)
    scores, handed_on = (runs.scores("hci", "cotton", "no_occlusion", stage) for stage in ("initial", "occlusion"))
    assert handed_on == scores
    assert runs.timing("hci", "cotton", "no_occlusion", "occlusion").seconds == 0
    assert runs.timing("hci", "cotton", "no_occlusion", "optimize").seconds == 1.5


def test_a_score_over_no_pixels_is_null_and_comes_back(found: dict[str, Any]) -> None:
    """JSON has no NaN (numbers_of refuses one): a browser refuses a file that does."""
    (flat,) = [scene for scene in found["scenes"] if scene["scene"] == "flat"]
    assert flat["stages"]["sepi"]["scores"]["paper"]["occluded"]["mse100"] is None
    assert np.isnan(Runs(found).final("builtin", "flat", "mse100", "occluded"))
    cells = cells_of(found, "table4_ablation", "builtin", "flat")
    assert (cells["paper"]["text"], cells["paper"]["value"]) == ("4.00/n/a/4.00", 4)


def test_numbers_are_the_same_text_each_time(plan: Plan) -> None:
    """All but when and where they were made; a difference shows one score per line."""
    one, two = (numbers.as_text(collect(plan) | {"made": {}}) for _ in range(2))
    assert one == two
    assert re.search(r'^ +"pixels": 1600,?$', one, re.MULTILINE)
