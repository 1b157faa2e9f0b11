"""What the channels of each pixel have in common, taken a channel at a time.

NumPy takes ten times as long along so short an axis, for the same.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt


def sum_of_channels(picture: Any) -> npt.NDArray[Any]:
    """Sum over the channels ``(H, W, C)`` of each pixel; shape (H, W)."""
    total: npt.NDArray[Any] = picture[..., 0].copy()
    for c in range(1, picture.shape[2]):
        total += picture[..., c]
    return total


def mean_of_channels(picture: Any) -> npt.NDArray[Any]:
    """Mean of the channels ``(H, W, C)`` of each pixel; shape (H, W)."""
    total = sum_of_channels(picture)
    total /= picture.shape[2]
    return total


def largest_channel(picture: Any) -> npt.NDArray[Any]:
    """The largest of the channels ``(H, W, C)`` of each pixel; shape (H, W)."""
    largest: npt.NDArray[Any] = picture[..., 0].copy()
    for c in range(1, picture.shape[2]):
        np.maximum(largest, picture[..., c], out=largest)
    return largest
