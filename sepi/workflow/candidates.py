"""A job's memory and time by its number of disparity candidates, which is known once the light field is read."""

from __future__ import annotations

from contextlib import suppress
from pathlib import Path

from sepi.errors import SepiError
from sepi.io.hdf5 import read_attributes
from sepi.matching.candidates import CandidateParameters
from sepi.matching.plane_sweep import SweepParameters
from sepi.stage import Parameters
from sepi.workflow.datasets import Scene


def candidates_mb(scene: Scene, light_field: Path, parameters: Parameters, threads: int = 1) -> int:
    """Memory in MB that a sweep needs beyond that for the default number of candidates: a cost volume or cost rows.

    Parameters
    ----------
    scene : Scene
    light_field : Path
        The output of ingest; before it exists, only a configured number of candidates is known.
    parameters : Parameters
        Parameters of the job's choice.
    threads : int
        Each thread of a plane sweep has its own cost rows.
    """
    if isinstance(parameters, SweepParameters):
        usual = type(parameters)().thread_bytes(parameters.rule.usual, scene.width)
        own = parameters.thread_bytes(_number(scene, light_field, parameters), scene.width)
        return round(threads * max(0, own - usual) / 2**20)
    each = parameters.needs.bytes_per_candidate
    if not isinstance(parameters, CandidateParameters) or not each:
        return 0
    more = max(0, _number(scene, light_field, parameters) - parameters.rule.usual)
    return round(more * each * scene.height * scene.width / 2**20)


def candidates_factor(scene: Scene, light_field: Path, parameters: Parameters) -> float:
    """Ratio of a job's number of candidates to the default; 1 without a sweep."""
    if not isinstance(parameters, CandidateParameters):
        return 1.0
    return _number(scene, light_field, parameters) / parameters.rule.usual


def _number(scene: Scene, light_field: Path, parameters: CandidateParameters) -> int:
    if parameters.num_disparities is not None:
        return parameters.num_disparities
    # missing or from an earlier version: it is made before the job runs
    with suppress(SepiError, KeyError):
        # planning reads many files; the job itself checks its file
        known = read_attributes(light_field, check=False)
        minimum, maximum = known["disparity_range"]
        return parameters.rule.number(float(maximum - minimum), float(known["reach"]), scene.height * scene.width)
    return parameters.rule.usual
