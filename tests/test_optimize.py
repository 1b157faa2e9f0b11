"""Global optimisation: the energy, its solver against a direct one, and what it does to a map."""

import numpy as np
import pytest
from scipy.sparse import coo_array, diags
from scipy.sparse.linalg import splu

from sepi.lightfield import DisparityRange, LightField
from sepi.optimize import CHOICES
from sepi.regularization.wls import (
    WlsParameters,
    data_weight,
    rectified_confidence,
    smoothness_coefficient,
    solve,
)
from sepi.stage import StageMaps, no_progress


def light_field_of(centre: np.ndarray) -> LightField:
    views = np.broadcast_to(centre, (3, 3, *centre.shape)).copy()
    return LightField(views, "scene", disparity_range=DisparityRange(-2, 2, "given"))


def run(light_field, maps, **values):
    return CHOICES["wls"].run(light_field, maps, WlsParameters(**values), no_progress)


def system_of(disparity, weight, smoothness, alpha):
    """Normal equations of Eq. 8, by neighbours, and their right side."""
    numbers, s = np.arange(disparity.size).reshape(disparity.shape), alpha * smoothness.astype(float)
    matrix = diags(weight.ravel().astype(float))
    for one, other in ((np.s_[:, :-1], np.s_[:, 1:]), (np.s_[:-1], np.s_[1:])):
        pair, ends = np.sqrt((s[one] + s[other]).ravel()), np.stack([numbers[one].ravel(), numbers[other].ravel()])
        at = np.arange(pair.size)
        difference = coo_array((np.r_[pair, -pair], (np.r_[at, at], ends.ravel())), shape=(pair.size, numbers.size))
        matrix = matrix + difference.T @ difference
    return matrix.tocsc(), (weight.astype(float) * disparity).ravel()


@pytest.mark.parametrize("alpha", [1e-12, 1e-6, 1e-3])
def test_solver_agrees_with_a_direct_solve(alpha):
    """Iterative solvers stop early where weights are tiny: pixels would be off by hundredths unnoticed."""
    generator = np.random.default_rng(2)
    shape = (90, 110)
    disparity = generator.uniform(-2, 2, shape).astype(np.float32)
    # weights over eight orders of magnitude, whole regions without any
    weight = (10.0 ** generator.uniform(-8, 0, shape)).astype(np.float32)
    weight[30:60, 40:90] = 1e-8
    smoothness = (10.0 ** generator.uniform(1, 5, shape)).astype(np.float32)
    matrix, right = system_of(disparity, weight, smoothness, alpha)
    direct = splu(matrix).solve(right).reshape(shape)
    solved = solve(disparity, weight, smoothness, alpha, WlsParameters().rtol)
    assert np.abs(solved - direct).max() < 1e-4


def test_smoothness_is_weaker_at_edges_and_where_depth_is_sure():
    """Eq. 11-12: else texture would be smoothed over, or noise believed."""
    parameters = WlsParameters()
    centre = np.zeros((7, 9, 3), np.float32)
    centre[:, 5:] = 0.4
    low, high = (smoothness_coefficient(centre, np.full((7, 9), c, np.float32), parameters) for c in (0.0, 1.0))
    np.testing.assert_allclose(high / low, np.exp(-parameters.tau_2), rtol=1e-5)
    # away from the edge no gradient is left but the floor; at it, a step of 0.4 in three channels, halved by Sobel
    np.testing.assert_allclose(low[:, 1], 1 / parameters.gradient_floor**2, rtol=1e-5)
    np.testing.assert_allclose(low[:, 4], 1 / (3 * 0.2**2 + parameters.gradient_floor**2), rtol=1e-5)


def test_doubtful_outliers_are_pulled_to_their_surface():
    light_field = light_field_of(np.full((60, 60, 3), 120, np.uint8))
    disparity = np.zeros((60, 60), np.float32)
    confidence = np.full_like(disparity, 0.9)
    disparity[30, 30], confidence[30, 30] = 1.5, 0.05
    assert abs(run(light_field, StageMaps(disparity, confidence)).disparity[30, 30]) < 0.05


def test_depth_step_at_a_colour_edge_survives():
    """Smoothing over object borders is what a user sees first."""
    centre = np.full((60, 60, 3), 60, np.uint8)
    centre[:, 30:] = 190
    disparity = np.where(np.arange(60) < 30, -1, 1).astype(np.float32) * np.ones((60, 1), np.float32)
    maps = run(light_field_of(centre), StageMaps(disparity, np.full_like(disparity, 0.8)))
    assert np.abs(maps.disparity - disparity)[:, np.r_[:28, 32:60]].max() < 0.05
    assert np.abs(maps.disparity - disparity).max() < 0.5


def test_data_counts_less_at_steps_and_by_its_confidence():
    """Eq. 9: full weight by confidence on a surface, next to none at a step."""
    parameters = WlsParameters(confidence_power=1.0)
    disparity = np.zeros((20, 20), np.float32)
    disparity[:, 10:] = 2
    weight = data_weight(disparity, np.full_like(disparity, 0.5), parameters)
    np.testing.assert_allclose(weight[:, [2, 17]], 0.5)
    np.testing.assert_allclose(weight[:, [9, 10]], 0.5 * parameters.discontinuity_weight)


def test_texture_less_pixels_have_the_papers_confidence():
    """Eq. 10: c_tl = 0.8 whatever the sweep thought of them."""
    confidence = np.linspace(0.1, 0.9, 100, dtype=np.float32).reshape(10, 10)
    textureless = np.zeros((10, 10), bool)
    textureless[:3] = True
    maps = StageMaps(confidence, confidence, {"textureless": textureless})
    rectified = rectified_confidence(maps.confidence, maps.mask("textureless"), WlsParameters())
    np.testing.assert_allclose(rectified[:3], 0.8)
    assert (np.diff(rectified[3:].ravel()) >= 0).all()
