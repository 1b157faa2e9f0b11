"""Wrong arguments in Python are told at once and in one line, not by wrong maps or another exception later."""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import sepi
from sepi.camera import camera_from
from sepi.evaluate import evaluation_of, evaluations_of
from sepi.inspection.disparity_range import estimate_range
from sepi.inspection.view_order import check_order
from sepi.io.disparity_maps import read_disparity
from sepi.io.hdf5 import write_light_field
from sepi.io.map_pictures import colour_code
from sepi.io.pfm import read_pfm, write_pfm
from sepi.io.ply import write_ply
from sepi.io.point_cloud import point_cloud
from sepi.matching.sheared_views import ShearedViews
from sepi.matching.stitched_epi import stitched_epi
from sepi.matching.unknown import unknown_pixels
from sepi.process.threads import use_threads
from sepi.scenes import render, write_hci
from sepi.scoring.confidence import oracle, sparsification
from sepi.scoring.edges import edges_of
from sepi.scoring.regions import occluded, textureless
from sepi.scoring.scores import region_masks, score, score_regions
from sepi.variants import VARIANTS, stage_parameters

VIEWS = np.zeros((3, 3, 64, 64, 3), np.uint8)


SCENE = render("dots", size=64, views=3)
ONES = np.ones((64, 64), np.float32)


def camera(**more: Any) -> Callable[[], object]:
    numbers = {"focal_length_mm": 1, "baseline_mm": 1, "focus_distance_m": 1, "sensor_size_mm": 1, "shape": (64, 64)}
    return lambda: camera_from(**{**numbers, **more})


def read(path: Any = "anywhere", **more: Any) -> Callable[[], object]:
    return lambda: sepi.read_light_field(path, **more)


def depth(*arguments: Any, **more: Any) -> Callable[[], object]:
    return lambda: sepi.estimate_depth(*arguments, **more)


def write(disparity: Any = ONES, confidence: Any = ONES, **extra: Any) -> Callable[[], object]:
    return lambda: sepi.write_result("unwritten", SCENE, sepi.StageMaps(disparity, confidence, extra))


def written(*arguments: Any, **more: Any) -> Callable[[], object]:
    return lambda: sepi.write_result(*arguments, **more)


def call(function: Callable[..., object], *arguments: Any, **more: Any) -> Callable[[], object]:
    return lambda: function(*arguments, **more)


def field(**more: Any) -> Callable[[], object]:
    return lambda: sepi.LightField(**{"views": VIEWS, "name": "mine", **more})


WRONG: dict[str, tuple[Callable[[], object], str]] = {
    "pixels before views": (
        field(views=np.zeros((64, 64, 5, 5, 3), np.uint8)),
        r"mine: .*64x64 views of 5x5.*transpose",
    ),
    "equal positions": (field(positions=np.zeros((3, 3, 2))), "mine: positions must differ"),
    "positions of text": (field(positions=np.full((3, 3, 2), "a")), "mine: positions must be finite"),
    "list of positions": (field(positions=[[0, 0]]), "mine: positions: expected an array"),
    "far range": (
        depth(SCENE.with_range(sepi.DisparityRange(-1e6, 1e6, "given"))),
        "dots: disparity range .* 64",
    ),
    "range as tuple": (
        field(disparity_range=(-1, 1)),
        r"mine: disparity_range: expected a DisparityRange, got \(-1, 1\)",
    ),
    "range of text": (lambda: sepi.DisparityRange("a", 1, "given"), "got 'a' and 1"),  # type: ignore[arg-type]
    "camera as tuple": (field(camera=(1, 2, 3)), "mine: camera: expected a Camera"),
    "camera of text": (lambda: sepi.Camera("a", 1, 1), "camera: expected"),  # type: ignore[arg-type]
    "view of three": (field(view=(0, 0, 0)), "mine: view: expected two whole numbers"),
    "view between": (field(view=(0.5, 0)), "mine: view: expected two whole numbers"),
    "path as name": (field(name=Path("mine")), "name of the light field: expected text"),
    "masks of numbers": (
        field(masks={"sky": np.ones((64, 64), np.uint8)}),
        "mine: masks must be bool, got sky of uint8",
    ),
    "spacing of text": (field(row_spacing="a"), "mine: row_spacing must be a positive number, got 'a'"),
    "text as notes": (field(notes="abc"), "mine: notes: expected a tuple of texts, got 'abc'"),
    "numbers as notes": (field(notes=(1,)), "mine: notes: expected a tuple of texts, got 1"),
    "ground truth of text": (field(ground_truth=np.full((64, 64), "a")), "mine: ground_truth must be float32"),
    "source of a range": (
        field(disparity_range=sepi.DisparityRange(0, 1, "mine")),
        "mine: source of the disparity range: unknown 'mine'; known: parameters, given, estimated",
    ),
    "camera of texts": (camera(focal_length_mm="a"), "camera: expected positive numbers, got focal length 'a' mm"),
    "camera's shape": (camera(shape=64), "camera: shape: expected height and width of a view, got 64"),
    "no path": (read(None), "light field: expected the path of a file or folder, got None"),
    "options as mapping": (read(options={"view": (0, 0)}), "anywhere: options: expected sepi.ReadOptions"),
    "range of three": (read(disparity_range=(1, 2, 3)), r"disparity_range: expected \(minimum, maximum\)"),
    "range of one": (read(disparity_range=3), r"disparity_range: expected \(minimum, maximum\), got 3"),
    "depth of a path": (depth("dots"), "light field: expected a LightField, .*, got 'dots'"),
    "depth by no variant": (depth(SCENE, None), "variant: expected the name of a variant or a Variant, got None"),
    "parameters as number": (depth(SCENE, "paper", {"initial": 3}), "parameters: initial: expected parameters"),
    "parameters as list": (depth(SCENE, "paper", [1]), "parameters: expected stages"),
    "memory as text": (depth(SCENE, memory="1"), "memory: expected a number of bytes, got '1'"),
    "result of an array": (written("unwritten", VIEWS, None), "light field: expected a LightField"),
    "result of a map": (written("unwritten", SCENE, ONES), "dots: maps: expected StageMaps"),
    "result nowhere": (written(None, SCENE, sepi.StageMaps(ONES, ONES)), "folder of the result: expected a path"),
    "attributes as list": (
        written("unwritten", SCENE, sepi.StageMaps(ONES, ONES), [1]),
        r"unwritten: attributes: expected names with values, got \[1\]",
    ),
    "maps as lists": (write([[1]]), "dots: map 'disparity': expected an array"),
    "complex maps": (write(ONES.astype(complex)), "dots: map 'disparity': expected numbers, got complex128"),
    "confidence without numbers": (write(ONES, ONES * np.nan), "dots: confidence must lie within 0..1, got NaN"),
    "numbers of unknown": (write(unknown=ONES.astype(np.uint8)), "dots: map 'unknown': expected bool, got uint8"),
    "text as seconds": (written("unwritten", SCENE, sepi.StageMaps(ONES, ONES), seconds="a"), "unwritten: seconds: "),
    "size of text": (call(render, "dots", size="a"), "size must be a whole number"),
    "scene of an array": (call(write_hci, VIEWS, "unwritten"), "light field: expected a LightField"),
    "scene to nowhere": (call(write_hci, SCENE, None), "folder of the light field: expected a path, got None"),
    "light field of an array": (call(write_light_field, "unwritten", VIEWS), "light field: expected a LightField"),
    "light field to nowhere": (call(write_light_field, None, SCENE), "light field to write: expected a path"),
    "result from nowhere": (call(sepi.read_result, None), "result: expected a path, got None"),
    "map from nowhere": (call(read_disparity, 3), "disparity map: expected a path, got 3"),
    "scale of text": (call(read_disparity, Path(__file__), scale="a"), "scale: expected a finite number, got 'a'"),
    "no number as scale": (
        call(read_disparity, Path(__file__), scale=np.nan),
        "scale: expected a finite number, got nan",
    ),
    "PFM of colours": (call(write_pfm, "unwritten", VIEWS[0, 0]), r"unwritten: expected .* \(H, W\), got uint8"),
    "PFM from nowhere": (call(read_pfm, None), "PFM to read: expected a path"),
    "points of a map": (call(write_ply, "unwritten", ONES), "unwritten: positions: expected an array"),
    "points of text": (call(point_cloud, VIEWS[0, 0], "a"), "point cloud: disparity: expected an array"),
    "colours of text": (call(colour_code, "a"), "map to colour: expected an array"),
    "unknown in an array": (call(unknown_pixels, VIEWS, ONES), "light field: expected a LightField"),
    "unknown by a small map": (
        call(unknown_pixels, SCENE, ONES[:5]),
        r"dots: disparity: .*\(64, 64\), got float32 \(5",
    ),
    "threads of text": (call(use_threads, "a"), "threads: expected a whole number from 1 on, got 'a'"),
    "no threads": (call(use_threads, 0), "threads: expected a whole number from 1 on, got 0"),
    "sheared array": (call(ShearedViews, VIEWS), "light field: expected a LightField"),
    "row of text": (call(stitched_epi, SCENE, "a", 0), "dots: row: expected a whole number"),
    "stitched by text": (call(stitched_epi, SCENE, 3, "a"), "dots: disparity must be a finite number"),
    "range of an array": (call(estimate_range, VIEWS), "light field: expected a LightField"),
    "order of an array": (call(check_order, VIEWS), "light field: expected a LightField"),
    "unknown order": (call(check_order, SCENE, "a"), "order: unknown 'a'; known: as-given"),
    "score of text": (call(score, "a", ONES), "estimate: expected an array"),
    "score by text": (call(score_regions, ONES, "a"), "ground_truth: expected an array"),
    "regions of an array": (call(region_masks, VIEWS), "light field: expected a LightField"),
    "evaluation of an array": (call(evaluation_of, VIEWS, ONES), "light field: expected a LightField"),
    "evaluation of a small map": (call(evaluation_of, SCENE, ONES[:5]), "dots: disparity: expected an array"),
    "evaluations of one map": (call(evaluations_of, SCENE, ONES), "dots: maps: expected names with their maps"),
    "edges of text": (call(edges_of, "a"), "ground truth: expected an array"),
    "hidden by text": (call(occluded, "a", SCENE.baselines), "ground truth: expected an array"),
    "texture of text": (call(textureless, "a"), "reference view: expected an array"),
    "confidence of text": (call(sparsification, "a", ONES), "confidence: expected an array"),
    "best confidence of text": (call(oracle, "a"), "error: expected an array"),
    "parameters of no variant": (call(stage_parameters, None), "variant: expected a Variant, got None"),
    "number as reading": (field(reading=3), "mine: reading: expected text, got 3"),
    "options: grid": (lambda: sepi.ReadOptions(grid="5x5"), "options: grid: expected two whole"),  # type: ignore[arg-type]
    "options: exclude": (lambda: sepi.ReadOptions(exclude=((0, 0),)), "options: exclude: "),  # type: ignore[arg-type]
    "options: central": (lambda: sepi.ReadOptions(central="3"), "options: central: "),  # type: ignore[arg-type]
    "options: pattern": (lambda: sepi.ReadOptions(pattern=3), "options: pattern: "),  # type: ignore[arg-type]
}


@pytest.mark.parametrize("wrong", WRONG)
def test_a_wrong_argument_is_told_in_one_line(wrong: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    make, message = WRONG[wrong]
    with pytest.raises(sepi.SepiError, match=message):
        make()
    assert not list(tmp_path.iterdir())


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
