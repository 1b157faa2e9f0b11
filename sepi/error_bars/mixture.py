"""Distribution of a pixel's error: mostly about the map, sometimes anywhere, and beside a step the other surface's.

The true disparity differs from the map's by

- noise and smoothing: a Laplace distribution of mean absolute value ``scale``;
- with probability ``outlier``, something that the map does not know of, such as another texture that looks alike, or
  what a glossy surface mirrors: a Laplace distribution of mean absolute value ``outlier_scale``;
- with probability ``rim``, the surface next to it: the nearest or the farthest disparity of the neighbours, ``above``
  or ``below``, whichever differs more being likelier, with a Laplace distribution of a fifth of that distance about it.

The bounds leave out a probability ``tail`` on either side. The standard deviation is that of a normal distribution of
the same expected absolute error: that of the mixture itself is decided by rare outliers.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from sepi.kernels import mixture as kernels
from sepi.lightfield import FloatMap

RIM_WIDTH: float = kernels.RIM_WIDTH
"""Mean absolute deviation of the other surface's disparity, as part of its distance."""

LEAST_RIM: float = kernels.LEAST_RIM
"""The least of it, pixels per view step."""


class Mixture(NamedTuple):
    """Parameters of each pixel's error; all of shape (H, W), float32.

    Attributes
    ----------
    scale : ndarray
        Mean absolute error where the map is about right, pixels per view step.
    outlier_scale : ndarray
        Mean absolute error of outliers, pixels per view step.
    outlier, rim : ndarray
        Probabilities.
    above, below : ndarray
        Distance of the other surface, pixels per view step, at least 0.
    """

    scale: FloatMap
    outlier_scale: FloatMap
    outlier: FloatMap
    rim: FloatMap
    above: FloatMap
    below: FloatMap


class Described(NamedTuple):
    """What a mixture comes to; all of shape (H, W), float32.

    Attributes
    ----------
    sigma : ndarray
        Standard deviation of a normal distribution of the same expected absolute error, pixels per view step.
    below, above : ndarray
        Distances of the lower and of the upper bound, pixels per view step, at least 0.
    probability : ndarray
        That the error is at most ``close``.
    """

    sigma: FloatMap
    below: FloatMap
    above: FloatMap
    probability: FloatMap


def described(mixture: Mixture, tail: float, close: float) -> Described:
    """Standard deviation, interval, and probability of a small error.

    Parameters
    ----------
    mixture : Mixture
    tail : float
        Probability beyond each bound.
    close : float
        Pixels per view step.

    Returns
    -------
    Described
    """
    out = np.empty((4, *mixture.scale.shape), np.float32)
    kernels.describe(mixture, tail, close, out)
    return Described(*out)
