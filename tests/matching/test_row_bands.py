"""Bands of rows: as many as memory asks for, and the same bytes whatever their number."""

import subprocess
import sys
from dataclasses import replace

import numpy as np
import pytest
from geometries import GEOMETRIES, standing
from several_threads import threads

from sepi.lightfield import DisparityRange, LightField
from sepi.matching.memory_limit import bytes_of_bands
from sepi.matching.row_bands import row_bands
from sepi.pipeline import estimate_depth
from sepi.process.workspace import Workspace
from sepi.scenes import render
from sepi.variants import stage_parameters, variant_named


def test_bands_cover_the_picture_and_what_it_is_seen_in() -> None:
    field = LightField(np.zeros((5, 5, 200, 40, 3), np.uint8), "grid")
    assert len(row_bands(field, field.present, 1.5, 10)) == 1
    limited = replace(field, workspace=Workspace(100 * 40 * 25 * 10))
    bands = row_bands(limited, field.present, 1.5, 10)
    assert len(bands) > 1
    assert [band.begin for band in bands] == [0, *(band.end for band in bands[:-1])]
    assert bands[-1].end == 200
    for begin, end, (low, high) in bands:
        # two rows of views away, a pixel moves by three rows, and its sample touches one more
        assert low <= max(0, begin - 4)
        assert high >= min(200, end + 4)
        assert high - low <= 100


@pytest.mark.parametrize("geometry", GEOMETRIES)
@pytest.mark.parametrize("variant", ["best", "best_no_detail"])
def test_maps_are_the_same_for_any_number_of_bands(variant: str, geometry: str) -> None:
    """Someone with less memory gets the map that others get."""
    scene = render("wall", size=64)
    field = LightField(
        scene.views[2:7, 2:7], "wall", disparity_range=scene.disparity_range, **standing(geometry, (5, 5))
    )
    few = {"initial": {"num_disparities": 21}, "occlusion": {"num_disparities": 21}}
    at_once, in_bands = (
        estimate_depth(one, variant, few).all() for one in (field, replace(field, workspace=Workspace(1)))
    )
    assert at_once.keys() == in_bands.keys()
    for name, values in at_once.items():
        np.testing.assert_array_equal(in_bands[name], values, err_msg=name)


def test_a_limit_on_memory_counts_what_each_thread_of_a_plane_sweep_holds() -> None:
    """961 candidates of eight groups of views take dozens of megabytes a thread, however small the picture."""
    field = LightField(np.zeros((3, 3, 64, 512, 3), np.uint8), "a", disparity_range=DisparityRange(-1, 1, "given"))
    many = {stage: {"num_disparities": 961} for stage in ("initial", "occlusion")}
    stages = list(stage_parameters(variant_named("paper"), many).values())
    left = []
    for count in (1, 2):
        with threads(count):
            left.append(bytes_of_bands(field, stages, 2**30))
    assert 961 * 8 * 2 * 7 * 4 * 128 < left[0] - left[1] < 961 * 8 * 2 * 7 * 4 * 150


@pytest.mark.system
@pytest.mark.slow
@pytest.mark.parametrize("limit", [500, pytest.param(800, marks=pytest.mark.faults)])
def test_an_estimate_stays_within_its_memory(limit: int) -> None:
    """What somebody says that the machine has is what the process takes, libraries and light field included."""
    code = """
import sys
from sepi.process.command import peak_memory_mb
from sepi.optimize import SecondOrderParameters, second_order
from sepi.pipeline import estimate_depth
from sepi.scenes import render
size, views, limit = map(int, sys.argv[1:])
estimate_depth(render("pyramids", size=size, views=views), "best", memory=limit * 2**20)
print(peak_memory_mb())
"""
    # the first one may compile the kernels, for which there is no limit
    for size, views in ((64, 3), (400, 9)):
        words = [sys.executable, "-c", code, *map(str, (size, views, limit))]
        done = subprocess.run(words, capture_output=True, text=True, check=True)
    assert float(done.stdout) <= limit
