"""Noise told from the views, and views without what it explains."""

from dataclasses import replace

import numpy as np
import numpy.typing as npt
import pytest
from scipy import ndimage

from sepi.kernels import denoising as kernels
from sepi.lightfield import FloatMap, LightField
from sepi.matching import denoising as module
from sepi.matching.denoising import DenoisedLightField, denoised
from sepi.matching.view_noise import variance_map, view_noise
from sepi.process.workspace import Workspace
from sepi.scenes import render


def with_noise(light_field: LightField, sigma: FloatMap | float, seed: int = 0) -> LightField:
    """A scene in bytes with white noise of ``sigma`` levels."""
    noise = np.random.default_rng(seed).standard_normal(light_field.views.shape, np.float32)
    views = 255 * light_field.rgb_views.astype(np.float32) + sigma * noise
    return replace(light_field, views=np.clip(np.rint(views), 0, 255).astype(np.uint8))


def textured(scale: float = 0.25) -> LightField:
    """A slanted plane of strong texture, ``scale`` of black to white round grey, floats."""
    scene = render("slanted_plane", size=128, views=5)
    views = scene.views.astype(np.float32) / np.iinfo(scene.views.dtype).max
    return replace(scene, views=0.5 + scale * (views - views.mean()))


def test_noise_is_told_by_brightness_and_by_place_whatever_the_texture() -> None:
    """If this fails, views with texture pass for noisy, or a dark corner's noise is taken for everybody's."""
    scene = textured()
    assert view_noise(with_noise(scene, 0)).usual * 255 < 1
    assert view_noise(with_noise(scene, 6)).usual * 255 == pytest.approx(6, rel=0.12)
    bright = np.where(np.arange(128) < 64, -0.25, 0.25).astype(np.float32)[:, None]
    halves = replace(scene, views=0.5 + bright + 0.4 * (scene.views - 0.5))
    by_brightness = view_noise(with_noise(halves, 16 * (1 - halves.views)))
    told = np.sqrt(by_brightness.variance) * 255
    np.testing.assert_allclose(told, 16 * (1 - by_brightness.brightness), rtol=0.15)
    assert told[0] > 2 * told[-1]
    sides = np.where(np.arange(128) < 64, 3, 9).astype(np.float32)[:, None]
    by_place = np.sqrt(view_noise(with_noise(scene, sides)).by_place).mean(axis=0)
    assert by_place[3] / by_place[0] == pytest.approx(3, rel=0.2)


def test_noise_is_much_the_same_at_every_brightness() -> None:
    """If this fails, leaves that hide one another are taken for noise, and smoothed away."""
    scene = textured()
    random = np.random.default_rng(3)
    # where it is darker, five of the eight brightnesses, a grain that moves along, and one of every view's own
    dark = np.arange(128) < 80
    grain = random.standard_normal((128, 128, 1), np.float32) + random.standard_normal(scene.views.shape, np.float32)
    views = 0.5 + np.where(dark, -0.2, 0.2).astype(np.float32)[:, None] + 0.04 * dark[:, None] * grain
    noise = view_noise(with_noise(replace(scene, views=views.astype(np.float32)), 2))
    told = np.sqrt(noise.variance) * 255
    assert told[-1] == pytest.approx(2, rel=0.15)
    assert told.max() < 7


def test_a_pixels_own_noise_is_not_its_texture() -> None:
    """If this fails, texture whose depth is wrong passes for a bare wall."""
    scene = textured()
    scene.views[:] = 0.5
    # a grain of single pixels at disparity 0
    scene.views[..., 64:, :] += 0.1 * np.random.default_rng(2).standard_normal((128, 64, 3), np.float32)
    noisy = with_noise(scene, 4)
    variance = 255**2 * variance_map(noisy, view_noise(noisy), noisy.present)
    assert variance[:, :50].mean() == pytest.approx(16, rel=0.2)
    assert variance[:, 80:].max() < 5 * 16


def test_pictures_of_unlike_brightness_are_no_noise() -> None:
    """If this fails, an automatic exposure makes all detail be taken for noise."""
    scene = textured()
    steps = np.random.default_rng(1).choice([-0.05, 0.05], scene.grid).astype(np.float32)[..., None, None, None]
    steps[scene.reference_position] = 0
    noise = view_noise(with_noise(replace(scene, views=scene.views + steps), 4))
    assert noise.usual * 255 == pytest.approx(4, rel=0.15)
    assert noise.share > 0.75


def test_faint_noise_is_taken_out_where_it_can_be_nothing_else() -> None:
    """If this fails, a level of noise puts a dark wall into another depth, or clean renderings are blurred."""
    scene = textured()
    # as much of it plain, in every brightness
    scene.views[..., 64:, :] = np.linspace(0.3, 0.7, 128, dtype=np.float32)[:, None, None]
    noise = view_noise(faint := with_noise(scene, 0.9))
    assert noise.usual * 255 == pytest.approx(np.hypot(0.9, 0.29), rel=0.12)
    assert noise.agreement > 0.8
    assert isinstance(denoised(faint, 1.5), DenoisedLightField)
    # what does not fit at whole pixels has as much, but flat parts do not
    clean = render("curved_occluders", size=128)
    assert view_noise(clean).usual > module.LEAST_SURE_NOISE
    assert view_noise(clean).agreement < 0.5
    assert denoised(clean, 1.5) is clean


def plain_denoised(view: FloatMap, levels: FloatMap, variances: FloatMap, least: FloatMap) -> npt.NDArray[np.float64]:
    """The same as the kernel by plain means, (H, W, C), mirrored at the ends."""
    mean = np.asarray(view, np.float64)
    for axis in (0, 1):
        mean = ndimage.convolve1d(mean, [0.25, 0.5, 0.25], axis=axis, mode="mirror")
    detail = view - mean
    noise = 0.640625 * least * np.interp(mean.mean(axis=2), levels, variances)
    energy = ndimage.uniform_filter((detail**2).mean(axis=2), 5, mode="mirror")
    gain = np.maximum(energy - noise, 0) / np.maximum(energy, 1e-30)
    return np.asarray(mean + gain[..., None] * detail)


@pytest.mark.parametrize("channels", [1, 3])
def test_kernel_equals_plain_means(channels: int) -> None:
    rng = np.random.default_rng(2)
    views = rng.random((1, 2, 71, 23, channels)).astype(np.float32)
    views[..., :11, :] = 0.5 + 0.01 * views[..., :11, :]
    levels, variances = np.array([(0.2, 1e-4), (0.6, 4e-2)], np.float32).T
    least = rng.uniform(1, 2, views.shape[2:4]).astype(np.float32)
    present = np.array([[True, False]])
    out = np.zeros_like(views)
    lines = module.lines_between(levels, variances)
    kernels.denoise_views(views, present, 1, lines, least, out)
    np.testing.assert_allclose(out[0, 0], plain_denoised(views[0, 0], levels, variances, least), atol=2e-6)
    assert not out[0, 1].any()
    levels_of_bytes = np.rint(255 * views).astype(np.uint8)
    rounded = np.zeros_like(levels_of_bytes)
    kernels.denoise_views(levels_of_bytes, present, 255, lines, least, rounded)
    expected = plain_denoised((levels_of_bytes[0, 0] / np.float32(255)), levels, variances, least)
    np.testing.assert_allclose(rounded[0, 0], 255 * np.clip(expected, 0, 1), atol=0.51)


def test_only_noisy_views_are_changed() -> None:
    """If this fails, clean scenes lose detail, or each stage denoises anew."""
    scene = textured()
    clean = with_noise(scene, 0.2)
    assert denoised(clean, 1.5) is clean
    noisy = with_noise(scene, 6)
    assert denoised(noisy, 0) is noisy
    kept = replace(noisy, workspace=Workspace())
    one, other = denoised(kept, 1.5), denoised(replace(kept), 1.5)
    assert one.views is other.views
    assert isinstance(one, DenoisedLightField)
    assert one.noise * 255 == pytest.approx(6, rel=0.5)
    before, after = (np.abs(v.reference_view - scene.reference_view).mean() for v in (noisy, one))
    assert after < before
    # where a stage asks for more noise than there is
    assert denoised(noisy, 1.5, 7 / 255) is noisy
    assert isinstance(denoised(noisy, 1.5, 5 / 255), DenoisedLightField)
