"""Lines whose sides differ most: what the method claims of them, its loop against NumPy, and awkward light fields."""

import cv2
import numpy as np
import numpy.typing as npt
import pytest
from geometries import GEOMETRIES, standing

from sepi.extensions.methods.costs import GuidedCostsParameters, guided_costs
from sepi.extensions.methods.spo import (
    SpoParameters,
    column_weights,
    peak_weight,
    side_distances,
    spo,
    views_of_directions,
)
from sepi.kernels import spo as kernels
from sepi.lightfield import BoolMap, DisparityRange, FloatMap, LightField
from sepi.pipeline import estimate_depth
from sepi.scenes import render
from sepi.stage import StageMaps, no_progress

pytestmark = pytest.mark.slow

WRONG = 0.1
"""Error of a wrong pixel, pixels per view step."""


def filtered(light_field: LightField, maps: StageMaps) -> FloatMap:
    """Disparity after the filter of the variant."""
    return guided_costs(light_field, maps, GuidedCostsParameters(radius=9), no_progress).disparity


def wrong(light_field: LightField, disparity: FloatMap, where: BoolMap) -> float:
    """Share of wrong pixels."""
    return float((np.abs(disparity - light_field.ground_truth) > WRONG)[where].mean())


def near_occluders(light_field: LightField) -> BoolMap:
    """Pixels that some view does not see, and those beside them."""
    return cv2.dilate(light_field.masks["occluded"].astype(np.uint8), np.ones((3, 3))) > 0


@pytest.mark.parametrize(("scene", "size"), [("curved_occluders", 64), ("fine_structures", 96)])
def test_a_line_beside_an_occluder_keeps_its_depth(scene: str, size: int) -> None:
    """The claim of the method: an occluder takes views from a line, but its sides still differ.

    If this fails, depth next to edges is no better than without the method.
    """
    light_field = render(scene, size=size, views=7)
    parameters = SpoParameters(num_disparities=48)
    near = near_occluders(light_field)
    ours = wrong(light_field, filtered(light_field, spo(light_field, None, parameters, no_progress)), near)
    assert ours < 0.08


def moved_views(picture: npt.ArrayLike) -> LightField:
    """5x5 views of a picture, 2 pixels wider on each side, of disparity 1."""
    picture = np.asarray(picture, np.float32)
    height, width = picture.shape[:2]
    places = range(4, -1, -1)
    views = [[picture[t : height - 4 + t, s : width - 4 + s] for s in places] for t in places]
    return LightField(np.array(views)[::-1, ::-1], "moved", disparity_range=DisparityRange(-2, 2, "given"))


def test_the_direction_with_the_texture_decides() -> None:
    """Of upright stripes only the EPIs along rows know the depth.

    If this fails, the direction that sees nothing adds its guesses to the one that knows.
    """
    parameters = SpoParameters(num_disparities=41)
    beside = slice(6, -6), slice(6, -6)
    far_off = []
    for seed in range(4):
        stripes = np.repeat(np.random.default_rng(seed).random((1, 52, 3), np.float32), 52, axis=0)
        light_field = moved_views(cv2.GaussianBlur(stripes, (0, 0), 1.0))
        disparities = parameters.candidates(light_field)
        along, down = (
            peak_weight(
                side_distances(light_field, direction, disparities, parameters, no_progress),
                parameters.peak,
            )[beside]
            for direction in views_of_directions(light_field)
        )
        assert np.median(along) > 3 * np.median(down)
        found = filtered(light_field, spo(light_field, None, parameters, no_progress))
        far_off.append(np.abs(found - 1)[beside] > WRONG)
    # a stripe whose neighbours are alike has the same colours on both sides of the right line
    assert np.mean(far_off) < 0.01


@pytest.mark.parametrize("geometry", GEOMETRIES)
def test_a_plane_parallel_to_the_views_gets_its_disparity(geometry: str) -> None:
    """Its disparity lies in the middle between two of 40 candidates, 0.05 apart.

    If this fails, candidates or the parabola between them are off, or views are taken to stand where they do not.
    """
    light_field = render("fronto_parallel", size=64, views=5, **standing(geometry, (5, 5)))
    maps = estimate_depth(light_field, "spo", {"initial": {"num_disparities": 40}})
    error = np.abs(maps.disparity - light_field.ground_truth)[6:-6, 6:-6]
    assert np.median(error) < 0.01
    assert np.percentile(error, 99) < 0.05


def twin_of_half_distances(lines: FloatMap, weights: FloatMap, bins: int) -> npt.NDArray[np.float64]:
    """Histograms of the halves, pixel by pixel."""
    views, channels, height, width = lines.shape
    places = np.clip(lines * np.float32(bins) - np.float32(0.5), 0, bins - 1)
    # what a colour is farther from the middle of a bin than the bins are wide, it does not count for
    counts = np.clip(1 - np.abs(places[..., None] - np.arange(bins)), 0, 1)
    found = np.zeros((height, width))
    for y, x in np.ndindex(height, width):
        for c in range(channels):
            left, right = np.zeros((2, bins))
            for k, weight in enumerate(weights / weights.sum() / views):
                left += weight * counts[:, c, y, max(x - 1 - k, 0)].sum(axis=0)
                right += weight * counts[:, c, y, min(x + 1 + k, width - 1)].sum(axis=0)
            filled = left + right > 0
            found[y, x] += ((left - right) ** 2)[filled] @ (1 / (left + right)[filled]) / 2 / channels
    return found


@pytest.mark.parametrize(("scale", "bins", "width"), [(0.8, 64, 11), (0.4, 5, 7), (2.0, 2, 3)])
def test_distances_equal_a_plain_twin(scale: float, bins: int, width: int) -> None:
    """If this fails, the distances are not those of the equations, such as at the border or where colours overshoot."""
    rng = np.random.default_rng(4)
    lines = (0.5 + 0.3 * rng.standard_normal((5, 3, 4, width))).astype(np.float32)
    lines[1:3] = lines[:1]
    weights = column_weights(scale)
    found = np.full((4, width), np.nan, np.float32)
    kernels.half_distances(lines, weights / np.float32(5), bins, found)
    assert np.allclose(found, twin_of_half_distances(lines, weights, bins), atol=1e-6)
