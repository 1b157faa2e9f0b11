"""Views that were compressed with loss are told, and no others."""

from pathlib import Path

import cv2
import numpy as np
import pytest

from sepi.inspection.coded_views import coded_views
from sepi.lightfield import LightField
from sepi.reading import read_light_field
from sepi.scenes import SCENES, render


def test_blocks_are_told_wherever_they_begin(tmp_path: Path) -> None:
    """Bare walls are drawn to disparity 0, with a narrow interval."""
    views = render("pyramids", size=200, views=3).views
    for row, column in np.ndindex(3, 3):
        coded = cv2.imdecode(cv2.imencode(".jpg", views[row, column], [cv2.IMWRITE_JPEG_QUALITY, 50])[1], 1)
        # a part of the pictures, as a crop is
        cv2.imwrite(str(tmp_path / f"{row}_{column}.png"), coded[3:, 5:])
    notes = read_light_field(tmp_path, check_order=False).notes
    assert any("compressed with loss" in note for note in notes)


@pytest.mark.parametrize("name", SCENES)
def test_scenes_that_no_coder_saw_have_no_blocks(name: str) -> None:
    """Of textures that repeat, too, and in noise."""
    views = render(name, size=192, views=2).views
    noise = np.random.default_rng(0).normal(0, 3, views.shape)
    noisy = np.clip(np.rint(views + noise), 0, 255).astype(np.uint8)
    assert coded_views(LightField(views, name)) is coded_views(LightField(noisy, name)) is None
