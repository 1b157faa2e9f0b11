"""Near or far beside a depth step: what views, colours and edges say of exact scenes, and equal to plain twins."""

from dataclasses import replace
from typing import Any

import cv2
import numpy as np
import numpy.typing as npt
import pytest
from geometries import GEOMETRIES, standing

from sepi.boundaries.decision import assigned_to_surfaces
from sepi.boundaries.parameters import BoundaryParameters
from sepi.boundaries.rim import Rim, RimViews, Sides, rim_of, surroundings
from sepi.boundaries.surface_shares import _views_alike as views_alike
from sepi.boundaries.surface_shares import view_brightness
from sepi.kernels import background as background_kernels
from sepi.kernels import surface_shares as kernels
from sepi.lightfield import FloatMap, LightField
from sepi.matching.nearest_surfaces import SeenViews
from sepi.matching.row_bands import Rows
from sepi.process.workspace import Workspace
from sepi.scenes import render

USUAL = BoundaryParameters(use_mixture=False)
AROUND = np.ones((3, 3), np.uint8)


def wrong(disparity: npt.NDArray[np.float32], truth: npt.NDArray[np.float32]) -> int:
    """Pixels of the wrong surface."""
    return int((abs(disparity - truth) > 0.3).sum())


@pytest.mark.parametrize("name", ["stripes", "curved_occluders", "dots"])
@pytest.mark.parametrize("change", ["too wide", "too narrow"])
def test_edges_are_found_again(name: str, change: str) -> None:
    """Surfaces a pixel too wide close narrow gaps, those a pixel too narrow lose what is thin."""
    scene = render(name, size=96)
    truth = scene.ground_truth
    changed = (cv2.dilate if change == "too wide" else cv2.erode)(truth, AROUND)
    before = wrong(changed, truth)
    assert before > 500
    assert wrong(assigned_to_surfaces(scene, changed, USUAL), truth) < 0.35 * before


def test_only_what_changed_is_decided_again() -> None:
    """Beside a wall that moved back the edge is found; elsewhere what was decided stays."""
    scene, left = render("curved_occluders", size=96), np.s_[:, :40]
    wide = cv2.dilate(scene.ground_truth, AROUND)
    before = wide + np.where(np.arange(96) < 40, np.float32(1), np.float32(0))
    again = assigned_to_surfaces(scene, wide, USUAL, before)
    assert wrong(again[left], scene.ground_truth[left]) < 0.35 * wrong(wide[left], scene.ground_truth[left])
    np.testing.assert_array_equal(again[:, 42:], wide[:, 42:])


def test_each_pixel_can_be_decided_alone() -> None:
    """The ablation without edges: other pixels than with them, and much better than a map a pixel too narrow."""
    scene = render("dots", size=96)
    truth = scene.ground_truth
    narrow = cv2.erode(truth, AROUND)
    alone = assigned_to_surfaces(scene, narrow, BoundaryParameters(use_mixture=False, use_lines=False))
    along_edges = assigned_to_surfaces(scene, narrow, USUAL)
    assert (alone != along_edges).any()
    assert wrong(alone, truth) < 0.35 * wrong(narrow, truth)


@pytest.mark.parametrize("name", ["stripes", "curved_occluders", "dots", "slanted_plane", "pyramids"])
def test_what_is_right_stays(name: str) -> None:
    scene = render(name, size=96)
    assert wrong(assigned_to_surfaces(scene, scene.ground_truth, USUAL), scene.ground_truth) < 0.01 * 96**2


def edge(rim: float, background: float = 0.0) -> tuple[LightField, npt.NDArray[np.float32]]:
    """A bright surface whose last two pixels have the brightness ``rim``, before a wall, and its exact disparity.

    The pattern of the wall has the contrast ``background``; pixels are means over their area.
    """
    H, W, fine, near, far, end = 40, 60, 16, 1.0, -0.5, 31.3
    x = (np.arange(W * fine) + 0.5) / fine - 0.5
    y = np.arange(H)[:, None]
    random = np.random.default_rng(5)
    waves = random.uniform(0.2, 1.2, (12, 2)), random.uniform(0, 6, 12)
    views = np.empty((5, 5, H, W, 1), np.float32)
    for t, s in np.ndindex(5, 5):
        # what a sample shows of each surface, as if it were alone
        at_y, at_x = y + far * (t - 2), x[None] + far * (s - 2)
        wall = 0.45 + background * np.mean(
            [np.sin(v * at_y + u * at_x + p) for (v, u), p in zip(*waves, strict=True)], axis=0
        )
        on_surface = x + near * (s - 2)
        surface = np.where(on_surface > end - 2, rim, 0.75)
        picture = np.where(on_surface[None] < end, surface[None], wall)
        views[t, s, :, :, 0] = picture.reshape(H, W, fine).mean(axis=2)
    truth = np.where(np.arange(W)[None] < end, np.float32(near), np.float32(far)) + np.zeros((H, 1), np.float32)
    return LightField(views, "edge"), truth.astype(np.float32)


@pytest.mark.parametrize("background", [0.0, 0.3])
def test_a_surface_darker_towards_its_edge_keeps_it(background: float) -> None:
    """Silhouettes of round things are darker: as shares of the bright surface they would be lost."""
    field, truth = edge(rim=0.55, background=background)
    inner = np.s_[4:-4]
    assert wrong(assigned_to_surfaces(field, truth, USUAL)[inner], truth[inner]) == 0


@pytest.mark.parametrize("background", [0.0, 0.1, 0.3])
def test_a_surface_one_pixel_too_wide_gets_its_edge_back(background: float) -> None:
    """Also before a bare wall, whose colour the surface does not show."""
    field, truth = edge(rim=0.75, background=background)
    wide = cv2.dilate(truth, AROUND)
    inner = np.s_[6:-6]
    assert wrong(wide[inner], truth[inner]) == 28
    assert wrong(assigned_to_surfaces(field, wide, USUAL)[inner], truth[inner]) == 0


@pytest.mark.parametrize("factor", [0.15, 1.15])
def test_dark_views_and_other_exposures_do_no_harm(factor: float) -> None:
    """Lenses darken the views at the edge of the grid: edges would move by pixels."""
    scene = render("curved_occluders", size=96)
    wide = cv2.dilate(scene.ground_truth, AROUND)
    views = scene.views * np.float32(0.8)
    views[[0, -1]] = views[[0, -1]] * np.float32(factor)
    views[:, [0, -1]] = views[:, [0, -1]] * np.float32(factor)
    if scene.views.dtype != np.float32:
        views = np.rint(views).astype(scene.views.dtype)
    changed = LightField(views, "changed")
    before = wrong(wide, scene.ground_truth)
    assert wrong(assigned_to_surfaces(changed, wide, USUAL), scene.ground_truth) < 0.4 * before


@pytest.mark.parametrize("geometry", GEOMETRIES)
def test_grey_and_bands_change_nothing(geometry: str) -> None:
    """The same bytes, however much memory there is, and for grey as three colours."""
    scene = render("dots", size=96)
    wide = cv2.dilate(scene.ground_truth, AROUND)
    grey = np.rint(scene.views[2:7, 2:7].mean(axis=4, keepdims=True)).astype(np.uint8)
    field = LightField(grey, "grey", **standing(geometry, (5, 5)))
    threefold = LightField(np.repeat(grey, 3, axis=4), "grey", **standing(geometry, (5, 5)))
    expected = assigned_to_surfaces(field, wide, USUAL)
    assert (expected != wide).any()
    np.testing.assert_array_equal(assigned_to_surfaces(threefold, wide, USUAL), expected)
    in_bands = replace(field, workspace=Workspace(1))
    np.testing.assert_array_equal(assigned_to_surfaces(in_bands, wide, USUAL), expected)


def cubic(picture: npt.NDArray[Any], y: float, x: float) -> npt.NDArray[np.float64]:
    """Colour (C,) of a picture (H, W, C) between its pixels, by Catmull and Rom's spline; its border goes on."""
    row, column = int(y), int(x)

    def weights(f: float) -> npt.NDArray[np.float64]:
        basis = np.array([[0, -1, 2, -1], [2, 0, -5, 3], [0, 1, 4, -3], [0, 0, -1, 1]]) / 2
        return basis @ np.array([1, f, f * f, f**3])

    rows = np.clip(np.arange(row - 1, row + 3), 0, picture.shape[0] - 1)
    columns = np.clip(np.arange(column - 1, column + 3), 0, picture.shape[1] - 1)
    patch = picture[np.ix_(rows, columns)].astype(np.float64)
    return np.einsum("i,j,ijc->c", weights(y - row), weights(x - column), patch)


class Twin:
    """The kernels, pixel by pixel and with whole arrays of views."""

    def __init__(self, views: RimViews, rim: Rim, sides: Sides) -> None:
        self.views, self.rim, self.sides = views, rim, sides
        self.pixels = views.lines.reshape(*views.lines.shape[:3], -1, views.channels)
        self.H, self.W = self.pixels.shape[2:4]
        # pixels that fit best as a whole pixel of the far surface, and those beside which a colour goes on changing
        self.decided_alone = self.went_on = 0

    def seen(self, d: float, y: int, x: int) -> list[tuple[int, npt.NDArray[np.float64]]]:
        """Views that show a pixel, and the colours they show."""
        found = []
        for n, ((t, s), (v, u)) in enumerate(zip(self.views.seen.places, self.views.seen.baselines, strict=True)):
            down, across = y - d * v, x - d * u
            if min(down, across) < 0 or down > self.H - 1 or across > self.W - 1:
                continue
            if self.views.seen.nearest[n, y - round(d * v), x - round(d * u)] <= d + self.views.seen.margin:
                found.append((n, cubic(self.pixels[t, s], down, across) * self.views.units[n]))
        return found

    def background(self, d: float, y: int, x: int) -> tuple[npt.NDArray[np.float64], float, int]:
        colours = np.array([colour for _, colour in self.seen(d, y, x)]).reshape(-1, 3).astype(np.float32)
        if len(colours) < background_kernels.FEWEST_VIEWS:
            return np.zeros(3), 0.0, len(colours)
        middle = np.median(colours, axis=0)
        return middle, float(np.minimum((colours - middle) ** 2, 0.01).mean()), len(colours)

    def own_colour(self, y: int, x: int) -> tuple[npt.NDArray[np.float64], float]:
        """Colour of the nearer surface at a pixel, linear in the place as far as that is told, and its variance."""
        disparity, guide, clean, _ = self.sides
        yy, xx = np.mgrid[: self.H, : self.W]
        pure = (abs(yy - y) <= 4) & (abs(xx - x) <= 4) & clean & (abs(disparity - self.rim.near[y, x]) < 0.25)
        if not pure.any():
            return guide[y, x].astype(np.float64), 1.0
        place, colours = np.stack([yy - y, xx - x])[:, pure].astype(np.float64), guide[pure].astype(np.float64)
        weight = 1 / (1 + (place**2).sum(axis=0)) ** 2
        mean, middle = np.average(colours, axis=0, weights=weight), np.average(place, axis=1, weights=weight)
        extent = np.cov(place, aweights=weight, ddof=0) + 0.1 * np.eye(2)
        covariance = (place - middle[:, None]) * weight @ (colours - mean) / weight.sum()
        slope = np.linalg.solve(extent, covariance)
        plain = np.average((colours - mean) ** 2, axis=0, weights=weight)
        rest = np.maximum(plain - (slope * covariance).sum(axis=0), 0).sum()
        change = -middle @ slope
        effective = max(weight.sum() ** 2 / (weight**2).sum() - 3, 1)
        doubt = (rest + 3 * 0.004**2) / effective * (middle @ np.linalg.solve(extent, middle))
        kept = max(0.0, 1 - doubt / ((change**2).sum() + 1e-12))
        self.went_on += kept > 0.1
        variance = (kept * rest + (1 - kept) * plain.sum() + 0.1 * kept**2 * (change**2).sum()) / 3 + 0.02**2
        return mean + kept * change, variance

    def costs(
        self, background: npt.NDArray[np.float32], scales2: tuple[float, float], y: int, x: int
    ) -> npt.NDArray[np.float64] | None:
        rim, (disparity, guide, _, _) = self.rim, self.sides
        near, far = float(rim.near[y, x]), float(rim.far[y, x])
        colours, behind, noise = [], [], []
        for n, colour in self.seen(near, y, x):
            v, u = self.views.seen.baselines[n]
            down, across = y - (near - far) * v, x - (near - far) * u
            if min(down, across) < 0 or down > self.H - 1 or across > self.W - 1:
                continue
            i, j = min(int(down), self.H - 2), min(int(across), self.W - 2)
            patch = np.s_[i : i + 2, j : j + 2]
            weights = np.outer([1 - (down - i), down - i], [1 - (across - j), across - j])
            if (background[patch][..., 3][weights > 0] == background_kernels.UNSEEN).any():
                continue
            colours.append(colour)
            behind.append(np.einsum("ij,ijc->c", weights, background[patch][..., :3]))
            noise.append((weights * background[patch][..., 3]).sum())
        if len(colours) < kernels.FEWEST_SAMPLES:
            return None
        C, B, N = np.array(colours), np.array(behind), np.array(noise)[:, None]
        yy, xx = np.mgrid[: self.H, : self.W]
        window = (abs(yy - y) <= 4) & (abs(xx - x) <= 4)
        shown = guide[window & (disparity > (near + far) / 2)]
        own, variance = self.own_colour(y, x)
        if rim.is_near[y, x]:
            variance = 0.2**2
        scale2 = scales2[0] + scales2[1] * ((own - B) ** 2).mean()
        costs = np.empty(kernels.SHARES)
        for k, a in enumerate(np.arange(kernels.SHARES) / (kernels.SHARES - 1)):
            held = scale2 / variance
            F = (a * (C - (1 - a) * B).sum(axis=0) + held * own) / (a * a * len(C) + held)
            F = np.clip(F, shown.min(axis=0), shown.max(axis=0))
            residual2 = (C - a * F - (1 - a) * B) ** 2
            cost = (residual2 / (residual2 + scale2 + (1 - a) ** 2 * N)).sum() + held * ((F - own) ** 2).sum() / scale2
            costs[k] = cost / C.size
        # but the reference view, which always fits
        alone = [colour for n, colour in self.seen(far, y, x) if self.views.seen.baselines[n].any()]
        if not rim.is_near[y, x] and len(alone) >= kernels.FEWEST_ALONE:
            residual2 = (np.array(alone) - guide[y, x]) ** 2
            cost = (residual2 / (residual2 + scale2)).mean()
            self.decided_alone += cost < costs.min()
            # with less than a quarter of the nearer surface in it
            costs[:3] = np.minimum(costs[:3], cost)
        return costs


def twin_rim(disparity: npt.NDArray[np.float32], y: int, x: int, radius: int) -> tuple[float, float, float]:
    """Step, and means of the disparities on its near and far side."""
    rows, columns = slice(max(0, y - radius), y + radius + 1), slice(max(0, x - radius), x + radius + 1)
    yy, xx = np.mgrid[: disparity.shape[0], : disparity.shape[1]][:, rows, columns]
    window = disparity[rows, columns].astype(np.float64)
    weight = 1 / (1 + (yy - y) ** 2 + (xx - x) ** 2)
    near = window > (window.min() + window.max()) / 2
    if not near.any():
        return 0.0, 0.0, 0.0
    return (
        np.ptp(window),
        np.average(window[near], weights=weight[near]),
        np.average(window[~near], weights=weight[~near]),
    )


@pytest.mark.parametrize("geometry", GEOMETRIES)
@pytest.mark.parametrize("dtype", [np.uint8, np.float32])
def test_kernels_equal_a_plain_twin(geometry: str, dtype: Any) -> None:
    """Every rim pixel of a small picture, with a view missing."""
    random = np.random.default_rng(2)
    # a wall of disparity -0.4 alone: many pixels fit it best as they are
    wall = cv2.GaussianBlur(random.random((40, 40, 3), np.float32), (0, 0), 0.8)
    views = 0.02 * random.random((4, 5, 12, 14, 3), np.float32)
    for t, s in np.ndindex(4, 5):
        shift = np.float32([[1, 0, 0.4 * (s - 2) - 12], [0, 1, 0.4 * (t - 2) - 12]])
        views[t, s] += cv2.warpAffine(wall, shift, (14, 12), flags=cv2.INTER_CUBIC)
    if dtype == np.uint8:
        views = np.rint(255 * views).astype(np.uint8)
    present = np.ones((4, 5), bool)
    present[0, 1] = False
    field = LightField(views, "random", present=present, **standing(geometry, (4, 5)))
    disparity = np.full((12, 14), -0.4, np.float32)
    disparity[3:9, 4:9] = 0.6
    disparity += random.uniform(-0.05, 0.05, disparity.shape).astype(np.float32)
    rim = rim_of(disparity, 2, 0.3)
    for y, x in np.ndindex(disparity.shape):
        step, near, far = twin_rim(disparity, y, x, 2)
        assert rim.inside[y, x] == (step >= 0.3)
        if rim.inside[y, x]:
            np.testing.assert_allclose([rim.near[y, x], rim.far[y, x]], [near, far], rtol=1e-5)
            assert rim.is_near[y, x] == (disparity[y, x] > (near + far) / 2)
    seen = SeenViews.of(field, cv2.dilate(disparity, AROUND), present, Rows(0, 12), 0.15)
    unit = np.float32(1 / 255 if dtype == np.uint8 else 1)
    units = random.uniform(0.9, 1.1, present.sum()).astype(np.float32) * unit
    rim_views = RimViews(views.reshape(*views.shape[:3], -1), views.shape[4], units, seen)
    clean = disparity - surroundings(disparity).farthest < 0.3
    sides = Sides(disparity, field.reference_view, clean, 4)
    twin = Twin(rim_views, rim, sides)
    layer = np.where(rim.is_near, rim.far, disparity)
    background = np.empty((*layer.shape, 4), np.float32)
    background_kernels.background_of(
        rim_views, layer, *np.ones((2, *layer.shape), bool), np.ones(len(units), bool), 0, 12, background
    )
    for y, x in np.ndindex(disparity.shape):
        colour, variance, count = twin.background(float(layer[y, x]), y, x)
        assert (background[y, x, 3] != background_kernels.UNSEEN) == (count >= background_kernels.FEWEST_VIEWS)
        if count >= background_kernels.FEWEST_VIEWS:
            np.testing.assert_allclose(background[y, x, :3], colour, atol=1e-6)
            np.testing.assert_allclose(background[y, x, 3], variance, atol=1e-7)
    scales2 = (0.02**2, 0.3**2)
    pixels = np.flatnonzero(rim.inside)
    costs, told = np.zeros((len(pixels), kernels.SHARES), np.float32), np.zeros(len(pixels), bool)
    kernels.costs_of_shares(rim_views, rim, background, sides, *scales2, pixels, costs, told)
    expected = [twin.costs(background, scales2, y, x) for y, x in np.argwhere(rim.inside)]
    np.testing.assert_array_equal(told, [cost is not None for cost in expected])
    assert told.sum() > 30
    assert twin.decided_alone > 10
    assert twin.went_on > 10
    np.testing.assert_allclose(costs[told], [cost for cost in expected if cost is not None], atol=2e-5)
    assert (costs[~told] == 0).all()


def test_few_views_tell_a_background_that_the_reference_view_shows() -> None:
    """The same numbers as with these views alone."""
    random = np.random.default_rng(4)
    lines = random.random((1, 9, 6, 30), np.float32)
    few = np.arange(9) % 2 == 0
    layer = np.zeros((6, 10), np.float32)

    def found(among: npt.NDArray[np.bool_], shown: bool) -> FloatMap:
        places = np.stack([np.zeros(among.sum(), np.int64), np.flatnonzero(among)], axis=1)
        nearest = np.zeros((len(places), *layer.shape), np.float32)
        views = RimViews(lines, 3, np.ones(len(places), np.float32), SeenViews(places, places * 0.0, nearest, 0, 0.1))
        background = np.empty((*layer.shape, 4), np.float32)
        wanted, asked = np.ones(layer.shape, bool), np.full(layer.shape, shown)
        background_kernels.background_of(views, layer, wanted, asked, few[among], 0, 6, background)
        return background

    every = np.ones(9, bool)
    np.testing.assert_array_equal(found(every, shown=True), found(few, shown=False))
    assert (found(every, shown=False) != found(every, shown=True)).any()


def test_brightness_is_told_view_by_view() -> None:
    """Beside the reference, over what both show."""
    random = np.random.default_rng(3)
    picture = cv2.GaussianBlur(random.random((40, 48, 3), np.float32), (0, 0), 3)
    factors = np.array([[0.5, 1, 1.2]], np.float32)
    views = np.clip(picture * factors[..., None, None, None], 0, 1)
    field = LightField(views, "bright")
    still = np.zeros((40, 48), np.float32)
    sides = Sides(still, field.reference_view, still == 0, 4)
    brightness, residual = view_brightness(field, sides, np.argwhere(field.present))
    np.testing.assert_allclose(brightness, factors[0], rtol=0.02)
    assert (residual < 0.01).all()


def test_brightness_is_that_of_what_a_view_shows() -> None:
    """What lies beyond a camera's picture is none of its light; the view would be left out as another exposure."""
    picture = cv2.GaussianBlur(np.random.default_rng(4).random((40, 48, 3), np.float32), (0, 0), 3)
    views = np.stack([picture] * 3)[None].copy()
    missing = np.zeros((1, 3, 40, 48), bool)
    missing[0, 2, :, 20:] = True
    views[missing] = 1
    still = np.zeros((40, 48), np.float32)
    sides = Sides(still, picture, still == 0, 4)
    for marked, kept in ((missing, 3), (None, 2)):
        field = LightField(views, "half shown", missing=marked)
        assert len(views_alike(field, sides, USUAL)[1]) == kept
