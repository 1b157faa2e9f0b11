"""Grey light fields: grey is three equal channels, so a light field gives the same maps as grey and as RGB."""

from dataclasses import replace

import numpy as np
import pytest

from sepi.inspection.disparity_range import estimate_range
from sepi.inspection.view_order import check_order
from sepi.lightfield import LightField
from sepi.scenes import render
from sepi.scoring.regions import textureless
from sepi.stage import CostVolume, StageMaps, no_progress
from sepi.variants import STAGES, VARIANTS, compared_methods, needing_files

pytestmark = pytest.mark.slow

WHOLE = render("curved_occluders", size=64, views=5)
assert WHOLE.ground_truth is not None
INSIDE = np.s_[12:52, 8:56]
SCENE = replace(
    WHOLE, views=WHOLE.views[:, :, *INSIDE].copy(), ground_truth=WHOLE.ground_truth[INSIDE].copy(), masks={}
)
KINDS = {"uint8": np.uint8, "uint16": np.uint16, "float32": np.float32}


def grey_and_rgb(kind: type) -> tuple[LightField, LightField]:
    """The scene with one channel, and with three that are equal to it."""
    brightness = SCENE.views.mean(axis=4, keepdims=True) / 255
    grey = brightness.astype(np.float32) if kind == np.float32 else (brightness * np.iinfo(kind).max).astype(kind)
    views = grey, np.repeat(grey, 3, axis=4)
    return tuple(LightField(v, "g", disparity_range=SCENE.disparity_range, view=(1, 2)) for v in views)


# of the compared methods' choices, which are slow, in one kind: they compute with floats whatever the kind
OWN = {
    (stage, choice)
    for name in VARIANTS.keys() - set(compared_methods())
    for stage, choice in VARIANTS[name].choices.items()
}


@pytest.mark.parametrize(
    ("stage", "choice", "kind"),
    [
        (stage, choice, kind)
        for stage, choices in STAGES.items()
        for choice in choices
        if choice not in needing_files()
        for kind in (KINDS if (stage, choice) in OWN else ["uint8"])
    ],
)
def test_every_choice_sees_grey_as_equal_channels(stage: str, choice: str, kind: str) -> None:
    """A camera without colours, such as infrared, must not get another depth than the same pictures saved as RGB."""
    chosen = STAGES[stage][choice]
    random = np.random.default_rng(1)
    disparity = (SCENE.ground_truth + random.normal(0, 0.05, SCENE.shape)).astype(np.float32)
    costs = CostVolume(SCENE.disparity_range.candidates(9), random.random((9, *SCENE.shape)).astype(np.float16))
    maps = StageMaps(disparity, random.random(SCENE.shape, np.float32), cost_volume=costs)
    before = None if stage == "initial" else maps
    grey, rgb = (chosen.run(f, before, chosen.parameters(), no_progress).all() for f in grey_and_rgb(KINDS[kind]))
    assert list(grey) == list(rgb)
    for name, values in grey.items():
        np.testing.assert_array_equal(values, rgb[name], err_msg=name)


@pytest.mark.parametrize("kind", KINDS)
def test_what_is_found_out_about_grey_views_is_the_same(kind: str) -> None:
    """Disparity range, order of the views and the regions of the scores."""
    grey, rgb = grey_and_rgb(KINDS[kind])
    assert estimate_range(grey) == estimate_range(rgb)
    assert check_order(grey).warning() == check_order(rgb).warning()
    np.testing.assert_array_equal(textureless(grey.reference_view), textureless(rgb.reference_view))


def test_grey_views_have_superpixels_of_their_picture() -> None:
    """They were those of a blank picture, a plain grid, which puts planes across edges."""
    grey, _ = grey_and_rgb(np.uint8)
    maps = STAGES["initial"]["sepi"].run(grey, None, STAGES["initial"]["sepi"].parameters(), no_progress)
    lti = STAGES["textureless"]["lti"]
    labels = lti.run(grey, maps, lti.parameters(), no_progress).extra["superpixels"]
    blank = LightField(np.full_like(grey.views, 128), "blank", disparity_range=grey.disparity_range, view=grey.view)
    assert (labels != lti.run(blank, maps, lti.parameters(), no_progress).extra["superpixels"]).mean() > 0.1
