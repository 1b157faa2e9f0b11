"""The vote cost: what its publication says of it, its loops, and light fields unlike the publication's."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from sepi.extensions.methods import costs, oavc
from sepi.extensions.methods.costs import least_costs
from sepi.extensions.methods.oavc import lower_thresholds, vote_costs
from sepi.lightfield import DisparityRange, FloatMap, LightField
from sepi.matching.sheared_views import ShearedViews
from sepi.pipeline import estimate_depth
from sepi.scenes import render
from sepi.stage import CostVolume, no_progress

pytestmark = pytest.mark.slow

PARAMETERS = oavc.OavcParameters(num_disparities=61)
FILTER = costs.GuidedMedianParameters(radius=7, epsilon=1e-5)
FEW = {"initial": {"num_disparities": 31}}
# scenes of what is too thin in a smaller picture
FINE = ("fine_structures", "stripes")


@cache
def scene(name: str, noise: float = 0.0) -> LightField:
    """A built-in scene, with noise of this standard deviation, colours in 0..1."""
    light_field = render(name, size=96 if name in FINE else 64, views=5)
    disturbed = light_field.views.astype(np.float64) + np.random.default_rng(1).normal(
        0, noise * 255, light_field.views.shape
    )
    return replace(light_field, views=np.clip(disturbed, 0, 255).round().astype(np.uint8))


@cache
def mean_costs(name: str) -> CostVolume:
    """The usual cost: the mean difference of all views from the reference view."""
    light_field = scene(name)
    views, disparities = ShearedViews(light_field), PARAMETERS.candidates(light_field)
    costs = np.empty((len(disparities), *light_field.shape), np.float16)
    for k, sheared in views.over(disparities):
        costs[k] = np.abs(sheared - sheared[views.reference]).mean(axis=(0, 1))
    return CostVolume(disparities, costs)


@cache
def voted(name: str, noise: float = 0.0, threshold: float | None = None) -> CostVolume:
    """The vote cost, with one threshold for all pixels if given."""
    light_field = scene(name, noise)
    if threshold is None:
        volume = oavc.oavc(light_field, None, PARAMETERS, no_progress).cost_volume
        assert volume is not None
        return volume
    thresholds = np.full(light_field.shape, threshold, np.float32)
    return oavc.votes(ShearedViews(light_field), PARAMETERS.candidates(light_field), thresholds, no_progress)


def errors(light_field: LightField, volume: CostVolume) -> FloatMap:
    """How far the candidate of least cost is from the truth, pixels per view step."""
    assert light_field.ground_truth is not None
    return np.asarray(np.abs(volume.disparities[least_costs(volume)] - light_field.ground_truth))


def sheared_example() -> FloatMap:
    """Five views of 6x9 pixels of which some agree; the third is the reference view."""
    random = np.random.default_rng(2)
    views = np.repeat(random.uniform(0, 1, (1, 3, 6, 9)), 5, axis=0)
    return (views + random.normal(0, 0.03, views.shape)).astype(np.float32)


def deviations(sheared: FloatMap, reference: int) -> FloatMap:
    """Of the views other than the reference view."""
    return np.delete(np.abs(sheared - sheared[reference]).mean(axis=1), reference, axis=0)


@pytest.mark.parametrize(("name", "part"), [("curved_occluders", 0.7), ("fine_structures", 0.7), ("stripes", 0.35)])
def test_votes_find_occluded_pixels_that_the_mean_does_not(name: str, part: float) -> None:
    """The publication's claim: an occluder's colours do not count, so that edges are kept without looking for them."""
    light_field = scene(name)
    occluded = light_field.masks["occluded"]
    bad = (errors(light_field, voted(name)) > 0.1)[occluded].mean()
    assert bad < part * (errors(light_field, mean_costs(name)) > 0.1)[occluded].mean()


@pytest.mark.parametrize(("noise", "wrong"), [(0.0, 0.03), (0.02, 0.004), (0.02, 0.01), (0.05, 0.004), (0.05, 0.01)])
def test_thresholds_adapt_to_the_noise(noise: float, wrong: float) -> None:
    """With one threshold for all light fields, the wrong one for this gives more bad pixels."""
    light_field = scene("slanted_plane", noise)
    adapted = (errors(light_field, voted("slanted_plane", noise)) > 0.1).mean()
    assert adapted < 0.7 * (errors(light_field, voted("slanted_plane", noise, wrong)) > 0.1).mean()


def test_a_plane_is_exact() -> None:
    """A textured plane that no candidate hits: where it is wrong, all scenes are."""
    light_field = render("fronto_parallel", size=96, views=5).with_range(DisparityRange(0.013, 1.971, "given"))
    assert light_field.ground_truth is not None
    maps = estimate_depth(light_field, "oavc", {"initial": {"num_disparities": 61}})
    error = np.abs(maps.disparity - light_field.ground_truth)[8:-8, 8:-8]
    # candidates are 0.033 apart
    assert error.max() < 0.01
    assert np.median(error) < 0.005


@pytest.mark.parametrize("needed", [1, 2, 4])
def test_thresholds_are_those_by_which_the_share_agrees(needed: int) -> None:
    """Else other views than the unoccluded ones decide."""
    first, second = sheared_example(), sheared_example()[[1, 0, 2, 4, 3]] * np.float32(0.98)
    thresholds = np.full(first.shape[2:], np.inf, np.float32)
    expected = thresholds.copy()
    for sheared in (first, second):
        lower_thresholds(sheared, 2, needed, thresholds)
        expected = np.minimum(expected, np.sort(deviations(sheared, 2), axis=0)[needed - 1])
    np.testing.assert_allclose(thresholds, expected, rtol=1e-4, atol=1e-7)


@pytest.mark.parametrize("threshold", [0.01, 0.03, 1.0])
def test_costs_are_votes_less_their_mean_difference(threshold: float) -> None:
    """Pixels without a vote, with some and with all."""
    sheared = sheared_example()
    out = vote_costs(sheared, 2, np.full(sheared.shape[2:], threshold, np.float32))
    difference = deviations(sheared, 2) / threshold
    votes = (difference <= 1).sum(axis=0)
    mean = np.where(difference <= 1, difference, 0).sum(axis=0) / np.maximum(votes, 1)
    np.testing.assert_allclose(out, 1 - (votes - mean) / 4, atol=1e-5)
    assert out.min() >= 0
    assert out.max() <= 1


def test_a_vote_counts_for_more_than_any_mean_difference() -> None:
    """Three views that barely agree beat two that agree entirely."""
    sheared = np.zeros((5, 3, 1, 2), np.float32)
    sheared[:, :, 0, 0] = np.array([0.0099, 0.0099, 0, 0.0099, 0.9])[:, None]
    sheared[:, :, 0, 1] = np.array([0, 0, 0, 0.9, 0.9])[:, None]
    out = vote_costs(sheared, 2, np.full((1, 2), 0.01, np.float32))
    assert out[0, 1] == pytest.approx(0.5)
    assert out[0, 0] < out[0, 1]
