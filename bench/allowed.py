"""Least standard deviation of a disparity that noise allows, by the Cramer-Rao bound.

A view at ``b`` view steps from the reference view has the colours ``c(p)`` at ``p - d b``, with its own noise. Colours
and disparity are both unknown. The Fisher information of such samples on the disparity is

``J = sum_channels sum_views (g_v - mean g)^2 / sigma^2``, with ``g_v = b_v . grad c``,

over the views that see the pixel. No unbiased estimate has a smaller variance than ``1 / J`` [1]_. Over a window of one
disparity, ``J`` adds up. Further assumptions, such as smooth surfaces, may give a smaller variance where they hold.

References
----------
.. [1] S. M. Kay: Fundamentals of Statistical Signal Processing: Estimation Theory. 1993, sections 3.4 and 3.7.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
from scipy.optimize import brentq
from scipy.special import erf

from sepi.lightfield import FloatMap, LightField
from sepi.matching.aligned_views import AlignedViews
from sepi.matching.base_detail import BaseDetailParameters
from sepi.matching.gauss_newton import spline_derivatives
from sepi.scoring.scores import BAD_PIXEL
from sepi.stage import OcclusionMarginParameters

Deviations = npt.NDArray[np.float64]

_MOST = 1000.0
"""Largest quartile of errors, pixels per view step."""


def deviations_allowed(light_field: LightField, sigma: float, radius: int = 0) -> Deviations:
    """Least standard deviation of a disparity that noise allows.

    Parameters
    ----------
    light_field : LightField
        With ground truth; its views count as free of noise.
    sigma : float
        Standard deviation of the noise of one channel of each view, colours in 0..1.
    radius : int
        Information adds up over the pixels of a window of ``2 radius + 1`` on one surface of the truth.

    Returns
    -------
    ndarray, shape (H, W), float64
        Pixels per view step; infinite without information, NaN without truth.
    """
    truth = np.asarray(light_field.ground_truth, np.float32)
    known = np.isfinite(truth)
    disparity = np.where(known, truth, np.float32(np.median(truth[known])))
    margin = OcclusionMarginParameters().occlusion_margin
    mean = AlignedViews(light_field, BaseDetailParameters(use_detail=False), margin).mean(disparity)
    # grey has three channels with the same noise
    mean = np.ascontiguousarray(mean[..., : light_field.views.shape[-1]])
    down, across = (slope.astype(np.float64) for slope in spline_derivatives(mean))
    of_v, of_both, of_u = (each[..., None] for each in _spreads_of_baselines(light_field, disparity, margin))
    information = (of_v * down**2 + of_both * down * across + of_u * across**2).sum(axis=2)
    told = _over_windows(np.where(known, np.maximum(information, 0.0), 0.0), disparity, radius, margin)
    allowed = np.full(truth.shape, np.inf)
    np.divide(sigma, np.sqrt(told), out=allowed, where=told > 0)
    return np.where(known, allowed, np.nan)


def scores_allowed(deviations: Deviations) -> dict[str, float]:
    """Expected scores of a map with normal errors of these standard deviations.

    Returns
    -------
    dict
        ``q25`` and ``badpix007`` as in :func:`sepi.scoring.scores.score`.
    """
    known = deviations[~np.isnan(deviations)]

    def share_within(error: float) -> float:
        return float(erf(error / np.sqrt(2) / np.maximum(known, 1e-12)).mean())

    quartile = brentq(lambda error: share_within(error) - 0.25, 0, _MOST) if share_within(_MOST) > 0.25 else np.inf
    return {"q25": 100 * quartile, "badpix007": 100 * (1 - share_within(BAD_PIXEL["badpix007"]))}


def _spreads_of_baselines(
    light_field: LightField, disparity: FloatMap, margin: float
) -> tuple[Deviations, Deviations, Deviations]:
    """Sums of ``v^2``, ``2 v u`` and ``u^2`` about their means, over the views that see each pixel."""
    H, W = disparity.shape
    y, x = np.mgrid[:H, :W]
    number, sums, products = np.zeros((H, W)), np.zeros((2, H, W)), np.zeros((3, H, W))
    for t, s in np.argwhere(light_field.present).tolist():
        v, u = light_field.baselines[t, s]
        row, column = np.floor(y - disparity * v + 0.5).astype(int), np.floor(x - disparity * u + 0.5).astype(int)
        inside = (row >= 0) & (row < H) & (column >= 0) & (column < W)
        row, column = row.clip(0, H - 1), column.clip(0, W - 1)
        # a bound must include every view that may see the pixel
        nearest = np.full((H, W), -np.inf, np.float32)
        np.maximum.at(nearest, (row[inside], column[inside]), disparity[inside])
        sees = inside & (nearest[row, column] <= disparity + margin)
        number += sees
        sums += sees * np.array([v, u])[:, None, None]
        products += sees * np.array([v * v, 2 * v * u, u * u])[:, None, None]
    of_mean = np.stack([sums[0] ** 2, 2 * sums[0] * sums[1], sums[1] ** 2]) / np.maximum(number, 1)
    return tuple(products - of_mean)


def _over_windows(information: Deviations, disparity: FloatMap, radius: int, margin: float) -> Deviations:
    """Sums over the pixels of each window that are on the surface of its middle pixel."""
    if not radius:
        return information
    padded, depths = np.pad(information, radius), np.pad(disparity, radius)
    H, W = disparity.shape
    total = np.zeros((H, W))
    for dy in range(2 * radius + 1):
        for dx in range(2 * radius + 1):
            alike = np.abs(depths[dy : dy + H, dx : dx + W] - disparity) <= margin
            total += alike * padded[dy : dy + H, dx : dx + W]
    return total
