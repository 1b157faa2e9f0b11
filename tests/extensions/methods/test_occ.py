"""Angular patches that edges split: what the method claims of them, its loops against NumPy, awkward light fields."""

import cv2
import numpy as np
import numpy.typing as npt
import pytest
from geometries import GEOMETRIES, standing

from sepi.extensions.methods.occ import (
    LEAST_SHARE,
    ORIENTATIONS,
    OccFieldParameters,
    OccParameters,
    OccSplitParameters,
    halves_of_views,
    occ,
    occ_field,
    occ_split,
    split_patch_costs,
    whole_patch_costs,
)
from sepi.lightfield import BoolMap, DisparityRange, LightField
from sepi.scenes import render
from sepi.scoring.scores import score
from sepi.stage import StageMaps, no_progress

pytestmark = pytest.mark.slow

Array = npt.NDArray[np.float64]


def stages(light_field: LightField, number: int = 41) -> tuple[StageMaps, StageMaps, StageMaps]:
    """Maps of the three stages, with few candidates."""
    whole = occ(light_field, None, OccParameters(num_disparities=number), no_progress)
    split = occ_split(light_field, whole, OccSplitParameters(num_disparities=number), no_progress)
    return whole, split, occ_field(light_field, split, OccFieldParameters(num_disparities=number), no_progress)


def bar(*, slope: float = 0.0) -> LightField:
    """A textured bar of disparity 1 before a textured background of disparity -1, its edges aslant."""
    size, views = 72, 5
    rng = np.random.default_rng(3)
    dark, bright = (low + 0.3 * rng.random((40, 40, 3)) for low in (0.1, 0.6))
    y, x = np.mgrid[:size, :size].astype(float)

    def colour(texture: Array, v: Array, u: Array) -> Array:
        # smooth: bilinear between texels four pixels apart
        v, u = v / 4 + 10, u / 4 + 10
        i, j = np.floor(v).astype(int), np.floor(u).astype(int)
        a, b = (v - i)[..., None], (u - j)[..., None]
        rows = [(1 - b) * texture[i + k, j] + b * texture[i + k, j + 1] for k in (0, 1)]
        return np.asarray((1 - a) * rows[0] + a * rows[1])

    pictures = np.empty((views, views, size, size, 3), np.float32)
    for t in range(views):
        for s in range(views):
            # the point seen at (y, x) lies at (y, x) + d * baseline in the reference view
            at = [(y + d * (t - 2), x + d * (s - 2)) for d in (1.0, -1.0)]
            inside = np.abs(at[0][1] - size / 2 + slope * (at[0][0] - size / 2)) < 10
            pictures[t, s] = np.where(inside[..., None], colour(dark, *at[0]), colour(bright, *at[1]))
    inside = np.abs(x - size / 2 + slope * (y - size / 2)) < 10
    truth = np.where(inside, 1.0, -1.0).astype(np.float32)
    return LightField(
        pictures, "bar", disparity_range=DisparityRange(-1.6, 1.6, "given"), ground_truth=truth, masks={"bar": inside}
    )


def beside_bar(light_field: LightField, width: int = 3) -> BoolMap:
    """Background within ``width`` pixels of the bar, away from the picture's border: hidden in some views."""
    inside = light_field.masks["bar"].astype(np.uint8)
    near = cv2.dilate(inside, np.ones((1, 2 * width + 1), np.uint8)) > inside
    near[:8] = near[-8:] = False
    return np.asarray(near)


@pytest.mark.parametrize("slope", [0.0, 0.6])
def test_split_patches_see_past_an_occluder(slope: float) -> None:
    """The method's claim: half a patch stays of one colour beside an occluder, along an edge of any orientation.

    If this fails, depth bleeds over edges as it does without any occlusion model.
    """
    light_field = bar(slope=slope)
    whole, split, _ = stages(light_field)
    near = beside_bar(light_field)
    before, after = (score(maps.disparity, light_field.ground_truth, region=near)["mse100"] for maps in (whole, split))
    assert after < 0.3 * before


@pytest.mark.parametrize("geometry", GEOMETRIES)
def test_a_plane_parallel_to_the_views_gets_its_disparity(geometry: str) -> None:
    """Its disparity lies in the middle between two of 40 candidates, 0.05 apart.

    If this fails, candidates or the parabola between them are off, or views are taken to stand where they do not.
    """
    light_field = render("fronto_parallel", size=64, views=5, **standing(geometry, (5, 5)))
    # the plane lies half a candidate, 0.0256, from the labels of the optimisation
    for maps, bound in zip(stages(light_field, 40), (0.003, 0.01, 0.0257), strict=True):
        error = np.abs(maps.disparity - light_field.ground_truth)[6:-6, 6:-6]
        assert np.median(error) < bound
        assert np.percentile(error, 95) < 0.04


def test_whole_patch_costs_equal_numpy() -> None:
    """If this fails, the loop over the views does not compute the stated costs."""
    rng = np.random.default_rng(0)
    sheared, reference = rng.random((7, 3, 6, 5), np.float32), rng.random((3, 6, 5), np.float32)
    out = whole_patch_costs(sheared, reference)
    expected = (sheared.var(axis=0, ddof=1) + (sheared.mean(axis=0) - reference) ** 2).mean(axis=0)
    np.testing.assert_allclose(out, expected, rtol=1e-4, atol=1e-6)


def test_split_patch_costs_equal_numpy() -> None:
    """If this fails, the loops over the views do not compute the stated costs of halves."""
    rng = np.random.default_rng(1)
    sheared, reference = rng.random((9, 3, 6, 5), np.float32), rng.random((3, 6, 5), np.float32)
    places = np.array([rng.integers(0, 6, 8), rng.integers(0, 5, 8), rng.integers(0, 3, 8)]).T
    halves = rng.random((3, 2, 9)) < 0.6
    halves[:, :, :2] = True
    beside = rng.random((8, 2, 3), np.float32)
    costs, cues = split_patch_costs(sheared, reference, places, halves, beside, 0.02)
    for p, (y, x, orientation) in enumerate(places):
        parts = [sheared[halves[orientation, j], :, y, x] for j in (0, 1)]
        means = [part.mean(axis=0) for part in parts]
        variances = [part.var(axis=0, ddof=1).mean() for part in parts]
        best = int(variances[1] < variances[0])
        cost = variances[best] + ((means[best] - reference[:, y, x]) ** 2).mean()
        fit = sum(np.abs(means[j] - beside[p, j]).mean() for j in (0, 1))
        swapped = sum(np.abs(means[1 - j] - beside[p, j]).mean() for j in (0, 1))
        np.testing.assert_allclose(costs[p], cost if fit <= swapped + 0.02 else np.inf, rtol=1e-4)
        np.testing.assert_allclose(cues[p], [*variances, np.abs(means[0] - means[1]).mean()], rtol=1e-3)


def test_halves_lie_on_their_sides_and_share_the_dividing_line() -> None:
    """If this fails, halves do not match the edge, and both hold views of both surfaces."""
    baselines = np.stack(np.meshgrid([-1, 0, 1], [-1, 0, 1], indexing="ij"), axis=2).reshape(-1, 2).astype(float)
    halves = halves_of_views(baselines)
    np.testing.assert_array_equal(halves[0, 1], baselines[:, 1] >= 0)
    np.testing.assert_array_equal(halves[0, 0], baselines[:, 1] <= 0)
    np.testing.assert_array_equal(halves[ORIENTATIONS // 2, 1], baselines[:, 0] >= 0)
    np.testing.assert_array_equal(halves.any(axis=1), True)


def test_halves_without_views_are_whole() -> None:
    """If this fails, the one view of such a half agrees with itself at every candidate, and the depth is noise."""
    corner = np.stack(np.meshgrid([0, 1, 2], [0, 1, 2], indexing="ij"), axis=2).reshape(-1, 2).astype(float)
    assert halves_of_views(corner)[0, 0].sum() == 3  # a column of views: 2 of 8 others
    assert halves_of_views(corner)[2].sum(axis=1).min() - 1 >= LEAST_SHARE * 8
    np.testing.assert_array_equal(halves_of_views(corner)[2, 0], True)
