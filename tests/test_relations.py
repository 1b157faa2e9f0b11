"""What must hold between maps of light fields that are the same but for how they are told."""

from dataclasses import replace

import numpy as np
import pytest

from sepi import estimate_depth
from sepi.lightfield import DisparityRange, LightField
from sepi.scenes import render

pytestmark = pytest.mark.slow

VARIANTS = ("best", "fast", "paper", "no_sepi", "mishiba")


def in_other_steps(light_field: LightField, factor: float) -> LightField:
    """The same light field in view steps so many times as short."""
    known = light_field.require_disparity_range()
    scaled = DisparityRange(known.minimum / factor, known.maximum / factor, "given")
    return replace(light_field, positions=light_field.baselines * factor, disparity_range=scaled, ground_truth=None)


@pytest.mark.parametrize("variant", VARIANTS)
@pytest.mark.parametrize("factor", [0.1, 10])
def test_the_unit_of_the_view_step_does_not_matter(variant: str, factor: float) -> None:
    """Positions in millimetres or in steps of the grid: thresholds would be right in one of them alone."""
    light_field = render("curved_occluders", size=64, views=5)
    usual = estimate_depth(light_field, variant)
    other = estimate_depth(in_other_steps(light_field, factor), variant)
    assert np.mean(np.abs(other.disparity * np.float32(factor) - usual.disparity) > 1e-3) < 0.005
    assert np.mean(np.abs(other.confidence - usual.confidence) > 1e-2) < 0.005


@pytest.mark.parametrize("variant", ["best", "fast", "paper"])
def test_no_map_leaves_the_range(variant: str) -> None:
    """Who narrows the range must not get what lies outside it."""
    narrow = render("slanted_plane", size=64, views=5).with_range(DisparityRange(-0.5, 0.25, "given"))
    found = estimate_depth(narrow, variant).disparity
    assert found.min() >= -0.5
    assert found.max() <= 0.25


def test_the_last_column_is_as_good_as_the_last_row() -> None:
    """A transposed light field has the transposed map: samples on the border itself count along both axes."""
    light_field = render("pyramids", size=64, views=5)
    views = np.ascontiguousarray(light_field.views.transpose(1, 0, 3, 2, 4))
    other = estimate_depth(
        LightField(views, "transposed", disparity_range=light_field.disparity_range), "no_occlusion_no_textureless"
    )
    usual = estimate_depth(light_field, "no_occlusion_no_textureless")
    assert np.abs(other.disparity.T - usual.disparity)[:, -1].max() < 1e-4
