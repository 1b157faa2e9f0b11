"""Memory and time of a stage's job, by its number of disparity candidates, known once the light field is read."""

from __future__ import annotations

from contextlib import suppress
from pathlib import Path

from sepi.errors import SepiError
from sepi.io.hdf5 import read_attributes
from sepi.matching.candidates import CandidateParameters
from sepi.matching.plane_sweep import SweepParameters
from sepi.stage import Needs, Parameters
from sepi.workflow.datasets import Scene

USUAL = {
    "initial": Needs(bytes_per_sample=13, bytes_per_pixel=1300, seconds_per_megasample=0.2),
    "occlusion": Needs(bytes_per_sample=18, bytes_per_pixel=1400, seconds_per_megasample=0.4),
    "textureless": Needs(bytes_per_sample=17, bytes_per_pixel=500, seconds_per_megasample=0.1),
    "optimize": Needs(bytes_per_sample=30, bytes_per_pixel=1500, seconds_per_megasample=0.35),
}
"""What any choice of a stage is given, with the usual number of candidates."""


def stage_needs(scene: Scene, light_field: Path, stage: str, parameters: Parameters, threads: int) -> tuple[int, int]:
    """Memory of a stage's job in MB, and its time in minutes.

    They are the stage's usual ones, or those of its choice if larger. More candidates than usual take more memory, for
    a cost volume or for the rows of costs of each thread; time grows with their number.

    Parameters
    ----------
    scene : Scene
    light_field : Path
        The output of ingest; before it exists, only a configured number of candidates is known.
    stage : str
    parameters : Parameters
        Of the job's choice.
    threads : int
    """
    usual, own = USUAL[stage], parameters.needs
    memory = max(scene.memory_mb(one.bytes_per_sample, one.bytes_per_pixel) for one in (usual, own))
    seconds = max(usual.seconds_per_megasample, own.seconds_per_megasample)
    if not isinstance(parameters, CandidateParameters):
        return memory, scene.minutes(seconds)
    number, before = _number(scene, light_field, parameters), parameters.rule.usual
    if isinstance(parameters, SweepParameters):
        one, other = parameters.thread_bytes(number, scene.width), type(parameters)().thread_bytes(before, scene.width)
        more = float(threads * (one - other))
    else:
        more = (number - before) * own.bytes_per_candidate * scene.height * scene.width
    return memory + round(max(0.0, more) / 2**20), scene.minutes(number / before * seconds)


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
