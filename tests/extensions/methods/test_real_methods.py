"""The compared methods on real benchmark scenes: their figures must stay those that the documents state.

A part of each scene stands for the whole, which all of them together would take minutes for.
"""

from pathlib import Path

import pytest
from real_scenes import part

from sepi.pipeline import estimate_depth
from sepi.scoring.scores import score
from sepi.variants import compared_methods

SIZE = 48
# first row and column of the part, which has a depth step; for one method another, with no fewer errors than usual
CORNERS = {"cotton": (100, 150), "antinous": (160, 240)}
OTHER_CORNERS = {("acc", "cotton"): (100, 160)}
# MSE x100 and Q25 x100 that a method must stay below: a tenth, or about three pixels at the step, above what was seen
BOUNDS: dict[str, dict[str, tuple[float, float]]] = {
    "oavc": {"cotton": (0.7, 0.083), "antinous": (27, 0.86)},
    "cae": {"cotton": (1.3, 0.077), "antinous": (13, 0.75)},
    "pobr": {"cotton": (25, 0.12), "antinous": (20, 0.39)},
    "spo": {"cotton": (0.7, 0.108), "antinous": (31, 1.04)},
    "mishiba": {"cotton": (1.8, 0.23), "antinous": (28, 1)},
    "acc": {"cotton": (44, 1.5), "antinous": (21, 0.98)},
    "occ": {"cotton": (2.3, 0.32), "antinous": (12.2, 0.7)},
}


@pytest.mark.parametrize("method", compared_methods())
@pytest.mark.parametrize("name", CORNERS)
def test_a_compared_method_keeps_its_accuracy(hci: Path, name: str, method: str) -> None:
    """A compared method that got worse unseen would make ours look better."""
    light_field = part(hci / name, SIZE, OTHER_CORNERS.get((method, name), CORNERS[name]))
    found = score(estimate_depth(light_field, method).disparity, light_field.ground_truth)
    mse, q25 = BOUNDS[method][name]
    assert found["mse100"] <= mse
    assert found["q25"] <= q25
