"""The fast method of Mishiba [1]_: one-bit features of few views, interpolated costs, weighted medians.

``mishiba``, a choice of the initial depth, saves computation in three ways. Each view becomes a bit map, so that all
pairs of views are compared by counting; only a few views are used, selected independently of the scene; and costs are
computed for few pixels and candidates and interpolated. ``median_descent``, a choice of the global optimisation,
minimises absolute differences to these disparities and between neighbours by a weighted median filter.

Equations, with views ``I_i`` in grey, ``i = 1..n``, and baselines ``b_i``:

- bit of view ``i`` at ``x``: ``f_i(x) = 1`` where ``(I_i - G * I_i)(x) > 0``, else 0, with a Gaussian ``G``;
- cost of candidate ``d`` at the reference pixel ``p``: ``C(p, d) = sum over i < j of |f_i - f_j|``, the bits taken at
  ``p - d b``. With ``m`` ones among the ``n`` bits it is ``m (n - m)``: one count replaces ``n (n - 1) / 2``
  comparisons. Here it is divided by its largest value;
- interpolated costs: on a lattice of pixels, costs are fitted as linear functions of the reference view's colours in
  each window (guided filter); these functions, not the costs, are interpolated to all pixels;
- disparity: least cost, and the parabola through it and its neighbours; confidence ``c = 1 - least / mean`` over the
  candidates;
- energy of the refinement, with the first disparities ``D0``:
  ``E(D) = sum over p of c_p |D_p - D0_p| + sum over pairs of w_pq |D_p - D_q|`` with
  ``w_pq = s / N exp(-|I_p - I_q|^2 / 2 sigma^2)``, ``N`` the neighbours of a pixel. With all other pixels fixed, the
  best ``D_p`` is the weighted median of ``D0_p`` (weight ``c_p``) and of its neighbours ``D_q`` (weight ``w_pq``).
  All pixels are updated at once, which approximates the result of graph cuts.

The publication's abstract states the one-bit feature, the sum over all combinations of views by a fast algorithm, the
offline selection of views, the interpolation of the cost volume, the energy of l1 data and smoothness terms, and its
approximate solver by a fast weighted median filter. No more could be confirmed; the following was chosen here:

- the feature: the sign of the difference to a Gaussian mean, which does not depend on a view's brightness. It is taken
  after resampling (cubic convolution), so that shifts need not be whole pixels. Views have no bit for pixels beyond
  their border;
- the views: the row and the column of the reference view. Their pairs have baselines in every direction, and an
  occluder hides a smaller share of them than of all views. All views are used if only the reference view and at most
  one other are there, and for a single row or column of views;
- the interpolation: between pixels with colours as guide, as in a fast guided filter [2]_, which also aggregates the
  costs; between candidates by the parabola;
- the candidates: one for each 0.3 pixels in the farthest view;
- the energy: confidences as data weights, the window and the weights of neighbours. The scale of colour distances
  increases with the noise of the reference view, as elsewhere in this package;
- the fast weighted median: weights and disparities are integers, so that bisection finds it exactly, without sorting
  and independently of the number of threads.

References
----------
.. [1] Mishiba: Fast depth estimation for light field cameras. IEEE TIP 29, pp. 4232-4242, 2020.
.. [2] He, Sun: Fast guided filter. arXiv:1505.00996, 2015.
"""

import cv2
import numpy as np
import numpy.typing as npt
from pydantic import Field

from sepi.extensions.methods.costs import GREY, GuidedFilter
from sepi.image.noise import residual_variance
from sepi.kernels import mishiba as kernels
from sepi.kernels import sheared_views
from sepi.lightfield import BoolMap, FloatMap, LightField, as_unit_float
from sepi.matching.candidates import CandidateParameters, CandidateRule, number_field
from sepi.stage import Choice, Parameters, Progress, StageMaps, require_previous

TIE = 1e-5
"""Tolerance for rounding errors in the comparison with the mean, grey values 0..1."""

NO_COST = 1e-3
"""Added to costs in the confidence, so that it is 0 for textureless surfaces."""

LEVELS = 1 << 16
"""Number of integer levels of disparity in the medians."""

FULL_WEIGHT = 1 << 20
"""Integer for a weight of 1; a window's weights sum to less than 2^31."""

TABLE_ENTRIES = 512
"""Entries of the table of weights by colour distance, up to four times the scale, where they are negligible."""


class MishibaParameters(CandidateParameters):
    """Parameters of the costs of one-bit features."""

    # spacing of 0.3 pixels in the farthest view, where a minimum of the costs is about one pixel wide
    rule = CandidateRule(usual=64, finest=0.3, coarsest=0.3)

    num_disparities: int | None = number_field(rule, "docs/reproduce/compared.md")
    feature_sigma: float = Field(1.0, gt=0, le=10, description="sigma of the mean that a pixel's bit exceeds, pixels")
    lattice_step: int = Field(2, ge=1, le=8, description="distance of pixels whose costs are not interpolated, pixels")
    radius: int = Field(3, ge=1, le=50, description="window in which colours fit the costs, 2 r + 1 of these pixels")
    epsilon: float = Field(1e-4, gt=0, description="variance of colour above which edges are kept, colours in 0..1")


class MedianDescentParameters(Parameters):
    """Parameters of the refinement by weighted medians."""

    smoothness: float = Field(1.2, ge=0, le=100, description="weight of all neighbours of one colour; data has 0..1")
    sigma: float = Field(0.03, ge=1e-4, le=2, description="RGB distance at which a neighbour's weight falls, 0..1")
    radius: int = Field(5, ge=1, le=15, description="neighbourhood of 2 r + 1 by 2 r + 1 pixels, with gaps between")
    gap: int = Field(2, ge=1, le=10, description="distance of these neighbours, in pixels")
    passes: int = Field(8, ge=1, le=100, description="passes of the weighted median over all pixels")


def mishiba(
    light_field: LightField, previous: StageMaps | None, parameters: MishibaParameters, progress: Progress
) -> StageMaps:
    """Disparities of least cost from one-bit features of a few views.

    Returns
    -------
    StageMaps
    """
    disparities, guide, step = parameters.candidates(light_field), light_field.reference_view, parameters.lattice_step
    lattice, views = np.ascontiguousarray(guide[::step, ::step]), selected_views(light_field)
    offsets = -disparities[:, None, None].astype(np.float64) * light_field.baselines[views]
    costs = pair_costs(details(light_field, views, parameters.feature_sigma), offsets, step)
    progress(0.4)
    labels, kept = np.zeros(light_field.shape, np.int64), np.zeros((*light_field.shape, 5), np.float32)
    fit = GuidedFilter(lattice, parameters.radius, parameters.epsilon)
    origin = lattice[0, 0] - fit.guide[0, 0]
    for k, cost in enumerate(costs):
        slopes, constants = fit.lines(cost)
        kernels.keep_least(k, slopes, constants - slopes @ origin, guide, step, labels, kept)
        progress(0.4 + 0.6 * (k + 1) / len(costs))
    return StageMaps(*refined(disparities, labels, kept))


def median_descent(
    light_field: LightField, previous: StageMaps | None, parameters: MedianDescentParameters, progress: Progress
) -> StageMaps:
    """Disparities of approximately least energy of absolute differences.

    The disparities of the previous maps are weighted by their confidence.

    Returns
    -------
    StageMaps
        With unchanged confidence, without a cost volume.
    """
    before = require_previous(previous)
    guide = light_field.reference_view
    low, high = float(before.disparity.min()), float(before.disparity.max())
    unit = max(high - low, 1e-6) / (LEVELS - 1)
    data = np.round((before.disparity.astype(np.float64) - low) / unit).astype(np.int32, order="C")
    weights = np.round(before.confidence * FULL_WEIGHT).astype(np.int32, order="C")
    table = neighbour_weights(parameters, residual_variance(guide))
    current, following = data.copy(), np.empty_like(data)
    for i in range(parameters.passes):
        kernels.median_pass(current, data, weights, guide, parameters.radius, parameters.gap, *table, following)
        current, following = following, current
        progress((i + 1) / parameters.passes)
    return before.updated((low + current * unit).astype(np.float32), before.confidence).without_costs()


def selected_views(light_field: LightField) -> BoolMap:
    """Views in the row and column of the reference view, or all views if these are too few; shape (T, S)."""
    t, s = light_field.reference_position
    cross = np.zeros(light_field.grid, bool)
    cross[t] = cross[:, s] = True
    cross &= light_field.present
    return cross if cross.sum() > 2 else light_field.present


def details(light_field: LightField, views: BoolMap, sigma: float) -> FloatMap:
    """Grey values minus their Gaussian mean, whose signs are the features; shape (N, H, W), float32."""
    result = np.empty((int(views.sum()), *light_field.shape), np.float32)
    for n, (t, s) in enumerate(np.argwhere(views)):
        grey = as_unit_float(light_field.rgb_views[t, s]) @ GREY
        result[n] = grey - cv2.GaussianBlur(grey, (0, 0), sigma) - np.float32(TIE)
    return result


def pair_costs(maps: FloatMap, offsets: npt.NDArray[np.float64], step: int) -> FloatMap:
    """Number of pairs of views whose bits differ, relative to the largest possible number; 1 without a pair.

    Views in which a pixel lies outside take no part.

    Parameters
    ----------
    maps : ndarray, shape (N, H, W), float32
        A map of each view, whose signs are the bits.
    offsets : ndarray, shape (K, N, 2), float64
        Down and across from a reference pixel to its sample, for each candidate, in pixels.
    step : int
        Distance of the pixels.

    Returns
    -------
    ndarray, shape (K, ceil(H / step), ceil(W / step)), float32
    """
    count, height, width = maps.shape
    # by the number of views that see a pixel, and of ones among them
    seen, ones = np.ogrid[: count + 1, : count + 1]
    most = np.maximum((seen // 2) * (seen - seen // 2), 1)
    shares = np.where(seen < 2, 1, ones * (seen - ones) / most).astype(np.float32)
    sheared, found = np.empty_like(maps[:, None]), []
    for of_views in offsets:
        sheared_views.shear(maps[:, None], of_views, True, sheared)
        down, across = (np.arange(0, length, step) + of_views[:, [n]] for n, length in enumerate((height, width)))
        inside = ((down >= 0) & (down <= height - 1))[:, :, None] & ((across >= 0) & (across <= width - 1))[:, None]
        bits = inside & (sheared[:, 0, ::step, ::step] > 0)
        found.append(shares[inside.sum(axis=0), bits.sum(axis=0)])
    return np.stack(found)


def refined(disparities: FloatMap, labels: npt.NDArray[np.int64], kept: FloatMap) -> tuple[FloatMap, FloatMap]:
    """Disparity by the parabola around the least cost, and confidence; each (H, W), float32.

    Parameters
    ----------
    disparities : ndarray, shape (K,), float32
    labels : ndarray, shape (H, W), int64
        Candidates of least cost.
    kept : ndarray, shape (H, W, 5), float32
        Costs as ``keep_least`` (``kernels/mishiba.cpp``) keeps them.
    """
    least, below, above, _, total = np.moveaxis(kept, 2, 0)
    curvature = below - 2 * least + above
    inner = (labels > 0) & (labels < len(disparities) - 1) & (curvature > 0)
    offset = np.where(inner, (below - above) / (2 * np.where(inner, curvature, 1)), 0)
    disparity = disparities[labels] + (disparities[1] - disparities[0]) * offset
    # fitted costs may be slightly negative
    least, mean = np.maximum(least, 0) + NO_COST, np.maximum(total / len(disparities), 0) + NO_COST
    confidence = np.clip(1 - least / mean, 0, 1)
    return disparity.astype(np.float32), confidence.astype(np.float32)


def neighbour_weights(parameters: MedianDescentParameters, noise: float) -> tuple[npt.NDArray[np.int32], float]:
    """Table of integer weights by squared colour distance, and the width of an entry.

    Parameters
    ----------
    parameters : MedianDescentParameters
    noise : float
        Expected squared colour distance due to noise.

    Returns
    -------
    table : ndarray, shape (TABLE_ENTRIES,), int32
    per_entry : float
    """
    variance = parameters.sigma**2 + noise
    per_entry = 16 * variance / TABLE_ENTRIES
    squared = (np.arange(TABLE_ENTRIES) + 0.5) * per_entry
    neighbours = (2 * parameters.radius + 1) ** 2 - 1
    weights = parameters.smoothness / neighbours * np.exp(-squared / (2 * variance))
    return np.round(FULL_WEIGHT * weights).astype(np.int32), per_entry


CHOICES: dict[str, dict[str, Choice]] = {
    "initial": {"mishiba": Choice(MishibaParameters, mishiba)},
    "optimize": {"median_descent": Choice(MedianDescentParameters, median_descent)},
}
