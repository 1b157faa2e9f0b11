"""Filtering of the cost volume with the reference view as guide [1]_, a choice of the global optimisation.

Each candidate's costs are smoothed by a guided filter (:mod:`sepi.extensions.methods.guided_filter`); then each pixel
selects the candidate of least cost.

References
----------
.. [1] Hosni, Rhemann, Bleyer, Rother, Gelautz: Fast cost-volume filtering for visual correspondence and beyond.
   IEEE TPAMI 35(2), 2013. doi:10.1109/TPAMI.2012.156
"""

from __future__ import annotations

import numpy as np
from pydantic import Field

from sepi.extensions.methods.cost_volumes import disparity_of, distinctness, least_costs
from sepi.extensions.methods.guided_filter import GuidedFilter
from sepi.lightfield import LightField
from sepi.stage import Choice, CostVolume, Parameters, Progress, StageMaps, require_costs


class GuidedCostsParameters(Parameters):
    """Parameters of the filtered costs."""

    radius: int = Field(5, ge=1, le=50, description="window of 2 r + 1 pixels")
    epsilon: float = Field(1e-4, gt=0, description="variance of colour above which edges are kept, colours in 0..1")


def guided_costs(
    light_field: LightField, previous: StageMaps | None, parameters: GuidedCostsParameters, progress: Progress
) -> StageMaps:
    """Candidates of least filtered cost.

    Requires maps with a cost volume.

    Returns
    -------
    StageMaps
        Without the cost volume.
    """
    before, volume = require_costs(previous)
    smooth = GuidedFilter(light_field.reference_view, parameters.radius, parameters.epsilon)
    filtered = np.empty_like(volume.costs)
    for k, costs in enumerate(volume.costs):
        filtered[k] = smooth(costs.astype(np.float32))
        progress((k + 1) / len(filtered))
    result = CostVolume(volume.disparities, filtered)
    labels = least_costs(result)
    return before.updated(disparity_of(result, labels), distinctness(result, labels)).without_costs()


CHOICES = {"optimize": {"guided_costs": Choice(GuidedCostsParameters, guided_costs)}}
