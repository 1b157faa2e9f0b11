"""Colour differences of sheared views from the reference view."""

from __future__ import annotations

from collections.abc import Iterator

import cv2
import numpy as np

from sepi.lightfield import FloatMap


def colour_differences(sheared: FloatMap, reference: FloatMap) -> Iterator[FloatMap]:
    """Mean absolute channel difference of each view (N, 3, H, W) from one view (3, H, W); each (H, W)."""
    for view in sheared:
        red, green, blue = cv2.absdiff(view, reference)
        yield (red + green + blue) * np.float32(1 / 3)
