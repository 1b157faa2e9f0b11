"""Single pixels under the glass: the curves are the sweep's, SEPIs show straight lines where the depth is right."""

from dataclasses import replace

import numpy as np
import pytest
from geometries import GEOMETRIES, standing

from bench.noisy import with_noise
from sepi.errors import SepiError
from sepi.extensions.page.curves import cost_curves
from sepi.extensions.page.pixels import APART, BORDER, InterestingPixel, interesting_pixels
from sepi.extensions.page.probe import GREY, HALF_WIDTH, Probe, SepiPicture, to_json
from sepi.lightfield import DisparityRange, LightField
from sepi.matching.plane_sweep import SweepParameters, sweep
from sepi.matching.softening import softened
from sepi.matching.view_subsets import halves_and_quarters
from sepi.pipeline import estimate_depth
from sepi.scenes import render
from sepi.stage import StageMaps


def random_light_field(grid=(5, 4), shape=(14, 17), channels=3, dtype=np.uint8, **known):
    generator = np.random.default_rng(0)
    views = generator.random((*grid, *shape, channels), np.float32)
    if dtype != np.float32:
        views = np.round(views * np.iinfo(dtype).max).astype(dtype)
    # whole disparities among the candidates: their samples on the last row and column are special cases
    return LightField(views, "random", disparity_range=DisparityRange(-1, 1.25, "given"), **known)


def missing_views(grid=(5, 4)):
    present = np.ones(grid, bool)
    # all of the upper left quarter but the dividing lines, and a single view
    present[:2, :2] = present[4, 3] = False
    return present


@pytest.fixture(scope="session")
def occluder():
    """A small scene with occlusions, and its final maps."""
    light_field = render("curved_occluders", size=96)
    return light_field, estimate_depth(light_field, "paper")


@pytest.mark.parametrize(
    ("settings", "radius"),
    [
        ({}, 2),
        ({"dtype": np.float32, "channels": 1}, 2),
        ({"view": (3, 1), "present": missing_views()}, 2),
        ({"grid": (1, 5)}, 2),
        (standing("closer rows", (5, 4)), 2),
        ({"present": missing_views(), **standing("off the grid", (5, 4))}, 1),
        ({"shape": (2, 3)}, 3),
    ],
)
def test_curves_are_what_the_sweep_minimises(settings, radius):
    """A curve drawn from other samples, weights or counts would explain a depth that was found another way."""
    light_field = random_light_field(**settings)
    parameters = SweepParameters(num_disparities=10, scale=0.3, window_radius=radius, window_sigma=0.5)
    views = halves_and_quarters(light_field)
    result = sweep(light_field, parameters, subsets=views)
    H, W = light_field.shape
    corners_and_inside = [(0, 0), (H - 1, W - 1), (0, W - 1), (H - 1, 0), (H // 2, W // 2), (H // 2, 1), (1, W // 2)]
    for y, x in corners_and_inside:
        curves = cost_curves(light_field, y, x, parameters)
        assert curves.names == views.names
        np.testing.assert_allclose(curves.costs.min(axis=1), result.cost[:, y, x], atol=2e-5)
        np.testing.assert_allclose(curves.costs.mean(axis=1), result.mean[:, y, x], atol=2e-5)
        lowest = np.sort(curves.costs, axis=1)[:, :2]
        for n in np.flatnonzero((np.diff(lowest) > 1e-3)[:, 0]):
            disparity, cost = curves.minimum(curves.names[n])
            assert disparity == pytest.approx(result.disparity[n, y, x], abs=5e-3)
            assert cost == pytest.approx(result.cost[n, y, x], abs=2e-5)


def plane(disparity, grid=(5, 5), size=60, **known):
    """A textured plane of one disparity, each view exact at every pixel: a sum of waves."""
    generator = np.random.default_rng(1)
    waves = generator.normal(scale=0.5, size=(12, 2))
    phases = generator.uniform(0, 2 * np.pi, 12)
    views = np.zeros((*grid, size, size, 1), np.float32)
    light_field = LightField(views, "plane", disparity_range=DisparityRange(-2, 2, "given"), **known)
    y, x = np.ogrid[:size, :size]
    baselines = light_field.baselines[:, :, None, None]
    v, u = y + disparity * baselines[..., 0], x + disparity * baselines[..., 1]
    values = sum(np.cos(a * v + b * u + p) for (a, b), p in zip(waves, phases, strict=True))
    views[..., 0] = 0.5 + values / 24
    return light_field


def raggedness(picture):
    """Mean deviation down the middle columns, which all views see, grey levels."""
    return picture.pixels[:, HALF_WIDTH - 8 : HALF_WIDTH + 9, 0].astype(float).std(axis=0).mean()


@pytest.mark.parametrize("view", [None, (1, 3)])
@pytest.mark.parametrize("geometry", GEOMETRIES)
def test_the_right_candidate_gives_upright_stripes(view, geometry):
    """The point of the picture: the reader sees at a glance which candidate is right."""
    light_field = plane(1.25, view=view, **standing(geometry, (5, 5)))
    right, near, wrong = (SepiPicture(light_field, 30, 30, d) for d in (1.25, 1.0, -0.75))
    assert raggedness(right) < 1.5
    assert raggedness(near) > 4 * raggedness(right)
    assert raggedness(wrong) > raggedness(near)
    assert right.pixels.shape == (25, 2 * HALF_WIDTH + 1, 3)


def test_grey_where_nothing_is_seen():
    """Black or repeated pixels beyond the edge would look like a part of the scene."""
    present = np.ones((5, 5), bool)
    present[4, 0] = False
    light_field = plane(0.0, present=present)
    picture = SepiPicture(light_field, 1, 2, 1.0)
    near = slice(HALF_WIDTH - 6, HALF_WIDTH + 7)
    rows = picture.pixels.reshape(5, 5, -1, 3)[:, :, near]
    inside = picture.inside.reshape(5, 5, -1)[:, :, near]
    # row 1 of view row 4 would be at -1
    assert not inside[4].any()
    assert not inside[2, 2, :4].any()
    assert inside[2, 2, 4:].all()
    assert np.all(rows[~inside] == GREY)
    assert not SepiPicture(light_field, 30, 30, 0.0).inside[20].any()
    with pytest.raises(SepiError, match="finite"):
        SepiPicture(light_field, 1, 2, float("nan"))


def made_maps(light_field, **extra):
    shape = light_field.shape
    return StageMaps(np.full(shape, 0.5, np.float32), np.full(shape, 0.75, np.float32), extra)


def test_probe_tells_what_the_maps_say():
    """Values of another pixel or map, or the views of another side, would explain the wrong thing."""
    ground_truth = np.full((60, 60), np.nan, np.float32)
    ground_truth[20, 30] = 0.5
    light_field = plane(0.5, ground_truth=ground_truth)
    side = np.zeros((60, 60), np.uint8)
    side[20, 30] = 2
    flag = side > 0
    maps = made_maps(light_field, view_subset=side, occluded=flag, textureless=~flag)
    bars = dict(zip(("sigma", "low", "high"), (0.1 * np.ones((60, 60)), side / 8, np.ones((60, 60))), strict=True))
    best = StageMaps(np.full((60, 60), 0.625, np.float32), maps.confidence, bars)
    parameters = SweepParameters(num_disparities=41)
    pixel = InterestingPixel(20, 30, "here")
    found = Probe(light_field, pixel, maps, parameters, best)
    assert found.pixel == pixel
    assert (found.chosen, found.best, found.ground_truth, found.confidence) == (0.5, 0.625, 0.5, 0.75)
    assert (found.interval, to_json(found)["interval"]) == ((0.25, 1.0), [0.25, 1.0])
    assert found.curves.minimum()[0] == pytest.approx(0.5, abs=0.02)
    assert found.occluded
    assert not found.textureless
    assert found.kept_subset == "right"
    np.testing.assert_array_equal(found.kept, np.tile([False, False, True, True, True], (5, 1)))
    assert list(found.pictures) == ["minimum", "chosen", "wrong", "ground_truth"]
    # every view sees the plane's point, so the patch has the pixel's colour
    colour = 255 * float(light_field.reference_view[20, 30, 0])
    np.testing.assert_allclose(found.pictures["chosen"].pixels[:, HALF_WIDTH], colour, atol=2)
    other = Probe(light_field, InterestingPixel(21, 30, ""), maps, parameters, None)
    assert (other.ground_truth, other.best, other.kept_subset, other.occluded) == (None, None, "full", False)
    assert other.kept.all()
    assert "ground_truth" not in other.pictures


def test_interesting_pixels_show_each_kind(occluder):
    """Pixels on top of each other, or none of a kind that the scene has, would leave the reader without an example."""
    light_field, maps = occluder
    pixels = interesting_pixels(light_field, maps)
    assert pixels == interesting_pixels(light_field, maps)
    labels = [pixel.label for pixel in pixels]
    assert labels[0] == "textured and sure"
    assert "largest error" in labels
    assert any(label.startswith("occluded") for label in labels)
    check_places(pixels, light_field.shape)
    side_names = ("full", "left", "right", "up", "down")
    for y, x, label in pixels:
        if label.startswith("occluded"):
            assert side_names[maps.extra["view_subset"][y, x]] in label
    without = [pixel.label for pixel in interesting_pixels(replace(light_field, ground_truth=None), maps)]
    assert "largest error" not in without


def check_places(pixels, shape):
    places = np.array([(pixel.y, pixel.x) for pixel in pixels])
    distance = np.hypot(*(places[:, None] - places[None]).T)
    assert np.all(distance[~np.eye(len(places), dtype=bool)] >= APART)
    assert np.all(places >= BORDER)
    assert np.all(places < np.array(shape) - BORDER)


def test_the_largest_error_is_found():
    """Truth is of use for this only: the pixel must lie in the wrong patch, whatever else is unknown."""
    ground_truth = np.full((60, 60), 0.5, np.float32)
    ground_truth[30:40, 42:50] = -1
    ground_truth[10:20] = np.nan
    light_field = plane(0.5, ground_truth=ground_truth)
    pixels = interesting_pixels(light_field, made_maps(light_field))
    (wrong,) = [pixel for pixel in pixels if pixel.label == "largest error"]
    assert 30 <= wrong.y < 40
    assert 42 <= wrong.x < 50


def test_an_occluded_pixel_is_one_beside_its_occluder():
    """A pixel marked by mistake, with the nearer surface on the side of the views that are kept, explains nothing."""
    light_field = plane(0.5)
    disparity = np.full((60, 60), -0.5, np.float32)
    disparity[:, 28:34] = 0.5
    side = np.zeros((60, 60), np.uint8)
    # the left half is kept on both sides of the bar; only those left of it are hidden from the right
    side[:, 22:28] = side[:, 34:40] = 1
    maps = StageMaps(disparity, np.ones((60, 60), np.float32), {"view_subset": side, "occluded": side > 0})
    (found,) = [pixel for pixel in interesting_pixels(light_field, maps) if "occluded" in pixel.label]
    assert found.label == "occluded, left half kept"
    assert 22 <= found.x < 28


def test_curves_are_corrected_for_noise_like_the_sweep():
    """A curve off by what noise costs would have its minimum elsewhere."""
    light_field, parameters = with_noise(render("pyramids", size=64, views=5), 8), SweepParameters(num_disparities=61)
    assert parameters.noise_to_correct(light_field) is not None
    cost = sweep(light_field, parameters).cost[0, 20, 31]
    assert cost_curves(light_field, 20, 31, parameters).costs[0].min() == pytest.approx(cost, abs=2e-5)


def test_curves_are_corrected_for_noise_as_softened_views_have_it():
    """The blur takes the noise of sharp texture, which leaves hardly anything to correct."""
    picture = np.full((128, 128, 3), 120, np.uint8)
    picture[16:56, 16:56] += 60 * np.random.default_rng(2).integers(0, 2, (40, 40, 3), np.uint8)
    known = DisparityRange(-1, 1, "given")
    light_field = with_noise(LightField(np.tile(picture, (5, 5, 1, 1, 1)), "sharp", disparity_range=known), 3)
    parameters = SweepParameters(num_disparities=41)
    assert softened(light_field, parameters.softening) is not light_field
    assert parameters.noise_to_correct(light_field) is not None
    # in the middle of the texture, and beside it
    for y, x in ((36, 36), (84, 84)):
        cost = sweep(light_field, parameters).cost[0, y, x]
        assert cost_curves(light_field, y, x, parameters).costs[0].min() == pytest.approx(cost, abs=2e-5)
