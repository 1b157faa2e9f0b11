"""Costs of a sweep are without what noise makes of interpolation."""

from dataclasses import replace

import numpy as np
import numpy.typing as npt
import pytest
from geometries import standing

from bench.noisy import with_noise
from sepi.lightfield import DisparityRange, LightField
from sepi.matching.denoising import DenoisedLightField, denoised
from sepi.matching.expected_costs import expected_costs, robust_cost_of_noise
from sepi.matching.plane_sweep import SweepParameters, sweep
from sepi.matching.sweep_arrays import sampled_candidates
from sepi.matching.view_noise import ViewNoise
from sepi.matching.view_subsets import halves_and_quarters
from sepi.scenes import render

WHOLE_TO_HALF = np.array([0.0, 0.1, 0.2, 0.25, 0.35, 0.5, 0.6, 0.75, 0.9, 1.0])


def noisy_pictures(sigma: float, channels: int = 3, texture: float = 0.0) -> LightField:
    """Two greys side by side, noisier where it is darker, with faint texture or none."""
    scene = render("slanted_plane", size=96, views=5)
    views = scene.views[..., :channels] / 255
    level = np.where(np.arange(96) < 48, 0.4, 0.6).astype(np.float32)[:, None]
    views = level + texture * (views - views.mean())
    noise = np.random.default_rng(5).standard_normal(views.shape) * np.where(level < 0.5, 1.5, 1) * sigma / 255
    return replace(scene, views=(views + noise).astype(np.float32))


@pytest.mark.parametrize("channels", [1, 3])
@pytest.mark.parametrize("variance", [0.001, 0.1, 3.0])
def test_cost_of_noise_is_the_mean_of_many(channels: int, variance: float) -> None:
    """If this fails, faint texture in noise is drawn to some depths, or away from them."""
    residuals = np.random.default_rng(0).standard_normal((100_000, channels)) * np.sqrt(variance)
    z = 3 / channels * (residuals**2).sum(axis=1)
    told = robust_cost_of_noise(np.array([variance]), channels)
    assert told == pytest.approx((z / (z + 1)).mean(), rel=0.01)


@pytest.mark.parametrize("channels", [1, 3])
def test_noise_alone_costs_the_same_at_every_disparity(channels: int) -> None:
    """If this fails, bare walls in noise go to the disparities at which most views are sampled between pixels."""
    noisy = noisy_pictures(4, channels)
    parameters = SweepParameters(num_disparities=3)
    views, inside = halves_and_quarters(noisy), np.s_[8:-8, 12:36]
    of_all = []
    for disparity in WHOLE_TO_HALF:
        here = noisy.with_range(DisparityRange(disparity, disparity + 1e-4, "given"))
        found = sweep(here, parameters, subsets=views)
        of_all.append(found.mean[:, *inside].mean(axis=(1, 2)))
    costs = np.array(of_all)
    # as they are they spread by a fifth
    assert (np.ptp(costs, axis=0) < 0.06 * costs.mean(axis=0)).all()
    # of each side its own noise
    assert costs.mean() == pytest.approx(found.of_noise[inside].mean(), rel=0.08)
    assert found.of_noise[8:-8, 60:-8].mean() < 0.85 * found.of_noise[inside].mean()
    # grey stored as colours is grey
    colours = replace(here, views=np.ascontiguousarray(here.rgb_views))
    np.testing.assert_array_equal(sweep(colours, parameters, subsets=views).mean, found.mean)


def test_each_candidate_has_the_mean_of_what_its_views_make_of_noise() -> None:
    """If this fails, halves of the views, odd arrays or cameras that look elsewhere lock to other disparities."""
    grid = (3, 4)
    views = np.random.default_rng(0).random((*grid, 12, 14, 3), np.float32) * 0.8 + 0.1
    present, missing = np.ones(grid, bool), np.zeros(views.shape[:4], bool)
    present[0, 1], missing[2, 3] = False, True
    known = DisparityRange(-1.3, 1.2, "given")
    light_field = LightField(
        views, "noise", present=present, missing=missing, disparity_range=known, **standing("off the grid", grid)
    )
    groups, variance, squared_scale = np.arange(12).reshape(grid) % 4, 2e-4, 3e-4
    subsets = np.array([[1, 1, 1, 1], [1, 0, 0, 1], [0, 1, 0, 0]], bool)
    candidates = SweepParameters(num_disparities=9).candidates(light_field)
    noise = ViewNoise(np.array([0.5]), np.array([variance]), np.ones((4, 4), np.float32), 1.0, 1.0)
    sampled = sampled_candidates(candidates, light_field.baselines)
    found = expected_costs(light_field, noise, sampled, groups, subsets, squared_scale, 8)

    def cost(down: npt.NDArray[np.float64], across: npt.NDArray[np.float64]) -> npt.NDArray[np.float64]:
        weights = [(1 - np.abs(f - np.floor(f))) ** 2 + (f - np.floor(f)) ** 2 for f in (down, across)]
        return robust_cost_of_noise(variance / squared_scale * (1 + weights[0] * weights[1]), 3)

    anywhere = cost(*np.meshgrid(*2 * [(np.arange(100) + 0.5) / 100])).mean()
    np.testing.assert_allclose(found.anywhere, anywhere, rtol=2e-3)
    compared = present & ~missing.all(axis=(2, 3))
    compared[light_field.reference_position] = False
    for n, subset in enumerate(subsets):
        moves = light_field.baselines[compared & subset[groups]]
        of_views = cost(*np.moveaxis(candidates[:, None, None] * moves, 2, 0)).mean(axis=1)
        taken = np.tensordot(found.weights[:, 5, 5], found.moments[:, n, :9], 1)
        np.testing.assert_allclose(taken, (of_views - anywhere) / (1 - anywhere), atol=3e-3)


def test_texture_is_distinct_in_noise_and_noise_is_not() -> None:
    """If this fails, bare walls take planes of edges nearby, or noise itself passes for texture."""
    scene = render("slanted_plane", size=96, views=5)
    views = scene.views / 255
    views = 0.5 + np.where(np.arange(96) < 48, 0, 0.5)[:, None] * (views - views.mean())
    noisy = views + np.random.default_rng(5).standard_normal(views.shape) * 4 / 255
    confidence = sweep(replace(scene, views=noisy.astype(np.float32)), SweepParameters()).confidence()[0]
    assert np.median(confidence[8:-8, 56:-8]) > 0.8
    assert np.quantile(confidence[8:-8, 8:40], 0.95) < 0.4


def test_faint_texture_in_noise_keeps_its_depth() -> None:
    """If this fails, dark folds of a noisy picture lie in steps."""
    noisy = noisy_pictures(3, texture=0.15)
    found = sweep(noisy, SweepParameters())
    error = (found.disparity[0] - noisy.ground_truth)[8:-8, 8:-8]
    assert np.median(np.abs(error)) < 0.04


def test_without_noise_nothing_changes() -> None:
    """If this fails, clean renderings have other maps than the paper's costs give."""
    # so small that no whole pixel fits its texture, which might be noise
    clean, noisy = render("curved_occluders", size=64, views=5), render("dots", size=96, views=5)
    assert isinstance(denoised(clean, 1.5), DenoisedLightField)
    for scene, changes in ((clean, False), (with_noise(clean, 8), True), (noisy, True)):
        for corrects in (True, False):
            parameters = SweepParameters(correct_noise=corrects)
            candidates = sampled_candidates(parameters.candidates(scene), scene.baselines)
            groups, noise = np.zeros(scene.grid, int), parameters.noise_to_correct(scene)
            expected = expected_costs(scene, noise, candidates, groups, np.ones((1, 1), bool), 3e-4, 8)
            assert [bool(values.any()) for values in expected] == [changes and corrects] * 3
