"""Memory of a job by its number of candidates, which is known once the light field is read."""

from __future__ import annotations

from contextlib import suppress
from pathlib import Path

from sepi.errors import SepiError
from sepi.io.hdf5 import read_attributes
from sepi.matching.visibility_sweep import BYTES_PER_CANDIDATE, CANDIDATES, VisibilitySweepParameters
from sepi.stage import Parameters
from sepi.workflow.datasets import Scene


def candidates_mb(scene: Scene, light_field: Path, parameters: Parameters) -> int:
    """Memory in MB that a cost volume takes beyond one of the usual number of candidates.

    Parameters
    ----------
    scene : Scene
    light_field : Path
        What ingest writes of it; until then only a number that is set can be told.
    parameters : Parameters
        Of the job's choice; most choices hold no cost volume.
    """
    if not isinstance(parameters, VisibilitySweepParameters):
        return 0
    number = parameters.num_disparities or CANDIDATES.usual
    if parameters.num_disparities is None:
        # absent, or of an earlier version: it is made before the job runs
        with suppress(SepiError, KeyError):
            known = read_attributes(light_field)
            minimum, maximum = known["disparity_range"]
            number = CANDIDATES.number(float(maximum - minimum), float(known["reach"]), scene.height * scene.width)
    more = max(0, number - CANDIDATES.usual) * BYTES_PER_CANDIDATE * scene.height * scene.width
    return round(more / 2**20)
