"""Maps as pictures: colours, scales, outlines."""

import numpy as np
from report_results import light_field

from sepi.report import pictures


def test_error_picture_shows_sign_and_unknown() -> None:
    """Red is too near, blue too far, white right, magenta unknown."""
    near, far, right, unknown = pictures.error_picture(np.array([[1, -1, 0, np.nan]], np.float32))[0]
    assert near[0] > 100
    assert near[2] == 0
    assert far[2] > 50
    assert far[0] == 0
    assert (right > 250).all()
    np.testing.assert_array_equal(unknown, [255, 0, 255])


def test_disparity_colours_share_the_truths_scale() -> None:
    scene = light_field("cotton")
    assert pictures.disparity_limits(scene) == (-1, 1)
    assert pictures.disparity_limits(light_field("picture")) == (-1.5, 1.5)
    ends = pictures.map_picture(np.array([[-5, -1, 1, 5]], np.float32), (-1, 1))[0]
    np.testing.assert_array_equal(ends[0], ends[1])
    np.testing.assert_array_equal(ends[2], ends[3])
    assert (ends[1] != ends[2]).any()


def test_superpixel_outlines_lie_on_the_borders() -> None:
    centre = np.zeros((4, 4, 3), np.uint8)
    labels = np.repeat([[0, 0, 1, 1]], 4, axis=0)
    drawn = pictures.outline_picture(centre, labels).any(axis=2)
    np.testing.assert_array_equal(drawn, labels == np.array([9, 9, 1, 9]))
