"""Maps of a part of the picture, brought into the frame of the whole picture's ground truth."""

from __future__ import annotations

import numpy as np

from sepi.camera import require_part
from sepi.lightfield import BoolMap, FloatMap


def in_frame(crop: FloatMap, offset: tuple[int, int], shape: tuple[int, int]) -> tuple[FloatMap, BoolMap]:
    """A crop's map in the frame of the whole picture.

    Parameters
    ----------
    crop : ndarray, shape (h, w), float32
        Disparity of a part of the picture, pixels per view step.
    offset : (int, int)
        Row and column in the whole picture of the crop's top left pixel, from 0.
    shape : (int, int)
        Height and width (H, W) of the whole picture.

    Returns
    -------
    whole : ndarray, shape (H, W), float32
        NaN outside the crop.
    inside : ndarray, shape (H, W), bool
        The crop's pixels.

    Raises
    ------
    SepiError
        If the crop does not lie inside the whole picture.
    """
    (row, column), (height, width) = offset, crop.shape
    require_part((shape[1], shape[0], column, row), crop.shape)
    whole, inside = np.full(shape, np.nan, np.float32), np.zeros(shape, bool)
    place = np.s_[row : row + height, column : column + width]
    whole[place], inside[place] = crop, True
    return whole, inside
