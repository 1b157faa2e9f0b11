"""Identifies the axes of an array from its pictures where its sizes are ambiguous.

An axis of 3 or 4 beside one of views may hold colours or a row of the grid: colours show no parallax against each
other, views do.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
import numpy.typing as npt

from sepi.inspection.view_layouts import MOVEMENT, Views, matched
from sepi.lightfield import LightField

# number of sequences of pictures, reductions for the search of movement, and its spacing
_SEQUENCES = 8
_REDUCTIONS = (1, 2, 4)
_SPACING = 0.3
# ratio of the matching cost in place to the least with movement: largest for colours, least for views
_COLOURS = 1.2
_VIEWS = 1.4
_COLOUR_COUNTS = (3, 4)


def fitting_axes(readings: Mapping[str, LightField]) -> str | None:
    """The order of axes in which an array's pictures match; None if ambiguous.

    Parameters
    ----------
    readings : mapping of str to LightField
        Orders of the axes, and the light field that the array is in each.
    """
    kept = [axes for axes, light_field in readings.items() if _is_consistent(light_field)]
    return kept[0] if len(kept) == 1 else None


def _is_consistent(light_field: LightField) -> bool:
    """Whether colours show no parallax, and views of an equally short row or column do."""
    views = light_field.views
    T, S, H, W, C = views.shape
    if C > 1 and not _parallax(np.moveaxis(views, 4, 2).reshape(-1, C, H, W)) <= _COLOURS:
        return False
    grey = views[..., C // 2]
    short = [np.moveaxis(grey, axis, 1).reshape(-1, n, H, W) for axis, n in enumerate((T, S)) if n in _COLOUR_COUNTS]
    return all(_parallax(pictures) >= _VIEWS for pictures in short)


def _parallax(pictures: npt.NDArray[np.generic]) -> float:
    """Ratio of the matching cost of pictures in place to that as a row or column of views; NaN if undecided.

    ``pictures`` are (K, M, H, W), K sequences of M.
    """
    pictures = pictures[:: max(1, len(pictures) // _SEQUENCES), ..., None]
    views, middle = Views(LightField(pictures, "pictures", arranged=False)), pictures.shape[1] // 2
    steps = np.array([step for step in range(-middle, pictures.shape[1] - middle) if step], np.float64)
    offsets = np.stack([np.stack([0 * steps, steps], 1), np.stack([steps, 0 * steps], 1)])
    best = np.nan
    for factor in (factor for factor in _REDUCTIONS if not views.is_too_small(factor)):
        costs = []
        for k in range(len(pictures)):
            places = [(k - views.middle[0], int(step) + middle - views.middle[1]) for step in (0, *steps)]
            found = [
                matched(views, places[0], places[1:], factor, offsets, movement, sampling=_SPACING)
                for movement in (MOVEMENT, 0)
            ]
            costs += [(*moved[0].mean(axis=0), still[0].mean()) for moved, still in [found] if moved and still]
        if costs:
            *moved, still = np.mean(costs, axis=0)
            best = np.fmax(best, still / max(min(moved), 1e-6))
    return float(best)
