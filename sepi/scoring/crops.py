"""Places maps of a crop in the frame of the whole image's ground truth."""

from __future__ import annotations

import numpy as np

from sepi.camera import require_part
from sepi.lightfield import BoolMap, FloatMap


def in_frame(crop: FloatMap, offset: tuple[int, int], shape: tuple[int, int]) -> tuple[FloatMap, BoolMap]:
    """A crop's map in the frame of the whole image.

    Parameters
    ----------
    crop : ndarray, shape (h, w), float32
        Disparity of the crop, pixels per view step.
    offset : (int, int)
        Row and column of the crop's top left pixel in the whole image, from 0.
    shape : (int, int)
        Height and width (H, W) of the whole image.

    Returns
    -------
    whole : ndarray, shape (H, W), float32
        NaN outside the crop.
    inside : ndarray, shape (H, W), bool
        The crop's pixels.

    Raises
    ------
    SepiError
        If the crop extends beyond the whole image.
    """
    (row, column), (height, width) = offset, crop.shape
    require_part((shape[1], shape[0], column, row), crop.shape)
    whole, inside = np.full(shape, np.nan, np.float32), np.zeros(shape, bool)
    place = np.s_[row : row + height, column : column + width]
    whole[place], inside[place] = crop, True
    return whole, inside
