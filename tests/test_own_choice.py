"""A stage's choice that a caller adds."""

import numpy as np
import pytest
from pydantic import Field

from sepi import variants
from sepi.errors import SepiError
from sepi.lightfield import LightField
from sepi.pipeline import estimate_depth
from sepi.scenes import render
from sepi.stage import Choice, Parameters, Progress, StageMaps, require_previous
from sepi.variants import Variant, add_choice


class ShiftParameters(Parameters):
    by: float = Field(1.0, ge=0, description="pixels per view step")


def shift(
    light_field: LightField, previous: StageMaps | None, parameters: ShiftParameters, progress: Progress
) -> StageMaps:
    before = require_previous(previous)
    return before.updated(before.disparity + np.float32(parameters.by), before.confidence)


@pytest.fixture(autouse=True)
def stages_of_this_test(monkeypatch: pytest.MonkeyPatch) -> None:
    for stage, choices in variants.STAGES.items():
        monkeypatch.setitem(variants.STAGES, stage, dict(choices))
    monkeypatch.setattr(variants, "_ADDED", set())


def test_added_choice_runs_with_its_parameters() -> None:
    """A stage of one's own is ignored, or cannot be told anything."""
    light_field = render("fronto_parallel", size=64, views=3)
    with pytest.raises(SepiError, match="unknown 'shift'"):
        Variant("sepi", "none", "none", "shift")
    add_choice("optimize", "shift", Choice(ShiftParameters, shift))
    plain = estimate_depth(light_field, Variant("sepi", "none", "none", "none")).disparity
    shifted = Variant("sepi", "none", "none", "shift", {"optimize": {"by": 0.5}})
    np.testing.assert_array_equal(estimate_depth(light_field, shifted).disparity, plain + np.float32(0.5))
    with pytest.raises(SepiError, match=r"optimize\.shift\.by: .* got -1"):
        estimate_depth(light_field, shifted, {"optimize": {"by": -1}})


@pytest.mark.parametrize(
    ("stage", "name", "message"),
    [
        ("smoothing", "mine", "stages: unknown 'smoothing'"),
        ("optimize", "wls", "stage optimize: 'wls' is a built-in choice"),
        ("optimize", "a/b", "stage optimize: a choice's name"),
    ],
)
def test_what_cannot_be_added(stage: str, name: str, message: str) -> None:
    """The package's own method is replaced unseen, or a name makes paths and labels that nothing can read."""
    with pytest.raises(SepiError, match=message):
        add_choice(stage, name, Choice(ShiftParameters, shift))
