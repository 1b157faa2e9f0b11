"""The table of the error bars: coverage and width side by side, by scene and region, and over all scenes together."""

from typing import Any

import pytest
from report_results import ABOVE, BELOW, SIZE, csv_rows, markdown, only

from sepi.report.runs import Runs
from sepi.report.tabular.error_bars import pooled_reliability, variants_with_bars

# what stage_maps adds to the truth in the paper's final map, of four scenes with truth; intervals reach 0.15 below it
ERROR = {"dots": 0.1, "flat": 0.2, "cotton": 0.1, "mine": 0.2}
HELD = {scene: 100.0 * (error <= BELOW) for scene, error in ERROR.items()}


def test_coverage_stands_beside_width_for_every_scene(found: dict[str, Any]) -> None:
    rows = csv_rows(found, "error_bars")
    for scene, held in HELD.items():
        row = only(rows, scene=scene, variant="paper", region="all")
        assert float(row["coverage"]) == held
        assert float(row["width"]) == pytest.approx(BELOW + ABOVE, abs=1e-4)
        # errors are all alike: no order is better than another
        assert [float(row[name]) for name in ("ause", "ause_confidence")] == pytest.approx([0, 0], abs=1e-3)
    assert not any(row["scene"] == "picture" for row in rows), "no ground truth"
    page = markdown(found, "error_bars")
    assert "| builtin/dots | paper | 100.00 | 0.2000 |" in page
    assert "all, coverage % | all, width | occluded, coverage % | occluded, width |" in page
    assert "| builtin/flat | 0.00 | 0.2000 | n/a | n/a |" in page


def test_all_scenes_together_are_means_over_their_pixels(found: dict[str, Any]) -> None:
    """Three scenes have 200 occluded pixels each, one none: an average of scenes would have no figure for it."""
    rows = csv_rows(found, "error_bars")
    whole, occluded = (only(rows, scene="all scenes", region=region) for region in ("all", "occluded"))
    assert (whole["pixels"], occluded["pixels"]) == (str(4 * SIZE**2), str(3 * 5 * SIZE))
    assert float(whole["coverage"]) == 50
    assert float(occluded["coverage"]) == pytest.approx(200 / 3, abs=1e-3)
    # a confidence of 0.5 for errors of at most 0.28, which all are; half of the pixels would be said if they were not
    runs = Runs(found)
    reliability = pooled_reliability(runs, "paper", runs.scored_pairs())
    assert (reliability.pixels[5], reliability.said[5], reliability.found[5]) == (4 * SIZE**2, 0.5, 1)
    assert float(whole["gap"]) == 50


def test_best_comes_first_and_parts_of_it_do_not(external: dict[str, Any], found: dict[str, Any]) -> None:
    assert variants_with_bars(Runs(external)) == ["best", "paper"]
    assert variants_with_bars(Runs(found)) == ["paper"]
    assert [section["heading"] for section in external["tables"]["error_bars"]["sections"]] == [
        "",
        "Regions, variant best",
    ]
