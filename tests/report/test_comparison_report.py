"""The report of the compared methods: what is computed here beside what was published for the same method."""

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import pytest
from click.testing import CliRunner
from report_results import SCENES, VARIANTS, cells_of, csv_rows, numbers_of, only, with_results

from sepi import variants as built_in
from sepi.report import numbers, published, tables
from sepi.report.plan import COMPARISON_TABLES, Plan
from sepi.variants import compared_methods, needing_files

pytestmark = pytest.mark.extension("methods")


def choices(*names: str) -> Mapping[str, Mapping[str, str]]:
    return {name: built_in.VARIANTS[name].labels for name in names}


@pytest.fixture(scope="session")
def comparison(tmp_path_factory: pytest.TempPathFactory) -> Plan:
    """Results of two of ours and one compared method on a scene of the paper's and one that it does not have."""
    variants = VARIANTS | choices("best", "fast", "best_wls", "spo", "onnx")
    folder = tmp_path_factory.mktemp("comparison")
    whole = Plan(folder, {"hci": ["cotton", "mine"], "builtin": SCENES["builtin"]}, variants)
    return with_results(whole.comparison())


@pytest.fixture(scope="session")
def compared(comparison: Plan) -> dict[str, Any]:
    return numbers_of(comparison)


def test_the_comparison_has_ours_and_the_methods_and_nothing_else(comparison: Plan) -> None:
    """Reductions of the paper's method, parts of best, and networks that the package does not bring cost time."""
    assert list(comparison.variants) == ["best", "fast", "paper", "spo"] == comparison.compared == comparison.listed
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
    assert not set(plan.listed) & {*compared_methods(), *needing_files()}
    assert not set(plan.compared) & {*compared_methods(), *needing_files()}
    assert set(compared_methods()) < set(plan.comparison().listed)


def test_every_compared_method_has_a_published_counterpart() -> None:
    """Its figures would stand beside those of another method."""
    learned_nothing = [one for one in published.methods().values() if one.learning == "none"]
    assert {one.variant for one in learned_nothing} == {"paper", *compared_methods()}
    assert {published.counterpart(variant).key for variant in ("best", "fast", "mine", "paper")} == {"zhou"}


def test_computed_figures_stand_beside_the_published_ones_of_the_same_method(compared: dict[str, Any]) -> None:
    """Errors here are 0.1 + 0.1 (spo) and 0.1 (paper); on cotton the paper prints 1.94 and 0.52, and 1.20 and 0.34."""
    row = only(csv_rows(compared, "methods"), dataset="hci", scene="cotton", variant="spo")
    assert (row["method"], row["mse100_published"], row["q25_published"]) == ("Zhang et al. (SPO)", "1.94", "0.52")
    assert float(row["mse100"]) == pytest.approx(4, rel=1e-3)
    assert float(row["mse100_ratio"]) == pytest.approx(4 / 1.94, rel=1e-3)
    assert float(row["q25_ratio"]) == pytest.approx(20 / 0.52, rel=1e-3)
    ours = only(csv_rows(compared, "methods"), dataset="hci", scene="cotton", variant="paper")
    assert float(ours["mse100_ratio"]) == pytest.approx(1 / 1.20, rel=1e-3)
    # a built-in scene called like one of the benchmark's is not that
    own = only(csv_rows(compared, "methods"), dataset="builtin", scene="dots", variant="spo")
    assert (own["mse100_published"], own["mse100_ratio"]) == ("", "")


def test_time_and_memory_are_of_the_stages_that_run(compared: dict[str, Any]) -> None:
    """Four stages of 1.5 s; spo has two or three."""
    found = {row["variant"]: row for row in csv_rows(compared, "methods") if row["scene"] == "cotton"}
    assert float(found["paper"]["seconds"]) == 6
    stages = [choice for choice in built_in.VARIANTS["spo"].choices.values() if choice != "none"]
    assert float(found["spo"]["seconds"]) == 1.5 * len(stages)


def test_tables_1_and_2_divide_by_the_methods_own_published_figure(compared: dict[str, Any]) -> None:
    """Divided by that of the paper's method, a faithful computation would look wrong."""
    row = only(csv_rows(compared, "table1_mse"), dataset="hci", scene="Cotton")
    assert float(row["ours_spo"]) == pytest.approx(4, rel=1e-3)
    assert float(row["ratio_spo"]) == pytest.approx(4 / 1.94, rel=1e-3)
    assert float(row["ratio_best"]) == pytest.approx(float(row["ours_best"]) / 1.20, rel=1e-3)


def test_tables_are_those_of_the_comparison(compared: dict[str, Any], tmp_path: Path) -> None:
    assert tuple(compared["tables"]) == COMPARISON_TABLES
    path = tmp_path / "numbers.json"
    path.write_text(numbers.as_text(compared), encoding="utf-8")
    words = ["--numbers", str(path), "--output", str(tmp_path / "out")]
    assert CliRunner().invoke(tables.command, words).exit_code == 0
    assert {file.stem for file in (tmp_path / "out").iterdir()} == set(COMPARISON_TABLES)
    cells = cells_of(compared, "methods", "hci/cotton", "best")
    assert (cells["MSE x100"]["mark"], cells["MSE x100, published"]["kind"]) == ("best", "published")


@pytest.mark.extension("page")
def test_the_page_is_about_the_methods(compared: dict[str, Any]) -> None:
    """Headings of the ablation would promise what is not there."""
    from sepi.extensions.page.page import page_of

    page = page_of(compared, [], "<svg></svg>")
    assert "<h1>Light field depth: the compared methods, computed</h1>" in page
    assert "this code, spo" in page
    assert "<h2>Ablation</h2>" not in page
    assert json.dumps("table4_ablation") not in page
