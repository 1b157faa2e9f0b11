"""Estimates the spacing of rows of views, as a multiple of that of columns, from the views alone.

A camera gantry may use different vertical and horizontal steps. Points of one view are matched with views above, below
and beside it, for each spacing and layout tried: in the right one, all views agree on one disparity for each point.
"""

from __future__ import annotations

import math
from dataclasses import replace
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from sepi.inspection.view_layouts import (
    AT_END,
    FEWEST_POINTS,
    MATCHED,
    MOVEMENT,
    Baseline,
    Views,
    baselines_under,
    is_clear,
    matched,
    ring,
    search_distances,
)
from sepi.lightfield import LightField

# Spacings tried, and how many between one and its double
_MOST = 4.0
_PER_OCTAVE = 4
# Number of points to distinguish spacings, and to measure the one found
_POINTS_TO_TELL, _POINTS_TO_CHOOSE = 80, 150
# Layouts up to the sign
_ORDERS = ("as-given", "flip-rows", "transpose", "transpose-flip-rows")
# Movement in the farthest view, pixels: spacing where movements are compared, and the most when the spacing is measured
_FINE_SAMPLING = 0.1
_MOST_MOVEMENT = 80.0
# Rounds of measuring, and spacings to each side of the last round's best
_ROUNDS = 2
_EACH_SIDE = 4
# Smaller differences are not reported: they are within the measurement error
_LEAST_DIFFERENCE = 0.04
# Spacings within this factor of one need a second test: interpolation smooths noise, and decoded lenslet pictures are
# shifted by a few hundredths of a pixel; either can favour a spacing that is a tenth off
_DOUBTED = 1.25


def settle_row_spacing(light_field: LightField, views: Views | None = None) -> LightField:
    """The light field with the row spacing estimated from its views, and a note; unchanged if that fails.

    Nothing is done where a spacing or positions of the views are known already. ``views``: its views, where they are
    looked at otherwise, too.
    """
    if light_field.settled or light_field.positions is not None or light_field.row_spacing != 1:
        return light_field
    spacing = estimate_row_spacing(views or Views(light_field))
    if spacing is None:
        return light_field
    spacing = round(spacing, 3)
    note = f"rows of views are {spacing:g} times as far apart as columns (estimated); set it by --row-spacing"
    return replace(light_field, row_spacing=spacing, notes=(*light_field.notes, note))


class _Trial(NamedTuple):
    """Best spacing from the views at one distance."""

    spacing: float
    order: str
    baselines: list[Baseline]
    movement: float
    clear: bool


def estimate_row_spacing(views: Views) -> float | None:
    """Distance of rows in view steps, if another than that of columns fits clearly better.

    Parameters
    ----------
    views : Views
        Their own row spacing is not used.

    Returns
    -------
    float or None
        For the order in which the light field was read. None if rows are as far apart as columns, there is only one
        row or column, or the spacing is unclear.
    """
    for reach, factor in search_distances(views):
        trial = _tried(views, reach, factor)
        if trial is not None:
            measured = _measured(views, trial) if trial.clear else 1.0
            if abs(math.log(measured)) < _LEAST_DIFFERENCE:
                return None
            near = abs(math.log(measured)) < math.log(_DOUBTED)
            return None if near and not _is_seen_in_movements(views, trial, measured) else measured
    return None


def _tried(views: Views, reach: int, factor: int) -> _Trial | None:
    """The best spacing from views at this distance; None if unclear.

    It is clear if it fits clearly better than equal spacing in any layout.
    """
    baselines = views.worth_matching(ring(views.baselines, reach))
    if not any(t for t, _ in baselines) or not any(s for _, s in baselines) or views.is_too_small(factor):
        return None
    count = round(_PER_OCTAVE * math.log2(_MOST))
    spacings = [2 ** (n / _PER_OCTAVE) for n in range(-count, count + 1)]
    # most light fields are in order, and their rows as far apart as their columns: a few hypotheses tell
    hypotheses = [(_ORDERS[0], spacing) for spacing in (0.5, 1.0, 2.0)]
    found = matched(views, (0, 0), baselines, factor, _offsets(baselines, hypotheses), MOVEMENT, _POINTS_TO_TELL)
    if found is None or not all(is_clear(found[0][:, 1], found[0][:, other]) for other in (0, 2)):
        hypotheses = [(order, spacing) for order in _ORDERS for spacing in spacings]
    else:
        hypotheses = [(_ORDERS[0], spacing) for spacing in spacings]
    found = matched(views, (0, 0), baselines, factor, _offsets(baselines, hypotheses), MOVEMENT, _POINTS_TO_CHOOSE)
    if found is None:
        return None
    cost, movement = found
    mean = cost.mean(axis=0)
    best = int(mean.argmin())
    usual = min((n for n, (_, spacing) in enumerate(hypotheses) if spacing == 1), key=lambda n: mean[n])
    moved = abs(movement[cost[:, best] < MATCHED, best])
    if moved.size < FEWEST_POINTS or np.quantile(moved, 1 - AT_END) > 0.95 * MOVEMENT:
        return None
    order, spacing = hypotheses[best]
    clear = is_clear(cost[:, best], cost[:, usual])
    return _Trial(spacing, order, baselines, factor * float(moved.max()), clear)


def _measured(views: Views, trial: _Trial) -> float:
    """The spacing of a trial, to about a hundredth."""
    spacing, width = trial.spacing, 1 / _PER_OCTAVE
    for _ in range(_ROUNDS):
        tried = [spacing * 2 ** (width * n / _EACH_SIDE) for n in range(-_EACH_SIDE, _EACH_SIDE + 1)]
        offsets = _offsets(trial.baselines, [(trial.order, one) for one in tried])
        found = matched(views, (0, 0), trial.baselines, 1, offsets, min(trial.movement + 1, _MOST_MOVEMENT))
        if found is None:
            return spacing
        spacing = tried[int(found[0].mean(axis=0).argmin())]
        width /= _EACH_SIDE
    return spacing


def _is_seen_in_movements(views: Views, trial: _Trial, spacing: float) -> bool:
    """Whether the ratio of points' movements along columns of views to those along rows is that, surely not one.

    A line through both movements may miss the origin, so that a shift of all views does not count.
    """
    # here, since it takes a while to load, and hardly any light field needs it
    from scipy.stats import theilslopes

    movements, fits = [], []
    for axis in (0, 1):
        along = [baseline for baseline in trial.baselines if baseline[1 - axis] == 0]
        if not along:
            return False
        offsets = _offsets(along, [(trial.order, 1.0)])
        found = matched(views, (0, 0), along, 1, offsets, trial.movement + 1, sampling=_FINE_SAMPLING)
        if found is None:
            return False
        cost, moved = found
        movements.append(moved[:, 0] / max(abs(baseline[axis]) for baseline in along))
        fits.append(cost[:, 0] < MATCHED)
    both = fits[0] & fits[1]
    if both.sum() < FEWEST_POINTS or not np.ptp(movements[1][both]):
        return False
    # where nearly all movements are the same its interval is none, and no number is nearer than that
    with np.errstate(invalid="ignore"):
        line = theilslopes(movements[0][both], movements[1][both])
    # all of the slope's interval of confidence is nearer to the spacing than to one
    middle = math.sqrt(spacing)
    return bool(line.low_slope > middle if spacing > 1 else line.low_slope > 0 and line.high_slope < middle)


def _offsets(baselines: list[Baseline], hypotheses: list[tuple[str, float]]) -> npt.NDArray[np.float64]:
    """Baselines (L, V, 2) under each order and spacing, in units of the longest: all search the same movement."""
    laid = [baselines_under(order, np.array(baselines, np.float64) * (spacing, 1)) for order, spacing in hypotheses]
    return np.stack([offsets / abs(offsets).max() for offsets in laid])
