"""What the channels of each pixel have in common, taken a channel at a time.

NumPy takes ten times as long along so short an axis, for the same.
"""

from __future__ import annotations

import numpy as np

from sepi.lightfield import FloatMap


def sum_of_channels(picture: FloatMap) -> FloatMap:
    """Sum over the channels ``(H, W, C)`` of each pixel; shape (H, W)."""
    total = picture[..., 0].copy()
    for c in range(1, picture.shape[2]):
        total += picture[..., c]
    return total


def mean_of_channels(picture: FloatMap) -> FloatMap:
    """Mean of the channels ``(H, W, C)`` of each pixel; shape (H, W)."""
    total = sum_of_channels(picture)
    total /= picture.shape[2]
    return total


def largest_channel(picture: FloatMap) -> FloatMap:
    """The largest of the channels ``(H, W, C)`` of each pixel; shape (H, W)."""
    largest = picture[..., 0].copy()
    for c in range(1, picture.shape[2]):
        np.maximum(largest, picture[..., c], out=largest)
    return largest
