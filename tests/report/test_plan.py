"""The plan of a report: which files it needs, and as text."""

import json
from dataclasses import replace
from pathlib import Path

import pytest
from report_results import SCENES, VARIANTS

from sepi.errors import SepiError
from sepi.report.plan import Plan
from sepi.workflow.result_paths import stage_of


def test_variants_share_the_files_of_their_first_stages(plan: Plan) -> None:
    files = [plan.stage_file("hci", "cotton", variant, "initial") for variant in VARIANTS]
    assert len(set(files)) == 1
    assert files[0] == plan.results / "hci/cotton/stages/sepi/initial.h5"
    # of each scene: scores, times of nine stages, light field and ground truth
    assert len(plan.number_inputs()) == 5 * (1 + 9 + 2)


def test_a_stage_that_hands_its_maps_on_has_no_file() -> None:
    """Choice none is no job: what is asked for after it is the file before."""
    handed_on = {"initial": "sepi", "occlusion": "none", "textureless": "none", "optimize": "none"}
    made = Plan(Path("results"), SCENES, VARIANTS | {"mine": handed_on})
    folder = Path("results/hci/cotton/stages/sepi")
    assert made.stage_file("hci", "cotton", "no_occlusion", "occlusion") == folder / "initial.h5"
    assert made.stage_file("hci", "cotton", "no_occlusion", "textureless") == folder / "none/lti/textureless.h5"
    assert made.stage_file("hci", "cotton", "mine", "optimize") == folder / "initial.h5"
    assert stage_of(made.stage_key("mine", "optimize")) == "initial"


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


def test_a_plan_comes_back_from_its_text(plan: Plan) -> None:
    """External may be left out, as in the plans that only draw pictures."""
    whole = replace(plan, scenes={"hci": ("cotton",)}, external=("SPO", "a b"))
    assert Plan.from_json(plan.results, whole.to_json()) == whole
    without = {key: value for key, value in json.loads(whole.to_json()).items() if key != "external"}
    assert Plan.from_json(plan.results, json.dumps(without)).external == ()
    assert whole.external_file("hci", "cotton") == plan.results / "hci/cotton/external.h5"
    assert whole.external_file("hci", "cotton") in whole.map_inputs("hci", "cotton")
