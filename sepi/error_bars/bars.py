"""Error bars of a final map, from cues of error by a calibrated model.

The error of a pixel has the distribution of :mod:`sepi.error_bars.mixture`. Its scales and the odds of its
probabilities are products of powers of the cues (:mod:`sepi.error_bars.cues`), with the exponents of
:mod:`sepi.error_bars.calibration`. docs/method/error_bars.md derives the model and states its limits.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from sepi.error_bars.calibration import CONSTANT, Calibration
from sepi.error_bars.cues import FLOORS, Cues
from sepi.error_bars.mixture import Mixture, described
from sepi.lightfield import DisparityRange, FloatMap
from sepi.stage import CLOSE

TAIL = 0.05
"""Probability beyond each bound."""

_LOGARITHMS = (-9.0, 9.0)
"""Limits of the logarithms of scales, in pixels per view step, and odds."""


def error_bars(disparity: FloatMap, cues: Cues, known: DisparityRange, calibration: Calibration) -> dict[str, FloatMap]:
    """Error bars of a disparity map.

    Parameters
    ----------
    disparity : ndarray, shape (H, W), float32
        Pixels per view step; the farthest view is four view steps away.
    cues : mapping of str to ndarray, shape (H, W), float32
        Cues of :mod:`sepi.error_bars.cues`, at least those of the calibration.
    known : DisparityRange
        The interval stays within it.
    calibration : Calibration

    Returns
    -------
    dict of str to ndarray, shape (H, W), float32
        ``sigma``: standard deviation, pixels per view step, as :mod:`sepi.error_bars.mixture` defines it; ``low`` and
        ``high``: interval that holds the disparity with a probability of 90 %, pixels per view step; ``confidence``:
        probability that the error is at most :data:`sepi.stage.CLOSE`.
    """
    mixture = mixture_of(cues, calibration)
    found = described(mixture, TAIL, CLOSE)
    lowest, highest = np.float32(known.minimum), np.float32(known.maximum)
    low = np.minimum(np.maximum(disparity - found.below, lowest), disparity)
    high = np.maximum(np.minimum(disparity + found.above, highest), disparity)
    return {"sigma": found.sigma, "low": low, "high": high, "confidence": found.probability}


def mixture_of(cues: Cues, calibration: Calibration) -> Mixture:
    """Parameters of the distribution of each pixel's error.

    Parameters
    ----------
    cues : mapping of str to ndarray, shape (H, W), float32
    calibration : Calibration

    Returns
    -------
    Mixture
    """
    logarithms = {
        name: np.log(np.maximum(cues[name], np.float32(FLOORS[name])))
        for name in sorted({name for part in calibration for name in part} - {CONSTANT})
    }

    def exponential(powers: Mapping[str, float]) -> FloatMap:
        total = np.full_like(cues["above"], powers[CONSTANT])
        for name, power in powers.items():
            if name != CONSTANT:
                total += np.float32(power) * logarithms[name]
        return np.asarray(np.exp(np.clip(total, *_LOGARITHMS)), np.float32)

    outlier, rim = exponential(calibration.outlier), exponential(calibration.rim)
    whole = 1 + outlier + rim
    scale, outlier_scale = exponential(calibration.scale), exponential(calibration.outlier_scale)
    return Mixture(scale, outlier_scale, outlier / whole, rim / whole, cues["above"], cues["below"])
