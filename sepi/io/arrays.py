"""Light fields that arrive as one array."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from sepi.io.options import ReadOptions, arranged
from sepi.lightfield import LightField


def rearranged(light_field: LightField, options: ReadOptions) -> LightField:
    """A light field whose views are arranged as asked for; ground truth and masks stay with the view they belong to.

    Raises
    ------
    SepiError
        If the options do not fit its grid.
    """
    numbers = arranged(light_field.source or light_field.name, light_field.grid, options)
    T, S = light_field.grid
    if np.array_equal(numbers, np.arange(T * S).reshape(T, S)):
        return light_field
    # -1 picks the last view, which `present` then leaves out
    views = light_field.views.reshape(T * S, *light_field.views.shape[2:])[numbers]
    present = light_field.present.ravel()[numbers] & (numbers >= 0)
    t0, s0 = light_field.reference
    places = [(int(t), int(s)) for t, s in np.argwhere(numbers == t0 * S + s0)]
    if places:
        return replace(light_field, views=views, present=present, view=places[0])
    return replace(light_field, views=views, present=present, view=options.view, truth=None, masks={})
