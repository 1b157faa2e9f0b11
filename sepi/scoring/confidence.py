"""Sparsification curves [1]_: how well confidence ranks pixels by error.

References
----------
.. [1] Ilg et al.: Uncertainty estimates and multi-hypotheses networks for optical flow. ECCV 2018.
   doi:10.1007/978-3-030-01234-2_40
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from sepi.lightfield import FloatMap
from sepi.validation import require_type

STEPS = 100
"""Number of points of a sparsification curve."""

FloatArray = npt.NDArray[np.float64]


def sparsification(confidence: FloatMap, error: FloatMap) -> FloatArray:
    """Mean absolute error of the pixels that remain after the least confident ones are removed [1]_.

    Parameters
    ----------
    confidence, error : ndarray, shape (H, W), float32
        0..1; estimate minus ground truth in pixels per view step, ``error`` of
        :class:`sepi.io.scores.Evaluation`. Pixels whose error is not finite are left out.

    Returns
    -------
    ndarray, shape (100,), float64
        Times 100; with 0, 1, ... 99 % of the pixels taken away. NaN where no error is finite.

    References
    ----------
    .. [1] Ilg et al.: Uncertainty estimates and multi-hypotheses networks for optical flow. ECCV 2018.
       doi:10.1007/978-3-030-01234-2_40

    Examples
    --------
    The curve of a useful confidence falls:

    >>> import sepi
    >>> from sepi.evaluate import evaluation_of
    >>> from sepi.scoring.confidence import sparsification
    >>> from sepi.scenes import render
    >>> light_field = render("curved_occluders", size=96, views=5)
    >>> maps = sepi.estimate_depth(light_field)
    >>> curve = sparsification(maps.confidence, evaluation_of(light_field, maps.disparity).error)
    >>> curve.shape, bool(curve[50] < 0.2 * curve[0])
    ((100,), True)
    """
    for name, values in (("confidence", confidence), ("error", error)):
        require_type(name, values, np.ndarray, "an array of numbers")
    sums = np.cumsum(np.abs(_by_confidence(confidence, error)))
    if sums.size == 0:
        return np.full(STEPS, np.nan)
    kept = np.maximum(1, np.rint(sums.size * (1 - np.arange(STEPS) / STEPS))).astype(np.int64)
    return np.asarray(100 * sums[kept - 1] / kept)


def oracle(error: FloatMap) -> FloatArray:
    """The lowest possible curve of :func:`sparsification`: pixels are removed in order of their error.

    Parameters
    ----------
    error : ndarray, shape (H, W), float32
        Estimate minus ground truth in pixels per view step.

    Returns
    -------
    ndarray, shape (100,), float64
        Times 100; with 0, 1, ... 99 % of the pixels taken away. NaN where no error is finite.

    Examples
    --------
    >>> import numpy as np
    >>> from sepi.scoring.confidence import oracle, sparsification
    >>> error = np.array([[0.0, 0.1], [0.2, 0.3]], np.float32)
    >>> [round(value, 3) for value in oracle(error)[[0, 25, 50, 75]].tolist()]
    [15.0, 10.0, 5.0, 0.0]
    >>> ignorant = sparsification(np.ones((2, 2), np.float32), error)  # in the order of the pixels
    >>> bool((oracle(error) <= ignorant).all())
    True
    """
    require_type("error", error, np.ndarray, "an array of numbers")
    return sparsification(-np.abs(error), error)


def _by_confidence(confidence: FloatMap, error: FloatMap) -> FloatArray:
    known = np.isfinite(error)
    order = np.argsort(-confidence[known], kind="stable")
    return np.asarray(error[known][order], np.float64)
