"""Results and numbers that the tests of the report share; none of them may be changed."""

from typing import Any

import pytest
from report_results import EXTERNAL, SCENES, VARIANTS, numbers_of, with_results

from sepi import variants as built_in
from sepi.report.plan import Plan


@pytest.fixture(scope="session")
def plan(tmp_path_factory: pytest.TempPathFactory) -> Plan:
    """Results of five scenes (one built-in called like a benchmark scene, one picture without truth) and 3 variants."""
    return with_results(Plan(tmp_path_factory.mktemp("results"), SCENES, VARIANTS))


@pytest.fixture(scope="session")
def found(plan: Plan) -> dict[str, Any]:
    """The numbers of these."""
    return numbers_of(plan)


@pytest.fixture(scope="session")
def external(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Any]:
    """Numbers of four scenes with best, the paper's variant, and maps of three other methods."""
    variants = {"paper": VARIANTS["paper"], "best": built_in.VARIANTS["best"].choices}
    scenes = {"builtin": ["dots"], "hci": ["cotton", "mine", "picture"]}
    return numbers_of(with_results(Plan(tmp_path_factory.mktemp("external"), scenes, variants, tuple(EXTERNAL))))


@pytest.fixture(scope="session")
def complete(tmp_path_factory: pytest.TempPathFactory) -> Plan:
    """Results of one scene with best, one of its parts, and maps of other methods."""
    variants = {name: built_in.VARIANTS[name].choices for name in ("paper", "best", "best_wls")}
    return with_results(Plan(tmp_path_factory.mktemp("complete"), {"hci": ["cotton"]}, variants, ("SPO", "zhou")))
