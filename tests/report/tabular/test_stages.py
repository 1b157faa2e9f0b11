"""Scores after each stage, and run times."""

import copy
from typing import Any

import pytest
from report_results import VARIANTS, csv_rows, markdown, only

from sepi.external import NO_FILE


def test_stage_table_follows_the_stages(found: dict[str, Any]) -> None:
    rows = [row for row in csv_rows(found, "stages") if row["scene"] == "cotton" and row["variant"] == "wang"]
    whole = [row for row in rows if row["protocol"] == "benchmark" and row["region"] == "all"]
    assert [(row["stage"], row["choice"]) for row in whole] == list(VARIANTS["wang"].items())
    assert [row["mse100"] for row in whole] == ["36.0000", "25.0000", "16.0000", "9.0000"]
    assert {(row["pixels"], row["non_finite"]) for row in whole} == {("100", "0")}
    assert len(rows) == 4 * 2 * 3


def test_other_methods_maps_stand_below(external: dict[str, Any]) -> None:
    rows = [row for row in csv_rows(external, "stages") if row["stage"] == "external"]
    for protocol, pixels in (("paper", "1600"), ("benchmark", "100")):
        row = only(rows, scene="cotton", variant="SPO", protocol=protocol, region="all")
        assert (row["mse100"], row["badpix007"], row["pixels"]) == ("4.0000", "100.0000", pixels)
    missing = only(rows, scene="mine", variant="SPO", protocol="paper", region="occluded")
    assert (missing["mse100"], missing["pixels"]) == (NO_FILE, "")
    assert not [row for row in rows if row["scene"] == "picture"]
    assert "| SPO | external | 4.00 | 20.00 | 100.00 |" in markdown(external, "stages")


def test_runtime_table(found: dict[str, Any]) -> None:
    rows = [row for row in csv_rows(found, "runtime") if row["scene"] == "picture"]
    total = only(rows, variant="paper", stage="total")
    assert (total["seconds"], total["peak_memory_mb"]) == ("6.0000", "310.0000")
    assert total["published_seconds"] == "1800.60"
    assert only(rows, variant="wang", stage="initial")["published_seconds"] == ""
    assert {row["ratio"] for row in rows} == {""}


@pytest.mark.parametrize(
    ("scene", "variant", "ratio"), [("cotton", "paper", "300.1000"), ("cotton", "best", ""), ("mine", "paper", "")]
)
def test_published_seconds_are_divided_by_ours_for_scenes_of_their_size(
    scene: str, variant: str, ratio: str, external: dict[str, Any]
) -> None:
    """Another number of pixels is other work, and its ratio would flatter."""
    found = copy.deepcopy(external)
    for one in found["scenes"]:
        if one["scene"] == "cotton":
            one["light_field"] |= {"shape": [512, 512], "grid": [9, 9]}
    row = only(csv_rows(found, "runtime"), scene=scene, variant=variant, stage="total")
    assert (row["seconds"], row["ratio"]) == ("6.0000", ratio)
    assert "| paper | 1.50 | 1.50 | 1.50 | 1.50 | 6.00 | 300.10 | 310.00 |" in markdown(found, "runtime")
