"""The plane sweep equals a plain NumPy twin, the paper's SEPI construction, and itself on any number of threads."""

from itertools import product

import numpy as np
import pytest
from geometries import GEOMETRIES, standing
from scipy.ndimage import map_coordinates

from sepi.errors import SepiError
from sepi.image.noise import noise_level, residual_variance
from sepi.kernels import plane_sweep
from sepi.lightfield import DisparityRange, LightField
from sepi.matching.denoising import sure_noise
from sepi.matching.expected_costs import expected_costs
from sepi.matching.plane_sweep import TILE_WIDTH, SweepParameters, sweep
from sepi.matching.stitched_epi import stitched_epi
from sepi.matching.sweep_arrays import sampled_candidates
from sepi.matching.view_subsets import HALVES_AND_QUARTERS, halves_and_quarters
from sepi.scenes import render


def random_light_field(grid=(5, 4), shape=(14, 17), channels=3, dtype=np.uint8, seed=0, geometry="grid"):
    generator = np.random.default_rng(seed)
    views = generator.random((*grid, *shape, channels), np.float32)
    if dtype != np.float32:
        views = np.round(views * np.iinfo(dtype).max).astype(dtype)
    known = DisparityRange(-1.3, 1.1, "given")
    return LightField(views, "random", disparity_range=known, **standing(geometry, grid))


def twin_sums(light_field, parameters, groups):
    """Costs that each group of views adds up to at each candidate, and of how many: one interpolation per view."""
    T, S = light_field.grid
    t0, s0 = light_field.reference_position
    H, W = light_field.shape
    candidates = light_field.require_disparity_range().candidates(parameters.num_disparities)
    candidates = candidates.astype(float)[:, None, None]
    centre = light_field.reference_view
    noise = residual_variance(centre)
    views = light_field.views / (np.iinfo(light_field.views.dtype).max if light_field.views.dtype != np.float32 else 1)
    rows, columns = np.mgrid[:H, :W].astype(float)
    sums, counts = np.zeros((2, groups.max() + 1, len(candidates), H, W))
    for t in range(T):
        for s in range(S):
            if (t, s) == (t0, s0) or not light_field.present[t, s]:
                continue
            down, across = light_field.baselines[t, s]
            y, x = rows - candidates * down, columns - candidates * across
            inside = (y >= 0) & (y <= H - 1) & (x >= 0) & (x <= W - 1)
            sample = np.stack([map_coordinates(c, [y, x], order=1) for c in np.moveaxis(views[t, s], 2, 0)], axis=3)
            squared = ((sample - centre) ** 2).sum(axis=3)
            sums[groups[t, s]] += np.where(inside, squared / (squared + parameters.scale**2 + noise), 0)
            counts[groups[t, s]] += inside
    return sums, counts


def twin(light_field, parameters, of_groups, groups, subset):
    """The sweep of a subset of the groups in plain NumPy: the picture moved over itself, as far as the window goes."""
    H, W = light_field.shape
    candidates = light_field.require_disparity_range().candidates(parameters.num_disparities)
    centre = light_field.reference_view.astype(float)
    noise = residual_variance(light_field.reference_view)
    sums, counts = (values[subset[: len(values)]].sum(axis=0) for values in of_groups)
    r = parameters.window_radius
    cost, total = np.zeros_like(sums), np.zeros_like(counts)
    for down, across in product(range(-r, r + 1), repeat=2):
        at = np.s_[max(0, -down) : H - max(0, down), max(0, -across) : W - max(0, across)]
        other = np.s_[max(0, down) : H - max(0, -down), max(0, across) : W - max(0, -across)]
        distance = ((centre[at] - centre[other]) ** 2).sum(axis=2)
        weight = np.exp(-0.5 * distance / (parameters.window_sigma**2 + noise))
        cost[:, *at] += weight * sums[:, *other]
        total[:, *at] += weight * counts[:, *other]
    cost = np.where(total > 0, cost / np.maximum(total, 1e-300), 1)
    sampled = sampled_candidates(candidates.astype(np.float32), light_field.baselines)
    to_correct = parameters.noise_to_correct(light_field)
    of_noise = expected_costs(light_field, to_correct, sampled, groups, subset[None], parameters.scale**2 + noise, 1)
    taken = np.einsum("pyx,pk->kyx", of_noise.weights, of_noise.moments[:, 0])
    cost = 1 - (1 - cost) / (1 - taken)
    best = cost.argmin(axis=0)
    lowest = cost.min(axis=0)
    near = np.clip(best, 1, len(candidates) - 2)
    before, after = (np.take_along_axis(cost, near[None] + step, axis=0)[0] for step in (-1, 1))
    with np.errstate(all="ignore"):
        offset = np.where((best == near) & (lowest != 0), 0.5 * (before - after) / (before - 2 * lowest + after), 0)
    step = (candidates[-1] - candidates[0]) / (len(candidates) - 1)
    return candidates[best] + offset * step, lowest, cost.mean(axis=0)


def sweep_and_twin(light_field, parameters, numbers):
    """Disparities of the sweep and of its twin, of subsets of the views; their costs are the same."""
    views = halves_and_quarters(light_field)
    result = sweep(light_field, parameters, subsets=views)
    of_groups = twin_sums(light_field, parameters, views.groups)
    disparities = []
    for n in numbers:
        disparity, cost, mean = twin(light_field, parameters, of_groups, views.groups, views.subsets[n])
        np.testing.assert_allclose(result.cost[n], cost, atol=2e-5)
        np.testing.assert_allclose(result.mean[n], mean, atol=2e-5)
        disparities.append((result.disparity[n], disparity))
    return disparities


@pytest.mark.parametrize("radius", [0, 2])
@pytest.mark.parametrize("channels", [1, 3])
@pytest.mark.parametrize("dtype", [np.uint8, np.uint16, np.float32])
def test_sweep_equals_its_numpy_twin(radius, channels, dtype):
    """Wrong sampling, borders, counts or weights would show as a wrong depth map."""
    light_field = random_light_field(channels=channels, dtype=dtype)
    parameters = SweepParameters(num_disparities=11, scale=0.3, window_radius=radius, window_sigma=0.5, softening=0)
    for own, of_twin in sweep_and_twin(light_field, parameters, (0, 1, 4, 6)):
        # two candidates may tie within rounding
        assert np.mean(np.abs(own - of_twin) > 2e-3) < 0.01


@pytest.mark.parametrize("channels", [1, 3])
def test_sweep_of_sure_noise_equals_its_numpy_twin(channels):
    """What noise costs one half of the views, taken from another, would give bare walls the depth of neither."""
    light_field = random_light_field((3, 4), (40, 44), channels=channels).seen_from((0, 1))
    assert sure_noise(light_field) is not None
    parameters = SweepParameters(num_disparities=11, scale=0.3, window_radius=1, window_sigma=0.5, softening=0)
    sweep_and_twin(light_field, parameters, (0, 1, 4, 6))


@pytest.mark.parametrize("geometry", GEOMETRIES)
@pytest.mark.parametrize("view", [(0, 3), (4, 0), (1, 1)])
def test_depth_of_another_view_than_the_centre(view, geometry):
    """Steps counted from the wrong view, or on a grid where there is none, would shift every sample of the map."""
    light_field = random_light_field(geometry=geometry).seen_from(view)
    parameters = SweepParameters(num_disparities=11, scale=0.3, window_radius=1, window_sigma=0.5, softening=0)
    sweep_and_twin(light_field, parameters, range(len(HALVES_AND_QUARTERS)))


def test_tiles_of_a_wide_picture_fit_together():
    """Pictures wider than a tile: a seam, or a border counted in the middle, would run through the depth map."""
    light_field = random_light_field(grid=(3, 3), shape=(9, 2 * TILE_WIDTH + 9))
    parameters = SweepParameters(num_disparities=5, scale=0.3, window_radius=2, window_sigma=0.5)
    groups = np.zeros(light_field.grid, int)
    result = sweep(light_field, parameters)
    of_groups = twin_sums(light_field, parameters, groups)
    _, cost, mean = twin(light_field, parameters, of_groups, groups, np.ones(1, bool))
    np.testing.assert_allclose(result.cost[0], cost, atol=2e-5)
    np.testing.assert_allclose(result.mean[0], mean, atol=2e-5)


@pytest.mark.parametrize("geometry", GEOMETRIES)
@pytest.mark.parametrize("disparity", [-0.75, 0.0, 0.4])
def test_sweep_visits_the_samples_of_the_stitched_epi(disparity, geometry):
    """The fast sweep and the paper's construction (shift, concatenate, follow the line) are the same cost (Eq. 1-3)."""
    light_field = random_light_field(shape=(12, 15), geometry=geometry)
    light_field = light_field.with_range(DisparityRange(disparity - 0.5, disparity + 0.5, "given"))
    parameters = SweepParameters(num_disparities=3, scale=0.3, window_radius=0, softening=0)
    scale = float(np.sqrt(parameters.scale**2 + residual_variance(light_field.reference_view)))
    result = sweep(light_field, parameters)
    for y, x in [(6, 7), (0, 3), (11, 14), (5, 1)]:
        costs = []
        for candidate in (disparity - 0.5, disparity, disparity + 0.5):
            samples, valid = stitched_epi(light_field, y, candidate).along_line(x)
            valid[np.ravel_multi_index(light_field.reference_position, light_field.grid)] = False
            squared = ((samples - light_field.reference_view[y, x]) ** 2).sum(axis=1)[valid]
            costs.append(np.mean(squared / (squared + scale**2)) if squared.size else np.nan)
        assert result.cost[0, y, x] == pytest.approx(np.nanmin(costs), abs=1e-5)


def test_true_slope_is_a_straight_line_in_the_stitched_epi():
    """A drawn SEPI at the true disparity shows the pixel's colour all along one straight line."""
    light_field = render("fronto_parallel", size=64, views=5)
    y, x = 32, 30
    at_truth = stitched_epi(light_field, y, float(light_field.ground_truth[y, x]))
    samples, valid = at_truth.along_line(x)
    assert valid.sum() == 25
    assert np.abs(samples - light_field.reference_view[y, x]).max() < 0.02
    picture = at_truth.image()
    assert picture.shape == (25, 64, 3)
    columns = np.round(x - at_truth.disparity * at_truth.positions).astype(int)
    drawn = (columns >= 0) & (columns < 64)
    np.testing.assert_allclose(picture[drawn, columns[drawn]], samples[drawn], atol=0.02)
    wrong, _ = stitched_epi(light_field, y, 0.0).along_line(x)
    assert np.abs(wrong - light_field.reference_view[y, x]).max() > 0.05


def test_stitched_epi_refuses_a_row_outside():
    with pytest.raises(SepiError, match="row 99 lies outside"):
        stitched_epi(random_light_field(), 99, 0.0)


def test_dense_candidates_equal_the_numpy_twin():
    """They share the pixels that they read: a weight of one used for the other would blur the minimum."""
    light_field = random_light_field(shape=(20, 40))
    parameters = SweepParameters(num_disparities=61, scale=0.3, window_radius=0, window_sigma=0.5)
    candidates = sampled_candidates(parameters.candidates(light_field), light_field.baselines)
    shared = (np.diff(candidates.down) == 0).mean() * (np.diff(candidates.across) == 0).mean()
    assert 0.5 < shared < 1, "some candidates read the same pixels, some do not"
    sweep_and_twin(light_field, parameters, range(len(HALVES_AND_QUARTERS)))


def test_pixels_outside_the_mask_stay_unknown_and_those_inside_unchanged():
    light_field = random_light_field()
    parameters = SweepParameters(num_disparities=5, scale=0.3, window_radius=2, window_sigma=0.5)
    mask = np.zeros(light_field.shape, bool)
    mask[[1, 7, 8], [3, 0, 16]] = True
    some, whole = sweep(light_field, parameters, mask=mask), sweep(light_field, parameters)
    assert np.isnan(some.disparity[0][~mask]).all()
    np.testing.assert_array_equal(some.disparity[0][mask], whole.disparity[0][mask])


def test_pixels_far_apart_equal_the_whole_picture():
    """Columns between are passed over: a window cut short there would change the depth of the pixels beside."""
    gap = plane_sweep.BLOCK
    light_field = random_light_field(grid=(3, 3), shape=(9, 4 * gap))
    parameters = SweepParameters(num_disparities=5, scale=0.3, window_radius=2, window_sigma=0.5)
    mask = np.zeros(light_field.shape, bool)
    mask[[0, 3, 3, 8], [5, 4, 2 * gap, 4 * gap - 1]] = True
    some, whole = sweep(light_field, parameters, mask=mask), sweep(light_field, parameters)
    for name in ("disparity", "cost", "mean"):
        np.testing.assert_array_equal(getattr(some, name)[0][mask], getattr(whole, name)[0][mask])


def test_subset_without_views_matches_nothing():
    """Seen from a corner of the grid, some parts hold no view: their cost is the worst there is, and is a number."""
    light_field = random_light_field(grid=(3, 3), shape=(40, 44)).seen_from((0, 0))
    views = halves_and_quarters(light_field)
    parameters = SweepParameters(num_disparities=5, scale=0.3, window_radius=1, window_sigma=0.5, softening=0)
    result = sweep(light_field, parameters, subsets=views)
    empty = views.names.index("left-up")
    assert (result.cost[empty] == 1).all()
    assert (result.mean[empty] == 1).all()
    assert np.isfinite(result.disparity).all()


def test_noise_level_is_the_noise_put_in():
    """Scale and window follow the noise: an estimate off by far would blur clean scenes or trust noisy ones."""
    generator = np.random.default_rng(1)
    ramp = np.linspace(0.2, 0.8, 100, dtype=np.float32)
    image = np.repeat((ramp[None] + 0 * ramp[:, None])[..., None], 3, axis=2)
    assert noise_level(image) < 1e-4
    for sigma in (0.01, 0.08):
        noisy = (image + generator.normal(0, sigma, image.shape)).astype(np.float32)
        assert noise_level(noisy) == pytest.approx(sigma, rel=0.1)
        for level in (0.0, 0.5, 1.0):
            # a mask painted in, a black background, what is overexposed: most of the picture
            noisy[20:80, 3:97] = level
            assert noise_level(noisy) == pytest.approx(sigma, rel=0.1)
    assert noise_level(np.zeros_like(image)) == 0
