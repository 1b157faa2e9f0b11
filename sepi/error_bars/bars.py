"""Error bars of a final map."""

from __future__ import annotations

from typing import NamedTuple

import cv2
import numpy as np

from sepi.lightfield import FloatMap

CLOSE = 0.07
"""Error that the confidence is about, pixels per view step of which the farthest view is four away."""

_HALF_WIDTH = 1.645


class ErrorBars(NamedTuple):
    """Error bars of each pixel; shapes (H, W), float32.

    Attributes
    ----------
    sigma : ndarray
        Standard deviation, pixels per view step.
    low, high : ndarray
        Interval that holds the disparity with a probability of 90 %.
    confidence : ndarray
        Probability that the error is at most :data:`CLOSE`.
    """

    sigma: FloatMap
    low: FloatMap
    high: FloatMap
    confidence: FloatMap


def error_bars(disparity: FloatMap, confidence: FloatMap) -> ErrorBars:
    """Error bars by the second difference of the surface and what the views know about it."""
    box = np.ones((3, 3), np.uint8)
    width = np.float32(_HALF_WIDTH) * np.float32(0.01) / np.maximum(confidence, np.float32(0.02))
    low = np.minimum(disparity - width, cv2.erode(disparity, box))
    high = np.maximum(disparity + width, cv2.dilate(disparity, box))
    sigma = (high - low) / np.float32(2 * _HALF_WIDTH)
    low, high, sigma = (np.asarray(values, np.float32) for values in (low, high, sigma))
    return ErrorBars(sigma, low, high, np.exp(-0.5 * (sigma / CLOSE) ** 2).astype(np.float32))
