"""The report of the compared methods: what is computed here beside what was published for the same method."""

import json
from pathlib import Path

import pytest
from report_results import SCENES, VARIANTS, cells_of, choices

from sepi import variants as built_in
from sepi.report import published, tables
from sepi.report.plan import COMPARISON, TABLES, Plan
from sepi.report.runs import Runs
from sepi.variants import compared_methods, needing_files

pytestmark = pytest.mark.extension("methods")


def test_the_comparison_has_ours_and_the_methods_and_nothing_else(comparison: Plan) -> None:
    """Reductions of the paper's method, parts of best, and networks that the package does not bring cost time."""
    assert list(comparison.variants) == ["best", "fast", "paper", "spo"] == comparison.compared
    assert comparison.detailed == ["best", "paper"]
    assert comparison.scores_file("hci", "cotton").name == "scores_comparison.h5"
    assert Plan.from_json(comparison.results, comparison.to_json()) == comparison


def test_a_users_own_variant_is_compared_too() -> None:
    mine = {"mine": {**VARIANTS["paper"], "optimize": "none"}}
    plan = Plan(Path("results"), {"hci": ["cotton"]}, VARIANTS | mine | choices("best", "spo"))
    assert plan.comparison().compared == ["best", "paper", "mine", "spo"]


def test_all_does_not_run_the_compared_methods() -> None:
    """They would take many times as long as all the rest."""
    plan = Plan(Path("results"), SCENES, choices(*built_in.VARIANTS))
    assert not {*plan.main().variants, *plan.main().compared} & {*compared_methods(), *needing_files()}
    assert set(compared_methods()) < {*plan.comparison().variants}


def test_every_compared_method_has_a_published_counterpart() -> None:
    """Its figures would stand beside those of another method."""
    known = published.methods()
    assert {*known.loc[known["learning"] == "none", "variant"]} == {"paper", *compared_methods()}
    assert {published.counterpart(variant) for variant in ("best", "fast", "mine", "paper")} == {"zhou"}


def test_tables_are_those_of_the_comparison(compared: Runs, tmp_path: Path) -> None:
    tables.write_tables(compared, tmp_path)
    assert {file.stem for file in tmp_path.iterdir()} == set(TABLES[COMPARISON])
    cells = cells_of(compared, "methods", "hci/cotton", "best")
    assert (cells["MSE x100"][2], cells["MSE x100, published"][3]) == ("best", "published")


@pytest.mark.extension("page")
def test_the_page_is_about_the_methods(compared: Runs) -> None:
    """Headings of the ablation would promise what is not there."""
    from sepi.extensions.page.page import page_of

    page = page_of(compared, [])
    assert "<h1>Light field depth: the compared methods, computed</h1>" in page
    assert "this code, spo" in page
    assert "<h2>Ablation</h2>" not in page
    assert json.dumps("table4_ablation") not in page
