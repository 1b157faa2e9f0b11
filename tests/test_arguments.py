"""Wrong arguments in Python are told at once and in one line, not by wrong maps or another exception later."""

from collections.abc import Callable
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import sepi
from sepi.camera import camera_from
from sepi.evaluate import evaluation_of, evaluations_of
from sepi.inspection.disparity_range import estimate_range
from sepi.inspection.view_order import check_order
from sepi.io.disparity_maps import read_disparity, read_pfm, write_pfm
from sepi.io.hdf5 import write_light_field
from sepi.io.map_pictures import colour_code
from sepi.io.point_cloud import point_cloud, write_ply
from sepi.matching.sheared_views import ShearedViews
from sepi.matching.stitched_epi import stitched_epi
from sepi.matching.unknown import unknown_pixels
from sepi.process.threads import use_threads
from sepi.scenes import render, write_hci
from sepi.scoring.error_bars import oracle, sparsification
from sepi.scoring.regions import edges_of, occluded, textureless
from sepi.scoring.scores import region_masks, score, score_regions
from sepi.variants import VARIANTS, stage_parameters

VIEWS = np.zeros((3, 3, 64, 64, 3), np.uint8)


SCENE = render("dots", size=64, views=3)
ONES = np.ones((64, 64), np.float32)


MAPS = sepi.StageMaps(ONES, ONES)
LENS = {"focal_length_mm": 1, "baseline_mm": 1, "focus_distance_m": 1, "sensor_size_mm": 1, "shape": (64, 64)}

Calls = list[tuple[Callable[..., object], dict[str, Any]]]

# functions with arguments that would do, each of which is exchanged for what none of them takes
CALLS: Calls = [
    (
        partial(sepi.LightField, views=VIEWS, name="mine"),
        dict.fromkeys(
            ["positions", "disparity_range", "camera", "view", "row_spacing", "notes", "ground_truth", "reading"]
        ),
    ),
    (partial(sepi.LightField, name="mine"), {"views": VIEWS}),
    (partial(sepi.LightField, views=VIEWS), {"name": "mine"}),
    (partial(sepi.DisparityRange, source="given"), {"minimum": 0, "maximum": 1}),
    (sepi.Camera, {"scale": 1, "offset": 1, "focal_px": 1}),
    (camera_from, LENS),
    (sepi.read_light_field, {"path": "anywhere", "options": sepi.ReadOptions(), "disparity_range": (0, 1)}),
    (sepi.ReadOptions, dict.fromkeys(["grid", "exclude", "central", "pattern", "view", "white", "row_spacing"])),
    (partial(sepi.estimate_depth, SCENE), {"variant": "fast", "parameters": {}, "memory": None}),
    (sepi.estimate_depth, {"light_field": SCENE}),
    (sepi.write_result, {"folder": "unwritten", "light_field": SCENE, "maps": MAPS, "attributes": {}, "seconds": 1}),
    (sepi.read_result, {"path": "unwritten"}),
    (partial(render, "dots"), {"size": 64}),
    (write_hci, {"light_field": SCENE, "folder": "unwritten"}),
    (write_light_field, {"path": "unwritten", "light_field": SCENE}),
    (read_disparity, {"path": Path(__file__), "scale": 1.0, "offset": 0.0}),
    (write_pfm, {"path": "unwritten", "values": ONES}),
    (read_pfm, {"path": "unwritten"}),
    (point_cloud, {"picture": VIEWS[0, 0], "disparity": ONES}),
    (partial(write_ply, "unwritten"), {"cloud": None}),
    (colour_code, {"values": ONES}),
    (unknown_pixels, {"light_field": SCENE, "disparity": ONES}),
    (use_threads, {"count": 1}),
    (ShearedViews, {"light_field": SCENE}),
    (stitched_epi, {"light_field": SCENE, "y": 3, "disparity": 0}),
    (estimate_range, {"light_field": SCENE}),
    (check_order, {"light_field": SCENE, "read_in": "as-given"}),
    (score, {"estimate": ONES, "ground_truth": ONES}),
    (score_regions, {"estimate": ONES, "ground_truth": ONES}),
    (region_masks, {"light_field": SCENE}),
    (evaluation_of, {"light_field": SCENE, "maps": ONES}),
    (evaluations_of, {"light_field": SCENE, "maps": {}}),
    (edges_of, {"ground_truth": ONES}),
    (occluded, {"ground_truth": ONES}),
    (textureless, {"reference_view": ONES}),
    (sparsification, {"confidence": ONES}),
    (oracle, {"error": ONES}),
    (stage_parameters, {"variant": VARIANTS["paper"]}),
]


def exchanged(calls: Calls) -> list[Any]:
    """Each of the calls with one of its arguments to exchange."""
    return [
        pytest.param(function, given, name, id=f"{getattr(function, 'func', function).__name__}-{name}")
        for function, given in calls
        for name in given
    ]


def refused(function: Callable[..., object], given: dict[str, Any], name: str, here: Path) -> None:
    """A call with an argument that nothing takes is told in one line, and writes nothing."""
    more = {"baselines": SCENE.baselines} if function is occluded else {}
    more |= {"error": ONES} if function is sparsification else {}
    values = {key: value for key, value in given.items() if value is not None} | more
    with pytest.raises(sepi.SepiError) as caught:
        function(**values | {name: object()})
    assert str(caught.value).isprintable()
    assert not list(here.iterdir())


@pytest.mark.parametrize(("function", "given", "name"), exchanged(CALLS))
def test_an_argument_of_another_type_is_told(
    function: Callable[..., object], given: dict[str, Any], name: str, here: Path
) -> None:
    refused(function, given, name, here)


# of the right type, and wrong all the same
WRONG: dict[str, tuple[Callable[[], object], str]] = {
    "pixels before views": (
        lambda: sepi.LightField(np.zeros((64, 64, 5, 5, 3), np.uint8), "mine"),
        r"mine: .*64x64 views of 5x5.*transpose",
    ),
    "equal positions": (lambda: sepi.LightField(VIEWS, "mine", positions=np.zeros((3, 3, 2))), "mine: positions must"),
    "far range": (
        lambda: sepi.estimate_depth(SCENE.with_range(sepi.DisparityRange(-1e6, 1e6, "given"))),
        "dots: disparity range .* 64",
    ),
    "parameters as number": (lambda: sepi.estimate_depth(SCENE, "paper", {"initial": 3}), "initial: expected"),
    "complex map": (lambda: write_maps(ONES.astype(complex)), "dots: map 'disparity': expected numbers"),
    "confidence without numbers": (lambda: write_maps(ONES, ONES * np.nan), "confidence must lie within 0..1"),
    "unknown in numbers": (lambda: write_maps(unknown=ONES.astype(np.uint8)), "map 'unknown': expected bool"),
    "unknown by a small map": (lambda: unknown_pixels(SCENE, ONES[:5]), r"dots: disparity: .*\(64, 64\)"),
}


def write_maps(disparity: np.ndarray = ONES, confidence: np.ndarray = ONES, **extra: np.ndarray) -> None:
    sepi.write_result("unwritten", SCENE, sepi.StageMaps(disparity, confidence, extra))


@pytest.mark.parametrize("wrong", WRONG)
def test_a_wrong_argument_is_told_in_one_line(wrong: str, here: Path) -> None:
    make, message = WRONG[wrong]
    with pytest.raises(sepi.SepiError, match=message):
        make()
    assert not list(here.iterdir())


def test_lists_and_numbers_of_numpy_are_what_they_look_like() -> None:
    light_field = render("dots", size=64, views=3)
    assert replace(light_field, view=[0, 2]).reference_position == (0, 2)  # type: ignore[arg-type]
    assert sepi.ReadOptions(view=np.array([0, 2])).view == (0, 2)  # type: ignore[arg-type]
    assert replace(SCENE, ground_truth=np.zeros((64, 64))).ground_truth.dtype == np.float32  # type: ignore[union-attr]
    settings = stage_parameters(VARIANTS["paper"], {"initial": {"num_disparities": np.int64(31)}})
    assert settings["initial"].num_disparities == 31  # type: ignore[attr-defined]


@pytest.mark.parametrize("kind", [float, int])
def test_maps_of_other_numbers_are_written_as_float32(kind: type, tmp_path: Path) -> None:
    sepi.write_result(tmp_path / "maps", SCENE, sepi.StageMaps(ONES.astype(kind), ONES.astype(kind)))
    result = sepi.read_result(tmp_path / "maps")
    assert result.disparity.dtype == result.confidence.dtype == np.float32
    assert np.load(tmp_path / "maps/disparity.npy").dtype == np.float32
