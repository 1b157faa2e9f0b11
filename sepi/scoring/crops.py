"""Maps of a part of the picture, brought into the frame of the whole picture's ground truth."""

from __future__ import annotations

import numpy as np

from sepi.errors import SepiError
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
    if row < 0 or column < 0 or row + height > shape[0] or column + width > shape[1]:
        raise SepiError(
            f"a map of {crop.shape} at offset {row},{column} does not lie inside the ground truth of {shape} "
            "(height, width)"
        )
    whole, inside = np.full(shape, np.nan, np.float32), np.zeros(shape, bool)
    place = np.s_[row : row + height, column : column + width]
    whole[place], inside[place] = crop, True
    return whole, inside
