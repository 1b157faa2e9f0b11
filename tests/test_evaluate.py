"""Scores: by hand, against a plain twin, with unknown pixels, and as the command that the workflow calls."""

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path

import h5py
import numpy as np
import pytest
from click.testing import CliRunner
from error_lines import done
from geometries import grid_baselines

from sepi import ingest, truth
from sepi.errors import SepiError
from sepi.evaluate import command, evaluation_of, evaluations_of
from sepi.io.hdf5 import read_with_truth, write_light_field, write_stage
from sepi.io.images import write_png
from sepi.io.scores import Evaluation, read_evaluations
from sepi.lightfield import DisparityRange, LightField
from sepi.matching.unknown import unknown_pixels
from sepi.scenes import render, write_hci
from sepi.scoring import regions
from sepi.scoring.scores import EDGE_SCORES, score
from sepi.stage import StageMaps

STAGE_ATTRIBUTES = {"stage": "initial", "choice": "sepi", "parameters": "{}", "made_from": "[]", "version": "0"}


def scene(ground_truth: np.ndarray | None, masks: dict[str, np.ndarray] | None = None, size: int = 40) -> LightField:
    """A light field of noise; only its shape, truth and masks matter here."""
    views = np.random.default_rng(1).integers(0, 256, (3, 3, size, size, 3), np.uint8)
    known = DisparityRange(-1, 1, "given")
    return LightField(views, "noise", "built-in", disparity_range=known, ground_truth=ground_truth, masks=masks or {})


def twin(estimate: np.ndarray, ground_truth: np.ndarray, border: int) -> dict[str, float]:
    """The rules of the two protocols, written without masks and in one place."""
    height, width = ground_truth.shape
    errors = [
        abs(float(estimate[y, x]) - float(ground_truth[y, x]))
        for y in range(border, height - border)
        for x in range(border, width - border)
        if np.isfinite(ground_truth[y, x])
    ]
    good = [e for e in errors if np.isfinite(e)]
    ranked = sorted(100 * e if np.isfinite(e) else float("inf") for e in errors)
    return {
        "mse100": 100 * sum(e * e for e in good) / len(good),
        "q25": ranked[int(0.25 * len(errors))],
        "badpix007": 100 * sum(not e <= 0.07 for e in errors) / len(errors),
        "badpix003": 100 * sum(not e <= 0.03 for e in errors) / len(errors),
        "badpix001": 100 * sum(not e <= 0.01 for e in errors) / len(errors),
        "non_finite": len(errors) - len(good),
        "pixels": len(errors),
    }


@pytest.mark.parametrize("border", [0, 15])
def test_scores_equal_a_plain_twin(border: int) -> None:
    """Both protocols, with holes in truth and estimate: an error here would make every table wrong."""
    random = np.random.default_rng(3)
    ground_truth = random.normal(size=(41, 37)).astype(np.float32)
    estimate = (ground_truth + random.normal(scale=0.05, size=ground_truth.shape)).astype(np.float32)
    ground_truth[random.random(ground_truth.shape) < 0.1] = np.nan
    ground_truth[20, 20] = np.inf
    estimate[random.random(ground_truth.shape) < 0.1] = np.nan
    estimate[18, 18] = -np.inf
    found, expected = score(estimate, ground_truth, border), twin(estimate, ground_truth, border)
    assert {name: found[name] for name in expected} == pytest.approx(expected)
    assert found.keys() - expected.keys() == set(EDGE_SCORES)


def test_unknown_estimates_are_bad_and_reported() -> None:
    """The benchmark's toolkit counts NaN as good; a method must not gain by giving none."""
    ground_truth = np.zeros((2, 2), np.float32)
    scores = score(np.array([[np.nan, np.inf], [0, 1]], np.float32), ground_truth)
    assert scores["badpix007"] == 75
    assert scores["non_finite"] == 2
    assert scores["mse100"] == 50
    nothing = score(np.full((2, 2), np.nan, np.float32), ground_truth)
    assert np.isnan(nothing["mse100"])
    assert nothing["badpix007"] == 100


def test_no_pixels_give_nan_not_a_crash() -> None:
    """A benchmark border wider than a small scene, or a scene without occlusions."""
    flat = np.zeros((20, 20), np.float32)
    for scores in (score(flat, flat, border=15), score(flat, flat, region=np.zeros(flat.shape, bool))):
        assert scores["pixels"] == 0
        assert all(np.isnan(scores[key]) for key in ("mse100", "q25", "badpix007", "badpix003", "badpix001"))


def test_scores_are_by_protocol_and_regions() -> None:
    ground_truth = np.zeros((40, 40), np.float32)
    mask = np.zeros((40, 40), bool)
    mask[:10] = True
    result = evaluation_of(scene(ground_truth, {"occluded": mask}), ground_truth + np.float32(0.05)).scores
    assert list(result) == ["paper", "benchmark"]
    assert list(result["paper"]) == ["all", "occluded", "textureless", "discontinuities"]
    assert result["paper"]["all"]["pixels"] == 1600
    assert result["benchmark"]["all"]["pixels"] == 100
    assert result["paper"]["occluded"]["pixels"] == 400
    assert result["paper"]["all"]["badpix003"] == 100


def test_masks_come_from_the_scene_or_are_computed() -> None:
    ground_truth = np.zeros((40, 40), np.float32)
    ground_truth[10:30, 10:30] = 1
    mask = np.ones((40, 40), bool)
    found = evaluation_of(scene(ground_truth, {"textureless": mask}), ground_truth)
    assert found.region_sources == {"occluded": "computed", "textureless": "scene", "discontinuities": "computed"}
    np.testing.assert_array_equal(found.regions["occluded"], regions.occluded(ground_truth, grid_baselines((3, 3))))
    np.testing.assert_array_equal(found.regions["textureless"], mask)


def test_what_the_ground_truth_does_not_know_counts_nowhere() -> None:
    """Measured truth has holes and margins: scores that follow what an estimate says there would be of nothing."""
    light_field = render("curved_occluders", size=64, views=3)
    random = np.random.default_rng(5)
    unknown = random.random((64, 64)) < 0.2
    unknown[:, :18] = True
    holed = np.where(unknown, np.float32(np.nan), light_field.ground_truth)
    seen = replace(light_field, ground_truth=holed, masks={})
    estimate = (np.roll(light_field.ground_truth, 1, axis=1) + random.normal(0, 0.2, (64, 64))).astype(np.float32)
    elsewhere = {value: np.where(unknown, np.float32(value), estimate) for value in (np.nan, np.inf, -7, 7)}
    found = list(evaluations_of(seen, {str(k): v for k, v in elsewhere.items()}, [0.3, 0.07]).values())
    # a score over no pixels is NaN, which equals nothing
    assert len({str(one.scores) for one in found}) == 1
    whole = found[0].scores["paper"]["all"]
    error = np.abs(estimate - light_field.ground_truth)[~unknown]
    assert (whole["pixels"], whole["non_finite"]) == (error.size, 0)
    assert whole["badpix_0.3"] == pytest.approx(100 * (error > 0.3).mean())
    assert "badpix_0.07" not in whole, "as badpix007 it is there"
    assert found[0].scores["paper"]["occluded"]["pixels"] > 0
    assert not found[0].regions["discontinuities"][unknown].any()
    assert not found[0].regions["occluded"][unknown].any()
    np.testing.assert_array_equal(np.isnan(found[0].error), unknown)


def run_command(
    folder: Path, light_field: LightField, maps: Mapping[str, np.ndarray | StageMaps], output: str = "scores.h5"
) -> tuple[Path, str]:
    """Score these maps as the workflow does; the score file, and what the command said."""
    write_light_field(folder / "lightfield.h5", light_field)
    stages = folder / "stages"
    for name, found in maps.items():
        known = found if isinstance(found, StageMaps) else StageMaps(found, np.ones_like(found))
        write_stage(stages / name / "stage.h5", known, STAGE_ATTRIBUTES)
    files = [stages / name / "stage.h5" for name in maps]
    options = ["--light-field", folder / "lightfield.h5", "--stages", stages, "--output", folder / output]
    words = [str(word) for word in [*options, *files]]
    result = done(*words, of=command)
    return folder / output, result.stderr


def noisy(ground_truth: np.ndarray, seed: int) -> np.ndarray:
    noise = np.random.default_rng(seed).normal(scale=0.05, size=ground_truth.shape)
    return ground_truth + noise.astype(np.float32)


def test_command_writes_what_evaluate_finds(tmp_path: Path) -> None:
    ground_truth = np.random.default_rng(5).normal(size=(40, 40)).astype(np.float32)
    maps = {"sepi": noisy(ground_truth, 6), "sepi/half_sepi": noisy(ground_truth, 7)}
    light_field = scene(ground_truth)
    path, _ = run_command(tmp_path, light_field, maps)
    written, back = read_evaluations(path, with_maps=False), read_evaluations(path)
    assert list(written) == list(back) == list(maps)
    for name, estimate in maps.items():
        assert set(written[name].scores) == {"paper", "benchmark"}
        for protocol, cells in evaluation_of(light_field, estimate).scores.items():
            for region, scores in cells.items():
                assert written[name].scores[protocol][region] == pytest.approx(scores, nan_ok=True)
        found = back[name]
        np.testing.assert_array_equal(found.error, estimate - ground_truth)
        assert found.region_sources == dict.fromkeys(["occluded", "textureless", "discontinuities"], "computed")
        assert found.regions.keys() == found.region_sources.keys()
    assert path.read_bytes() == run_command(tmp_path, light_field, maps, "again.h5")[0].read_bytes()
    # nothing is kept beside the scores: a job that is forced scores anew
    assert {file.name for file in tmp_path.iterdir()} == {"lightfield.h5", "stages", "scores.h5", "again.h5"}


def test_command_scores_error_bars_as_users_get_them(tmp_path: Path) -> None:
    """Of final maps alone; where no view knows anything the interval is the whole range, which holds the truth."""
    seen = render("dots", size=64, views=3)
    seen.views[:, :, :32] = 0
    ones = np.ones((64, 64), np.float32)
    estimate = seen.ground_truth + np.float32(0.3)
    bars = {"sigma": 0.1 * ones, "low": estimate - 0.1 * ones, "high": estimate + 0.1 * ones}
    maps = {"sepi": estimate, "sepi/none": StageMaps(estimate, 0.75 * ones, bars)}
    path, _ = run_command(tmp_path, seen, maps)
    before, final = read_evaluations(path).values()
    assert "coverage" not in before.scores["paper"]["all"]
    assert before.reliability is None
    whole = final.scores["paper"]["all"]
    unknown = unknown_pixels(seen, estimate)
    assert 0.4 < unknown.mean() < 0.6
    assert whole["coverage"] == pytest.approx(100 * unknown.mean())
    pixels, said, found = final.reliability
    assert (pixels[0], pixels[7]) == (unknown.sum(), (~unknown).sum())
    assert (said[0], said[7], found[0], found[7]) == (0, 0.75, 0, 0)
    alone = read_evaluations(path, ["sepi/none"], with_maps=False)["sepi/none"]
    np.testing.assert_array_equal(alone.reliability, final.reliability)
    assert (alone.scores, alone.error, alone.regions) == (final.scores, None, {})


def test_command_says_that_there_is_no_truth(tmp_path: Path) -> None:
    """A real picture goes through the workflow: a file is written, without scores."""
    path, told = run_command(tmp_path, scene(None), {"sepi": np.zeros((40, 40), np.float32)})
    assert "no ground truth, no scores" in told
    assert read_evaluations(path) == {"sepi": Evaluation()}
    with h5py.File(path) as file:
        assert not file.attrs["ground_truth"]
        assert file.attrs["scene"] == "noise"


def test_a_map_that_was_not_scored_is_named(tmp_path: Path) -> None:
    path, _ = run_command(tmp_path, scene(None), {"sepi": np.zeros((40, 40), np.float32)})
    with pytest.raises(SepiError, match=r"no scores of 'sepi/wang'; it holds: sepi$"):
        read_evaluations(path, ["sepi/wang"])


@pytest.mark.parametrize("kind", ["built-in", "folder", "file"])
def test_ground_truth_lies_apart_whatever_the_scene_is(tmp_path: Path, kind: str) -> None:
    """In the light field's own file, new ground truth would ask for all maps; lost, the scene would have no scores."""
    whole = render("dots", size=64, views=3)
    built_in = ["dots", "--module", "sepi.scenes.light_field", "--set", "size=64", "--set", "views=3"]
    words = built_in if kind == "built-in" else [str(tmp_path / kind)]
    if kind == "folder":
        write_hci(whole, tmp_path / kind)
    elif kind == "file":
        write_light_field(tmp_path / kind, whole)
    views, apart = tmp_path / "lightfield.h5", tmp_path / "truth.h5"
    for main, output in ((ingest.main, views), (truth.main, apart)):
        done(*words, "--output", output, of=main)
    alone = read_with_truth(views, None)
    assert (alone.ground_truth, alone.masks) == (None, {})
    found = read_with_truth(views, apart)
    np.testing.assert_array_equal(found.views, whole.views)
    np.testing.assert_array_equal(found.ground_truth, whole.ground_truth)
    assert {name: mask.tolist() for name, mask in found.masks.items()} == {
        k: v.tolist() for k, v in whole.masks.items()
    }
    # a file of one's own takes the place of the light field's, of which the masks stay
    own = tmp_path / "own.png"
    write_png(own, np.pad(np.full((60, 64), 9, np.uint8), ((4, 0), (0, 0))))
    flags = ["--truth", str(own), "--truth-scale", "0.5", "--light-field", str(views), "--output", str(apart)]
    assert CliRunner().invoke(truth.main, [*words, *flags]).exit_code == 0
    found = read_with_truth(views, apart)
    np.testing.assert_array_equal(np.isnan(found.ground_truth).sum(1), [64] * 4 + [0] * 60)
    assert np.nanmin(found.ground_truth) == np.nanmax(found.ground_truth) == 4.5
    assert found.masks.keys() == whole.masks.keys()
    write_light_field(views, scene(None))
    result = CliRunner().invoke(truth.main, flags)
    assert f"{own}: ground truth is (64, 64), the views are (40, 40)" in result.output
    with pytest.raises(SepiError, match=f"^{apart}: .*ground_truth must be numbers of shape"):
        read_with_truth(views, apart)
