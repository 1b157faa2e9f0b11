"""Constrained angular entropy and defocus: what their authors claim of them, plain twins, and bad cases."""

from functools import cache

import numpy as np
import pytest

from sepi.extensions.methods.cae import (
    CaeParameters,
    cae,
    entropies_and_responses,
    level_weights,
)
from sepi.kernels import cae as kernels
from sepi.lightfield import LightField
from sepi.matching.sheared_views import ShearedViews
from sepi.scenes import render
from sepi.stage import no_progress

pytestmark = pytest.mark.slow

PATCH = kernels.PATCH
PARAMETERS = CaeParameters(num_disparities=31)


@cache
def scene(name: str, views: int = 5) -> LightField:
    return render(name, size=64, views=views)


def mean_error(light_field: LightField, costs: np.ndarray, mask: np.ndarray | None = None) -> float:
    """Mean absolute error of the candidates of least cost, pixels per view step."""
    disparities = PARAMETERS.candidates(light_field)
    error = np.abs(disparities[costs.argmin(axis=0)] - light_field.ground_truth)
    return float(error[... if mask is None else mask].mean())


def entropy_costs(light_field: LightField, sigma: float = PARAMETERS.colour_sigma) -> np.ndarray:
    return entropies_and_responses(light_field, PARAMETERS.candidates(light_field), sigma, no_progress)[0]


def variance_costs(light_field: LightField) -> np.ndarray:
    views = ShearedViews(light_field).over(PARAMETERS.candidates(light_field))
    return np.stack([sheared.var(axis=0).mean(axis=0) for _, sheared in views])


@pytest.mark.parametrize("name", ["curved_occluders", "rack"])
def test_entropy_withstands_occluders_and_variance_does_not(name: str) -> None:
    """Behind occluders the depth would be theirs, or none at all."""
    field = scene(name)
    occluded = field.masks["occluded"]
    by_entropy, by_variance = (mean_error(field, costs(field), occluded) for costs in (entropy_costs, variance_costs))
    assert by_entropy < 0.5 * by_variance


@pytest.mark.parametrize(("name", "bound"), [("fronto_parallel", 0.03), ("slanted_plane", 0.03)])
def test_a_textured_plane_has_its_disparity(name: str, bound: float) -> None:
    """Half a candidate would be 0.05 pixels and more: the parabola between candidates must be right."""
    field = scene(name)
    disparity = cae(field, None, CaeParameters(num_disparities=20), no_progress).disparity
    assert np.abs(disparity - field.ground_truth)[8:-8, 8:-8].mean() < bound


def entropy_twin(patch: np.ndarray, own: float, sigma: float) -> float:
    levels, level = np.round(255 * np.clip(patch, 0, 1)), np.round(255 * own)
    weights = np.exp(-(((levels - level) / 255 / sigma) ** 2) / 2)
    weights[weights < 1e-3] = 0
    if not weights.any():
        return float(np.log(patch.size))
    shares = np.array([weights[levels == each].sum() for each in np.unique(levels)]) / weights.sum()
    shares = shares[shares > 0]
    return float(-(shares * np.log(shares)).sum())


@pytest.mark.parametrize("sigma", [0.01, 0.1, np.inf])
def test_entropy_equals_a_plain_twin(sigma: float) -> None:
    """Also of what resampling overshoots, and of pixels that no view is like."""
    random = np.random.default_rng(2)
    own = random.random((3, 5, 6)).astype(np.float32)
    sheared = (own + random.normal(0, 0.05, (9, 3, 5, 6))).astype(np.float32)
    own[:, 2, 3] = 0.0
    sheared[:, :, 2, 3] = 0.9
    found = np.empty_like(own)
    kernels.constrained_entropies(sheared, own, level_weights(sigma), found)
    for place in np.ndindex(own.shape):
        expected = entropy_twin(sheared[(slice(None), *place)].astype(float), float(own[place]), sigma)
        assert found[place] == pytest.approx(expected, abs=2e-5)


def test_least_patch_equals_a_plain_twin() -> None:
    """Also in views smaller than the neighbourhood."""
    random = np.random.default_rng(3)
    response, guide = random.random((9, 7, 4)).astype(np.float32), random.random((9, 7, 3)).astype(np.float32)
    found = np.empty_like(response)
    kernels.constrained_least_patch(response, guide, 0.3, 0.2, found)
    reach = 3 * PATCH // 2
    wide, colours = (
        np.pad(a.astype(float), ((reach, reach), (reach, reach), (0, 0)), "edge") for a in (response, guide)
    )
    for y, x in np.ndindex(9, 7):
        costs = []
        for i, j in np.ndindex(3, 3):
            part = np.s_[y + i * PATCH : y + (i + 1) * PATCH, x + j * PATCH : x + (j + 1) * PATCH]
            weights = np.exp(-((colours[part] - guide[y, x]) ** 2).mean(axis=2) / (2 * 0.3**2))
            mean = (weights[..., None] * wide[part]).sum(axis=(0, 1)) / weights.sum()
            costs.append(mean + 0.2 * (1 - weights.mean()))
        np.testing.assert_allclose(found[y, x], np.min(costs, axis=0), atol=1e-4)
