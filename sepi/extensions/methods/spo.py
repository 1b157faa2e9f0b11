r"""Spinning parallelogram operator, a compared method: finds the line whose two sides differ most [1]_.

In an EPI, the slice of a row of views along a row of pixels, a point of disparity ``d`` traces a line of slope ``d``. A
parallelogram around the pixel is rotated until the colours left and right of its centre line differ most. An occluder
changes some of the views on one side, but the sides still differ, whereas a comparison between views would fail. Noise
affects both sides equally. The data cost is the initial choice ``spo``.

1. *Operator.* A pixel ``i`` at the distance ``r`` from the line of candidate ``l`` has the weight
   ``w(i) = |r| exp(-r^2 / (2 a^2))``, the derivative of a Gaussian of scale ``a``. The weighted colours of the left
   half form a histogram ``g``, those of the right half ``h``, each of sum 1.
2. *Distance.* ``D(l) = 1/2 sum_b (g_b - h_b)^2 / (g_b + h_b)`` over the bins ``b``: 0 where the halves have the same
   colours, 1 where they share none. The best candidate maximises it.
3. *Both directions.* The row of views through the reference view gives ``D_h``, the column ``D_v``. A direction is
   weighted by how distinct the peak of its distances is, ``c = exp(-(mean_l D / max_l D) / (2 s^2))``, and
   ``D(l) = c_h D_h(l) + c_v D_v(l)``.
4. *Labels.* Every slice of the volume is smoothed by a guided filter (:mod:`sepi.extensions.methods.costs`),
   then each pixel selects its best candidate.

The EPIs are sheared by each candidate, so that its lines become columns, and the histogram of a column is shared by all
parallelograms that contain it (``kernels/spo.cpp``).

Choices made here where the publication is not specific or could not be confirmed:

- The numbers: the scale ``a``, the bins, the ``s`` of the confidence. The parallelogram extends three scales from its
  line, in whole columns; weights beyond are below about 5 % of the largest.
- The confidence's formula. Through the sum above, it also weights pixels relative to each other in the filter.
- Colours: one histogram per channel, and the mean of their distances. A colour is shared between the two nearest bins:
  with hard bin borders, noise would move a nearly uniform colour between two bins, and the halves would differ at every
  candidate. The method is not robust to noise of several bins.
- Samples between pixels: cubic convolution.
- The border: views and columns are extended by their border pixels.
- The number of candidates, and the parabola that refines the best one.
- The filter's numbers: those of the publication of cost-volume filtering.
- Views that are not in rows and columns: the views in the reference view's row and column of the grid are used and
  sheared by their true positions. A direction without other views is left out; if both are, all views are sheared
  together and split both ways.

References
----------
.. [1] Zhang, Sheng, Li, Zhang, Xiong: Robust depth estimation for light field via spinning parallelogram operator.
   Computer Vision and Image Understanding 145, 2016. doi:10.1016/j.cviu.2015.12.007
"""

import numpy as np
from pydantic import Field

from sepi.extensions.methods.costs import Previous, disparity_of, least_costs
from sepi.kernels import spo as kernels
from sepi.lightfield import BoolMap, FloatMap, LightField
from sepi.matching.candidates import CandidateParameters, CandidateRule, number_field
from sepi.matching.sheared_views import ShearedViews
from sepi.stage import Choice, CostVolume, Needs, Progress, StageMaps, part_of, relative_confidence

_HALF_WIDTH = 3.0
"""Half width of the parallelogram in scales."""

_ROUNDING = 1e-4
"""Distances up to this are rounding errors: the halves have the same colours."""

Direction = tuple[BoolMap, bool]
"""Views (T, S) of EPIs, and whether the EPIs are vertical; else they are along image rows."""


class SpoParameters(CandidateParameters):
    """Parameters of the spinning parallelogram operator."""

    rule = CandidateRule(usual=128, finest=0.02, coarsest=0.5, volume_bytes=2**29)
    needs = Needs(bytes_per_sample=9, bytes_per_pixel=2400, bytes_per_candidate=8, seconds_per_megasample=1.5)

    num_disparities: int | None = number_field(rule, "docs/reproduce/compared.md")
    scale: float = Field(0.8, ge=0.35, le=10, description="sigma of a line's sides, derivatives of Gaussians; pixels")
    bins: int = Field(64, ge=2, le=256, description="bins of a histogram, for each channel")
    peak: float = Field(0.26, ge=0.05, le=10, description="mean by largest distance where a direction's weight falls")


def spo(light_field: LightField, previous: Previous, parameters: SpoParameters, progress: Progress) -> StageMaps:
    """Candidates whose lines have the largest difference between their sides.

    Returns
    -------
    StageMaps
        With the cost volume.
    """
    disparities = parameters.candidates(light_field)
    directions = views_of_directions(light_field)
    merged = np.zeros((len(disparities), *light_field.shape), np.float32)
    confidence = np.zeros(light_field.shape, np.float32)
    for number, direction in enumerate(directions):
        of_all = part_of(progress, number, len(directions))
        distances = side_distances(light_field, direction, disparities, parameters, of_all)
        weight = peak_weight(distances, parameters.peak)
        distances *= weight
        merged += distances
        confidence = np.maximum(confidence, weight)
    # each pixel's best candidate costs 0, near which half precision is finest; the following filter is linear
    best = merged.max(axis=0)
    np.subtract(best, merged, out=merged)
    merged /= max(float(best.max()), _ROUNDING)
    volume = CostVolume(disparities, merged.astype(np.float16))
    return StageMaps(disparity_of(volume, least_costs(volume)), relative_confidence(confidence), cost_volume=volume)


def views_of_directions(light_field: LightField) -> list[Direction]:
    """The directions of the EPIs that are used."""
    present, (t, s) = light_field.present, light_field.reference_position
    row, column = np.zeros((2, *light_field.grid), bool)
    row[t], column[:, s] = present[t], present[:, s]
    found = [(views, down) for views, down in ((row, False), (column, True)) if views.sum() > 1]
    return found or [(present, False), (present, True)]


def side_distances(
    light_field: LightField, direction: Direction, disparities: FloatMap, parameters: SpoParameters, progress: Progress
) -> FloatMap:
    """Differences between the sides of each candidate's line in the EPIs of one direction.

    Parameters
    ----------
    light_field : LightField
    direction : Direction
    disparities : ndarray, shape (K,), float32
        The candidates, pixels per view step.
    parameters : SpoParameters
    progress : callable

    Returns
    -------
    ndarray, shape (K, H, W), float32
        0..1.
    """
    views, down = direction
    sheared_views = ShearedViews(light_field, views)
    shares = column_weights(parameters.scale) / np.float32(len(sheared_views.positions))
    found = np.empty((len(disparities), *light_field.shape), np.float32)
    for k, sheared in sheared_views.over(disparities, progress):
        lines = np.ascontiguousarray(sheared.swapaxes(2, 3)) if down else sheared
        of_lines = np.empty(lines.shape[2:], np.float32)
        kernels.half_distances(lines, shares, parameters.bins, of_lines)
        found[k] = of_lines.T if down else of_lines
    return found


def column_weights(scale: float) -> FloatMap:
    """Weights of the columns 1, 2, ... pixels from the line: the derivative of a Gaussian; shape (R,), float32."""
    distance = np.arange(1, int(_HALF_WIDTH * scale) + 1)
    weights = distance * np.exp(-(distance**2) / (2 * scale**2))
    return np.asarray(weights / weights.sum(), np.float32)


def peak_weight(distances: FloatMap, peak: float) -> FloatMap:
    """Distinctness of the peak of each pixel's distances ``(K, H, W)``; 0..1, shape (H, W), float32."""
    largest, mean = distances.max(axis=0), distances.mean(axis=0)
    flat = largest <= _ROUNDING
    ratio = np.where(flat, 1, mean / np.where(flat, 1, largest))
    return np.asarray(np.exp(-ratio / (2 * peak**2)), np.float32)


CHOICES = {"initial": {"spo": Choice(SpoParameters, spo)}}
