"""Initial depth (preliminary)."""

from __future__ import annotations

import numpy as np
from pydantic import Field

from sepi.command import stage_command
from sepi.lightfield import LightField
from sepi.stage import Choice, Parameters, Progress, StageMaps


class SepiParameters(Parameters):
    """Parameters of the SEPI plane sweep."""

    candidates: int = Field(181, ge=3, le=4001, description="number of candidate disparities")


class StructureTensorParameters(Parameters):
    """Parameters of the structure tensor."""


def sepi(light_field: LightField, previous: StageMaps | None, parameters: SepiParameters, progress: Progress) -> StageMaps:
    """Preliminary."""
    known = light_field.known_range()
    disparity = np.full(light_field.shape, (known.minimum + known.maximum) / 2, np.float32)
    return StageMaps(disparity, np.ones_like(disparity))


CHOICES = {"sepi": Choice(SepiParameters, sepi), "structure_tensor": Choice(StructureTensorParameters, sepi)}

if __name__ == "__main__":
    stage_command("initial", CHOICES)()
