"""Views that went through a lossy coder, such as JPEG's: their errors are measured, and hidden by noise.

Such a coder changes each block of 8x8 pixels by itself, so pixels differ more across block borders than within blocks.
The errors lie at the same pixels in every view: they match at disparity 0, and draw surfaces with little texture there.
White noise of their strength, another in each view, matches nowhere and makes quantised colours continuous. Matching
knows how to treat it.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from sepi.image.noise import sum_of_channels
from sepi.lightfield import HIGHEST, LOWEST, LightField, full_scale
from sepi.matching.exposure import equally_bright

_BLOCK = 8
_FEWEST_BLOCKS = 6
# least excess of differences across block borders over those at the other seven places: relative, and in standard
# deviations
_MORE, _ERRORS = 0.12, 6.0
# largest difference of neighbours that counts, as a multiple of the mean
_EDGE = 8.0
# errors at block borders up to which matching does better without noise, colours in 0..1; strength of the noise
# relative to the errors beyond them, since a border shows only what differs between blocks, in the mean of the channels
_BORNE, _STRENGTH = 1.5 / 255, 2.2


def coding_error(light_field: LightField) -> float:
    """Standard deviation of a coder's errors at the borders of its blocks, in the mean of the channels.

    Parameters
    ----------
    light_field : LightField
        Its reference view is measured.

    Returns
    -------
    float
        Colours in 0..1; 0 if no blocks show, or the pictures are too small.
    """
    view, squares = light_field.reference_view, []
    grey = sum_of_channels(view) / view.shape[2]
    for axis in (0, 1):
        steps = np.abs(np.diff(grey, axis=axis))
        # edges and highlights say nothing of a coder's errors
        steps = np.minimum(steps, _EDGE * steps.mean())
        blocks = steps.shape[axis] // _BLOCK
        if blocks < _FEWEST_BLOCKS:
            return 0.0
        of_place, squared = (
            values.mean(axis=1 - axis)[: blocks * _BLOCK].reshape(blocks, _BLOCK).mean(axis=0)
            for values in (steps, steps**2)
        )
        border = of_place.argmax()
        others = np.delete(of_place, border)
        if of_place[border] - others.mean() < max(_MORE * others.mean(), _ERRORS * others.std()):
            return 0.0
        # a step has the errors of two pixels
        squares.append((squared[border] - np.delete(squared, border).mean()) / 2)
    return float(np.sqrt(max(np.mean(squares), 0)))


def told_of_coding(light_field: LightField) -> str | None:
    """Message about views that show a coder's blocks; None if none do."""
    error = coding_error(light_field)
    if not error:
        return None
    noise = 255 * _noise_of(error)
    hidden = f"; noise of {noise:.1f}/255 is added to hide them" if noise else ""
    return (
        "the views were compressed with loss (they show blocks of 8x8 pixels, like JPEG's): the blocks have the same "
        f"place in all views, and draw regions of little texture to disparity 0{hidden}; use less compressed views if "
        "possible"
    )


def comparable(light_field: LightField) -> LightField:
    """The light field whose views all stages compare: equally bright, and without a coder's blocks."""
    return without_blocks(equally_bright(light_field))


def without_blocks(light_field: LightField) -> LightField:
    """The light field with noise that hides a coder's blocks; itself if none show, or they are faint.

    Parameters
    ----------
    light_field : LightField

    Returns
    -------
    LightField
        Views of the same dtype; the same noise each time.
    """
    views = light_field.views
    scale = full_scale(views.dtype)
    strength = np.float32(_noise_of(coding_error(light_field)) * scale)
    if not strength:
        return light_field
    noisy, random = np.array(views), np.random.default_rng(0)
    for place in map(tuple, np.argwhere(light_field.present).tolist()):
        view = views[place] + strength * random.standard_normal(views.shape[2:], np.float32)
        noisy[place] = np.clip(view, LOWEST, HIGHEST) if views.dtype == np.float32 else np.clip(np.rint(view), 0, scale)
    if light_field.missing is not None:
        noisy[light_field.missing] = views[light_field.missing]
    return replace(light_field, views=noisy)


def _noise_of(error: float) -> float:
    """Standard deviation of the noise that hides errors of a coder."""
    return _STRENGTH * float(np.sqrt(max(error**2 - _BORNE**2, 0)))
