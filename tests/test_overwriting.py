"""No step that overwrites a map takes a pixel away from a depth that the views know."""

from collections.abc import Callable
from functools import cache
from pathlib import Path

import cv2
import numpy as np
import pytest
from real_scenes import part

from sepi.boundaries.decision import assigned_to_surfaces
from sepi.boundaries.specks import without_specks
from sepi.lightfield import BoolMap, FloatMap, LightField
from sepi.matching.gaps import with_open_gaps
from sepi.matching.view_noise import view_noise
from sepi.matching.view_subsets import spread_views
from sepi.occlusion import VisibilityParameters
from sepi.optimize import SecondOrderParameters, second_order
from sepi.regularization.uniform_regions import UniformPlanesParameters, fill_uniform_regions
from sepi.scenes import render
from sepi.stage import StageMaps, no_progress

_ASKED = VisibilityParameters()

STEPS: dict[str, Callable[[LightField, StageMaps], FloatMap]] = {
    "gaps": lambda field, maps: with_open_gaps(field, maps.disparity, spread_views(field, 25), _ASKED),
    "rims": lambda field, maps: assigned_to_surfaces(field, maps.disparity, _ASKED),
    "specks": lambda field, maps: without_specks(field, maps.disparity, spread_views(field, 41), _ASKED),
    "planes": lambda field, maps: fill_uniform_regions(field, maps, UniformPlanesParameters())[0],
    "smoothing": lambda field, maps: second_order(field, maps, SecondOrderParameters(), no_progress).disparity,
}
# pixels per view step: more than any bar of what is known so well; pixels beside a step, which show both surfaces
FAR, RIM = 0.1, 2


def known(light_field: LightField) -> BoolMap:
    """Pixels of much more texture than noise, away from depth steps and from the border of the picture."""
    truth, box = light_field.ground_truth, np.ones((2 * RIM + 1,) * 2, np.uint8)
    down, across = np.gradient(light_field.reference_view.mean(axis=2))
    textured = (
        np.minimum(cv2.blur(down**2, (5, 5)), cv2.blur(across**2, (5, 5))) > (4 * view_noise(light_field).usual) ** 2
    )
    inside = np.zeros_like(textured)
    inside[8:-8, 8:-8] = True
    return inside & textured & (cv2.dilate(truth, box) - cv2.erode(truth, box) < 0.3)


def moved(light_field: LightField, step: str) -> float:
    """Percent of what is known, of a map that is the truth."""
    truth = light_field.ground_truth
    # doubtful, so that confidence holds nothing
    after = STEPS[step](light_field, StageMaps(truth.copy(), np.full(truth.shape, 0.5, np.float32)))
    asked = known(light_field)
    assert asked.mean() > 0.05
    return 100 * float((np.abs(after - truth) > FAR)[asked].mean())


@cache
def scene(name: str) -> LightField:
    return render(name, size=128, views=7)


@pytest.mark.parametrize("step", STEPS)
@pytest.mark.parametrize("name", ["wall", "curved_occluders", "pyramids", "rack"])
def test_the_truth_stays_where_views_know_it(name: str, step: str) -> None:
    """A step that guesses would move textured walls onto what it takes them for."""
    assert moved(scene(name), step) < 0.05


@pytest.mark.parametrize("step", STEPS)
@pytest.mark.parametrize("name", ["cotton", "antinous"])
def test_the_truth_stays_where_pictures_know_it(hci: Path, name: str, step: str) -> None:
    """The same of scenes with gloss and bare walls; a reflection on a chest moves a few."""
    assert moved(part(hci / name), step) < (0.4 if (name, step) == ("antinous", "smoothing") else 0.05)
