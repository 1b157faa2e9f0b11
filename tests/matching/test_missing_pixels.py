"""Pixels that a view does not show, as of cameras that look elsewhere, are compared with nothing."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import sepi
from sepi.boundaries.decision import assigned_to_surfaces
from sepi.boundaries.parameters import BoundaryParameters
from sepi.io.hdf5 import read_light_field, write_light_field
from sepi.io.readers.options import ReadOptions
from sepi.lightfield import LightField, as_unit_float
from sepi.matching.base_detail import BaseDetailParameters
from sepi.matching.gauss_newton import GaussNewton
from sepi.matching.plane_sweep import SweepParameters, sweep
from sepi.matching.unknown import unknown_pixels
from sepi.matching.view_subsets import ViewSubsets
from sepi.matching.visibility_sweep import (
    FirstDepthParameters,
    VisibleViewsParameters,
    depth_from_visible_views,
    first_depth,
    occluded_in_any_view,
)
from sepi.scenes import render
from sepi.stage import no_progress

SIZE, VIEWS = 64, 5


def turned(light_field: LightField, most: int, seed: int = 0) -> LightField:
    """Each view but the reference's lacks what a turned camera would: strips at two sides, one of them slanted."""
    rng, missing = np.random.default_rng(seed), np.zeros(light_field.views.shape[:4], bool)
    height, width = light_field.shape
    y, x = np.mgrid[:height, :width]
    for place in np.ndindex(light_field.grid):
        if place != light_field.reference_position:
            high, wide = rng.integers(2, most, 2)
            here = (y < high) | (x + y // 16 < wide)
            missing[place] = here[:: rng.choice((-1, 1)), :: rng.choice((-1, 1))]
    return replace(light_field, views=as_unit_float(light_field.views), missing=missing)


def filled(light_field: LightField, seed: int) -> LightField:
    """Something else at the missing pixels."""
    noise = np.random.default_rng(seed).random(light_field.views.shape).astype(np.float32)
    return replace(light_field, views=np.where(light_field.missing[..., None], noise, light_field.views))


def _swept(light_field, **more):
    result = sweep(light_field, SweepParameters(num_disparities=21), **more)
    return np.stack([result.disparity, result.cost, result.mean])


def _halves(light_field):
    groups = np.add.outer(np.arange(VIEWS) // 3, 2 * (np.arange(VIEWS) // 3))
    halves = np.array([[1, 1, 0, 0], [0, 1, 0, 1]], bool)
    return _swept(light_field, subsets=ViewSubsets(groups, halves, ("left", "right")))


def _first(light_field):
    parameters = FirstDepthParameters(num_disparities=21, first_views=VIEWS**2, use_detail=False)
    result = first_depth(light_field, parameters, no_progress)
    return np.stack([result.disparity, result.confidence])


def _seen(light_field):
    parameters = VisibleViewsParameters(
        num_disparities=21, first_views=VIEWS**2, views=VIEWS**2, passes=2, use_detail=False
    )
    result = depth_from_visible_views(light_field, light_field.ground_truth, parameters, no_progress)
    return np.stack([result.disparity, result.confidence])


def _newton(light_field):
    truth = light_field.ground_truth
    sums = GaussNewton(light_field, BaseDetailParameters(), 0.15)
    mean = sums.mean(truth)
    return np.concatenate([mean.ravel(), *(part.ravel() for part in sums.gradient_and_hessian(mean, truth))])


def _shares(light_field):
    blurred = light_field.ground_truth.copy()
    blurred[1:] = np.maximum(blurred[1:], blurred[:-1])
    return assigned_to_surfaces(light_field, blurred, BoundaryParameters(share_evidence=0.1, use_mixture=False))


def _occluded(light_field):
    return occluded_in_any_view(light_field, light_field.ground_truth, 0.1, light_field.present)


def _unknown(light_field):
    return unknown_pixels(light_field, light_field.ground_truth)


def _refocused(light_field):
    return sepi.refocus(light_field, 0.5)


def _in_focus(light_field):
    return sepi.all_in_focus(light_field, light_field.ground_truth)


OF_VIEWS = tuple(pytest.param(one, marks=pytest.mark.extension("views")) for one in (_refocused, _in_focus))
COMPARING = (_swept, _halves, _first, _seen, _newton, _shares, _occluded, _unknown, *OF_VIEWS)


@pytest.mark.parametrize("found_in", COMPARING)
def test_a_view_that_shows_nothing_is_as_one_that_was_not_taken(found_in) -> None:
    """A camera that looked elsewhere drags depth to what stands in its place."""
    light_field = render("pyramids", size=SIZE, views=VIEWS)
    gone = [place for place in np.ndindex(light_field.grid) if sum(place) % 2]
    missing, present = np.zeros(light_field.views.shape[:4], bool), light_field.present.copy()
    for place in gone:
        missing[place], present[place] = True, False
    plain = replace(light_field, views=as_unit_float(light_field.views))
    # what stands there looks like the scene, but does not move
    still = np.where(missing[..., None], light_field.reference_view, plain.views)
    dark = replace(plain, views=still, missing=missing)
    without = found_in(replace(plain, present=present))
    np.testing.assert_allclose(found_in(dark), without, atol=2e-4, equal_nan=True)
    unmarked = found_in(replace(dark, missing=None))
    if found_in not in (_occluded, _unknown):
        assert np.nanmax(np.abs(np.asarray(unmarked, float) - without)) > 1e-3, "the views matter"


@pytest.mark.parametrize("found_in", [_swept, _halves, _first, _seen, OF_VIEWS[0]])
def test_nothing_is_compared_with_what_stands_at_missing_pixels(found_in) -> None:
    """Strips at the border get the depth of a made-up picture."""
    light_field = turned(render("pyramids", size=SIZE, views=VIEWS), 20)
    one, other = (found_in(filled(light_field, seed)) for seed in (1, 2))
    np.testing.assert_array_equal(one, other)


@pytest.mark.extension("cameras")
@pytest.mark.parametrize("variant", ["best", "fast", "paper"])
def test_depth_near_the_border_of_turned_views_is_nearly_as_good(variant: str) -> None:
    from sepi.extensions.cameras.frame import completed

    whole = render("pyramids", size=SIZE, views=VIEWS)
    light_field = turned(whole, 16)
    views = light_field.views.copy()
    for place in np.ndindex(light_field.grid):
        views[place] = completed(views[place], light_field.missing[place])
    marked = replace(light_field, views=views)

    def error(field: LightField) -> float:
        return float(np.abs(sepi.estimate_depth(field, variant).disparity - whole.ground_truth).mean())

    unmarked = error(replace(marked, missing=None))
    assert error(marked) < min(1.05 * error(whole), unmarked)


def test_pixels_that_only_the_reference_shows_or_not_even_it_are_unknown() -> None:
    """A guess passes for depth that was measured."""
    light_field = render("fronto_parallel", size=SIZE, views=3)
    missing = np.zeros(light_field.views.shape[:4], bool)
    missing[:, :, :12] = True
    missing[1, 1] = False
    missing[1, 1, 40:44, 40:44] = True
    unknown = sepi.estimate_depth(replace(light_field, missing=missing)).mask("unknown")
    assert unknown[:10].all()
    assert unknown[40:44, 40:44].all()
    assert unknown[16:].sum() == 16


@pytest.mark.parametrize("kind", ["h5", pytest.param("folder", marks=pytest.mark.extension("formats"))])
def test_files_and_turned_grids_keep_the_marks(tmp_path: Path, kind: str) -> None:
    """Exported and read again, made-up pixels are compared."""
    light_field = turned(render("dots", size=SIZE, views=3), 10)
    path = tmp_path / ("scene.h5" if kind == "h5" else "scene")
    if kind == "h5":
        write_light_field(path, light_field)
        np.testing.assert_array_equal(read_light_field(path).missing, light_field.missing)
    else:
        from sepi.extensions.formats.exported import write_exported

        write_exported(path, light_field)
    np.testing.assert_array_equal(sepi.read_light_field(path).missing, light_field.missing)
    flipped = sepi.read_light_field(path, options=ReadOptions(order="flip-columns"), check_order=False)
    np.testing.assert_array_equal(flipped.missing, light_field.missing[:, ::-1])
