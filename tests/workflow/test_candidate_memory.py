"""Memory that jobs state follows the number of candidates: too little, and a cluster kills them."""

from pathlib import Path

import numpy as np

from sepi.io.hdf5 import write_light_field
from sepi.lightfield import DisparityRange, LightField
from sepi.matching.candidates import CandidateParameters
from sepi.matching.plane_sweep import SweepParameters
from sepi.matching.visibility_sweep import FirstDepthParameters
from sepi.occlusion import HalfSepiParameters
from sepi.workflow.datasets import Scene
from sepi.workflow.needs import stage_needs

SCENE = Scene("own", "wide", None, (), 25, 300, 400)


def written(path: Path, width: float) -> Path:
    views = np.zeros((5, 5, 300, 400, 1), np.uint8)
    known = DisparityRange(0, width, "given")
    write_light_field(path, LightField(views, "wide", disparity_range=known))
    return path


def candidates_mb(light_field: Path, stage: str, parameters: CandidateParameters, threads: int = 1) -> int:
    """What is added to the memory of the usual number of candidates."""
    number = parameters.rule.usual
    before = stage_needs(SCENE, light_field, stage, parameters.model_copy(update={"num_disparities": number}), threads)
    return stage_needs(SCENE, light_field, stage, parameters, threads)[0] - before[0]


def test_a_wide_range_asks_for_its_cost_volume(tmp_path: Path) -> None:
    light_field = written(tmp_path / "lf.h5", 100)
    # 100 px to views 2 steps away, 0.4 px apart there
    assert candidates_mb(light_field, "initial", FirstDepthParameters()) == round(410 * 5 * 300 * 400 / 2**20)
    # 0.5 px apart, in vectors of 8; each thread has the rows of a window and their numbers of samples, and sums of both
    rows = (408 - 184) * 2 * 4 * (7 * (128 + 6 + 8) + 32)
    assert candidates_mb(light_field, "initial", SweepParameters(), threads=3) == round(3 * rows / 2**20)
    assert candidates_mb(light_field, "occlusion", HalfSepiParameters(), threads=3) == round(3 * 8 * rows / 2**20)


def test_usual_narrow_and_yet_unread_ones_ask_for_no_more(tmp_path: Path) -> None:
    for width in (0.5, 5):
        assert candidates_mb(written(tmp_path / f"{width}.h5", width), "initial", FirstDepthParameters()) == 0
    assert candidates_mb(tmp_path / "gone.h5", "initial", FirstDepthParameters()) == 0


def test_a_number_that_is_set_counts(tmp_path: Path) -> None:
    found = candidates_mb(tmp_path / "gone.h5", "initial", FirstDepthParameters(num_disparities=191))
    assert found == round(100 * 5 * 300 * 400 / 2**20)
