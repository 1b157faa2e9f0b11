"""The mean of noisy views in place of the reference view."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from sepi.matching.aligned_views import mean_reference
from sepi.matching.base_detail import BaseDetailParameters, base_detail_decomposition, compared_with
from sepi.matching.denoising import DenoisedLightField, denoised
from sepi.matching.row_bands import Rows
from sepi.matching.view_subsets import spread_views
from sepi.scenes import render


def noisy(seed: int) -> DenoisedLightField:
    scene = render("slanted_plane", size=96, views=7)
    noise = np.random.default_rng(seed).normal(0, 12, scene.views.shape)
    views = np.clip(np.rint(scene.views.astype(np.float64) + noise), 0, 255).astype(np.uint8)
    light_field = denoised(dataclasses.replace(scene, views=views), 1.5)
    assert isinstance(light_field, DenoisedLightField)
    return light_field


def test_mean_of_the_views_has_half_of_their_noise() -> None:
    """Else noise of the reference view, which all residuals share, is taken for depth."""
    light_fields, parameters = [noisy(seed) for seed in (0, 1)], BaseDetailParameters()
    truth = light_fields[0].ground_truth
    compared = spread_views(light_fields[0], 25)
    means = [mean_reference(one, truth, compared, parameters, 0.15) for one in light_fields]
    left, before = (np.std(np.subtract(*two)) for two in (means, [one.reference_view for one in light_fields]))
    assert left < before / 2


def test_views_are_compared_with_others() -> None:
    """Else each is most like a mean that has its own noise, and in strong noise a wrong map finds itself again."""
    light_field, parameters = noisy(0), BaseDetailParameters()
    truth, compared = light_field.ground_truth, spread_views(light_field, 25)
    mean = mean_reference(light_field, truth, compared, parameters, 0.15)
    views = light_field.views.copy()
    compared[light_field.reference_position] = False
    views[compared] = 255 - views[compared]
    other = mean_reference(dataclasses.replace(light_field, views=views), truth, compared, parameters, 0.15)
    np.testing.assert_array_equal(mean, other)
    assert mean_reference(light_field, truth, spread_views(light_field, 45), parameters, 0.15) is None


def test_residuals_have_the_noise_of_one_view() -> None:
    """Else costs bear with twice the noise that there is; and detail is made alike, or it would fit nowhere."""
    light_field, parameters, rows = noisy(0), BaseDetailParameters(), Rows(10, 60)
    views = base_detail_decomposition(light_field, parameters, rows)
    same = compared_with(views, light_field.reference_view, parameters, rows)
    np.testing.assert_allclose(same.reference_detail, views.detail[light_field.reference_position], atol=1)
    assert same.noise == pytest.approx(views.noise / 2)
    other = compared_with(views, np.zeros_like(views.guide), parameters, rows)
    assert not other.reference_detail.any()
