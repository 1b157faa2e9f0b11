"""Depth discontinuities for evaluation, and the fattening and thinning of surfaces next to them.

The region and the two measures follow the idea of the HCI 4D light field benchmark's [1]_ measures for discontinuities
and fine structures, but are defined from the ground truth alone. Estimators never see them.

References
----------
.. [1] Honauer et al.: A dataset and evaluation methodology for depth estimation on 4D light fields. ACCV 2016.
   doi:10.1007/978-3-319-54187-7_2
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from sepi.lightfield import BoolMap, FloatMap
from sepi.validation import require_map

LEAST_DISCONTINUITY = 0.125
"""Minimum difference of neighbours in pixels per view step; half a pixel in the outermost of 9 x 9 views."""

REACH = 2
"""Width in pixels of the region on each side of a depth discontinuity."""


@dataclass(frozen=True)
class Edges:
    """Ground truth of the pixels near depth discontinuities.

    Attributes
    ----------
    region : ndarray, shape (H, W), bool
        Pixels within ``REACH`` of a depth discontinuity.
    middle : ndarray, shape (H, W), float32
        In the region, the disparity half way between the nearest and the most distant surface within ``REACH``.
    foreground : ndarray, shape (H, W), bool
        Pixels of the region that are nearer than ``middle``; its other pixels with ground truth are background.

    Examples
    --------
    >>> from sepi.scenes import render
    >>> from sepi.scoring.edges import Edges, edges_of
    >>> edges = edges_of(render("fronto_parallel", size=64, views=2).ground_truth)
    >>> isinstance(edges, Edges), int(edges.region.sum())  # one plane has no discontinuity
    (True, 0)
    """

    region: BoolMap
    middle: FloatMap
    foreground: BoolMap


def edges_of(ground_truth: FloatMap) -> Edges:
    """The depth discontinuities of a disparity map.

    Parameters
    ----------
    ground_truth : ndarray, shape (H, W), float32
        Disparity in pixels per view step. Non-finite pixels neither form discontinuities nor belong to the region.

    Returns
    -------
    Edges

    Examples
    --------
    >>> import numpy as np
    >>> from sepi.scoring.edges import edges_of
    >>> truth = np.zeros((3, 8), np.float32)
    >>> truth[:, 4:] = 1
    >>> edges = edges_of(truth)
    >>> edges.region[0].astype(int).tolist(), edges.foreground[0].astype(int).tolist()
    ([0, 0, 1, 1, 1, 1, 0, 0], [0, 0, 0, 0, 1, 1, 0, 0])
    >>> edges.middle[0, 2:6].tolist()
    [0.5, 0.5, 0.5, 0.5]
    """
    # slow to import, and tables do not need it
    require_map("ground truth", ground_truth)
    from scipy import ndimage

    known = np.isfinite(ground_truth)
    beside = np.zeros(ground_truth.shape, bool)
    for axis in (0, 1):
        values, marked = np.moveaxis(ground_truth, axis, 0), np.moveaxis(beside, axis, 0)
        both = np.isfinite(values[1:]) & np.isfinite(values[:-1])
        apart = np.abs(np.subtract(values[1:], values[:-1], out=np.zeros_like(values[1:]), where=both))
        marked[1:] |= apart > LEAST_DISCONTINUITY
        marked[:-1] |= apart > LEAST_DISCONTINUITY
    region = ndimage.binary_dilation(beside, np.ones((3, 3), bool), REACH - 1) & known
    side = 2 * REACH + 1
    nearest = ndimage.maximum_filter(np.where(known, ground_truth, -np.inf), side, mode="nearest")
    farthest = ndimage.minimum_filter(np.where(known, ground_truth, np.inf), side, mode="nearest")
    middle = np.full(ground_truth.shape, np.nan, np.float32)
    middle[region] = (nearest[region] + farthest[region]) / 2
    return Edges(region, middle, region & (ground_truth > middle))


def fattening_and_thinning(estimate: FloatMap, edges: Edges, chosen: BoolMap) -> tuple[float, float]:
    """How often an estimate is on the wrong side of a depth discontinuity.

    Parameters
    ----------
    estimate : ndarray, shape (H, W), float32
        Disparity in pixels per view step; NaN counts for neither side.
    edges : Edges
        Depth discontinuities of the ground truth.
    chosen : ndarray, shape (H, W), bool
        Pixels to score.

    Returns
    -------
    fattening : float
        Percentage of background pixels whose estimate is nearer than the middle; NaN without background.
    thinning : float
        Percentage of foreground pixels whose estimate is more distant than it; NaN without foreground.

    Examples
    --------
    The estimated edge is one pixel too far out: half of the background in the region is fattened.

    >>> import numpy as np
    >>> from sepi.scoring.edges import edges_of, fattening_and_thinning
    >>> truth = np.zeros((3, 8), np.float32)
    >>> truth[:, 4:] = 1
    >>> estimate = np.zeros((3, 8), np.float32)
    >>> estimate[:, 3:] = 1
    >>> fattening_and_thinning(estimate, edges_of(truth), np.ones(truth.shape, bool))
    (50.0, 0.0)
    """
    behind = chosen & edges.region & ~edges.foreground
    before = chosen & edges.foreground
    return _percentage(estimate[behind] > edges.middle[behind]), _percentage(estimate[before] < edges.middle[before])


def _percentage(flags: BoolMap) -> float:
    return 100 * float(flags.mean()) if flags.size else math.nan
