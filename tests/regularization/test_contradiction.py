"""Faint texture knows its depth against a plane, and noise knows none."""

import cv2
import numpy as np
import pytest

from sepi.lightfield import BoolMap, DisparityRange, LightField
from sepi.regularization.contradiction import contradicted

SIZE, VIEWS, NOISE = 64, 5, 0.004
REGION = np.zeros((SIZE, SIZE), bool)
REGION[12:52, 12:52] = True


def faint(contrast: float, disparity: float) -> LightField:
    """A surface whose texture is so much of the noise, and that noise."""
    rng = np.random.default_rng(3)
    texture = cv2.GaussianBlur(rng.normal(0, 1, (2 * SIZE, 2 * SIZE)), (0, 0), 2)
    texture *= contrast * NOISE / texture.std()
    views = rng.normal(0.5, NOISE, (VIEWS, VIEWS, SIZE, SIZE, 3))
    for t, s in np.ndindex(VIEWS, VIEWS):
        by = disparity * (np.array([s, t]) - VIEWS // 2) + SIZE / 2
        views[t, s] += cv2.warpAffine(
            texture,
            np.float64([[1, 0, by[0]], [0, 1, by[1]]]),
            (SIZE, SIZE),
            flags=cv2.INTER_CUBIC | cv2.WARP_INVERSE_MAP,
        )[..., None]
    return LightField(views.astype(np.float32), "faint", disparity_range=DisparityRange(-2, 2, "given"))


def against(light_field: LightField, before: float, after: float) -> BoolMap:
    maps = np.full((SIZE, SIZE), before, np.float32), np.where(REGION, after, before).astype(np.float32)
    return contradicted(light_field, *maps, REGION, light_field.present, 0.15, NOISE**2)


def test_faint_texture_speaks_against_a_plane_that_leads_away() -> None:
    """A fold in the dark would be put onto the wall behind it."""
    assert against(faint(1.5, 0.4), 0.4, 1.0)[REGION].mean() > 0.8
    assert not against(faint(1.5, 0.4), 1.0, 0.4).any()


@pytest.mark.parametrize(("before", "after"), [(0.5, 1.0), (1.0, 0.5), (0.25, 0.3)])
def test_noise_speaks_for_no_depth(before: float, after: float) -> None:
    """Samples between pixels average it, and would hold bare walls wherever matching put them."""
    assert against(faint(0.0, 0), before, after)[REGION].mean() < 0.02
