"""The visibility sweep, its z-buffers and the semi-global smoothing equal plain NumPy twins."""

import itertools

import numpy as np
import pytest
from geometries import GEOMETRIES, standing
from several_threads import SEVERAL, threads

from sepi.kernels import semi_global, visibility
from sepi.lightfield import DisparityRange, LightField
from sepi.matching.base_detail import DETAIL_UNIT, BaseDetailParameters, base_detail_decomposition
from sepi.matching.nearest_surfaces import EMPTY, z_buffers
from sepi.matching.semi_global import Places
from sepi.matching.sweep_arrays import Visibility, sampled_candidates
from sepi.matching.view_subsets import spread_views, views_without_aliases
from sepi.matching.visibility_sweep import (
    VisibleViewsParameters,
    depth_from_visible_views,
    occluded_in_any_view,
)
from sepi.scenes import render
from sepi.stage import no_progress


def random_light_field(grid=(3, 4), shape=(11, 13), channels=3, dtype=np.uint8, present=None, geometry="grid"):
    views = np.random.default_rng(0).random((*grid, *shape, channels), np.float32)
    if dtype != np.float32:
        views = np.round(views * np.iinfo(dtype).max).astype(dtype)
    known = DisparityRange(-1.3, 1.1, "given")
    return LightField(views, "random", present=present, disparity_range=known, **standing(geometry, grid))


@pytest.mark.parametrize(
    ("grid", "view", "at_least", "rows", "count"),
    [
        ((9, 9), (4, 4), 25, "x.x.x.x.x", 25),
        ((9, 9), (4, 4), 26, "x.x.x.x.x", 41),
        ((9, 9), (4, 4), 13, "x...x...x", 13),
        ((9, 9), (3, 4), 16, ".x.x.x.x.", 20),
        ((5, 5), (2, 2), 25, "xxxxx", 25),
        ((3, 3), (1, 1), 25, "xxx", 9),
        ((1, 51), (0, 25), 25, "x", 25),
        ((17, 17), (8, 8), 25, "x...x...x...x...x", 25),
        ((2, 2), (0, 0), 2, "x.", 2),
    ],
)
def test_few_views_that_stand_for_all(grid, view, at_least, rows, count) -> None:
    """Views on one side alone, or near the middle alone, would tell less of what hides what."""
    field = LightField(np.zeros((*grid, 4, 4, 3), np.uint8), "grid", view=view)
    chosen = spread_views(field, at_least)
    assert chosen[view]
    assert chosen.sum() == count
    assert ["x" if some else "." for some in chosen[:, view[1]]] == list(rows)


def test_a_third_of_the_views_leaves_out_no_row() -> None:
    """Every second row and column have the aliases of a texture twice as near."""
    field = LightField(np.zeros((9, 9, 4, 4, 3), np.uint8), "grid")
    for at_least, count in ((25, 27), (13, 13)):
        chosen = views_without_aliases(field, at_least)
        assert chosen[4, 4]
        assert chosen.sum() == count
        # of 13, one row and column are two off the middle on either side
        assert all((chosen.sum(axis=axis) > 0).sum() >= 7 for axis in (0, 1))


@pytest.mark.parametrize("side", [5, 9, 17])
def test_nine_views_repeat_no_more_than_all_and_turn_with_the_grid(side: int) -> None:
    """Views of every second or fourth column repeat stripes as often; a lattice that leans turns into another."""
    ring = views_without_aliases(LightField(np.zeros((side, side, 4, 4, 3), np.uint8), "grid"), 9)
    assert ring.sum() == 9
    np.testing.assert_array_equal(ring, np.rot90(ring))
    assert np.gcd.reduce(np.argwhere(ring)[:, 1] - side // 2) == 1


def test_a_single_row_keeps_enough_views() -> None:
    """It has no other rows to tell a texture from its repetition."""
    row = LightField(np.zeros((1, 51, 4, 4, 3), np.uint8), "row")
    assert views_without_aliases(row, 9).sum() >= 25


@pytest.mark.parametrize(("grid", "at_least"), [((9, 9), 41), ((17, 17), 41), ((17, 17), 25)])
@pytest.mark.parametrize("direction", [(0, 1), (1, 0), (1, 1), (1, -1)])
def test_no_stripes_or_checks_have_an_alias_in_few_views(grid, at_least, direction) -> None:
    """A chess board of views shows checks that move by half a period a view as if they stood still."""
    field = LightField(np.zeros((*grid, 4, 4, 3), np.uint8), "grid")
    chosen = np.argwhere(views_without_aliases(field, at_least, far=True)) - np.array(field.reference_position)
    assert at_least <= len(chosen) <= 1.2 * at_least
    # periods that the texture moves by a view
    moved = np.linspace(1.5 / grid[0], 1 - 1.5 / grid[0], 200)
    agreeing = np.abs(np.exp(2j * np.pi * np.outer(chosen @ np.array(direction), moved)).mean(axis=0))
    assert agreeing.max() < 0.5


def test_views_that_are_missing_do_not_stand_for_others() -> None:
    present = np.ones((9, 9), bool)
    present[::2] = False
    present[4] = True
    field = LightField(np.zeros((9, 9, 4, 4, 3), np.uint8), "holes", present=present)
    chosen = spread_views(field, 9)
    assert not (chosen & ~present).any()
    assert 9 <= chosen.sum() < present.sum()


def test_a_wrong_map_is_put_right() -> None:
    """Few views search far from it: who looked near it alone would keep what the stage before got wrong."""
    field = render("curved_occluders", size=96)
    wrong = np.full(field.shape, field.require_disparity_range().maximum, np.float32)
    found = depth_from_visible_views(field, wrong, VisibleViewsParameters(occlusion_margin=10), no_progress)
    assert np.mean(np.abs(found.disparity - field.ground_truth) > 0.1) <= 0.05


def z_buffer_twin(disparity, dt, ds):
    H, W = disparity.shape
    nearest = np.full((H, W), EMPTY)
    # what is at the border goes on beyond it
    for y, x in itertools.product(range(-H, 2 * H), range(-W, 2 * W)):
        d = disparity[min(max(y, 0), H - 1), min(max(x, 0), W - 1)]
        for row, column in np.ndindex(H, W):
            if abs(row - (y - d * dt)) < 1 and abs(column - (x - d * ds)) < 1:
                nearest[row, column] = max(nearest[row, column], d)
    return nearest


def sampled(values, y, x):
    """Bilinear samples with weights in steps of 2^-14."""
    H, W = values.shape
    top, left = (np.floor(p).astype(int).clip(0, n - 2) for p, n in ((y, H), (x, W)))
    fy, fx = (y - top).clip(0, 1), (x - left).clip(0, 1)
    weights = np.floor(np.stack([(1 - fy) * (1 - fx), (1 - fy) * fx, fy * (1 - fx), fy * fx]) * 2**14 + 0.5)
    weights += (weights.argmax(axis=0) == np.arange(4)[:, None, None]) * (2**14 - weights.sum(axis=0))
    return sum(values[top + i, left + j] * weights[2 * i + j] for i, j in np.ndindex(2, 2)) / 2**14


def bows(picture, y, x):
    """What straight lines between pixels are off from curves through them, across and down; picture (C, H, W)."""
    found = np.zeros(picture.shape)
    for axis, places in ((1, y), (2, x)):
        bend = np.moveaxis(np.zeros_like(picture), axis, 0)
        values = np.moveaxis(picture, axis, 0)
        bend[1:-1] = values[:-2] + values[2:] - 2 * values[1:-1]
        within = np.floor((places - np.floor(places)) * 2**14 + 0.5)
        bow = np.floor(2 * within * (2**14 - within) / 2**14) / 2**14
        quarters = np.trunc(np.sign(bend) * np.maximum(np.abs(bend) - np.float32(0.05), 0) * np.float32(5_000)) / 20_000
        found += np.moveaxis(quarters, 0, axis) * bow
    return found


def sweep_twin(light_field, views, nearest, disparities, margin, hidden, scales, shares, compared):
    t0, s0 = light_field.reference_position
    H, W = light_field.shape
    rows, columns = np.mgrid[:H, :W].astype(float)
    # colours in whole steps
    planes = [np.rint(views.colours.transpose(0, 1, 4, 2, 3) * views.colour_unit * 20_000) / 20_000]
    if views.detail.shape[2]:
        # one channel that counts as three
        planes.append(np.repeat(views.detail[:, :, None] * DETAIL_UNIT, 3, axis=2))
    out = np.ones((len(disparities), H, W))
    for k, d in enumerate(disparities.astype(float)):
        total, weight = np.zeros((2, H, W))
        for t, s in np.argwhere(light_field.present):
            if (t, s) == (t0, s0):
                continue
            down, across = light_field.baselines[t, s]
            y, x = rows - d * down, columns - d * across
            inside = (y >= 0) & (y <= H - 1) & (x >= 0) & (x <= W - 1)
            seen = np.ones((H, W))
            if nearest is not None:
                # halves alike from either side
                near = np.stack([rows - np.rint(np.float32(d * down)), columns - np.rint(np.float32(d * across))])
                near = near.astype(int).clip(0, [[[H - 1]], [[W - 1]]])
                beyond = d + 1.5 * margin - nearest[t, s][near[0], near[1]]
                seen = np.clip(beyond / max(margin, 1e-6), hidden, 1)
            seen = seen * compared[k, t, s]
            most = bows(np.moveaxis(views.guide, 2, 0), y, x)
            for values, scale, share in zip(planes, scales, shares, strict=False):
                off = np.stack([sampled(c, y, x) for c in values[t, s]]) - values[t0, s0]
                if values is planes[0]:
                    off -= np.clip(off, np.minimum(most, 0), np.maximum(most, 0))
                squared = (off**2).sum(axis=0)
                total += inside * seen * share * squared / (squared + scale)
            weight += inside * seen
        out[k] = np.where(weight > 0, total / np.maximum(weight, 1e-12), 1)
    return out


@pytest.mark.parametrize("channels", [1, 3])
@pytest.mark.parametrize("dtype", [np.uint8, np.uint16, np.float32])
@pytest.mark.parametrize("visible", [False, True])
@pytest.mark.parametrize("geometry", GEOMETRIES)
def test_costs_equal_a_plain_twin(channels: int, dtype: type, visible: bool, geometry: str) -> None:
    """A wrong sample, weight or view here is a wrong depth everywhere."""
    present = np.ones((3, 4), bool)
    present[0, 1] = False
    light_field = random_light_field(channels=channels, dtype=dtype, present=present, geometry=geometry)
    views = base_detail_decomposition(light_field, BaseDetailParameters())
    disparities = light_field.require_disparity_range().candidates(7)
    disparity = np.random.default_rng(1).choice(disparities, light_field.shape).astype(np.float32)
    baselines = light_field.baselines
    nearest = z_buffers(disparity, baselines[present], 0, 11) if visible else np.empty((11, 11, 0), np.float32)
    hidden = dict(zip(map(tuple, np.argwhere(present).tolist()), nearest, strict=True)) if visible else None
    scales, shares = np.array([0.02, 0.01], np.float32), np.array([0.4, 0.6], np.float32)
    cost = np.empty((7, 11, 13), np.float32)
    # some views compare all candidates, the others few, in a part of the picture
    searched = np.indices((3, 4)).sum(axis=0) % 2 == 0
    likely = np.sort(np.random.default_rng(2).integers(0, 7, (2, 11, 13), np.int32), axis=0)
    numbers = np.arange(7)[:, None, None]
    compared = searched[:, :, None, None] | ((likely[0] <= numbers) & (numbers <= likely[1]))[:, None, None]
    if not visible:
        compared, searched, likely = np.ones((7, 3, 4, 1, 1), bool), present, np.empty((2, 0, 0), np.int32)
    seen = Visibility(nearest, np.float32(0.1), np.float32(0.05), searched, likely)
    candidates = sampled_candidates(disparities, baselines)
    visibility.sweep_visible_rows(views, seen, scales, shares, candidates, 0, 11, cost)
    expected = sweep_twin(light_field, views, hidden, disparities, np.float32(0.1), 0.05, scales, shares, compared)
    np.testing.assert_allclose(cost, expected, atol=2e-5)


@pytest.mark.parametrize("geometry", GEOMETRIES)
def test_z_buffers_hold_the_nearest_pixel_that_touches_a_position(geometry: str) -> None:
    """An occluder at the wrong place leaves out views that see the pixel, and keeps those that do not."""
    light_field = random_light_field(geometry=geometry)
    disparity = np.random.default_rng(2).uniform(-1.5, 1.5, light_field.shape).astype(np.float32)
    baselines = light_field.baselines.reshape(-1, 2)
    for baseline, found in zip(baselines, z_buffers(disparity, baselines, 0, 11), strict=True):
        np.testing.assert_array_equal(found, z_buffer_twin(disparity, *baseline).astype(np.float32))


def test_an_occluder_hides_what_lies_beside_it() -> None:
    """A square before a wall hides the wall on each side from the views on that side, and nothing else."""
    disparity = np.zeros((40, 40), np.float32)
    disparity[15:25, 15:25] = 2
    field = LightField(np.zeros((3, 3, 40, 40, 1), np.uint8), "square")
    occluded = occluded_in_any_view(field, disparity, 0.15, field.present)
    assert occluded[18:22, 13:15].all()
    assert occluded[18:22, 25:27].all()
    assert occluded[13:15, 18:22].all()
    assert not occluded[15:25, 15:25].any()
    assert not occluded[:, :12].any()
    assert not occluded[28:].any()


def aggregate_twin(cost, guide, radius, variance):
    K, H, W = cost.shape
    out = np.empty((H, W, K))
    for y, x in np.ndindex(H, W):
        rows, columns = np.s_[max(0, y - radius) : y + radius + 1], np.s_[max(0, x - radius) : x + radius + 1]
        weight = np.exp(-((guide[rows, columns] - guide[y, x]) ** 2).sum(axis=2) / (2 * variance[y, x]))
        out[y, x] = (cost[:, rows, columns] * weight).sum(axis=(1, 2)) / weight.sum()
    return out


def path_twin(cost, guide, dy, dx, small, large, weakening):
    H, W, K = cost.shape
    path = np.zeros_like(cost)
    jumps = np.abs(np.subtract.outer(np.arange(K), np.arange(K)))
    for y in range(H)[:: 1 if dy >= 0 else -1]:
        for x in range(W)[:: 1 if dx >= 0 else -1]:
            v, u = y - dy, x - dx
            if not (0 <= v < H and 0 <= u < W):
                path[y, x] = cost[y, x]
                continue
            change = np.abs(guide[y, x] - guide[v, u]).sum()
            penalty = np.choose(np.minimum(jumps, 2), [0, small, max(1.5 * small, large / (1 + weakening * change))])
            path[y, x] = cost[y, x] + (path[v, u] + penalty).min(axis=1) - path[v, u].min()
    return path


def averaged_by_kernel(cost, guide, radius, variance, places):
    """By the kernel, in two parts; what was there before must not matter."""
    H = len(guide)
    colours = np.moveaxis(guide, 2, 0).copy()
    out = np.full(places.size, 7, np.uint16)
    half, top = H // 2, max(0, H // 2 - radius)
    semi_global.aggregate(cost[:, : half + radius].copy(), 0, colours, places, radius, variance, 0, half, out)
    semi_global.aggregate(cost[:, top:].copy(), top, colours, places, radius, variance, half, H, out)
    return out


def candidates_of(cost):
    """First and last of all candidates (K, H, W)."""
    return np.stack([np.zeros(cost.shape[1:], np.int32), np.full(cost.shape[1:], len(cost) - 1, np.int32)])


def laid_out(volume, places):
    """A volume as an array (H, W, K'), NaN where a pixel has no candidate."""
    out = np.full((*places.first.shape, places.candidates), np.nan)
    for y, x in np.ndindex(*places.first.shape):
        first, beyond, origin = (int(each[y, x]) for each in places[:3])
        out[y, x, first:beyond] = volume[origin + first : origin + beyond]
    return out


@pytest.mark.parametrize(
    ("large", "scale", "K", "some"), [(0.5, 2**2, 6, False), (12.5, 2**5, 6, False), (0.5, 2**2, 70, True)]
)
def test_smoothing_equals_a_plain_twin(large: float, scale: int, K: int, some: bool) -> None:
    """Paths are sums of whole numbers, of costs cut to fewer bits; with larger penalties of fewer.

    Where pixels have ``some`` of the candidates, others are not reached.
    """
    random = np.random.default_rng(3)
    H, W = 8, 2 * semi_global.STRETCH + 5
    cost, guide = random.random((K, H, W)).astype(np.float32), random.random((H, W, 3)).astype(np.float32) * 0.1
    likely = np.sort(random.integers(0, K, (2, H, W), np.int32), axis=0) if some else candidates_of(cost)
    places = Places.of_candidates(*likely, K)
    variance = random.uniform(0.002, 0.02, (H, W)).astype(np.float32)
    volume = averaged_by_kernel(cost, guide, 2, variance, places)
    averaged = laid_out(volume, places)[:, :, :K]
    told = np.isfinite(averaged)
    assert told.all() != some
    assert all(
        told[y, x, first : last + 1].all()
        for (y, x), first, last in zip(np.ndindex(H, W), *likely.reshape(2, -1), strict=True)
    )
    np.testing.assert_allclose(
        (averaged / semi_global.ONE)[told], aggregate_twin(cost, guide, 2, variance)[told], atol=2e-5
    )
    smoothed = np.full_like(volume, 7)
    with threads(SEVERAL):
        semi_global.semi_global(volume, np.moveaxis(guide, 2, 0).copy(), places, 0.1, large, 5, smoothed)
    directions = [(0, 1), (0, -1), (1, 0), (-1, 0), (1, 1), (1, -1), (-1, 1), (-1, -1)]
    steps, one = np.where(told, averaged // scale, np.inf), semi_global.ONE / scale
    expected = sum(path_twin(steps / one, guide, *d, 0.1, large, 5) for d in directions)
    np.testing.assert_allclose((laid_out(smoothed, places)[:, :, :K] / (one / 4))[told], expected[told], atol=40 / one)


@pytest.mark.parametrize(("shape", "radius"), [((2, 2), 4), ((3, 1), 2), ((9, 3), 4)])
def test_a_window_may_be_wider_than_the_picture(shape: tuple[int, int], radius: int) -> None:
    """What is beyond the picture's ends is no part of it: a sliver of a picture had another depth in each run."""
    random = np.random.default_rng(4)
    cost, guide = random.random((5, *shape)).astype(np.float32), random.random((*shape, 3)).astype(np.float32) * 0.1
    places = Places.of_candidates(*candidates_of(cost), 5)
    variance = random.uniform(0.002, 0.02, shape).astype(np.float32)
    averaged = laid_out(averaged_by_kernel(cost, guide, radius, variance, places), places)[:, :, :5] / semi_global.ONE
    np.testing.assert_allclose(averaged, aggregate_twin(cost, guide, radius, variance), atol=2e-5)


def test_margin_tells_one_minimum_from_two() -> None:
    """Confidence is high for one deep minimum, zero for two equal ones and where nothing differs."""
    disparities = np.linspace(-1, 1, 21).astype(np.float32)
    one = np.minimum(1, np.abs(disparities - 0.5))
    two = np.minimum(one, np.abs(disparities + 0.5))
    costs = np.stack([one, two, np.full(21, 0.3)])
    volume = np.full((1, 3, 2 * semi_global.AT_ONCE), semi_global.ONE, np.uint16)
    volume[0, :, :21] = np.rint(costs * semi_global.ONE)
    places, volume = Places.of_candidates(*candidates_of(np.empty((21, 1, 3))), 21), volume.ravel()
    disparity, margin = np.empty((2, 1, 3), np.float32)
    semi_global.choose(volume, volume, disparities, places, 0.25, disparity, margin)
    assert disparity[0, 0] == pytest.approx(0.5, abs=1e-5)
    assert margin[0, 0] == pytest.approx(0.3, abs=1e-4)
    np.testing.assert_allclose(margin[0, 1:], 0, atol=1e-4)
    # what fills vectors behind the last candidate is no other minimum
    semi_global.choose(volume, volume, disparities + 20, places, 3, disparity, margin)
    np.testing.assert_array_equal(margin, 0)
    # a minimum at a candidate that no pixel has is none
    some = Places.of_candidates(np.full((1, 3), 16, np.int32), np.full((1, 3), 20, np.int32), 21)
    semi_global.choose(volume, volume, disparities, some._replace(origin=places.origin), 0.5, disparity, margin)
    assert disparity[0, 1] == pytest.approx(0.6, abs=1e-5)
    assert margin[0, 1] == pytest.approx(0.9, abs=1e-4)
