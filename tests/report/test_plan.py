"""The plan of a report: which files it needs, and as text."""

import json
from dataclasses import replace
from pathlib import Path

import pytest

from sepi.errors import SepiError
from sepi.report.plan import Plan


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("{", "plan: expected JSON"),
        # deeper than Python's parser goes
        ("[" * 100_000, "plan: expected JSON"),
        ('{"scenes": {}}', "plan: expected JSON"),
        ('{"scenes": {}, "variants": {"mine": {"initial": "sepi"}}}', "no variant 'paper'"),
        ('{"scenes": [], "variants": {}}', "plan: expected JSON"),
        ('{"scenes": {"hci": "cotton"}, "variants": {}}', "plan: expected JSON"),
        ('{"scenes": {}, "variants": {"paper": {}}, "external": "SPO"}', "plan: expected JSON"),
    ],
)
def test_a_wrong_plan_is_a_clear_error(text: str, message: str) -> None:
    with pytest.raises(SepiError, match=message):
        Plan.from_json(Path("results"), text)


def test_parts_of_best_are_in_no_other_report(complete: Plan) -> None:
    """They would crowd the tables, and their numbers cost time."""
    assert list(complete.main().variants) == ["paper", "best"]
    assert list(complete.parts_of_best().variants) == ["best", "best_wls"]


def test_a_plan_comes_back_from_its_text(plan: Plan) -> None:
    """External may be left out, as in the plans that only draw pictures."""
    whole = replace(plan, scenes={"hci": ("cotton",)}, external=("SPO", "a b"))
    assert Plan.from_json(plan.results, whole.to_json()) == whole
    without = {key: value for key, value in json.loads(whole.to_json()).items() if key != "external"}
    assert Plan.from_json(plan.results, json.dumps(without)).external == ()
    assert whole.files("hci", "cotton").external == plan.results / "hci/cotton/external.h5"
    assert whole.files("hci", "cotton").external in whole.map_inputs("hci", "cotton")
