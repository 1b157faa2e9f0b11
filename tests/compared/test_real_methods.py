"""The compared methods on real benchmark scenes: their figures must stay those that the documents state.

A part of each scene stands for the whole, which all of them together would take minutes for.
"""

from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from real_scenes import scene

from sepi.compared.methods import METHODS
from sepi.lightfield import LightField
from sepi.pipeline import estimate_depth
from sepi.scoring.scores import score

SIZE = 96
# first row and column of the part
CORNERS = {"cotton": (60, 120), "antinous": (120, 200)}
# MSE x100 and Q25 x100 that a method must stay below, a tenth above what was seen
BOUNDS: dict[str, dict[str, tuple[float, float]]] = {
    "oavc": {"cotton": (1.1, 0.096), "antinous": (28.0, 0.84)},
    "cae": {"cotton": (2.9, 0.072), "antinous": (34.0, 0.77)},
    "pobr": {"cotton": (16.0, 0.09), "antinous": (26.0, 0.5)},
    "spo": {"cotton": (2.3, 0.09), "antinous": (30.1, 1.4)},
    "mishiba": {"cotton": (1.3, 0.28), "antinous": (30.0, 0.95)},
    "acc": {"cotton": (19.0, 1.0), "antinous": (27.0, 1.1)},
    "occ": {"cotton": (5.2, 0.42), "antinous": (21.0, 0.93)},
}


@cache
def part(folder: Path) -> LightField:
    """A part of a scene, with the range of the whole."""
    whole, (y, x) = scene(folder), CORNERS[folder.name]
    inside = np.s_[y : y + SIZE, x : x + SIZE]
    assert whole.ground_truth is not None
    return replace(
        whole, views=whole.views[:, :, *inside].copy(), ground_truth=whole.ground_truth[inside].copy(), masks={}
    )


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("name", CORNERS)
def test_a_compared_method_keeps_its_accuracy(hci: Path, name: str, method: str) -> None:
    """A compared method that got worse unseen would make ours look better."""
    light_field = part(hci / name)
    found = score(estimate_depth(light_field, method).disparity, light_field.ground_truth)
    mse, q25 = BOUNDS[method][name]
    assert found["mse100"] <= mse
    assert found["q25"] <= q25
