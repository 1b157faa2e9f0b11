"""Detects views that went through a lossy coder, such as JPEG's.

Such a coder changes each block of 8x8 pixels by itself, so pixels differ more across block borders than within blocks.
The artefacts lie at the same pixels in every view: they match at disparity 0, and so do surfaces with little texture.
"""

from __future__ import annotations

import numpy as np

from sepi.lightfield import LightField

_BLOCK = 8
_FEWEST_BLOCKS = 6
# least excess of differences across block borders over those at the other seven places: relative, and in standard
# deviations
_MORE, _ERRORS = 0.12, 6.0


def coded_views(light_field: LightField) -> str | None:
    """Message about views that show a coder's blocks; None if none do, or the pictures are too small.

    Parameters
    ----------
    light_field : LightField
        Its reference view is checked.
    """
    grey = light_field.reference_view.mean(axis=2)
    for axis in (0, 1):
        steps = np.abs(np.diff(grey, axis=axis)).mean(axis=1 - axis)
        blocks = len(steps) // _BLOCK
        if blocks < _FEWEST_BLOCKS:
            return None
        of_place = steps[: blocks * _BLOCK].reshape(blocks, _BLOCK).mean(axis=0)
        others = np.delete(of_place, of_place.argmax())
        if of_place.max() - others.mean() < max(_MORE * others.mean(), _ERRORS * others.std()):
            return None
    return (
        "the views were compressed with loss (they show blocks of 8x8 pixels, like JPEG's): the blocks have the same "
        "place in all views, and draw regions of little texture to disparity 0; use less compressed views if possible"
    )
