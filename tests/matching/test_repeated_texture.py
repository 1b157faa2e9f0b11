"""Texture that repeats is found at its disparity where no alias of all views lies in the range."""

import cv2
import numpy as np
import pytest

from sepi import estimate_depth
from sepi.lightfield import DisparityRange, LightField

SIZE, FINE, PATCH = 104, 8, np.s_[28:76, 28:76]


def repeated(grid: tuple[int, int], period: float, disparity: float, *, checks: bool) -> LightField:
    """A patch of stripes or checks, averaged over each pixel, before a soft ground."""
    rng = np.random.default_rng(0)
    ground = cv2.GaussianBlur(rng.random((2 * SIZE, 2 * SIZE), np.float32), (0, 0), 1.2)
    ground = (ground - ground.min()) / np.ptp(ground)
    dark = (np.arange(160 * FINE) + 0.5) / FINE % period < period / 2
    texture = cv2.blur(np.float32(dark ^ dark[:, None] if checks else dark[None].repeat(len(dark), 0)), (FINE, FINE))
    y, x = np.mgrid[:SIZE, :SIZE].astype(np.float32)
    views = np.empty((*grid, SIZE, SIZE, 1), np.float32)
    for place in np.ndindex(grid):
        t, s = (int(number - side // 2) for number, side in zip(place, grid, strict=True))
        v, u = y + np.float32(disparity * t), x + np.float32(disparity * s)
        front = cv2.remap(texture, (u + 20.5) * FINE, (v + 20.5) * FINE, cv2.INTER_LINEAR)
        behind = cv2.remap(
            ground, x + np.float32(SIZE / 2 - 0.8 * s), y + np.float32(SIZE / 2 - 0.8 * t), cv2.INTER_CUBIC
        )
        inside = np.maximum(abs(u - SIZE / 2), abs(v - SIZE / 2)) < 0.34 * SIZE
        views[(*place, ..., 0)] = np.where(inside, 0.6 * front + 0.2, behind)
    views += rng.normal(0, 0.008, views.shape)
    eight_bit = np.uint8(255 * np.clip(views, 0, 1) + 0.5)
    return LightField(eight_bit, "repeated", disparity_range=DisparityRange(-2, 2, "given"))


@pytest.mark.parametrize(
    ("variant", "grid", "period", "disparity", "checks"),
    [
        ("best", (9, 9), 5, 0.5, True),
        ("best", (9, 9), 4, 0.3, False),
        ("best", (17, 17), 7, 0.3, True),
        ("fast", (5, 5), 5, 0.5, False),
        ("best", (9, 9), 5, 0.5, False),
        ("fast", (9, 9), 5, 0.5, False),
    ],
)
def test_a_texture_without_an_alias_in_the_range_is_found(variant, grid, period, disparity, checks) -> None:
    """Interpolation loses a peak's colour, views of every second row show checks at half a period.

    Windows of like colour leave each stripe to itself, whose evidence is the same half a period away.
    """
    light_field = repeated(grid, period, disparity, checks=checks)
    error = np.abs(estimate_depth(light_field, variant).disparity - disparity)[PATCH]
    assert np.mean(error > 0.3) < 0.05
