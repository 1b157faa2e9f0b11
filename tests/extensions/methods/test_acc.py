"""The compared method of phase-shifted views: its shifts, costs and refinement, and what its publication claims."""

import numpy as np
import pytest
from geometries import GEOMETRIES, standing

from sepi.extensions.methods import acc
from sepi.extensions.methods.acc import (
    AccParameters,
    ConfidentLabelsParameters,
    agreed,
    confident_labels,
    matched_disparities,
    phase_shift_costs,
    phase_shifted,
    truncated_difference,
)
from sepi.extensions.methods.costs import GuidedFilter, disparity_of, least_costs
from sepi.lightfield import DisparityRange, LightField
from sepi.scenes import render
from sepi.stage import CostVolume, no_progress

pytestmark = pytest.mark.slow


def waves(height: int, width: int, down: float, across: float) -> np.ndarray:
    """Three pictures of a few waves below the highest frequency, at ``(y + down, x + across)``; (3, H, W)."""
    y, x = np.mgrid[:height, :width] + np.array([down, across])[:, None, None]
    y, x = 2 * np.pi * y / height, 2 * np.pi * x / width
    return np.stack([np.sin(3 * y + 2 * x), np.cos(7 * y - 5 * x) + 0.3, np.sin(11 * x) * np.cos(10 * y)])


@pytest.mark.parametrize(("height", "width"), [(24, 30), (25, 31)], ids=["even", "odd"])
def test_shift_of_a_band_limited_picture_is_exact(height: int, width: int) -> None:
    """The phase shift theorem: the method's whole claim is that sub-pixel shifts lose nothing."""
    offsets = np.array([[0, 0], [0.3, -1.7], [0.5, 0.5], [-3.25, 0.01], [40.1, -77.7]])
    found = phase_shifted(waves(height, width, 0, 0).astype(np.float32), offsets, None)
    for moved, (down, across) in zip(found, offsets, strict=True):
        np.testing.assert_allclose(moved, waves(height, width, down, across), atol=1e-5)


def differences_twin(moved: np.ndarray, reference: np.ndarray, across: float, share: float) -> np.ndarray:
    residual = np.pad(
        moved[:, : reference.shape[1], : reference.shape[2]] - reference, ((0, 0), (1, 1), (1, 1)), "edge"
    )
    right = np.abs(residual[:, 1:-1, 2:] - residual[:, 1:-1, :-2]).mean(axis=0) / 2
    below = np.abs(residual[:, 2:, 1:-1] - residual[:, :-2, 1:-1]).mean(axis=0) / 2
    colour = np.minimum(np.abs(residual[:, 1:-1, 1:-1]).mean(axis=0), 0.3)
    gradients = across * np.minimum(right, 0.2) + (1 - across) * np.minimum(below, 0.2)
    return np.asarray(share * colour + (1 - share) * gradients)


def test_differences_equal_plain_twins() -> None:
    """Every cost comes from them."""
    random = np.random.default_rng(2)
    moved, reference = random.random((4, 3, 14, 19), np.float32), random.random((3, 12, 17), np.float32)
    chosen = AccParameters(colour_share=0.4, colour_truncation=0.3, gradient_truncation=0.2)
    for one in moved:
        found = truncated_difference(one, reference, 0.7, chosen)
        np.testing.assert_allclose(found, differences_twin(one, reference, 0.7, 0.4), rtol=1e-5)


def textured(disparity: float, noise: float, *, rows: int = 5, stripes: bool = False) -> LightField:
    """A plane of texture up to 0.8 of the highest frequency, each of ``rows`` times 5 views sampled exactly."""
    random, size = np.random.default_rng(3), 48
    down, across = np.meshgrid(*[np.fft.fftfreq(size)] * 2, indexing="ij")
    kept = (np.abs(down) < 0.4) & (np.abs(across) < 0.4) & ((down == 0) | (not stripes))
    spectrum = np.fft.fft2(random.normal(size=(3, size, size))) * kept
    spectrum *= 0.12 / np.fft.ifft2(spectrum).real.std()
    views = np.empty((rows, 5, size, size, 3), np.float32)
    for t, s in np.ndindex(rows, 5):
        phase = np.exp(2j * np.pi * disparity * (down * (t - rows // 2) + across * (s - 2)))
        views[t, s] = 0.5 + np.fft.ifft2(spectrum * phase).real.transpose(1, 2, 0)
    views += random.normal(0, noise, views.shape).astype(np.float32)
    return LightField(np.clip(views, -0.5, 1.5), "texture", disparity_range=DisparityRange(-0.3, 0.5, "given"))


def errors(light_field: LightField, true: np.ndarray | float, **parameters: float) -> np.ndarray:
    """Of the candidates of least cost, borders left out."""
    chosen = AccParameters(num_disparities=41, **parameters)
    disparities = chosen.candidates(light_field)
    costs = phase_shift_costs(light_field, disparities, chosen, no_progress)
    volume = CostVolume(disparities, costs.astype(np.float16))
    return np.abs(disparity_of(volume, least_costs(volume)) - true)[8:-8, 8:-8]


def test_refinement_makes_a_slope_of_labels_continuous() -> None:
    """Without it a map has steps as high as the disparity sampling."""
    true = np.broadcast_to(np.linspace(-0.9, 0.9, 64, dtype=np.float32), (64, 64))
    disparities = np.linspace(-1, 1, 21).astype(np.float32)
    labels = disparities[np.abs(disparities[:, None, None] - true).argmin(axis=0)]
    smooth = GuidedFilter(np.full((64, 64, 3), 0.5, np.float32), 3, 1e-4)
    found = labels
    for _ in range(4):
        found = acc.refined(found, disparities, smooth)
    inner = np.s_[8:-8, 8:-8]
    assert np.abs(found - true)[inner].mean() < 0.5 * np.abs(labels - true)[inner].mean()


def test_features_tell_the_disparity_of_their_pixels() -> None:
    """They are weighted far above the costs: a wrong one is a wrong pixel."""
    scene = render("pyramids", size=96, views=5)
    rows, columns, found = matched_disparities(scene, *scene_range(scene))
    assert len(found) > 30
    assert len(np.unique(np.stack([rows, columns]), axis=1).T) == len(found)
    error = np.abs(found - scene.ground_truth[rows, columns])
    assert np.median(error) < 0.02
    assert np.mean(error > 0.2) < 0.05


def scene_range(scene: LightField) -> tuple[float, float]:
    known = scene.require_disparity_range()
    return known.minimum, known.maximum


def test_views_vote_on_a_feature() -> None:
    """One wrong match must not move a feature that the others agree on."""
    found = np.array([[0.5, np.nan, 0.1], [0.6, np.nan, np.nan], [3.0, np.nan, np.nan], [0.55, np.nan, np.nan]])
    disparity, support = agreed(found, np.array([1.0, 2, 1, 2]))
    np.testing.assert_allclose(disparity[[0, 2]], [(0.5 + 4 * 0.6 + 4 * 0.55) / 9, 0.1])
    np.testing.assert_array_equal(support, [3, 0, 1])
    assert np.isnan(disparity[1])


@pytest.mark.parametrize("geometry", GEOMETRIES)
def test_views_stand_where_their_baselines_say(geometry: str) -> None:
    """Hand-held arrays and rigs with closer rows get the depth that a grid gets."""
    scene = render("slanted_plane", size=64, views=5, **standing(geometry, (5, 5)))
    assert np.median(errors(scene, scene.ground_truth)) < 0.012


@pytest.mark.parametrize("stage", ["initial", "all"])
def test_a_plane_gets_its_disparity(stage: str) -> None:
    """The simplest scene: a tenth of a candidate by the costs, half a candidate by the labels."""
    scene = textured(0.137, 0)
    candidates = AccParameters(num_disparities=41)
    step = 0.8 / 40
    first = acc.acc(scene, None, candidates, no_progress)
    assert first.cost_volume is not None
    if stage == "initial":
        assert np.abs(first.disparity - 0.137)[4:-4, 4:-4].max() < 0.1 * step
    else:
        found = confident_labels(scene, first, ConfidentLabelsParameters(), no_progress).disparity
        assert np.abs(found - 0.137)[4:-4, 4:-4].max() < 0.5 * step
