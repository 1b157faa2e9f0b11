"""The fast method of one-bit features: its costs, their interpolation, its weighted medians, and what it claims."""

from dataclasses import replace
from itertools import combinations

import numpy as np
import numpy.typing as npt
import pytest

from sepi.extensions.methods.mishiba import (
    MishibaParameters,
    details,
    pair_costs,
)
from sepi.kernels import mishiba as kernels
from sepi.kernels import sheared_views
from sepi.lightfield import LightField
from sepi.pipeline import estimate_depth
from sepi.scenes import render

pytestmark = pytest.mark.slow

PARAMETERS = MishibaParameters()


def bits(light_field: LightField, views: npt.NDArray[np.bool_], disparity: float) -> npt.NDArray[np.bool_]:
    """Features of the views sheared by a disparity, by a kernel that goes on beyond borders; (N, H, W)."""
    maps = details(light_field, views, PARAMETERS.feature_sigma)[:, None]
    sheared = np.empty_like(maps)
    sheared_views.shear(maps, -disparity * light_field.baselines[views], True, sheared)
    return sheared[:, 0] > 0


@pytest.mark.parametrize("step", [1, 2, 3])
def test_counting_equals_the_sum_over_all_pairs_of_views(step: int) -> None:
    """The method's first saving: were it no equality, the costs would be of something else than pairs of views."""
    scene = render("pencils", size=64, views=3)
    disparities = np.array([-0.7, 0.0, 0.43], np.float32)
    offsets = -disparities[:, None, None].astype(float) * scene.baselines[scene.present]
    found = pair_costs(details(scene, scene.present, 1.0), offsets, step)
    for disparity, costs in zip(disparities.tolist(), found, strict=True):
        of_view = bits(scene, scene.present, disparity)
        pairs = np.mean([a != b for a, b in combinations(of_view, 2)], axis=0) * (9 * 8 / 2) / (4 * 5)
        # one view step away is at most a pixel beyond the border
        inner = (slice(1, -1), slice(1, -1))
        expected = np.full((64, 64), np.nan)
        expected[inner] = pairs[inner]
        expected = expected[::step, ::step]
        known = np.isfinite(expected)
        np.testing.assert_allclose(costs[known], expected[known], atol=1e-6)


def test_views_that_end_before_a_pixel_take_no_part() -> None:
    """Else what lies beyond the border would be compared as if it had been seen, and surfaces there would bulge."""
    generator = np.random.default_rng(0)
    maps = generator.normal(size=(3, 8, 12)).astype(np.float32)
    offsets = np.array([[[0, 0], [0, 3], [-2, 0]]], float)
    found = pair_costs(maps, offsets, 1)
    for y, x in np.ndindex(8, 12):
        seen = [maps[0, y, x] > 0]
        seen += [maps[1, y, x + 3] > 0] if x + 3 < 12 else []
        seen += [maps[2, y - 2, x] > 0] if y >= 2 else []
        ones, n = sum(seen), len(seen)
        expected = ones * (n - ones) / ((n // 2) * (n - n // 2)) if n > 1 else 1
        assert found[0, y, x] == pytest.approx(expected), (y, x)


def test_interpolated_costs_equal_a_plain_computation() -> None:
    """Least cost, its neighbours and the sum decide disparity and confidence of every pixel."""
    generator = np.random.default_rng(1)
    step, height, width = 3, 10, 11
    guide = generator.random((height, width, 3), np.float32)
    slopes = generator.normal(size=(5, 4, 4, 3)).astype(np.float32)
    constants = generator.normal(size=(5, 4, 4)).astype(np.float32)
    labels, kept = np.zeros((height, width), np.int64), np.zeros((height, width, 5), np.float32)
    for k in range(5):
        kernels.keep_least(k, slopes[k], constants[k], guide, step, labels, kept)
    y, x = np.arange(height) / step, np.arange(width) / step
    tent = np.arange(4)
    down, across = (np.maximum(0, 1 - np.abs(at[:, None].clip(0, 3) - tent)) for at in (y, x))
    functions = np.concatenate([slopes, constants[..., None]], axis=3)
    everywhere = np.einsum("yi,xj,kijc->kyxc", down, across, functions)
    costs = (everywhere[..., :3] * guide).sum(axis=3) + everywhere[..., 3]
    np.testing.assert_array_equal(labels, costs.argmin(axis=0))
    np.testing.assert_allclose(kept[..., 0], costs.min(axis=0), rtol=1e-4, atol=1e-5)
    np.testing.assert_allclose(kept[..., 4], costs.sum(axis=0), rtol=1e-4, atol=1e-5)
    inner = (labels > 0) & (labels < 4)
    for column, offset in ((1, -1), (2, 1)):
        beside = np.take_along_axis(costs, np.clip(labels + offset, 0, 4)[None], axis=0)[0]
        np.testing.assert_allclose(kept[inner, column], beside[inner], rtol=1e-4, atol=1e-5)


def plain_median_pass(current, data, weights, guide, radius, gap, table, per_entry):
    """The same by sorting."""
    out = np.empty_like(current)
    height, width = current.shape
    for y, x in np.ndindex(height, width):
        entries = [(data[y, x], weights[y, x])]
        for j, i in np.ndindex(2 * radius + 1, 2 * radius + 1):
            v, u = y + (j - radius) * gap, x + (i - radius) * gap
            if (v, u) != (y, x) and 0 <= v < height and 0 <= u < width:
                entry = int(((guide[v, u] - guide[y, x]) ** 2).sum() / per_entry)
                entries.append((current[v, u], table[entry] if entry < len(table) else 0))
        values, shares = np.array(sorted(entries), np.int64).T
        out[y, x] = values[np.searchsorted(2 * np.cumsum(shares), shares.sum())]
    return out


@pytest.mark.parametrize(("radius", "gap"), [(1, 1), (2, 3)])
def test_bisection_finds_the_weighted_median(radius: int, gap: int) -> None:
    """The refined depth is nothing but these medians."""
    generator = np.random.default_rng(3)
    current, data = generator.integers(0, 1000, (2, 13, 11), np.int32)
    weights = generator.integers(0, 50, (13, 11), np.int32)
    guide = np.round(generator.random((13, 11, 3)) * 8).astype(np.float32) / 8
    table = np.array([40, 20, 10], np.int32)
    # no squared distance of such colours lies on the limit between two entries
    arguments = (current, data, weights, guide, radius, gap, table, 0.3001)
    found = np.empty_like(data)
    kernels.median_pass(*arguments, found)
    np.testing.assert_array_equal(found, plain_median_pass(*arguments))


@pytest.mark.parametrize("views", [5, 9])
def test_a_plane_gets_its_disparity(views: int) -> None:
    """Sub-pixel depth comes from the parabola through costs that are counts of bits."""
    scene = render("fronto_parallel", size=96, views=views)
    error = np.abs(estimate_depth(scene, "mishiba").disparity - scene.ground_truth)
    # in pixels of the farthest view
    assert error.mean() * scene.reach < 0.02
    assert np.percentile(error, 99) * scene.reach < 0.2
    flat = replace(scene, views=np.full_like(scene.views, 90))
    assert estimate_depth(flat, "mishiba").confidence.max() <= 0.01
