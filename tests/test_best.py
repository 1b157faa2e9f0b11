"""What variant ``best`` adds to the paper's stages: detail, visibility, uniform regions, confidence."""

from dataclasses import replace

import numpy as np
import pytest

from sepi.lightfield import LightField
from sepi.pipeline import estimate_depth
from sepi.regularization.border_planes import BorderPlane, BorderPlaneParameters
from sepi.regularization.uniform_regions import UniformPlanesParameters, plain_pixels, squared_gradients
from sepi.scenes import render
from sepi.scoring.error_bars import oracle, sparsification
from sepi.scoring.scores import score

pytestmark = pytest.mark.slow


@pytest.mark.parametrize(
    ("name", "size", "mean_error"),
    [("fronto_parallel", 96, 1e-3), ("slanted_plane", 96, 4e-3), ("pyramids", 128, 1e-2)],
)
def test_mean_error_on_exact_truth(name: str, size: int, mean_error: float) -> None:
    scene = render(name, size=size)
    found = estimate_depth(replace(scene, ground_truth=None), "best").disparity
    assert np.abs(found - scene.ground_truth)[4:-4, 4:-4].mean() <= mean_error


def glossy(scene: LightField) -> LightField:
    """The scene with a brightness that changes smoothly with the view, as a gloss does, by up to 3 %."""
    views = scene.views.astype(np.float32) / 255
    T, S, H, W, _ = views.shape
    t, s, y, x = np.ogrid[:T, :S, :H, :W]
    gloss = 0.004 * ((t - T // 2) * np.sin(y / 17) + (s - S // 2) * np.cos(x / 23))
    return replace(scene, views=np.clip(views * (1 + gloss[..., None]), 0, 1).astype(np.float32))


def test_gloss_does_not_move_faint_texture() -> None:
    """On a surface of faint texture, brightness that changes with the view pulls colours alone aside."""
    scene = render("slanted_plane", size=128)
    faint = replace(scene, views=np.round(110 + (scene.views.astype(np.float32) - 110) * 0.12).astype(np.uint8))
    errors = {
        variant: np.abs(estimate_depth(glossy(faint), variant).disparity - scene.ground_truth)[8:-8, 8:-8].mean()
        for variant in ("best", "best_no_detail")
    }
    assert errors["best"] < 0.02
    assert errors["best"] < 0.5 * errors["best_no_detail"]


# 100 x MSE and BadPix 0.07 (%) of variant best on scenes that are edges for the most part
EDGE_BOUNDS = {
    "fine_structures": (2.8, 1.25), "stripes": (0.65, 0.6), "curved_occluders": (1.8, 0.3), "dots": (0.75, 0.65),
    "rack": (11.0, 2.1), "pencils": (3.3, 1.4), "wall": (0.5, 0.4),
}  # fmt: skip
# on thin things, under noise, and without texture
BETTER_THAN_THE_PAPER = ("fine_structures", "dots", "stripes", "wall")


@pytest.mark.parametrize("name", EDGE_BOUNDS)
def test_edges_are_sharp_and_texture_is_no_edge(name: str) -> None:
    """Surfaces a pixel too wide, or gaps closed, double the error; texture taken for edges leaves bad spots."""
    scene = render(name, size=192)
    best = score(estimate_depth(scene, "best").disparity, scene.ground_truth)
    most, bad = EDGE_BOUNDS[name]
    assert best["mse100"] <= most
    assert best["badpix007"] <= bad
    if name in BETTER_THAN_THE_PAPER:
        paper = score(estimate_depth(scene, "paper").disparity, scene.ground_truth)
        for measure, part in (("mse100", 0.6), ("q25", 0.6), ("badpix007", 0.3)):
            assert best[measure] < part * paper[measure], measure


def test_uniform_is_what_the_noise_explains() -> None:
    """Faint texture above the noise is texture, whatever its contrast; noise is not."""
    random = np.random.default_rng(0)
    mean = np.full((60, 80, 3), 0.5) + random.normal(0, 1e-3, (60, 80, 3))
    mean[:, 40:] += 6e-3 * random.normal(0, 1, (60, 40, 1))
    found = plain_pixels(squared_gradients(mean.astype(np.float32)), 1e-6, UniformPlanesParameters())
    assert found[:, :34].mean() > 0.95
    assert not found[:, 46:].any()


def test_plane_is_nowhere_nearer_than_most_of_the_border() -> None:
    """Half of the border belongs to things that stand before the region; what lies behind it cannot be."""
    y, x = np.mgrid[:30, :40]
    ground_truth = -0.5 + 0.01 * x
    disparity = ground_truth.copy()
    disparity[:, 30:] = 1.5
    border = np.zeros((30, 40), bool)
    border[[0, -1]] = border[:, [0, -1]] = True
    plane = BorderPlane.of(border, disparity.astype(np.float32), BorderPlaneParameters()).plane
    found = plane[0] + plane[1] * (x - 19.5) + plane[2] * (y - 14.5)
    np.testing.assert_allclose(found, ground_truth, atol=1e-3)
    assert BorderPlane.of(np.zeros((30, 40), bool), disparity, BorderPlaneParameters()) is None


def test_parts_that_noise_needs_change_maps_in_noise() -> None:
    """A part that a row of the ablation does not switch off would pass for worth nothing."""
    scene = render("dots", size=64, views=7)
    best = estimate_depth(scene, "best").disparity
    for name in ("best_no_mean", "best_no_refinements", "best_no_surfaces"):
        assert np.mean(np.abs(estimate_depth(scene, name).disparity - best) > 1e-3) > 0.05, name


def test_sparsification_is_what_its_name_says() -> None:
    error = np.array([[1.0, -2.0], [3.0, np.nan]], np.float32)
    confidence = np.array([[0.9, 0.1], [0.5, 1.0]], np.float32)
    curve = sparsification(confidence, error)
    assert curve[0] == pytest.approx(200)
    assert curve[-1] == pytest.approx(100)
    assert oracle(error)[0] == pytest.approx(200)
    assert np.all(oracle(error) <= curve + 1e-9)
    unknown = np.full((2, 2), np.nan, np.float32)
    assert np.isnan(sparsification(confidence, unknown)).all()
