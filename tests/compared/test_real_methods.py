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
CORNERS = {"cotton": (180, 150), "antinous": (120, 200)}
# MSE x100 and Q25 x100 that a method must stay below, a tenth above what was seen
BOUNDS: dict[str, dict[str, tuple[float, float]]] = {}


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
    assert (found["mse100"], found["q25"]) <= BOUNDS[method][name]
