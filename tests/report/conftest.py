"""Results and numbers that the tests of the report share; none of them may be changed."""

import pytest
from report_results import EXTERNAL, GLOSSY, SCENES, VARIANTS, choices, numbers_of, with_results

from sepi.report.plan import Plan
from sepi.report.runs import Runs


@pytest.fixture(scope="session")
def plan(tmp_path_factory: pytest.TempPathFactory) -> Plan:
    """Results of five scenes (one built-in called like a benchmark scene, one picture without truth) and 3 variants."""
    return with_results(Plan(tmp_path_factory.mktemp("results"), SCENES, VARIANTS))


@pytest.fixture(scope="session")
def found(plan: Plan) -> Runs:
    """The numbers of these."""
    return numbers_of(plan)


@pytest.fixture(scope="session")
def external(tmp_path_factory: pytest.TempPathFactory) -> Runs:
    """Numbers of four scenes with best, the paper's variant, and maps of three other methods."""
    scenes = {"builtin": ["dots"], "hci": ["cotton", "mine", "picture"]}
    variants = {"paper": VARIANTS["paper"], **choices("best")}
    return numbers_of(with_results(Plan(tmp_path_factory.mktemp("external"), scenes, variants, tuple(EXTERNAL))))


@pytest.fixture(scope="session")
def complete(tmp_path_factory: pytest.TempPathFactory) -> Plan:
    """Results of one scene with best, one of its parts, and maps of other methods."""
    variants = choices("paper", "best", "best_wls")
    return with_results(Plan(tmp_path_factory.mktemp("complete"), {"hci": ["cotton"]}, variants, ("SPO", "zhou")))


@pytest.fixture(scope="session")
def single(complete: Plan) -> Runs:
    """The numbers of that scene."""
    return numbers_of(complete.main())


@pytest.fixture(scope="session")
def parts(complete: Plan) -> Runs:
    """The numbers of the parts of best."""
    return numbers_of(complete.parts_of_best())


@pytest.fixture(scope="session")
def comparison(tmp_path_factory: pytest.TempPathFactory) -> Plan:
    """Results of three of ours and one compared method on scenes of the paper's and others."""
    variants = VARIANTS | choices("best", "fast", "best_wls", "spo", "onnx")
    scenes = {"hci": ["cotton", "mine"], "builtin": SCENES["builtin"]}
    return with_results(Plan(tmp_path_factory.mktemp("comparison"), scenes, variants).comparison())


@pytest.fixture(scope="session")
def compared(comparison: Plan) -> Runs:
    """The numbers of these."""
    return numbers_of(comparison)


@pytest.fixture(scope="session")
def rendered(tmp_path_factory: pytest.TempPathFactory) -> Runs:
    """Numbers of two scenes, without noise and with little of two seeds; one method has a map of one scene alone."""
    whole = Plan(tmp_path_factory.mktemp("rendered"), {"hci": ["cotton"]}, VARIANTS | choices("best"), ("SPO",))
    return numbers_of(with_results(whole.rendered(list(GLOSSY), ["sticks"])))
