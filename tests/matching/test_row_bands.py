"""Bands of rows: as many as memory asks for, and the same bytes whatever their number."""

import subprocess
import sys
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from geometries import GEOMETRIES, standing

from sepi.errors import SepiError
from sepi.lightfield import DisparityRange, LightField
from sepi.matching import row_bands as module
from sepi.matching.memory_limit import bytes_of_bands
from sepi.matching.row_bands import FEWEST_ROWS, row_bands
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


def test_bands_are_never_narrower_than_useful() -> None:
    field = LightField(np.zeros((5, 5, 200, 40, 3), np.uint8), "grid", workspace=Workspace(1))
    assert all(band.end - band.begin >= FEWEST_ROWS - 1 for band in row_bands(field, field.present, 1.5, 10))


@pytest.mark.parametrize("geometry", GEOMETRIES)
@pytest.mark.parametrize("variant", ["best", "best_no_detail"])
def test_maps_are_the_same_for_any_number_of_bands(variant: str, geometry: str, monkeypatch: Any) -> None:
    """Someone with less memory gets the map that others get."""
    scene = render("wall", size=64)
    field = LightField(
        scene.views[2:7, 2:7], "wall", disparity_range=scene.disparity_range, **standing(geometry, (5, 5))
    )
    numbers = []
    bands = module.row_bands
    for name in ("sepi.matching.visibility_sweep", "sepi.boundaries.surface_shares", "sepi.matching.aligned_views"):
        monkeypatch.setattr(
            f"{name}.row_bands", lambda *arguments: numbers.append(len(found := bands(*arguments))) or found
        )
    few = {"initial": {"num_disparities": 21}, "occlusion": {"num_disparities": 21}}
    at_once = estimate_depth(field, variant, few)
    assert set(numbers) == {1}
    numbers.clear()
    # with memory for the detail of all views beside the bands, and without
    for room in (None, 0):
        if room is not None:
            monkeypatch.setattr("sepi.pipeline.bytes_of_volumes", lambda *_, room=room: room)
        in_bands = estimate_depth(replace(field, workspace=Workspace(1)), variant, few)
        assert set(numbers) == {4}
        np.testing.assert_array_equal(in_bands.disparity, at_once.disparity)
        np.testing.assert_array_equal(in_bands.confidence, at_once.confidence)
        for name, values in at_once.extra.items():
            np.testing.assert_array_equal(in_bands.extra[name], values)


def test_a_limit_on_memory_leaves_the_rest_to_the_bands() -> None:
    field = LightField(
        np.zeros((5, 5, 400, 500, 3), np.uint8), "grid", disparity_range=DisparityRange(-1.5, 1.5, "given")
    )
    stages = list(stage_parameters(variant_named("best")).values())
    megabyte = 2**20
    few, many = (bytes_of_bands(field, stages, n * megabyte) for n in (600, 800))
    assert many - few == 200 * megabyte
    with pytest.raises(SepiError, match=r"grid: .* at least \d+ MB .* 100 MB"):
        bytes_of_bands(field, stages, 100 * megabyte)
    # 91 candidates of 400 x 500 pixels are 139 MB
    assert bytes_of_bands(field, list(stage_parameters(variant_named("paper")).values()), 600 * megabyte) > few


def test_a_limit_on_memory_counts_what_each_thread_of_a_plane_sweep_holds(monkeypatch: pytest.MonkeyPatch) -> None:
    """961 candidates of eight groups of views take dozens of megabytes a thread, however small the picture."""
    field = LightField(np.zeros((3, 3, 64, 512, 3), np.uint8), "a", disparity_range=DisparityRange(-1, 1, "given"))
    many = {stage: {"num_disparities": 961} for stage in ("initial", "occlusion")}
    stages = list(stage_parameters(variant_named("paper"), many).values())
    left = []
    for threads in (1, 2):
        monkeypatch.setattr("sepi.matching.memory_limit.threads_used", lambda threads=threads: threads)
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
