"""What noise allows: an estimate that is as good as any scatters by it, and no more is asked of any."""

import numpy as np
import pytest

from bench.allowed import deviations_allowed
from sepi.lightfield import LightField

SIGMA = 0.004
SIZE = 48


def still(picture: np.ndarray, views: int = 5, **more: object) -> LightField:
    """Views of a picture that does not move."""
    copies = np.broadcast_to(picture.astype(np.float32), (views, views, *picture.shape)).copy()
    truth = np.zeros(picture.shape[:2], np.float32)
    return LightField(copies, "still", **({"ground_truth": truth} | more))  # type: ignore[arg-type]


def test_no_more_is_allowed_than_the_best_estimate_of_a_pixel_reaches() -> None:
    """Least squares on views with noise, colours unknown, views left out on one side: efficient by theory."""
    y, x = np.mgrid[:SIZE, :SIZE].astype(float)
    phases, random = np.array([0.0, 1.0, 2.5]), np.random.default_rng(0)
    picture = 0.5 + 0.2 * np.sin(0.4 * x[..., None] + phases) + 0.2 * np.cos(0.5 * y[..., None] - 0.2 * x[..., None])
    across = 0.08 * np.cos(0.4 * x[..., None] + phases) + 0.04 * np.sin(0.5 * y[..., None] - 0.2 * x[..., None])
    down = np.broadcast_to(-0.1 * np.sin(0.5 * y[..., None] - 0.2 * x[..., None]), picture.shape)
    present = np.ones((5, 5), bool)
    present[:, :2] = False
    present[0, 4] = False
    allowed = deviations_allowed(still(picture, present=present), SIGMA)
    baselines = np.argwhere(present) - 2
    noise = random.normal(0, SIGMA, (40, len(baselines), *picture.shape))
    slopes = np.stack([v * down + u * across for v, u in baselines])
    slopes -= slopes.mean(axis=0)
    errors = np.einsum("vhwc,nvhwc->nhw", slopes, noise) / (slopes**2).sum(axis=(0, 3))
    inside = np.s_[4:-4, 4:-4]
    spread = np.sqrt((errors**2).mean(axis=0))[inside] / allowed[inside]
    # of forty estimates a pixel's is known to a ninth, that of all pixels to a third of a percent
    assert np.sqrt((spread**2).mean()) == pytest.approx(1, rel=0.02)
    assert 0.5 < spread.min() < spread.max() < 1.6


def test_pixels_of_one_surface_tell_of_each_other() -> None:
    ramp = np.tile(np.linspace(0.2, 0.8, SIZE), (SIZE, 1))[..., None]
    truth = np.zeros((SIZE, SIZE), np.float32)
    truth[:, :20] = -1
    light_field = still(ramp, ground_truth=truth)
    alone, together = (deviations_allowed(light_field, SIGMA, radius)[SIZE // 2] for radius in (0, 2))
    # one channel, and squares of u of -2..2 in five rows of views
    assert alone[30] == pytest.approx(SIGMA / (0.6 / (SIZE - 1) * np.sqrt(50)), rel=0.05)
    assert together[30] == pytest.approx(alone[30] / 5, rel=0.02)
    # two of five columns of the window are of the other surface
    assert together[20] == pytest.approx(alone[30] / np.sqrt(15), rel=0.1)
