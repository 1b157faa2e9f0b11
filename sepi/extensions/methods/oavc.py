"""The occlusion-aware vote cost [1]_: views vote for candidate disparities, and the candidate with most votes wins.

The usual cost, the mean difference of the views from the reference view, is small at the correct candidate only if all
views see the pixel. If some show an occluder instead, the mean is large at every candidate, and edges are blurred or
widened. Here a view votes for a candidate if it differs from the reference view by less than a small threshold. The
differences of the other views do not matter, so that an occluder's colours are ignored without detecting edges or
splitting the views into groups.

With the ``N`` views other than the reference view, ``delta_n(p, d)`` the difference of view ``n``, sheared by ``d``,
from the reference view at pixel ``p``, and ``tau(p)`` the threshold of the pixel:

- votes: ``V(p, d)`` = number of ``n`` with ``delta_n(p, d) <= tau(p)``;
- mean difference of the voting views, relative to the threshold: ``M(p, d)`` = mean of ``delta_n(p, d) / tau(p)`` over
  them, 0 without any;
- cost: ``C(p, d) = 1 - (V(p, d) - M(p, d)) / N``, in 0..1. One vote outweighs any difference of the means, which decide
  between candidates with equal votes and determine the sub-candidate disparity;
- threshold: ``tau(p) = max(tau_0, min over d of delta_(q N)(p, d))``, where ``delta_(m)`` is the ``m``-th smallest
  difference: the least threshold with which a share ``q`` of the views agree on one candidate.

The costs are smoothed by an edge-preserving filter, each pixel selects the candidate of least cost, a parabola through
the neighbouring candidates' costs refines it, and a weighted median removes remaining outliers. There is no global
optimisation, so that large textureless regions are not filled.

Confirmed from the publication is only that the cost counts the views whose difference from the reference view is below
a small threshold. Everything else was chosen here:

- the difference: mean absolute difference of the three channels;
- the adaptive threshold, as above. Behind an occluder with a straight edge, at least half of the views see a pixel, so
  ``q`` is one half: the threshold comes from views that see the pixel and adapts to noise, resampling of fine texture
  and brightness changes. With one wide threshold for all pixels, wrong candidates get all votes where texture is weak;
  with a narrow one there are no votes where texture is strong or the light field noisy. ``tau_0`` is one step of 8-bit
  colours, below which differences are meaningless;
- the combination of the number of votes and the mean difference, as above;
- 128 candidates, uniform over the disparity range; views resampled by cubic convolution. Views are extended by their
  border pixels; samples there vote at random, like occluded ones;
- the edge-preserving filter: the guided filter (:mod:`sepi.extensions.methods.costs`), in windows of 15 pixels;
- the sub-candidate disparity, by a parabola through the filtered costs. It makes most pixels more precise than the
  publication's results;
- the last step: a weighted median with weights by the colours of the reference view
  (:mod:`sepi.extensions.methods.costs`).

Any set of views works: one row, one column, positions off the grid.

References
----------
.. [1] Han, Xiang, Wang, Huang: A novel occlusion-aware vote cost for light field depth estimation. IEEE TPAMI 44(11),
   2022. doi:10.1109/TPAMI.2021.3105523
"""

import math

import numpy as np
from pydantic import Field

from sepi.extensions.methods.costs import Previous, colour_differences, maps_of
from sepi.lightfield import FloatMap, LightField
from sepi.matching.candidates import CandidateParameters, CandidateRule, number_field
from sepi.matching.sheared_views import ShearedViews
from sepi.stage import Choice, CostVolume, Needs, Progress, StageMaps

_ROWS = 64
"""Image rows processed at once, which limits the memory for the differences of all views."""


class OavcParameters(CandidateParameters):
    """Parameters of the vote cost."""

    # limited to a cost volume of 1 GB, since it is kept
    rule = CandidateRule(usual=128, finest=0.02, coarsest=0.5, volume_bytes=10**9)
    needs = Needs(bytes_per_sample=31, bytes_per_pixel=1300, bytes_per_candidate=8, seconds_per_megasample=3)

    num_disparities: int | None = number_field(rule, "docs/reproduce/compared.md")
    agreeing_share: float = Field(0.5, gt=0, le=1, description="share of the views that must vote for some candidate")
    least_threshold: float = Field(0.004, ge=1e-6, le=1, description="least threshold of a vote, difference of colours")


def oavc(light_field: LightField, previous: Previous, parameters: OavcParameters, progress: Progress) -> StageMaps:
    """Candidates with the most votes.

    Returns
    -------
    StageMaps
        With the cost volume.
    """
    views, disparities = ShearedViews(light_field), parameters.candidates(light_field)
    needed = max(1, math.ceil(parameters.agreeing_share * (len(views.positions) - 1)))
    thresholds = np.full(light_field.shape, np.inf, np.float32)
    for _, sheared in views.over(disparities, lambda done: progress(done / 2)):
        lower_thresholds(sheared, views.reference, needed, thresholds)
    thresholds = np.maximum(thresholds, np.float32(parameters.least_threshold))
    return maps_of(votes(views, disparities, thresholds, lambda done: progress((1 + done) / 2)))


def lower_thresholds(sheared: FloatMap, reference: int, needed: int, thresholds: FloatMap) -> None:
    """Lower thresholds (H, W) to those with which ``needed`` other views (N, 3, H, W) agree with the reference."""
    for top in range(0, len(thresholds), _ROWS):
        rows = slice(top, top + _ROWS)
        # the reference view agrees with itself too
        found = np.stack(list(colour_differences(sheared[:, :, rows], sheared[reference, :, rows])))
        # few pixels: most candidates do not lower the thresholds any more
        lower = np.count_nonzero(found < thresholds[rows], axis=0) > needed
        thresholds[rows][lower] = np.partition(found[:, lower], needed, axis=0)[needed]


def vote_costs(sheared: FloatMap, reference: int, thresholds: FloatMap) -> FloatMap:
    """Cost ``1 - (V - M) / (N - 1)`` of a candidate, from the views (N, 3, H, W) sheared by it; shape (H, W)."""
    number, total = np.zeros((2, *thresholds.shape), np.float32)
    for difference in colour_differences(sheared, sheared[reference]):
        agrees = difference <= thresholds
        number += agrees
        total += difference * agrees
    # the reference view has no vote
    number -= 1
    mean = total / (np.maximum(number, 1) * thresholds)
    return np.asarray(1 - (number - mean) / (len(sheared) - 1), np.float32)


def votes(views: ShearedViews, disparities: FloatMap, thresholds: FloatMap, progress: Progress) -> CostVolume:
    """The costs ``C``.

    Parameters
    ----------
    views : ShearedViews
        The reference view among them.
    disparities : ndarray, shape (K,), float32
        Candidates, pixels per view step.
    thresholds : ndarray, shape (H, W), float32
        Positive.
    progress : callable

    Returns
    -------
    CostVolume
    """
    costs = np.empty((len(disparities), *thresholds.shape), np.float16)
    for k, sheared in views.over(disparities, progress):
        costs[k] = vote_costs(sheared, views.reference, thresholds)
    return CostVolume(disparities, costs)


CHOICES = {"initial": {"oavc": Choice(OavcParameters, oavc)}}
