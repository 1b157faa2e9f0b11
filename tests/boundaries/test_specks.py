"""Specks of a map go, and what may be a surface stays."""

import numpy as np
import pytest
from scipy import ndimage

from sepi.boundaries.specks import join_specks, specks_of, without_specks
from sepi.lightfield import BoolMap, DisparityRange, FloatMap, LightField
from sepi.occlusion import VisibilityParameters

pytestmark = pytest.mark.slow

AROUND = np.ones((3, 3), bool)


def joined(disparity: FloatMap, colours: FloatMap) -> FloatMap:
    """With parts of up to 4 pixels gone, and holes of up to 8."""
    return join_specks(disparity, colours, 0.15, 4, 8)


def test_specks_join_what_has_their_colour() -> None:
    """Mismatches beside edges, in the corner, and in a hole of a plain surface are gone from a user's map."""
    disparity = np.zeros((12, 14), np.float32)
    disparity[:, 7:] = 1
    colours = np.repeat(disparity[..., None], 3, axis=2) * 0.5
    found = disparity.copy()
    # of the far surface's colour, beside the edge; of the near one's, in the picture's corner and in a hole that only
    # its rim knows the depth of
    found[3:5, 5:7], found[0, 13], found[6:8, 8:12] = 2, 2, -2
    np.testing.assert_array_equal(joined(found, colours), disparity)
    # rounds from the rim inwards: nothing beside the innermost pixel is known at first
    found = np.zeros((9, 9), np.float32)
    found[3:6, 3:6] = -1
    np.testing.assert_array_equal(join_specks(found, np.zeros((9, 9, 3), np.float32), 0.15, 0, 9), 0)


def test_what_may_be_a_surface_stays() -> None:
    """Wires, also those that run corner to corner, larger gaps, slopes, and a map of nothing but specks."""
    colours = np.zeros((12, 14, 3), np.float32)
    found = np.zeros((12, 14), np.float32)
    found[np.arange(5), np.arange(5)] = 1
    found[8:11, 8:11] = -1
    np.testing.assert_array_equal(joined(found, colours), found)
    # five pixels behind one of their neighbours, before the others, are no hole
    found = np.zeros((12, 14), np.float32)
    found[:, 7:], found[4:9, 7] = 2, 1
    np.testing.assert_array_equal(joined(found, colours), found)
    slope = np.add.outer(np.arange(12), np.arange(14)).astype(np.float32) * 0.1
    np.testing.assert_array_equal(joined(slope, colours), slope)
    scattered = np.arange(12 * 14, dtype=np.float32).reshape(12, 14)
    np.testing.assert_array_equal(joined(scattered, colours), scattered)


def test_specks_are_found_as_plain_labels_tell() -> None:
    """The compiled search against one that labels whole levels."""
    disparity = np.random.default_rng(0).integers(0, 3, (40, 50)).astype(np.float32)
    assert disparity.max() == 2

    def plain(most: int, most_of_hole: int) -> BoolMap:
        specks = np.zeros(disparity.shape, bool)
        for level in range(3):
            labels, parts = ndimage.label(disparity == level, AROUND)
            for part in (labels == n for n in range(1, parts + 1)):
                beside = ndimage.binary_dilation(part, AROUND) & ~part
                is_hole = part.sum() <= most_of_hole and (disparity[beside] > level).all()
                specks |= part & (is_hole or part.sum() <= most)
        return specks

    for most, most_of_hole in ((1, 1), (4, 8), (5, 0), (0, 6), (0, 0)):
        expected = plain(most, most_of_hole)
        np.testing.assert_array_equal(specks_of(disparity, 0.5, most, most_of_hole), expected)
    assert plain(4, 8).sum() > plain(4, 0).sum() > 0


def test_what_shows_in_small_gaps_stays() -> None:
    """If this fails, a rack or a fence is closed where what is behind it shows in two pixels, or mismatches stay."""
    views, size = 5, 48
    rng = np.random.default_rng(3)
    wall, fence = (rng.random((size, 2 * size, 3), np.float32) for _ in range(2))
    truth = np.ones((size, size), np.float32)
    # one large gap, two small ones beside it, and a small one that nothing near it is as deep as
    truth[10:20, 10:20] = truth[12:14, 22:24] = truth[16:18, 22:24] = 0
    pictures = np.empty((1, views, size, size, 3), np.float32)
    for s in range(views):
        left = size // 2 + s - views // 2
        open_ = np.roll(truth == 0, -(s - views // 2), axis=1)
        pictures[0, s] = np.where(open_[..., None], wall[:, size // 2 : size // 2 + size], fence[:, left : left + size])
    light_field = LightField(pictures, "fence", disparity_range=DisparityRange(-0.5, 1.5, "given"))
    found = truth.copy()
    found[16:18, 22:24], found[40:42, 40:42], found[30, 12] = 0.02, 0, 0
    parameters = VisibilityParameters()
    left_over = without_specks(light_field, found, light_field.present, parameters)
    expected = np.where(found == np.float32(0.02), found, truth)
    np.testing.assert_array_equal(left_over, expected)
    # where no view shows the wall there is no gap, however deep something near it is
    found[24:26, 15:17] = 0
    np.testing.assert_array_equal(without_specks(light_field, found, light_field.present, parameters), expected)
