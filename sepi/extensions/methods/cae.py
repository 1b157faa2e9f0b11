"""The data costs of Williem, Park, Lee [1]_: constrained angular entropy and constrained adaptive defocus.

Both are robust to occluders and noise. At the correct disparity, the views that see a pixel show the same colour, so
that the histogram of its angular patch has a single peak and low entropy; an occluder has little influence, since views
are weighted by the similarity of their colour to the pixel's own. At that disparity the refocused light field also
equals the reference view, near an occluder at least in a sub-patch on the pixel's own surface. The costs are added with
equal weights, filtered with the reference view as guide [2]_, and the disparity minimises an energy
(:mod:`sepi.extensions.methods.markov_field`).

Equations, for pixel ``p`` of colour ``P(p)``, disparity ``d``, and the views' samples ``A_v``, ``v = 1..N``, of one
channel of the light field sheared by ``d``:

- weights ``w_v = exp(-(A_v - P(p))^2 / (2 sigma^2))``, histogram ``h(i) = sum_{A_v in bin i} w_v / sum_v w_v``;
- entropy of a channel ``-sum_i h(i) log h(i)``; cost ``E(p, d)`` half its mean over the channels, half its largest;
- response ``r(q, d) = |R_d(q) - P(q)|``, mean over the channels, of the refocused light field ``R_d = mean_v A_v``;
- in each of the nine sub-patches ``c`` of the neighbourhood of ``p``, with weights ``m_q = exp(-|P(q) - P(p)|^2 /
  (2 sigma^2))`` (mean over the channels), ``D_c = sum_{q in c} m_q r(q, d) / sum m_q + gamma (1 - mean m_q)``; cost
  ``D(p, d) = min_c D_c``;
- ``C = (E / mean_d E + D / mean_d D) / 4``, each slice of it filtered.

Choices made here where the publications are not specific or could not be confirmed:

- *the weights' width*: ``sigma`` is a tenth of full scale, one for both costs;
- *the histogram*: one bin for each of 256 levels, each channel by itself;
- *channels*: pooled half by the mean and half by the maximum, as in the authors' earlier method [3]_ to our knowledge;
- *few similar views*: an angular patch without any weight has the entropy of N different colours; views with a weight
  below a thousandth are left out;
- *the neighbourhood*: 15 x 15 pixels in three by three sub-patches;
- *the colour constraint on the defocus*: as above. A term ``gamma |R_d(q) - P(p)|`` with a small ``gamma`` lets thin
  occluders take the disparity of what they hide, whose sub-patches are sharp there;
- *normalisation*: each cost is divided by its mean over the candidates at the pixel, but at least by a tenth of its
  mean over all pixels, so that textureless pixels have less influence;
- *labels*: 75, as in the publication; the result is refined by a parabola;
- *the minimiser*: message passing in place of graph cuts.

References
----------
.. [1] Williem, Park, Lee: Robust light field depth estimation using occlusion-noise aware data costs.
   IEEE TPAMI 40(10), 2018. doi:10.1109/TPAMI.2017.2746858
.. [2] Hosni, Rhemann, Bleyer, Rother, Gelautz: Fast cost-volume filtering for visual correspondence and beyond.
   IEEE TPAMI 35(2), 2013. doi:10.1109/TPAMI.2012.156
.. [3] Williem, Park: Robust light field depth estimation for noisy scene with occlusion. CVPR 2016.
"""

import numpy as np
from pydantic import Field

from sepi.extensions.methods.costs import GuidedFilter, Previous, filtered, maps_of
from sepi.kernels import cae as kernels
from sepi.lightfield import FloatMap, LightField
from sepi.matching.candidates import CandidateParameters, CandidateRule, number_field
from sepi.matching.sheared_views import ShearedViews, refocused
from sepi.stage import Choice, Needs, Progress, StageMaps

LEAST_MEAN = 0.1
"""Lower bound of a pixel's normalisation, as a fraction of the cost's mean over all pixels."""

LEAST_WEIGHT = 1e-3
"""Weight of a view below which it is left out."""


class CaeParameters(CandidateParameters):
    """Parameters of the constrained angular entropy and defocus."""

    # the authors' number, for light fields like theirs
    rule = CandidateRule(usual=75, finest=0.02, coarsest=0.5, volume_bytes=2**28)
    needs = Needs(bytes_per_sample=31, bytes_per_pixel=1500, bytes_per_candidate=8, seconds_per_megasample=2.5)

    num_disparities: int | None = number_field(rule, "docs/reproduce/compared.md")
    colour_sigma: float = Field(0.1, ge=1e-3, le=10, description="difference of colours, 0..1, at which weights fall")
    colour_constraint: float = Field(1.0, ge=0, description="defocus added for a sub-patch without the pixel's colour")
    filter_radius: int = Field(5, ge=1, le=50, description="window of 2 r + 1 pixels in which costs are filtered")
    filter_epsilon: float = Field(1e-4, gt=0, description="variance of colours, 0..1, above which filtered edges stay")


def cae(light_field: LightField, previous: Previous, parameters: CaeParameters, progress: Progress) -> StageMaps:
    """Filtered costs of every candidate, and the candidate of least cost.

    Returns
    -------
    StageMaps
        With the cost volume.
    """
    disparities = parameters.candidates(light_field)
    entropies, responses = entropies_and_responses(light_field, disparities, parameters.colour_sigma, progress)
    # least weighted responses over the sub-patches around each pixel
    guide, by_pixel = light_field.reference_view, np.ascontiguousarray(responses.transpose(1, 2, 0))
    defocus = np.empty_like(by_pixel)
    kernels.constrained_least_patch(by_pixel, guide, parameters.colour_sigma, parameters.colour_constraint, defocus)
    costs = 0.25 * (_normalised(entropies) + _normalised(defocus.transpose(2, 0, 1)))
    smooth = GuidedFilter(guide, parameters.filter_radius, parameters.filter_epsilon)
    return maps_of(filtered(smooth, disparities, costs, lambda done: progress(0.9 + 0.1 * done)))


def entropies_and_responses(
    light_field: LightField, disparities: FloatMap, sigma: float, progress: Progress
) -> tuple[FloatMap, FloatMap]:
    """Constrained angular entropy of each candidate, and the defocus response of single pixels.

    Parameters
    ----------
    light_field : LightField
    disparities : ndarray, shape (K,), float32
        Pixels per view step.
    sigma : float
        Width of the views' weights, colours in 0..1; infinite: the plain entropy.
    progress : callable
        Called for the first nine tenths.

    Returns
    -------
    entropies, responses : ndarray, shape (K, H, W), float32
    """
    views, weights = ShearedViews(light_field), level_weights(sigma)
    entropies, responses = np.empty((2, len(disparities), *light_field.shape), np.float32)
    channels = np.empty((3, *light_field.shape), np.float32)
    for k, sheared in views.over(disparities, lambda done: progress(0.9 * done)):
        own = sheared[views.reference]
        kernels.constrained_entropies(sheared, own, weights, channels)
        entropies[k] = (channels.mean(axis=0) + channels.max(axis=0)) / 2
        responses[k] = np.abs(refocused(sheared) - own).mean(axis=0)
    return entropies, responses


def level_weights(sigma: float) -> FloatMap:
    """Weight of a view by its level's difference from the pixel's, down to the minimum weight; shape (n,)."""
    difference = np.arange(kernels.LEVELS) / (kernels.LEVELS - 1)
    weights = np.exp(-((difference / sigma) ** 2) / 2)
    return weights[weights >= LEAST_WEIGHT].astype(np.float32)


def _normalised(costs: FloatMap) -> FloatMap:
    """Costs ``(K, H, W)`` divided by their mean over the candidates."""
    mean = costs.mean(axis=0)
    return np.asarray(costs / np.maximum(mean, max(LEAST_MEAN * float(mean.mean()), 1e-6)), np.float32)


CHOICES = {"initial": {"cae": Choice(CaeParameters, cae)}}
