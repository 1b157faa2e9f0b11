"""Scores at depth discontinuities, as the report shows them."""

from typing import Any

import pytest
from report_results import csv_rows, markdown, numbers_of, only

from sepi.report.plan import Plan
from sepi.scoring.scores import SCORED_REGIONS


def test_ours_and_other_methods_stand_in_the_table_of_edges(complete: Plan, external: dict[str, Any]) -> None:
    """Scenes of one slanted plane: nothing lies at an edge, all of it away."""
    rows = csv_rows(numbers_of(complete), "edges")
    assert {row["variant"] for row in rows} == {"best", "paper", "SPO", "zhou"}
    row = only(rows, scene="cotton", variant="best")
    assert (row["area"], row["squared_error"], row["fattening"]) == ("0.0000", "0.0000", "nan")
    assert float(row["mse100_away"]) == pytest.approx(0.25, abs=1e-3)
    of_external = csv_rows(external, "edges")
    assert {row["variant"] for row in of_external if row["scene"] == "cotton"} >= {"paper", "SPO", "zhou"}
    assert not [row for row in of_external if row["scene"] == "picture"]
    assert "| hci/cotton | SPO | 0.00 |" in markdown(external, "edges")


def test_numbers_hold_every_region(found: dict[str, Any]) -> None:
    (cotton,) = (scene for scene in found["scenes"] if scene["scene"] == "cotton")
    assert all(list(stage["scores"]["paper"]) == list(SCORED_REGIONS) for stage in cotton["stages"].values())
