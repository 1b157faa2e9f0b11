"""Texture too sharp for interpolation is found at its disparity, and other views stay as they are."""

from dataclasses import replace

import cv2
import numpy as np
import pytest
from skimage.data import brick

from sepi import estimate_depth
from sepi.lightfield import DisparityRange, FloatMap, LightField
from sepi.matching.softening import SofteningParameters, compared_views
from sepi.scenes import render

SIZE, FINE, PATCH = 112, 8, np.s_[34:78, 34:78]


def dotted(disparity: float, blur: float = 0.0) -> LightField:
    """Dots of 2 px, averaged over each pixel as in a light field that was made smaller, before a soft ground."""
    dots = np.float32(np.random.default_rng(1).random((70, 70)) > 0.5)
    dots = dots.repeat(2 * FINE, axis=0).repeat(2 * FINE, axis=1)
    return shown(cv2.GaussianBlur(dots, (0, 0), blur * FINE) if blur else dots, FINE, disparity)


def shown(texture: FloatMap, fine: int, disparity: float) -> LightField:
    """A texture of so many samples along a pixel, averaged over each pixel, before a soft ground."""
    rng = np.random.default_rng(2)
    texture = cv2.blur(texture, (fine, fine))
    ground = cv2.GaussianBlur(rng.random((2 * SIZE, 2 * SIZE), np.float32), (0, 0), 1.2)
    ground = (ground - ground.min()) / np.ptp(ground)
    y, x = np.mgrid[:SIZE, :SIZE].astype(np.float32)
    views = np.empty((9, 9, SIZE, SIZE, 1), np.float32)
    for t, s in np.ndindex(9, 9):
        v, u = y + disparity * (t - 4), x + disparity * (s - 4)
        front = cv2.remap(texture, (u + 0.5) * fine, (v + 0.5) * fine, cv2.INTER_LINEAR)
        behind = cv2.remap(ground, x - 0.8 * (s - 4) + SIZE / 2, y - 0.8 * (t - 4) + SIZE / 2, cv2.INTER_CUBIC)
        inside = np.maximum(abs(u - SIZE / 2), abs(v - SIZE / 2)) < 0.36 * SIZE
        views[t, s, ..., 0] = np.where(inside, 0.7 * front + 0.15, behind)
    views += rng.normal(0, 0.008, views.shape)
    eight_bit = np.uint8(255 * np.clip(views, 0, 1) + 0.5)
    return LightField(eight_bit, "shown", disparity_range=DisparityRange(-2, 2, "given"))


@pytest.mark.parametrize("variant", ["best", "fast", "paper"])
@pytest.mark.parametrize("disparity", [0.25, 0.1])
def test_sharp_texture_is_drawn_to_no_whole_pixel(disparity: float, variant: str) -> None:
    """Interpolation loses its frequencies: all of it came out a fourth of a pixel off, with confidence 1.

    What the blur leaves of them drew it by less than that, yet out of its interval.
    """
    maps = estimate_depth(dotted(disparity), variant)
    assert np.mean(np.abs(maps.disparity - disparity)[PATCH] > 0.07) < 0.02
    assert np.mean(((maps.low <= disparity) & (disparity <= maps.high))[PATCH]) > 0.9


def test_softened_views_are_not_corrected_for_noise_that_the_blur_took() -> None:
    """Corrected for all of it, positions between pixels cost too much: most of a wall was at whole pixels."""
    maps = estimate_depth(shown(np.float32(brick() / 255), 3, 0.1), "paper")
    assert np.mean(np.abs(maps.disparity - 0.1)[PATCH] > 0.07) < 0.2


def test_soft_texture_and_single_edges_stay() -> None:
    """Blur would cost them detail: a step between uniform surfaces is as sharp as the dots are, but alone."""
    parameters = SofteningParameters(denoising=0)
    edge = np.zeros((3, 3, SIZE, SIZE, 3), np.uint8)
    edge[:, :, :, SIZE // 2 :] = 200
    known = DisparityRange(-1, 1, "given")
    for light_field in (
        dotted(0.25, blur=1.0),
        render("pyramids", size=96, views=5),
        LightField(edge, "edge", disparity_range=known),
    ):
        assert compared_views(light_field, parameters) is light_field
    sharp = dotted(0.25)
    assert compared_views(sharp, parameters) is not sharp
    assert compared_views(sharp, SofteningParameters(denoising=0, softening=0)) is sharp
    # the black of what a view does not show would be blurred into what it shows
    missing = np.zeros((9, 9, SIZE, SIZE), bool)
    missing[0, 0, :5] = True
    partly = replace(sharp, missing=missing)
    assert compared_views(partly, parameters) is partly
