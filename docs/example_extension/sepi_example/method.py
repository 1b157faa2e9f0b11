"""A choice of the last stage: a median filter."""

import cv2
import numpy as np
from pydantic import Field

from sepi.lightfield import LightField
from sepi.stage import Choice, Parameters, Progress, StageMaps, require_previous


class MedianParameters(Parameters):
    """Parameters of the filter."""

    size: int = Field(3, ge=3, le=5, description="side of the window, pixels; odd")


def median(
    light_field: LightField, previous: StageMaps | None, parameters: MedianParameters, progress: Progress
) -> StageMaps:
    """The map of the stage before, filtered."""
    before = require_previous(previous)
    filtered = np.asarray(cv2.medianBlur(before.disparity, parameters.size), np.float32)
    return before.updated(filtered, before.confidence)


CHOICES = {"optimize": {"median": Choice(MedianParameters, median, own_steps=True)}}
