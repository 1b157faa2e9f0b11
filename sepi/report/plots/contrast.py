"""More contrast for the pictures of a probe, with unchanged hues."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from sepi.lightfield import BoolMap
from sepi.report.plots.pictures import Picture

# the brightness is stretched to black and white, by at most this factor because of noise
_MOST_CONTRAST = 4.0
# most gain of colours, which would glare on grey surfaces
_MOST_COLOUR = 1.5


def contrast_of(pictures: Sequence[tuple[Picture, BoolMap]]) -> tuple[float, float]:
    """Brightness within the masks that becomes black, and that which becomes white; 0..255."""
    seen = np.concatenate([pixels[inside].mean(axis=1) for pixels, inside in pictures])
    low, high = np.percentile(seen, (0.5, 99.5)) if seen.size else (0.0, 255.0)
    missing = max(0.0, 255 / _MOST_CONTRAST - (high - low)) / 2
    return float(low - missing), float(high + missing)


def stretched(picture: Picture, inside: BoolMap, limits: tuple[float, float]) -> Picture:
    """The picture (H, W, 3) with stretched brightness inside the mask (H, W)."""
    low, high = limits
    brightness = picture.mean(axis=2, keepdims=True)
    gain = 255 / (high - low)
    colour = (picture - brightness) * min(gain, _MOST_COLOUR)
    bright = np.asarray(np.rint(np.clip((brightness - low) * gain + colour, 0, 255)), np.uint8)
    return np.where(inside[:, :, None], bright, picture)
