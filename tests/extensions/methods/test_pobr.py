"""POBR: its labels, the boundary regions, what is shrunk and reinforced there, and light fields of other kinds."""

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.ndimage import gaussian_filter

from sepi.extensions.methods.pobr import (
    PobrCostParameters,
    PobrRegionParameters,
    PobrSmoothingParameters,
    photo_consistency,
    pobr_cost,
    pobr_regions,
    pobr_smoothing,
    squared_gradient,
    squared_steps,
)
from sepi.image.superpixels import superpixels
from sepi.lightfield import DisparityRange, LightField
from sepi.stage import no_progress

pytestmark = pytest.mark.slow

SIZE = 64


@pytest.fixture(scope="module")
def disc():
    """A bright disc of disparity 2 before a dim textured wall of disparity -1, 7 x 7 views.

    Both disparities are whole numbers: a view is a shifted copy, exact without interpolation.
    """
    generator = np.random.default_rng(3)
    wall, near = (
        np.clip(mean + gaussian_filter(generator.normal(0, 0.15, (3 * SIZE, 3 * SIZE, 3)), (1.5, 1.5, 0)), 0, 1)
        for mean in (0.3, 0.7)
    )
    rows, columns = np.mgrid[:SIZE, :SIZE]
    views = np.empty((7, 7, SIZE, SIZE, 3), np.float32)
    for t in range(7):
        for s in range(7):
            down, across = t - 3, s - 3
            y, x = rows + 2 * down, columns + 2 * across
            covered = (y - SIZE / 2) ** 2 + (x - SIZE / 2) ** 2 < 14**2
            shown = near[y + SIZE, x + SIZE], wall[rows - down + SIZE, columns - across + SIZE]
            views[t, s] = np.where(covered[..., None], *shown)
    covered = (rows - SIZE / 2) ** 2 + (columns - SIZE / 2) ** 2 < 14**2
    truth = np.where(covered, 2, -1).astype(np.float32)
    return LightField(views, "disc", disparity_range=DisparityRange(-1.5, 2.5, "given"), ground_truth=truth)


@pytest.fixture(scope="module")
def labels(disc):
    return pobr_cost(disc, None, PobrCostParameters(num_disparities=41), no_progress)


def regions_of(light_field, before, **values):
    # superpixels of 8 pixels
    number = light_field.shape[0] * light_field.shape[1] // 64
    return pobr_regions(light_field, before, PobrRegionParameters(superpixels=number, **values), no_progress)


def error_beside(light_field, disparity, reach=9):
    """Mean squared error of the pixels of the wall that the disc hides in some view."""
    rows, columns = np.mgrid[:SIZE, :SIZE]
    distance = np.hypot(rows - SIZE / 2, columns - SIZE / 2)
    beside = (distance >= 14) & (distance < 14 + reach)
    return float(((disparity - light_field.ground_truth)[beside] ** 2).mean())


def smoothed(light_field, maps):
    return pobr_smoothing(light_field, maps, PobrSmoothingParameters(), no_progress).disparity


def test_weights_over_border_regions_mend_what_the_occluder_did(disc, labels):
    """The claim of the publication: with them least squares do far better; else the method does nothing."""
    plain = error_beside(disc, smoothed(disc, labels))
    mended = error_beside(disc, smoothed(disc, regions_of(disc, labels)))
    assert plain > 0.5
    assert mended < 0.6 * plain


def test_border_regions_are_where_the_labels_are_wrong(disc, labels):
    """Regions that miss the wrong labels mend nothing; regions everywhere take away what is right."""
    regions = regions_of(disc, labels).mask("occluded")
    wrong = np.abs(labels.disparity - disc.ground_truth) > 0.2
    assert wrong.sum() > 100
    assert regions[wrong].mean() > 0.7
    assert regions.mean() < 0.5


def test_edge_strength_falls_inside_superpixels_and_rises_between_them(disc, labels):
    """Otherwise texture would stop what is filled in from beside, and the outline of the occluder would not."""
    maps = regions_of(disc, labels)
    segments = superpixels(disc.reference_view, 8, 10.0)
    inside, regions = segments.interior(), maps.mask("occluded")
    plain, changed = squared_gradient(disc.reference_view), maps.extra["edge_strength"]
    # the Sobel operator reaches the border's other side at corners
    inner = regions & inside & (squared_steps(disc.reference_view, segments) == 0)
    assert_allclose(changed[inner], 0.1 * plain[inner], rtol=1e-5)
    outline = regions & ~inside & (plain > np.percentile(plain, 95))
    assert changed[outline].mean() > plain[outline].mean()


def test_photo_consistency_is_the_mean_truncated_difference():
    """The loop over the views is the formula of the docstring."""
    views = np.random.default_rng(0).random((4, 3, 5, 6), np.float32)
    out = photo_consistency(views, 2, 0.3)
    difference = np.abs(np.delete(views, 2, axis=0) - views[2]).mean(axis=1)
    assert_allclose(out, (np.minimum(difference, 0.3) / 0.3).mean(axis=0), rtol=1e-5)


def test_smoothing_solves_its_energy(disc, labels):
    """At the least energy no pixel gains by moving: the solver must not stop before."""
    maps = regions_of(disc, labels)
    solution = smoothed(disc, maps).astype(np.float64)
    values = PobrSmoothingParameters()
    edges, weight = maps.extra["edge_strength"].astype(np.float64), maps.confidence.astype(np.float64)
    rng = np.random.default_rng(1)

    def energy(disparity):
        smooth = np.exp(-values.tau_2 * weight) / (edges + values.gradient_floor**2)
        total = (np.maximum(weight, 3e-4) ** 2 * (disparity - maps.disparity) ** 2).sum()
        for a, b in ((np.s_[:, 1:], np.s_[:, :-1]), (np.s_[1:], np.s_[:-1])):
            total += values.alpha * ((smooth[a] + smooth[b]) * (disparity[a] - disparity[b]) ** 2).sum()
        return total

    # noise adds to the floor of the gradient; this view has next to none
    least = energy(solution)
    assert all(energy(solution + 0.01 * rng.normal(size=solution.shape)) > least for _ in range(5))
    assert energy(labels.disparity) > 1.5 * least
