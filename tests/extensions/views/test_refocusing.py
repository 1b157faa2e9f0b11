"""Refocused pictures: exact cases, plain NumPy twins, noise, occluders, and what is refused."""

import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from geometries import GEOMETRIES, standing

from sepi.errors import SepiError
from sepi.extensions.views import refocusing
from sepi.extensions.views.refocusing import all_in_focus, evenly_spaced, focal_stack, refocus
from sepi.kernels import refocusing as kernels
from sepi.lightfield import FloatMap, LightField
from sepi.scenes import light_field, render
from sepi.scenes.definitions import DEFINITIONS


def random_field(grid: tuple[int, int] = (3, 3), shape: tuple[int, int] = (9, 11), **more: Any) -> LightField:
    views = np.random.default_rng(4).integers(0, 256, (*grid, *shape, 3), np.uint8)
    return LightField(views, "random", **more)


def keys(distance: float) -> float:
    """Weight of a pixel this far from the sample in cubic convolution."""
    x = abs(distance)
    if x <= 1:
        return 1.5 * x**3 - 2.5 * x**2 + 1
    return -0.5 * x**3 + 2.5 * x**2 - 4 * x + 2 if x < 2 else 0.0


def sample_twin(view: np.ndarray, y: float, x: float) -> np.ndarray:
    """Cubic convolution at a position; beyond its border a view goes on as it ends."""
    height, width = view.shape[:2]
    total = np.zeros(view.shape[2])
    for i in range(math.floor(y) - 1, math.floor(y) + 3):
        for j in range(math.floor(x) - 1, math.floor(x) + 3):
            pixel = view[min(max(i, 0), height - 1), min(max(j, 0), width - 1)]
            total += keys(y - i) * keys(x - j) * pixel
    return total


def refocused_twin(light_field: LightField, disparity: float, radius: float) -> np.ndarray:
    """The mean of the views in the aperture that hold a pixel, pixel by pixel."""
    height, width = light_field.shape
    sums, counts = np.zeros((height, width, 3)), np.zeros((height, width, 1))
    for t, s in np.argwhere(light_field.present):
        baseline = light_field.baselines[t, s]
        if np.hypot(*baseline) > radius:
            continue
        view = light_field.views[t, s] / 255
        for y, x in np.ndindex(height, width):
            down, across = (y, x) - disparity * baseline
            if 0 <= down <= height - 1 and 0 <= across <= width - 1:
                sums[y, x] += sample_twin(view, down, across)
                counts[y, x] += 1
    return np.clip(sums / counts, 0, 1)


@pytest.mark.parametrize("geometry", GEOMETRIES)
@pytest.mark.parametrize(("disparity", "radius"), [(0.7, 9.0), (-1.3, 1.1)])
def test_refocus_equals_a_plain_twin(geometry: str, disparity: float, radius: float) -> None:
    """Else the picture shows other things than the views do: shifted, or of missing views, or dark at its border."""
    present = np.ones((3, 3), bool)
    present[0, 1] = False
    light_field = random_field(present=present, **standing(geometry, (3, 3)))
    found = refocus(light_field, disparity, aperture=radius)
    np.testing.assert_allclose(found, refocused_twin(light_field, disparity, radius), atol=2e-6)
    assert (found.dtype, found.shape) == (np.float32, (9, 11, 3))


def add_view_twin(
    view: np.ndarray, baseline: np.ndarray, disparity: np.ndarray, nearest: np.ndarray, margin: float,
    centre: np.ndarray, scale2: float,
) -> tuple[np.ndarray, np.ndarray]:  # fmt: skip
    """What the kernel adds to sums and weights."""
    height, width = disparity.shape
    sums, weights = np.zeros(view.shape), np.zeros(disparity.shape)
    for y, x in np.ndindex(height, width):
        down, across = (y, x) - disparity[y, x].astype(float) * baseline
        if not (0 <= down <= height - 1 and 0 <= across <= width - 1):
            continue
        beside = np.s_[math.floor(down) : math.ceil(down) + 1, math.floor(across) : math.ceil(across) + 1]
        if nearest[beside].max() > disparity[y, x] + margin:
            continue
        difference = sample_twin(view, down, across) - centre[y, x]
        weights[y, x] = (scale2 / (scale2 + (difference**2).sum())) ** 2
        sums[y, x] = weights[y, x] * difference
    return sums, weights


@pytest.mark.parametrize("channels", [1, 3])
def test_kernel_equals_a_plain_twin(channels: int) -> None:
    """Each pixel in focus everywhere is made of these samples, those near borders and occluders too."""
    random = np.random.default_rng(1)
    view, centre = random.random((2, 9, 11, channels), np.float32)
    disparity, nearest = random.uniform(-1.5, 1.5, (2, 9, 11)).astype(np.float32)
    disparity[3, 4] = np.nan
    seen = 0
    for baseline in np.array([[0, 0], [1, -2], [-0.43, 0.7], [3, 3]]):
        sums, weights = np.ones_like(view), np.ones_like(disparity)
        kernels.add_view(view, *baseline, disparity, nearest, 0.15, centre, 0.05, sums, weights)
        expected = add_view_twin(view, baseline, disparity, nearest, 0.15, centre, 0.05)
        np.testing.assert_allclose(sums - 1, expected[0], atol=1e-5)
        np.testing.assert_allclose(weights - 1, expected[1], atol=1e-5)
        seen += np.count_nonzero(expected[1])
    assert 0 < seen < 4 * disparity.size


def box_twin(disparity: float, focus: float, cell: np.ndarray) -> tuple[float, float]:
    height, width = np.clip(abs(disparity - focus) * cell.astype(float), 1, kernels.WIDEST)
    return height, width


def covered_twin(distance: int, length: float) -> float:
    """Share that a pixel holds of a line of this length round another pixel's middle."""
    low, high = max(-length / 2, distance - 0.5), min(length / 2, distance + 0.5)
    return max(0.0, high - low) / length


def filled_twin(sheared: np.ndarray, surfaces: np.ndarray, focus: float, cell: np.ndarray, margin: float) -> np.ndarray:
    """Every pixel from every other one."""
    filled = np.zeros(sheared.shape)
    for y, x in np.ndindex(*surfaces.shape):
        own = surfaces[y, x]
        near, rest = np.zeros(4), np.zeros(4)
        for i, j in np.ndindex(*surfaces.shape):
            other = surfaces[i, j]
            height, width = box_twin(own if other < own - margin else other, focus, cell)
            share = covered_twin(i - y, height) * covered_twin(j - x, width)
            total = near if other > own + margin else rest
            total += share * np.append(sheared[:, i, j], 1)
        hidden = min(1.0, near[3])
        filled[:, y, x] = (1 - hidden) * rest[:3] / rest[3]
        if near[3]:
            filled[:, y, x] += hidden * near[:3] / near[3]
    return filled


@pytest.mark.parametrize("cell", [(1.0, 1.0), (0.43, 1.3), (0.0, 2.0)])
def test_filling_equals_a_plain_twin(cell: tuple[float, float]) -> None:
    """Out of focus, every pixel of a picture with a map is made so, beside outlines and borders too."""
    random = np.random.default_rng(5)
    sheared = random.random((3, 10, 12), np.float32)
    surfaces = random.choice(np.array([-2.5, -0.3, -0.25, 0.7, 3.1], np.float32), (10, 12))
    for focus in (-0.3, 3.1, 30.0):
        out = np.full_like(sheared, np.nan)
        kernels.fill_between(sheared, surfaces, focus, np.array(cell, np.float32), 0.15, out)
        expected = filled_twin(sheared, surfaces, focus, np.array(cell), 0.15)
        np.testing.assert_allclose(out, expected, atol=2e-6)


@pytest.mark.parametrize("geometry", GEOMETRIES)
def test_gaps_are_as_wide_as_the_views_stand_apart(geometry: str) -> None:
    """Rows that are closer together leave smaller gaps: of a flat picture, the blur would be too large."""
    field = random_field((4, 3), **standing(geometry, (4, 3)))
    expected = (0.43, 1.0) if geometry == "closer rows" else (1.0, 1.0)
    np.testing.assert_allclose(refocusing._cell(field), expected, atol=0.25 if geometry == "off the grid" else 1e-6)
    present = np.zeros((4, 3), bool)
    present[2, :2] = True
    row = random_field((4, 3), present=present, view=(2, 1))
    np.testing.assert_allclose(refocusing._cell(row), (0, 1))


def test_holes_show_the_farthest_beside_them() -> None:
    """What comes into sight behind an object belongs to the background."""
    from sepi.matching.nearest_surfaces import EMPTY

    nearest = np.full((9, 60), -0.5, np.float32)
    nearest[:, 30:] = 2
    nearest[:, 25:30] = EMPTY
    expected = np.where(nearest == EMPTY, np.float32(-0.5), nearest)
    np.testing.assert_array_equal(refocusing._without_holes(nearest, 9), expected)
    nearest[:, :59] = EMPTY
    found = refocusing._without_holes(nearest, 9)
    assert (found[:, 43:] == 2).all()
    assert (found[:, :43] == 9).all()


@pytest.fixture(scope="module")
def dots() -> tuple[LightField, LightField]:
    """The built-in scene under noise, and as it would be without."""
    usual = DEFINITIONS["dots"]
    noisy = render("dots", size=96, views=5)
    with pytest.MonkeyPatch.context() as patch:
        patch.setitem(DEFINITIONS, "dots", usual._replace(pixel_noise=(0.0, 0.0)))
        return noisy, light_field.render("dots", size=96, views=5)


def psnr(picture: FloatMap, expected: FloatMap) -> float:
    return float(-10 * np.log10(np.mean(np.square(picture - expected))))


def test_noise_goes_when_all_views_give_their_light(dots: tuple[LightField, LightField]) -> None:
    """25 views: 14 dB if all saw every pixel; the promise of the picture in focus everywhere."""
    noisy, clean = dots
    expected = clean.reference_view
    found = all_in_focus(noisy, noisy.ground_truth)
    assert psnr(found, expected) > psnr(noisy.reference_view, expected) + 8
    hidden = noisy.masks["occluded"]
    assert psnr(found[hidden], expected[hidden]) > psnr(noisy.reference_view[hidden], expected[hidden]) + 6


def test_occluders_do_not_bleed(dots: tuple[LightField, LightField], monkeypatch: pytest.MonkeyPatch) -> None:
    """Beside an outline, some views show the occluder: the background must not take its colour."""
    _, clean = dots
    beside = clean.masks["occluded"]

    def off(**more: Any) -> float:
        return float(np.abs(all_in_focus(clean, clean.ground_truth, **more) - clean.reference_view)[beside].mean())

    assert off() < 0.005
    # the map alone, whatever the colours say, and neither of them
    monkeypatch.setattr(refocusing, "COLOUR_SCALE", 100.0)
    alone, plain = off(), off(occlusion_margin=100.0)
    assert alone < 0.25 * plain


@pytest.mark.parametrize("geometry", GEOMETRIES)
def test_views_are_taken_from_where_they_stand(geometry: str) -> None:
    """Rows closer together, views off the grid, a view missing: without their baselines the picture is blurred."""
    field = render("pyramids", size=64, views=3, **standing(geometry, (3, 3)))
    present = np.ones((3, 3), bool)
    present[2, 0] = False
    views = field.views.copy()
    views[2, 0] = 0
    light_field = replace(field, views=views, present=present)
    found = all_in_focus(light_field, field.ground_truth)
    assert np.abs(found - field.reference_view).mean() < 0.003


def test_grey_is_one_channel_of_the_same() -> None:
    """Grey views give the picture that three equal channels give."""
    grey = random_field().views[..., :1]
    fields = LightField(grey, "grey"), LightField(np.repeat(grey, 3, axis=4), "colour")
    disparity = np.full((9, 11), 0.4, np.float32)
    for make in (lambda field: all_in_focus(field, disparity), lambda field: refocus(field, 0.4)):
        found, colour = map(make, fields)
        assert found.shape == (9, 11, 1)
        np.testing.assert_allclose(np.repeat(found, 3, axis=2), colour, atol=1e-6)


def test_pixels_of_unknown_disparity_stay_as_they_are() -> None:
    """Maps of other programs have holes; they neither spoil their neighbours nor become black."""
    light_field = render("pyramids", size=64, views=3)
    disparity = light_field.ground_truth.copy()
    hole = np.s_[20:30, 25:40]
    disparity[hole] = np.nan
    disparity[5, 6] = np.inf
    found, whole = all_in_focus(light_field, disparity), all_in_focus(light_field, light_field.ground_truth)
    np.testing.assert_array_equal(found[hole], light_field.reference_view[hole])
    np.testing.assert_array_equal(found[45:], whole[45:])
    nothing = np.full(light_field.shape, np.nan, np.float32)
    np.testing.assert_array_equal(all_in_focus(light_field, nothing), light_field.reference_view)
    np.testing.assert_array_equal(refocus(light_field, 0.3, nothing), refocus(light_field, 0.3))
    assert np.isfinite(refocus(light_field, 0.3, disparity)).all()


def test_a_stack_goes_from_near_to_far() -> None:
    """A few wrong pixels and those without a value do not stretch it."""
    disparity = np.linspace(-1, 2, 10000, dtype=np.float32).reshape(100, 100)
    disparity[0, :10] = -50
    disparity[1, 1] = np.nan
    found = focal_stack(disparity, 4)
    assert found == pytest.approx([1.985, 0.995, 0.005, -0.985], abs=0.02)
    assert focal_stack(disparity, 1) == pytest.approx([0.5], abs=0.02)
    assert focal_stack(np.full((4, 4), 0.5, np.float32), 9) == [0.5]
    assert evenly_spaced(-1, 1, 3) == [1, 0, -1]


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda field: refocus(field, math.nan), "random: disparity to focus at must be a finite number, got nan"),
        (lambda field: refocus(field, 0.0, aperture=0), "aperture must be a radius above 0 in view steps, got 0"),
        (
            lambda field: refocus(field, 0.0, aperture=0.6),
            "an aperture of 0.6 view steps .*; the nearest other is 1",
        ),
        (lambda field: all_in_focus(field, np.zeros((9, 10), np.float32)), r"\(9, 11\), got float32 \(9, 10\)"),
        (lambda _: focal_stack(np.full((3, 3), np.nan, np.float32), 3), "no pixel"),
    ],
)
def test_what_cannot_be_done_is_one_line(call: Any, message: str) -> None:
    with pytest.raises(SepiError, match=message) as caught:
        call(random_field())
    assert "\n" not in str(caught.value)
