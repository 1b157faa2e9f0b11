"""Gauss-Newton refinement and second-order smoothing against plain NumPy and SciPy, and on exact truth."""

from dataclasses import replace

import numpy as np
import pytest
from geometries import GEOMETRIES, standing
from scipy.ndimage import gaussian_filter, map_coordinates, spline_filter
from scipy.sparse import coo_array, diags
from scipy.sparse.linalg import spsolve

from sepi.kernels import gauss_newton
from sepi.lightfield import DisparityRange, LightField
from sepi.matching.base_detail import DETAIL_UNIT, BaseDetailParameters, base_detail_decomposition
from sepi.matching.gauss_newton import GaussNewton, Surfaces, spline_derivatives, windowed_step
from sepi.matching.nearest_surfaces import z_buffers
from sepi.matching.row_bands import Rows
from sepi.matching.spline_views import MARGIN, SPLINE_UNIT, spline_views
from sepi.matching.view_subsets import spread_views
from sepi.optimize import SecondOrderParameters, second_order
from sepi.pipeline import estimate_depth
from sepi.process.workspace import Workspace
from sepi.regularization.multilevel import MARGIN as MARGIN_OF_STENCIL
from sepi.regularization.multilevel import multilevel_inverse, solve_smooth
from sepi.regularization.second_order import (
    colour_changes,
    second_difference_stencil,
    smoothness_weights,
    upper_quartile,
)
from sepi.scenes import render
from sepi.stage import StageMaps, no_progress


def test_derivatives_are_those_of_the_spline() -> None:
    image = np.random.default_rng(1).random((12, 15, 3)).astype(np.float32)
    down, across = spline_derivatives(image)
    y, x = np.mgrid[:12, :15].astype(float)
    for c in range(3):
        plane = image[..., c].astype(float)
        for found, step in ((down, (1e-4, 0)), (across, (0, 1e-4))):
            ends = [map_coordinates(plane, [y + s * step[0], x + s * step[1]], order=3, mode="mirror") for s in (1, -1)]
            np.testing.assert_allclose(found[..., c], (ends[0] - ends[1]) / 2e-4, atol=1e-3)


def sums_twin(light_field, decomposed, parameters, disparity, margin):
    """Mean of the views, gradient and curvature, with SciPy's splines."""
    t0, s0 = light_field.reference_position
    H, W = light_field.shape
    rows, columns = np.mgrid[:H, :W].astype(float)
    baselines = light_field.baselines
    nearest = z_buffers(disparity, baselines.reshape(-1, 2), 0, H).reshape(*light_field.grid, *disparity.shape)
    means, gradient, curvature = [], np.zeros((H, W)), np.zeros((H, W))
    for values, unit, scale, share in (
        (
            decomposed.colours.transpose(0, 1, 4, 2, 3),
            decomposed.colour_unit,
            parameters.colour_scale,
            parameters.shares[0],
        ),
        (
            np.repeat(decomposed.detail[:, :, None], 3, axis=2),
            DETAIL_UNIT,
            parameters.detail_scale,
            parameters.shares[1],
        ),
    ):
        planes = values * unit
        scale2 = scale**2 + decomposed.noise
        own = planes[t0, s0].astype(float)
        samples = []
        for t, s in np.argwhere(light_field.present):
            if (t, s) == (t0, s0):
                continue
            v, u = light_field.baselines[t, s]
            y, x = rows - disparity * v, columns - disparity * u
            inside = (y >= 0) & (y <= H - 1) & (x >= 0) & (x <= W - 1)
            position = [
                (a - np.rint(disparity * b)).astype(int).clip(0, n - 1) for a, b, n in ((rows, v, H), (columns, u, W))
            ]
            seen = inside & (nearest[t, s][tuple(position)] <= disparity + np.float32(margin))
            sample = np.stack([map_coordinates(c.astype(float), [y, x], order=3, mode="mirror") for c in planes[t, s]])
            samples.append((v, u, seen, sample))
        total, weight = own.copy(), np.ones((H, W))
        for _, _, seen, sample in samples:
            w = seen / (1 + ((sample - own) ** 2).sum(axis=0) / scale2) ** 2
            total += w * sample
            weight += w
        mean = total / weight
        means.append(np.moveaxis(mean, 0, 2))
        down, across = spline_derivatives(means[-1].astype(np.float32))
        for v, u, seen, sample in samples:
            r, g = np.moveaxis(sample - mean, 0, 2), down * v + across * u
            w = share * seen / scale2 / (1 + (r**2).sum(axis=2) / scale2) ** 2
            gradient += w * (r * g).sum(axis=2)
            curvature += w * (g * g).sum(axis=2)
    return np.concatenate(means, axis=2), gradient, curvature


@pytest.mark.parametrize("geometry", GEOMETRIES)
def test_sums_over_the_views_equal_a_plain_twin(geometry: str) -> None:
    """Wrong visibility, weights or interpolation would bias the depth below the disparity sampling."""
    present = np.ones((3, 4), bool)
    present[1, 0] = False
    # more than one piece of a row
    shape = 10, gauss_newton.AT_ONCE + 12
    colours = np.round(255 * np.random.default_rng(2).random((3, 4, *shape, 3))).astype(np.uint8)
    known = DisparityRange(-1, 1, "given")
    standing_so = standing(geometry, (3, 4))
    light_field = LightField(colours, "random", present=present, disparity_range=known, **standing_so)
    parameters = BaseDetailParameters(colour_scale=0.3, detail_scale=0.2)
    decomposed = base_detail_decomposition(light_field, parameters)
    disparity = np.random.default_rng(3).uniform(-0.9, 0.9, shape).astype(np.float32)
    matching = GaussNewton(light_field, parameters, 0.2)
    mean = matching.mean(disparity)
    gradient, curvature = matching.gradient_and_hessian(mean, disparity)
    expected = sums_twin(light_field, decomposed, parameters, disparity, 0.2)
    # the detail is one channel that counts as three
    np.testing.assert_allclose(mean, expected[0][..., :4], atol=1e-3)
    for found, twin in ((gradient, expected[1]), (curvature, expected[2])):
        np.testing.assert_allclose(found, twin, atol=2e-3 * np.abs(twin).max())


def test_evidence_is_what_single_views_add_up_to() -> None:
    """A half that held other views, or residuals of views that do not see a pixel, would make wrong depth look sure."""
    scene = render("curved_occluders", size=64, views=5)
    parameters, disparity = BaseDetailParameters(), scene.ground_truth.astype(np.float32)
    matching = GaussNewton(scene, parameters, 0.15)
    mean = matching.mean(disparity)
    gradient, curvature, evidence = matching.with_evidence(mean, disparity)
    for found, usual in zip((gradient, curvature), matching.gradient_and_hessian(mean, disparity), strict=True):
        np.testing.assert_array_equal(found, usual)
    t0, s0 = scene.reference_position
    down, across = np.arange(5)[:, None] - t0, np.arange(5)[None] - s0
    for i, half in enumerate((across < 0, across > 0, down < 0, down > 0)):
        present = np.broadcast_to(half, (5, 5)).copy()
        present[t0, s0] = True
        alone = GaussNewton(scene, parameters, 0.15, present).gradient_and_hessian(mean, disparity)
        for found, expected in zip(evidence.halves[i], alone, strict=True):
            np.testing.assert_allclose(found, expected, rtol=1e-3, atol=1e-3 * np.abs(expected).max())
    # of the true depth of a clean scene: all that see a pixel agree, and the hidden see none of it
    hidden = scene.masks["occluded"]
    assert (evidence.seeing[~hidden][:, None] <= 24).all()
    assert evidence.seeing[hidden].mean() < 20 < evidence.seeing[~hidden].mean()
    assert np.median(evidence.agreement / evidence.seeing) > 0.9
    assert np.median(evidence.misfit / evidence.agreement) < 1e-4


def test_splines_that_are_kept_are_those_made_anew() -> None:
    """A stage that finds splines of the one before, of other views or without detail, computes with theirs."""
    scene = render("dots", size=64, views=5)
    rows, usual = Rows(0, scene.shape[0]), BaseDetailParameters()
    colours = usual.model_copy(update={"use_detail": False})
    keeping = replace(scene, workspace=Workspace())
    few, all_views = spread_views(scene, 9), scene.present
    made = ((colours, few), (usual, few), (usual, all_views), (colours, few), (usual, few), (colours, all_views))
    for parameters, present in made:
        found, anew = (spline_views(field, parameters, rows, present) for field in (keeping, scene))
        np.testing.assert_array_equal(found.splines[present], anew.splines[present])
        np.testing.assert_array_equal(found.reference, anew.reference)


def test_coefficients_of_the_strongest_pattern_do_not_wrap_round() -> None:
    """Single black and white pixels side by side have coefficients far outside 0..1."""
    y, x = np.mgrid[:16, :16]
    views = np.where((y + x) % 2, 1.5, -0.5).astype(np.float32)[None, None, ..., None] * np.ones((1, 2, 1, 1, 3))
    field = LightField(views.astype(np.float32), "board", disparity_range=DisparityRange(-1, 1, "given"))
    parameters = BaseDetailParameters()
    splines = spline_views(field, parameters, Rows(0, field.shape[0]), field.present).splines[0, 0, ..., 0]
    inner = splines[MARGIN:-MARGIN, MARGIN:-MARGIN]
    expected = spline_filter(views[0, 0, ..., 0], order=3, mode="mirror")
    np.testing.assert_allclose(inner * SPLINE_UNIT, expected, atol=2 * SPLINE_UNIT)


def test_iterations_end_at_the_true_disparity() -> None:
    """From a fifth of a candidate away, three iterations come within a thousandth of a pixel."""
    scene = render("slanted_plane", size=96)
    matching = GaussNewton(scene, BaseDetailParameters(), 0.15)
    disparity = (scene.ground_truth + 0.02).astype(np.float32)
    for _ in range(3):
        gradient, curvature = matching.gradient_and_hessian(matching.mean(disparity), disparity)
        disparity = disparity + windowed_step(gradient, curvature, disparity, Surfaces(0.15), 3, 0.05)[0]
    assert np.abs(disparity - scene.ground_truth)[8:-8, 8:-8].mean() < 1.5e-3


def plane(shape=(20, 24)):
    y, x = np.mgrid[: shape[0], : shape[1]]
    return (0.3 + 0.02 * x - 0.01 * y).astype(np.float32)


def weights_of(disparity, reliability=1.0):
    guide = np.zeros((*disparity.shape, 3), np.float32)
    return smoothness_weights(
        disparity, colour_changes(guide), np.full(disparity.shape, reliability, np.float32), 0.1, 0.01
    )


def second_differences(shape):
    """Matrices of the second differences along x, along y and across, a row for each, plainly."""
    numbers = np.arange(shape[0] * shape[1]).reshape(shape)
    found = []
    for places, factors in (
        ([numbers[:, :-2], numbers[:, 1:-1], numbers[:, 2:]], [1, -2, 1]),
        ([numbers[:-2], numbers[1:-1], numbers[2:]], [1, -2, 1]),
        ([numbers[:-1, :-1], numbers[:-1, 1:], numbers[1:, :-1], numbers[1:, 1:]], [1, -1, -1, 1]),
    ):
        rows = np.tile(np.arange(places[0].size), len(places))
        values = np.repeat(np.array(factors, float), places[0].size)
        columns = np.concatenate([place.ravel() for place in places])
        found.append(coo_array((values, (rows, columns)), shape=(places[0].size, numbers.size)).tocsr())
    return found


@pytest.mark.parametrize(("dtype", "rtol", "error"), [(np.float64, 1e-10, 1e-5), (np.float32, 1e-5, 1e-4)])
@pytest.mark.parametrize("shape", [(20, 24), (3, 3), (8, 9), (17, 8), (3, 30)])
def test_solver_agrees_with_a_direct_one(shape, dtype, rtol, error) -> None:
    """Also where the last blocks are a pixel wide, on pictures hardly larger than a second difference, and in single
    precision, in which the variants solve.
    """
    random = np.random.default_rng(4)
    data = (plane(shape) + random.normal(0, 0.02, shape)).astype(np.float32)
    weight = random.uniform(0, 1, shape).astype(np.float32) ** 4
    weights = [random.uniform(0, 1, w.shape).astype(dtype) for w in weights_of(data)]
    smooth = sum(d.T @ diags(w.ravel()) @ d for d, w in zip(second_differences(shape), weights, strict=True))
    system = (10 * smooth + diags(np.maximum(weight.ravel(), 1e-9))).tocsc()
    expected = spsolve(system, weight.ravel().astype(float) * data.ravel())
    found = solve_smooth(10 * second_difference_stencil(weights, shape), weight, data, data, rtol, 2000)
    np.testing.assert_allclose(found.ravel(), expected, atol=error)


@pytest.mark.parametrize("shape", [(20, 24), (3, 3), (70, 9)])
def test_preconditioner_adds_what_hats_of_each_width_see(shape) -> None:
    """With a wrong one the solver still gets there, in several times the steps, or stops short of it."""
    random = np.random.default_rng(8)
    weights = [random.uniform(0, 1, w.shape) for w in weights_of(plane(shape))]
    smooth = sum(d.T @ diags(w.ravel()) @ d for d, w in zip(second_differences(shape), weights, strict=True))
    held = random.uniform(0, 1, shape)
    matrix = smooth + diags(held.ravel())
    residual = random.normal(size=shape)
    expected = residual.ravel() / matrix.diagonal()
    for spacing in (2, 8, 32):
        hats = [
            # as far before the first pixel as behind the last, so that mirrored pictures have mirrored ones
            (1 - np.abs(np.arange(n)[:, None] + (1 + -n % 32) / 2 - np.arange(0, n + 32, spacing)) / spacing).clip(0)
            for n in shape
        ]
        both = np.kron(*hats)
        both = both[:, both.any(axis=0)]
        expected += both @ (both.T @ residual.ravel() / np.diag(both.T @ (matrix @ both)))
    margins = ((MARGIN_OF_STENCIL,) * 2,) * 2
    stencil = second_difference_stencil(weights, shape)
    inside = np.s_[MARGIN_OF_STENCIL:-MARGIN_OF_STENCIL, MARGIN_OF_STENCIL:-MARGIN_OF_STENCIL]
    stencil[0][inside] += held
    found, product = multilevel_inverse(stencil)(np.pad(residual, margins))
    np.testing.assert_allclose(found[inside].ravel(), expected, rtol=1e-9, atol=1e-12)
    assert product == pytest.approx(expected @ residual.ravel())


def test_what_is_a_step_follows_from_how_rough_a_map_is() -> None:
    """With the threshold of a bare wall, curved and finely cut surfaces fall into steps."""
    values = np.random.default_rng(3).normal(size=(9, 7)).astype(np.float32)
    along = [np.abs(d @ values.ravel().astype(float)) for d in second_differences(values.shape)[:2]]
    assert upper_quartile(values) == pytest.approx(np.quantile(np.concatenate(along), 0.75, method="higher"), abs=1e-6)
    assert upper_quartile(values[:2, :2]) == 0
    light_field = render("pyramids", size=96)
    bad = [
        np.mean(np.abs(estimate_depth(light_field, "best", own).disparity - light_field.ground_truth) > 0.07)
        for own in ({}, {"optimize": {"roughness_factor": 0.0}})
    ]
    assert bad[0] < 0.6 * bad[1]


def test_pixels_that_nothing_holds_stay_as_they_are() -> None:
    """A picture of 2x2 pixels whose views tell nothing: rounding would leave the solver no direction, and NaN."""
    data = np.array([[0.01447258, -0.1234202], [-0.00083831, -0.13873109]], np.float32)
    stencil = second_difference_stencil([np.zeros((2, 0)), np.zeros((0, 2)), np.full((1, 1), 1.04)], (2, 2))
    found = solve_smooth(stencil, np.zeros((2, 2), np.float32), data, data, 3e-3, 200)
    np.testing.assert_array_equal(found, data)


@pytest.mark.parametrize("contrast", [0, 4])
def test_planes_of_bare_regions_stay_as_they_were_put(contrast: int) -> None:
    """Neither a reflection that stands still in them, nor doubt, nor the slope of the surface beside may bend them."""
    size = 48
    random = np.random.default_rng(6)
    picture = np.full((size, size, 3), 120, np.uint8)
    picture[:, 24:] += random.integers(0, contrast + 1, (size, 24, 3)).astype(np.uint8)
    # detail wider than a pixel, so that it is not taken for noise of the camera
    picture[:, :24] = np.clip(120 + gaussian_filter(random.normal(0, 60, (size, 24, 3)), (1, 1, 0)), 0, 255)
    views = np.broadcast_to(picture, (3, 3, *picture.shape)).copy()
    y, x = np.mgrid[:size, :size]
    # two planes, one behind the other, that begin at the textured surface and lean away from it
    planes = np.where(x < 24, 0, 0.02 * (x - 24) + 0.5 * (y >= 24)).astype(np.float32)
    before = StageMaps(planes, np.where(x < 24, 1, 0.05).astype(np.float32), {"textureless": x >= 24})
    light_field = LightField(views, "bare", disparity_range=DisparityRange(-1, 2, "given"))
    result = second_order(light_field, before, SecondOrderParameters(), no_progress)
    assert np.abs(result.disparity - planes)[:, 30:].max() < 0.03


@pytest.mark.parametrize("axis", [0, 1])
def test_a_mirrored_picture_is_smoothed_alike(axis: int) -> None:
    """Colours hold surfaces apart along both diagonals."""
    random = np.random.default_rng(7)
    picture = random.integers(80, 160, (32, 32, 3)).astype(np.uint8)
    views = np.broadcast_to(picture, (3, 3, *picture.shape)).copy()
    known = DisparityRange(-1, 1, "given")
    maps = StageMaps(random.normal(0, 0.02, (32, 32)).astype(np.float32), np.ones((32, 32), np.float32))
    flipped = StageMaps(np.flip(maps.disparity, axis).copy(), maps.confidence)
    parameters = SecondOrderParameters(rtol=1e-5, first_rtol=1e-5, softening=0)
    usual = second_order(LightField(views, "one", disparity_range=known), maps, parameters, no_progress)
    views = np.flip(views, (axis, axis + 2)).copy()
    other = second_order(LightField(views, "other", disparity_range=known), flipped, parameters, no_progress)
    # samples are sums of whole numbers: where the last digit of a position is another, they differ by one
    np.testing.assert_allclose(np.flip(other.disparity, axis), usual.disparity, atol=5e-5)
