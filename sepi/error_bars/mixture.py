"""Distribution of a pixel's error: a mixture of small errors, outliers and, beside a step, the other surface.

The true disparity is distributed around

- the map's, by noise and smoothing: a Laplace distribution of mean absolute error ``scale``;
- the map's, with probability ``outlier``, where similar texture or a specular surface misleads the matching: a Laplace
  distribution of mean absolute error ``outlier_scale``;
- that of the surface beside the pixel, with probability ``rim``: the nearest or the farthest neighbour, at the distance
  ``above`` or ``below``; the larger distance is more likely, and the mean absolute error is a fifth of it.

The bounds leave out a probability ``tail`` on each side. ``sigma`` is the standard deviation of a normal distribution
with the same expected absolute error, since rare outliers dominate the standard deviation of the mixture itself.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from sepi.kernels import mixture as kernels
from sepi.lightfield import FloatMap

RIM_WIDTH: float = kernels.RIM_WIDTH
"""Mean absolute error about the other surface's disparity, as a share of its distance."""

LEAST_RIM: float = kernels.LEAST_RIM
"""Least mean absolute error about the other surface's disparity, pixels per view step."""


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
        Distance to the nearest and to the farthest neighbour, pixels per view step, at least 0.
    """

    scale: FloatMap
    outlier_scale: FloatMap
    outlier: FloatMap
    rim: FloatMap
    above: FloatMap
    below: FloatMap


class Described(NamedTuple):
    """Summary of a mixture; all of shape (H, W), float32.

    Attributes
    ----------
    sigma : ndarray
        Standard deviation of a normal distribution of the same expected absolute error, pixels per view step.
    below, above : ndarray
        Distances of the lower and of the upper bound, pixels per view step, at least 0.
    probability : ndarray
        Probability that the error is at most ``close``.
    """

    sigma: FloatMap
    below: FloatMap
    above: FloatMap
    probability: FloatMap


def described(mixture: Mixture, tail: float, close: float) -> Described:
    """Standard deviation, bounds, and probability of a small error.

    Parameters
    ----------
    mixture : Mixture
    tail : float
        Probability beyond each bound.
    close : float
        Error that counts as small, pixels per view step.

    Returns
    -------
    Described
    """
    out = np.empty((4, *mixture.scale.shape), np.float32)
    kernels.describe(mixture, tail, close, out)
    return Described(*out)
