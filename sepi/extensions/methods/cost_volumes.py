"""Converts a cost volume to a map: best candidate of each pixel, sub-candidate disparity, and confidence."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from sepi.lightfield import FloatMap
from sepi.stage import CostVolume


def least_costs(volume: CostVolume) -> npt.NDArray[np.int64]:
    """Index of the candidate of least cost of each pixel.

    Parameters
    ----------
    volume : CostVolume

    Returns
    -------
    ndarray, shape (H, W), int64
        Index into ``volume.disparities``; the first of equal costs.

    Examples
    --------
    >>> import numpy as np
    >>> from sepi.extensions.methods.cost_volumes import least_costs
    >>> from sepi.stage import CostVolume
    >>> volume = CostVolume(np.arange(3, dtype=np.float32), np.float16([[[0.9, 0.5]], [[0.1, 0.5]], [[0.9, 0.5]]]))
    >>> least_costs(volume).tolist()
    [[1, 0]]
    """
    return np.asarray(np.argmin(volume.costs, axis=0))


def disparity_of(volume: CostVolume, labels: npt.NDArray[np.int64]) -> FloatMap:
    """Disparity of the chosen candidates, refined by the parabola through the costs of each and its two neighbours.

    Parameters
    ----------
    volume : CostVolume
    labels : ndarray, shape (H, W), int64
        Numbers of candidates.

    Returns
    -------
    ndarray, shape (H, W), float32
        Pixels per view step. Candidates at an end of the range, or that are not a minimum, are not refined.

    Examples
    --------
    Costs that fall to a minimum at 1.25, between two candidates:

    >>> import numpy as np
    >>> from sepi.extensions.methods.cost_volumes import disparity_of, least_costs
    >>> from sepi.stage import CostVolume
    >>> candidates = np.arange(3, dtype=np.float32)
    >>> volume = CostVolume(candidates, ((candidates - 1.25) ** 2).astype(np.float16)[:, None, None])
    >>> disparity_of(volume, least_costs(volume)).tolist()
    [[1.25]]
    """
    below, here, above = _costs_round(volume, labels)
    curvature = below - 2 * here + above
    offset = np.where(curvature > 0, (below - above) / (2 * np.where(curvature > 0, curvature, 1)), 0)
    inner = (labels > 0) & (labels < len(volume.disparities) - 1) & (here <= below) & (here <= above)
    step = volume.disparities[1] - volume.disparities[0]
    return np.asarray(volume.disparities[labels] + step * np.where(inner, offset, 0), np.float32)


def distinctness(volume: CostVolume, labels: npt.NDArray[np.int64]) -> FloatMap:
    """Confidence: how far the chosen candidates' costs are below the mean over all candidates.

    Parameters
    ----------
    volume : CostVolume
    labels : ndarray, shape (H, W), int64
        Numbers of candidates.

    Returns
    -------
    ndarray, shape (H, W), float32
        As a fraction of the mean, 0..1: 1 for a unique perfect match, 0 if all candidates have the same cost.

    Examples
    --------
    >>> import numpy as np
    >>> from sepi.extensions.methods.cost_volumes import distinctness, least_costs
    >>> from sepi.stage import CostVolume
    >>> volume = CostVolume(np.arange(3, dtype=np.float32), np.float16([[[0.75, 0.5]], [[0, 0.5]], [[0.75, 0.5]]]))
    >>> distinctness(volume, least_costs(volume)).tolist()
    [[1.0, 0.0]]
    """
    mean = volume.costs.mean(axis=0, dtype=np.float32)
    least = volume.costs.min(axis=0).astype(np.float32)
    chosen = np.take_along_axis(volume.costs, labels[None], axis=0)[0].astype(np.float32)
    # costs may be negative
    spread = np.maximum(mean - np.minimum(least, 0), np.float32(1e-6))
    return np.asarray(np.clip((mean - chosen) / spread, 0, 1), np.float32)


def _costs_round(
    volume: CostVolume, labels: npt.NDArray[np.int64]
) -> tuple[npt.NDArray[np.float64], npt.NDArray[np.float64], npt.NDArray[np.float64]]:
    """Costs of the chosen candidate and of its neighbours, which repeat at the ends."""
    last = len(volume.disparities) - 1
    numbers = (np.clip(labels + step, 0, last) for step in (-1, 0, 1))
    below, here, above = (
        np.take_along_axis(volume.costs, number[None], axis=0)[0].astype(np.float64) for number in numbers
    )
    return below, here, above
