"""Views that were compressed with loss are told, and no others."""

from dataclasses import replace
from pathlib import Path

import cv2
import numpy as np
import pytest

from sepi import estimate_depth
from sepi.inspection.coded_views import coding_error, without_blocks
from sepi.lightfield import LightField
from sepi.reading import read_light_field
from sepi.scenes import SCENES, render


def coded(view: np.ndarray, quality: int) -> np.ndarray:
    return cv2.imdecode(cv2.imencode(".jpg", view, [cv2.IMWRITE_JPEG_QUALITY, quality])[1], 1)


@pytest.mark.parametrize(("name", "most"), [("fronto_parallel", 0.02), ("dots", 0.15)])
def test_blocks_do_not_draw_surfaces_to_disparity_0(name: str, most: float) -> None:
    """Most of both scenes went there."""
    scene = render(name, size=160, views=5)
    views = np.reshape([coded(view, 30) for view in scene.views.reshape(25, 160, 160, 3)], scene.views.shape)
    error = np.abs(estimate_depth(replace(scene, views=views), "fast").disparity - scene.ground_truth)
    assert np.mean(error > 0.1) < most
    faint = LightField(np.stack([[coded(view, 95) for view in scene.views[0]]]), name)
    assert without_blocks(faint) is faint


def test_highlights_hide_no_blocks_and_make_none() -> None:
    """Their edges are larger than the errors: what was left of these was below 0, and views became black."""
    scene = render("pyramids", size=160, views=3)
    views = np.reshape([coded(view, 50) for view in scene.views.reshape(9, 160, 160, 3)], scene.views.shape).copy()
    plain = coding_error(replace(scene, views=views))
    for y, x in ((20, 30), (70, 101), (90, 45), (120, 77), (139, 21)):
        views[:, :, y : y + 2, x : x + 2] = 255
    with_highlights = replace(scene, views=views)
    assert 0.7 * plain < coding_error(with_highlights) < 1.3 * plain
    assert without_blocks(with_highlights).views.mean() > 0.8 * views.mean()


def test_blocks_are_told_wherever_they_begin(tmp_path: Path) -> None:
    """Bare walls are drawn to disparity 0, with a narrow interval."""
    views = render("pyramids", size=200, views=3).views
    for row, column in np.ndindex(3, 3):
        # a part of the pictures, as a crop is
        cv2.imwrite(str(tmp_path / f"{row}_{column}.png"), coded(views[row, column], 50)[3:, 5:])
    notes = read_light_field(tmp_path, check_order=False).notes
    assert any("compressed with loss" in note for note in notes)


@pytest.mark.parametrize("name", SCENES)
def test_scenes_that_no_coder_saw_have_no_blocks(name: str) -> None:
    """Of textures that repeat, too, and in noise."""
    views = render(name, size=192, views=2).views
    noise = np.random.default_rng(0).normal(0, 3, views.shape)
    noisy = np.clip(np.rint(views + noise), 0, 255).astype(np.uint8)
    assert coding_error(LightField(views, name)) == coding_error(LightField(noisy, name)) == 0
