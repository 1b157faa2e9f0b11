"""Pixels whose depth no neighbour shares.

A surface is seen in more than one pixel, but for the rare tip: a pixel that stands alone is one whose matching went
astray, mostly beside an edge, where few views see it. It joins the neighbour whose colour is most like its own.
"""

from __future__ import annotations

import numpy as np

from sepi.lightfield import FloatMap

_NEIGHBOURS = [(dy, dx) for dy in (-1, 0, 1) for dx in (-1, 0, 1) if dy or dx]


def join_isolated_pixels(disparity: FloatMap, colours: FloatMap, difference: float) -> FloatMap:
    """Disparity in which no pixel stands alone.

    Parameters
    ----------
    disparity : ndarray, shape (H, W), float32
        Pixels per view step.
    colours : ndarray, shape (H, W, 3), float32
        0..1.
    difference : float
        How much nearer or farther than each of its neighbours a pixel that stands alone is, pixels per view step.

    Returns
    -------
    ndarray, shape (H, W), float32
    """
    height, width = disparity.shape
    padded = np.pad(disparity, 1, constant_values=np.nan)
    around = np.stack([padded[1 + dy : 1 + dy + height, 1 + dx : 1 + dx + width] for dy, dx in _NEIGHBOURS])
    # beyond the border there is none that could share it
    y, x = np.nonzero(~(np.abs(around - disparity) <= difference).any(axis=0))
    beside = np.stack([colours[(y + dy).clip(0, height - 1), (x + dx).clip(0, width - 1)] for dy, dx in _NEIGHBOURS])
    unlike = ((beside - colours[y, x]) ** 2).sum(axis=2)
    values = around[:, y, x]
    best = np.where(np.isnan(values), np.inf, unlike).argmin(axis=0)
    joined = disparity.copy()
    joined[y, x] = values[best, np.arange(len(y))]
    return joined
