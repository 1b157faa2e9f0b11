"""Tables of scores, times and error bars: which rows they have, and what is pooled."""

import copy
from dataclasses import replace

import pytest
from report_results import SIZE, csv_rows, markdown, only, report_of

from sepi.report.properties import variants_with_bars
from sepi.report.runs import Runs
from sepi.scoring.scores import SCORED_REGIONS


def test_ours_and_other_methods_stand_in_the_table_of_edges(external: Runs) -> None:
    rows = csv_rows(external, "edges")
    assert {row["variant"] for row in rows if row["scene"] == "cotton"} == {"best", "paper", "SPO", "zhou"}


def test_numbers_hold_every_region(found: Runs) -> None:
    cotton = found.maps.xs(("cotton", "paper"), level=("scene", "protocol"))
    for _, regions in cotton.reset_index().groupby(["variant", "stage"])["region"]:
        assert list(regions) == list(SCORED_REGIONS)


@pytest.mark.parametrize(
    ("scene", "variant", "ratio"), [("cotton", "paper", "300.1000"), ("cotton", "best", ""), ("mine", "paper", "")]
)
def test_published_seconds_are_divided_by_ours(scene: str, variant: str, ratio: str, external: Runs) -> None:
    """Another number of pixels is other work, and its ratio would flatter."""
    facts = copy.deepcopy(external.facts)
    for one in facts["scenes"]:
        if one["scene"] == "cotton":
            one["light_field"] |= {"shape": [512, 512], "grid": [9, 9]}
    found = replace(external, facts=facts)
    row = only(csv_rows(found, "runtime"), scene=scene, variant=variant, stage="total")
    assert (row["seconds"], row["ratio"]) == ("6.0000", ratio)
    assert "| paper | 1.50 | 1.50 | 1.50 | 1.50 | 6.00 | 300.10 | 310.00 |" in markdown(found, "runtime")


def test_reliability_is_over_the_pixels_of_all_scenes(found: Runs) -> None:
    """A confidence of 0.5 for errors of at most 0.28, which all are."""
    reliability = found.reliability("paper", found.scored_pairs)
    assert (reliability.pixels[5], reliability.said[5], reliability.found[5]) == (4 * SIZE**2, 0.5, 1)


def test_best_comes_first_and_parts_of_it_do_not(external: Runs, found: Runs) -> None:
    assert variants_with_bars(external) == ["best", "paper"]
    assert variants_with_bars(found) == ["paper"]
    headings = [section.heading for section in report_of(external, "error_bars").sections]
    assert headings == ["", "Regions, variant best"]
