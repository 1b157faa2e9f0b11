"""The report of the compared methods: what is computed here beside what was published for the same method."""

from pathlib import Path

import pytest
from report_results import SCENES, VARIANTS, choices

from sepi import variants as built_in
from sepi.report.plan import Plan
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
