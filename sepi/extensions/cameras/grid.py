"""Rows and columns of a grid for cameras at any positions."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from sepi.camera.rig import Floats

# least share of a grid's places with a camera
_FULL = 0.55
# largest row spacing in view steps, and sampling of the spacings tried
_SPACINGS = np.geomspace(0.25, 4.0, 161)
# largest mean distance of cameras from a grid's places, relative to its steps; random positions have 0.25
_NEAR = 0.19
_NO_WORSE = 0.02


def grid_of(baselines: Floats) -> npt.NDArray[np.int64]:
    """Row and column (N, 2) of each view, counted from 0, given the baselines ``(down, across)`` in view steps.

    The regular grid near which the cameras stand; without one, a single row in the order of their positions.
    """
    row, column = (_numbers(baselines[:, axis]) for axis in (0, 1))
    best: npt.NDArray[np.int64] | None = None
    if row is not None and column is not None:
        best = np.column_stack([row, column])
        shape = best.max(axis=0) + 1
        taken = len(np.unique(best, axis=0))
        if taken < len(best) or taken < _FULL * shape.prod():
            best = None
    if best is not None:
        return best
    # along the longer axis, or the cameras' path
    order = np.lexsort((baselines[:, 0], baselines[:, 1]))
    if np.ptp(baselines[:, 0]) > np.ptp(baselines[:, 1]):
        order = np.lexsort((baselines[:, 1], baselines[:, 0]))
    numbers = np.empty(len(order), np.int64)
    numbers[order] = np.arange(len(order))
    return np.column_stack([np.zeros_like(numbers), numbers])


def _numbers(along: Floats) -> npt.NDArray[np.int64] | None:
    """Number of each camera's step along an axis, from 0; None without regular steps."""
    if np.ptp(along) < _SPACINGS[0]:
        return np.zeros(len(along), np.int64)
    angle = 2 * np.pi * along / _SPACINGS[:, None]
    first = np.angle(np.exp(1j * angle).mean(axis=1)) / (2 * np.pi)
    steps = along / _SPACINGS[:, None] - first[:, None]
    stray = np.abs(steps - np.rint(steps)).mean(axis=1)
    padded = np.pad(stray, 1, constant_values=1.0)
    lowest = (stray <= padded[:-2]) & (stray <= padded[2:]) & (stray < min(_NEAR, stray.min() + _NO_WORSE))
    if not lowest.any():
        return None
    # a finer grid fits as well
    numbers = np.rint(steps[np.flatnonzero(lowest)[-1]]).astype(np.int64)
    return numbers - numbers.min() if np.ptp(numbers) else None
