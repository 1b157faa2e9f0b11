"""The compared methods on real benchmark scenes: their figures must stay those that the documents state.

A part of each scene stands for the whole, which all of them together would take minutes for.
"""

from pathlib import Path

import pytest
from real_scenes import part

from sepi.compared.methods import METHODS
from sepi.pipeline import estimate_depth
from sepi.scoring.scores import score

SIZE = 64
# first row and column of the part, which has a depth step
CORNERS = {"cotton": (92, 152), "antinous": (152, 232)}
# MSE x100 and Q25 x100 that a method must stay below, a tenth above what was seen
BOUNDS: dict[str, dict[str, tuple[float, float]]] = {
    "oavc": {"cotton": (2.6, 0.11), "antinous": (64, 0.86)},
    "cae": {"cotton": (6.5, 0.13), "antinous": (74, 0.75)},
    "pobr": {"cotton": (36, 0.13), "antinous": (59, 0.44)},
    "spo": {"cotton": (5.1, 0.11), "antinous": (71, 1.3)},
    "mishiba": {"cotton": (3.2, 0.29), "antinous": (68, 1.1)},
    "acc": {"cotton": (44, 1.5), "antinous": (61, 1.2)},
    "occ": {"cotton": (12, 0.4), "antinous": (44, 0.82)},
}


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("name", CORNERS)
def test_a_compared_method_keeps_its_accuracy(hci: Path, name: str, method: str) -> None:
    """A compared method that got worse unseen would make ours look better."""
    light_field = part(hci / name, SIZE, CORNERS[name])
    found = score(estimate_depth(light_field, method).disparity, light_field.ground_truth)
    mse, q25 = BOUNDS[method][name]
    assert found["mse100"] <= mse
    assert found["q25"] <= q25
