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
from sepi.evaluate import score
from sepi.lightfield import LightField
from sepi.pipeline import estimate_depth

SIZE = 144
# first row and column of the part
CORNERS = {"cotton": (60, 120), "antinous": (120, 200)}
# MSE x100 and Q25 x100 that a method must stay below, a tenth above what was seen
BOUNDS: dict[str, dict[str, tuple[float, float]]] = {
    "oavc": {"cotton": (1.1, 0.17), "antinous": (11.0, 0.79)},
    "cae": {"cotton": (2.7, 0.18), "antinous": (56.0, 0.78)},
    "pobr": {"cotton": (15.0, 0.16), "antinous": (58.0, 0.57)},
    "spo": {"cotton": (2.6, 0.73), "antinous": (9.9, 1.1)},
    "mishiba": {"cotton": (1.4, 0.4), "antinous": (8.1, 0.8)},
    "acc": {"cotton": (23.0, 0.89), "antinous": (69.0, 1.2)},
    "occ": {"cotton": (2.6, 0.43), "antinous": (18.0, 1.2)},
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
