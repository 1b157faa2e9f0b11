"""Textureless regions: LTI, its threshold, propagation of planes, and the promise never to make good depth worse."""

import numpy as np
import pytest
from scipy.ndimage import binary_erosion, gaussian_filter

from sepi.image.mean_shift import sample_modes
from sepi.image.superpixels import Superpixels, adjacency, colour_modes, superpixels
from sepi.kernels import planes as kernels
from sepi.lightfield import DisparityRange, LightField
from sepi.regularization.planes import basis, evaluate_planes, fit_planes, propagate
from sepi.scenes import render
from sepi.stage import StageMaps, no_progress
from sepi.textureless import (
    CHOICES,
    LtiParameters,
    local_texture_information,
    lti_threshold,
    slope_agreement,
    superpixel_size,
)


def tiles(shape, size) -> Superpixels:
    """Square superpixels."""
    rows, columns = np.indices(shape)
    labels = rows // size * -(-shape[1] // size) + columns // size
    sizes = np.bincount(labels.ravel())
    centroids = [np.bincount(labels.ravel(), axis.ravel()) / sizes for axis in (columns, rows)]
    return Superpixels(labels, sizes, np.stack(centroids, axis=1))


def bare_plane(seed=0, noise=True):
    """A slanted plane whose inner part has no texture: noise instead of depth, and no confidence, there."""
    generator = np.random.default_rng(seed)
    rows, columns = np.mgrid[:120, :120]
    ground_truth = (0.01 * columns - 0.006 * rows).astype(np.float32)
    bare = (np.abs(rows - 60) < 35) & (np.abs(columns - 60) < 35)
    texture = gaussian_filter(generator.normal(0, 40, (120, 120, 1)), (1, 1, 0))
    centre = np.repeat(np.where(bare[..., None], 128, 128 + texture), 3, axis=2).astype(np.uint8)
    light_field = LightField(
        np.broadcast_to(centre, (3, 3, *centre.shape)).copy(), "bare", disparity_range=DisparityRange(-2, 2, "given")
    )
    disparity = ground_truth.copy()
    if noise:
        disparity[bare] = generator.uniform(-2, 2, bare.sum())
    confidence = np.where(bare, 0.1, 0.9).astype(np.float32)
    return light_field, ground_truth, bare, StageMaps(disparity, confidence)


def run(light_field, maps, **values):
    return CHOICES["lti"].run(light_field, maps, LtiParameters(**values), no_progress)


def test_depth_propagates_linearly_into_a_bare_surface():
    light_field, ground_truth, bare, maps = bare_plane()
    refined = run(light_field, maps)
    inner = binary_erosion(bare, iterations=15)  # a superpixel from the rim
    assert np.abs(maps.disparity - ground_truth)[inner].mean() > 0.5
    assert np.abs(refined.disparity - ground_truth)[inner].mean() < 0.01
    assert np.abs(refined.disparity - ground_truth).mean() < 0.3 * np.abs(maps.disparity - ground_truth).mean()
    assert refined.extra["textureless"][inner].mean() > 0.95
    assert set(refined.extra) == {"superpixels", "lti", "textureless"}


def test_good_depth_is_not_made_worse():
    """Noise lowers confidence everywhere; a plane laid over sound depth would erase the scene."""
    light_field, ground_truth, _, _ = bare_plane()
    rows, columns = np.indices(ground_truth.shape)
    ground_truth = ground_truth + ((rows // 12 + columns // 12) % 2).astype(np.float32)
    maps = StageMaps(ground_truth, np.full_like(ground_truth, 0.2))
    refined = run(light_field, maps)
    assert np.abs(refined.disparity - ground_truth).max() < 0.15


@pytest.mark.parametrize("scene", ["dots", "curved_occluders", "pyramids", "stripes"])
def test_never_worse_on_scenes_without_bare_surfaces(scene):
    light_field = render(scene, size=128)
    generator = np.random.default_rng(3)
    noisy = light_field.ground_truth + generator.normal(0, 0.03, light_field.shape).astype(np.float32)
    maps = StageMaps(noisy, generator.uniform(0.2, 0.5, light_field.shape).astype(np.float32))
    before, after = (np.mean((m.disparity - light_field.ground_truth) ** 2) for m in (maps, run(light_field, maps)))
    assert after <= 1.02 * before


def test_lti_is_the_share_of_inner_texture_points():
    """Eq. 6, counted by hand: texture on a superpixel's rim does not count."""
    segments = tiles((20, 20), 10)
    texture = np.zeros((20, 20), bool)
    texture[1:4, 1:4] = True
    texture[9, :10] = True
    np.testing.assert_allclose(local_texture_information(segments, texture), [0.09, 0, 0, 0])


def test_threshold_lies_where_the_sorted_lti_rises_fastest():
    few_between = np.concatenate([np.linspace(0, 0.12, 300), [0.2, 0.25], np.linspace(0.32, 0.9, 300)])
    threshold = lti_threshold(few_between)
    assert 0.12 < threshold < 0.32


def test_agreement_tells_noise_from_depth():
    columns = np.indices((40, 40))[1]
    plane = (0.02 * columns).astype(np.float32)
    assert slope_agreement(plane).min() == 1
    noise = np.random.default_rng(0).uniform(-2, 2, (40, 40)).astype(np.float32)
    assert slope_agreement(noise).mean() < 0.15


def test_robust_fit_ignores_outliers():
    segments = tiles((30, 30), 15)
    rows, columns = np.indices((30, 30))
    ground_truth = (0.5 + 0.02 * columns - 0.01 * rows).astype(np.float32)
    spoiled = ground_truth.copy()
    spoiled[::3] += 1
    design = basis(segments)
    planes = fit_planes(segments, spoiled, np.ones_like(ground_truth), design, 0.05)
    assert np.abs(evaluate_planes(segments, planes, design) - ground_truth).max() < 0.02


def test_sums_over_superpixels_are_those_of_numpy():
    """To the last digit: sums in another order would give other maps than before."""
    random = np.random.default_rng(4)
    segments = tiles((31, 47), 12)
    design, count = basis(segments), len(segments)
    disparity, weight = random.normal(size=(2, 31, 47)).astype(np.float32)
    left, right = np.zeros((count, 3, 3)), np.zeros((count, 3))
    kernels.add_normal_equations(segments.labels.ravel(), design, weight.ravel(), disparity.ravel(), left, right)
    weighted = design * weight.reshape(-1, 1)
    for p in range(3):
        np.testing.assert_array_equal(right[:, p], segments.sums(weighted[:, p] * disparity.ravel()))
        for q in range(3):
            expected = segments.sums(weighted[:, min(p, q)] * design[:, max(p, q)])
            np.testing.assert_array_equal(left[:, p, q], expected)
    planes = random.normal(size=(count, 3))
    values = (design * planes[segments.labels.ravel()]).sum(axis=1).astype(np.float32)
    np.testing.assert_array_equal(evaluate_planes(segments, planes, design).ravel(), values)


def test_propagation_equals_the_plane_that_its_neighbours_lie_on():
    """One unknown superpixel among planes of one surface, no data: the continuation is exact."""
    segments = tiles((45, 45), 15)
    rows, columns = np.indices((45, 45))
    ground_truth = (0.02 * columns - 0.01 * rows).astype(np.float32)
    design = basis(segments)
    planes = fit_planes(segments, ground_truth, np.ones_like(ground_truth), design, 0.05)
    free = np.zeros(9, bool)
    free[4] = True
    planes[4] = [5, 5, 5]
    adjacent = adjacency(segments)
    solved = propagate(
        segments, adjacent, np.ones(len(adjacent.first)), planes, free, ground_truth, np.zeros_like(ground_truth),
        design, 1.0, 0.05,
    )  # fmt: skip
    np.testing.assert_allclose(evaluate_planes(segments, solved, design), ground_truth, atol=1e-3)
    np.testing.assert_array_equal(solved[~free], planes[~free])


def test_superpixels_have_the_papers_sizes():
    assert superpixel_size((512, 512), LtiParameters()) == 15
    assert superpixel_size((768, 768), LtiParameters()) == 17
    centre = render("wall", size=128, views=3).reference_view
    segments = superpixels(centre, 15, 10.0)
    assert 0.6 < len(segments) / (128**2 / 15**2) < 1.4


def test_colour_modes_join_what_looks_alike():
    segments = tiles((20, 40), 10)
    centre = np.full((20, 40, 3), 0.5, np.float32)
    centre[:, 20:] = [0.9, 0.1, 0.1]
    centre[:, :10] += 0.005
    modes = colour_modes(centre, segments, 0.03)
    assert np.abs(modes[0] - modes[1]).max() < 0.01
    assert np.abs(modes[1] - modes[2]).max() > 0.2


def test_sample_modes_equal_their_numpy_twin():
    """Superpixels of one colour that end at different points are kept apart, and depth does not travel between them."""
    generator = np.random.default_rng(3)
    centres = generator.random((5, 3))
    samples = np.repeat(centres, 20, axis=0) + generator.normal(0, 0.01, (100, 3))
    modes = sample_modes(samples, 0.03)
    expected = samples.copy()
    for _ in range(200):
        weight = np.exp(-0.5 * ((expected[:, None] - samples[None]) ** 2).sum(axis=2) / 0.03**2)
        expected = weight @ samples / weight.sum(axis=1, keepdims=True)
    np.testing.assert_allclose(modes, expected, atol=0.03 * 0.01)
    for cluster in modes.reshape(5, 20, 3):
        assert np.ptp(cluster, axis=0).max() < 0.03 * 0.01


@pytest.mark.parametrize("end", ["nearest", "farthest"])
def test_depth_at_the_end_of_the_range_resists_no_plane(end):
    """Where no candidate was best, a bare surface lies at the range's end as a whole: agreement that means nothing."""
    light_field, ground_truth, bare, maps = bare_plane(noise=False)
    maps.disparity[bare] = 2 if end == "nearest" else -2
    inner = binary_erosion(bare, iterations=15)
    assert np.abs(run(light_field, maps).disparity - ground_truth)[inner].max() < 0.05


def test_planes_stay_within_the_range():
    """Continued from their borders they lead beyond what was searched."""
    light_field, _, bare, maps = bare_plane()
    narrow = light_field.with_range(DisparityRange(-0.1, 0.5, "given"))
    within = StageMaps(np.clip(maps.disparity, -0.1, 0.5), maps.confidence)
    refined = run(narrow, within)
    assert refined.extra["textureless"][bare].mean() > 0.5
    assert refined.disparity.min() >= np.float32(-0.1)
    assert refined.disparity.max() <= np.float32(0.5)
