"""The final multi-label optimisation of several compared methods, a choice of the global optimisation.

``markov_field`` takes the previous stage's cost volume and assigns each pixel the candidate that minimises data costs
and truncated linear smoothness, which is weaker across edges of the reference view. The methods' authors use graph
cuts; this implementation uses message passing (for the reason, see :mod:`sepi.extensions.methods.message_passing`).
"""

from __future__ import annotations

from typing import ClassVar

import numpy as np
from pydantic import Field

from sepi.extensions.methods.cost_volumes import disparity_of, distinctness
from sepi.extensions.methods.message_passing import contrast_weights, labels_of_least_energy
from sepi.lightfield import LightField
from sepi.stage import Choice, Needs, Parameters, Progress, StageMaps, require_costs


class MarkovFieldParameters(Parameters):
    """Parameters of the multi-label optimisation."""

    needs: ClassVar[Needs] = Needs(bytes_per_sample=6, bytes_per_pixel=4000, seconds_per_megasample=0.6)

    smoothness: float = Field(0.02, ge=0, description="cost of a change by a hundredth of the disparity range")
    truncation: float = Field(
        0.1, gt=0, le=1, description="change beyond which the cost no longer grows, as a share of the disparity range"
    )
    contrast: float = Field(
        0.05, gt=0, description="mean difference of colours at which smoothness falls to 1/e, colours in 0..1"
    )
    iterations: int = Field(8, ge=1, le=100, description="passes of the messages, there and back")


def markov_field(
    light_field: LightField, previous: StageMaps | None, parameters: MarkovFieldParameters, progress: Progress
) -> StageMaps:
    """Candidates of least energy.

    Requires maps with a cost volume.

    Returns
    -------
    StageMaps
        Without the cost volume.
    """
    before, volume = require_costs(previous)
    across, down = contrast_weights(light_field.reference_view, parameters.contrast)
    intervals = len(volume.disparities) - 1
    weight = np.float32(parameters.smoothness * 100 / intervals)
    labels = labels_of_least_energy(
        volume.costs, weight * across, weight * down, parameters.truncation * intervals, parameters.iterations
    )
    progress(1.0)
    maps = before.updated(disparity_of(volume, labels), distinctness(volume, labels))
    return maps.without_costs()


CHOICES = {"optimize": {"markov_field": Choice(MarkovFieldParameters, markov_field)}}
