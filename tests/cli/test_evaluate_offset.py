"""`sepi evaluate --offset`: the map of a crop is scored as the whole map is over the crop's pixels."""

import json
import math
import shutil
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from error_lines import call, done, error_of

from sepi.io.disparity_maps import write_pfm
from sepi.io.readers.options import ReadOptions
from sepi.io.result_folder import write_result
from sepi.lightfield import LightField
from sepi.reading import read_light_field
from sepi.scenes import render, write_hci
from sepi.scoring.regions import in_frame
from sepi.scoring.scores import PROTOCOLS, region_masks, score, score_regions
from sepi.stage import StageMaps

OFFSET, SIZE = (9, 17), (40, 33)
PLACE = np.s_[9:49, 17:50]


@pytest.fixture(scope="module")
def light_field() -> LightField:
    return render("curved_occluders", size=64, views=3)


@pytest.fixture(scope="module")
def estimate(light_field: LightField) -> np.ndarray:
    """A map with errors of its own at every pixel, depth discontinuities included, and a pixel without a value."""
    random = np.random.default_rng(3)
    values = np.roll(light_field.ground_truth, 1, axis=1) + random.normal(0, 0.05, (64, 64)).astype(np.float32)
    values[20, 20] = np.nan
    return np.asarray(values, np.float32)


@pytest.fixture
def files(light_field: LightField, estimate: np.ndarray, here: Path) -> Path:
    """The scene, its ground truth alone, the whole map and that of a crop, in the current folder."""
    write_hci(light_field, Path("scene"))
    write_pfm(Path("truth.pfm"), light_field.ground_truth)
    write_pfm(Path("whole.pfm"), estimate)
    np.save("crop.npy", estimate[PLACE])
    return here


def same(one: dict[str, Any], other: dict[str, Any]) -> bool:
    return all(one[name] == other[name] or (math.isnan(one[name]) and math.isnan(other[name])) for name in one)


def test_a_crop_scores_as_the_whole_map_does_over_its_pixels(light_field: LightField, estimate: np.ndarray) -> None:
    """To the last bit, in every region and protocol: else numbers of maps with and without margins do not compare."""
    truth = light_field.ground_truth
    whole, inside = in_frame(estimate[PLACE], OFFSET, truth.shape)
    assert np.count_nonzero(inside) == SIZE[0] * SIZE[1]
    masks = region_masks(light_field)
    found = score_regions(whole, truth, masks, within=inside)
    for protocol, border in PROTOCOLS.items():
        assert same(found[protocol]["all"], score(estimate, truth, border, inside))
        for name, mask in masks.items():
            assert same(found[protocol][name], score(estimate, truth, border, inside & mask))
    assert found["paper"]["all"]["pixels"] == SIZE[0] * SIZE[1]
    assert found["paper"]["all"]["non_finite"] == 1
    # 15 pixels of the whole picture's border, of which the crop leaves out 9 rows and 17 columns already
    assert found["benchmark"]["all"]["pixels"] == (49 - 15) * (49 - 17)
    assert found["paper"]["discontinuities"]["pixels"] > 50


@pytest.mark.parametrize("truth", ["scene", "truth.pfm"])
def test_the_command_says_which_part_it_scored(files: Path, estimate: np.ndarray, truth: str) -> None:
    """In the text and in the JSON, so that a score of a part is not taken for one of the whole."""
    called = done("evaluate", "crop.npy", truth, "--offset", "9,17")
    first, head = called.stdout.splitlines()[:2]
    assert first.startswith("crop: rows 9 to 48, columns 17 to 49 of 64x64")
    assert head.split()[:2] == ["protocol", "region"]
    told = json.loads(call("evaluate", "crop.npy", truth, "--offset", "9,17", "--json").stdout)
    assert told["crop"] == {"offset": [9, 17], "shape": [40, 33], "whole": [64, 64]}
    assert told["paper"]["all"]["pixels"] == SIZE[0] * SIZE[1]
    assert ("occluded" in told["paper"]) == (truth == "scene")
    # of any other place the scores are those of a map that does not fit
    wrong = json.loads(call("evaluate", "crop.npy", truth, "--offset", "9,12", "--json").stdout)
    assert wrong["paper"]["all"]["mse100"] > 3 * told["paper"]["all"]["mse100"]


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (("crop.npy", "--offset", "25,17"), "crop.npy: 33x40 pixels (width x height) from column 17, row 25"),
        (("crop.npy", "--offset", "9,32"), "column 32, row 9 do not fit into 64x64"),
        (("large.npy", "--offset", "0,0"), "large.npy: 64x65 pixels"),
        (("crop.npy",), "(64, 64), the estimate (40, 33) (height, width); for a crop, give --offset"),
    ],
)
def test_a_crop_that_does_not_fit_is_one_line(files: Path, words: tuple[str, ...], message: str) -> None:
    np.save("large.npy", np.zeros((65, 64), np.float32))
    assert message in error_of(call("evaluate", words[0], "scene", *words[1:]))


def test_whole_truth_is_cut_as_the_views_were(files: Path, light_field: LightField, estimate: np.ndarray) -> None:
    """Who crops the views has the truth of the whole picture still: in the folder, as a file, or with the map alone."""
    (top, left), (height, width) = OFFSET, SIZE
    masks = {name: mask[PLACE] for name, mask in light_field.masks.items()}
    views = light_field.views[:, :, top : top + height, left : left + width]
    write_hci(replace(light_field, views=views, ground_truth=light_field.ground_truth[PLACE], masks=masks), Path("cut"))
    expected = json.loads(call("evaluate", "crop.npy", "cut", "--json").stdout)
    for name in ("parameters.cfg", "gt_disp_lowres.pfm", *(f"mask_{name}.png" for name in masks)):
        shutil.copy(f"scene/{name}", f"cut/{name}")
    part = f"64x64+{left}+{top}"
    assert json.loads(call("evaluate", "crop.npy", "cut", "--json", "--crop-of", part).stdout) == expected
    # a result says itself how its views were cut
    maps = StageMaps(estimate[PLACE], np.ones(SIZE, np.float32))
    write_result("depth", read_light_field("cut", options=ReadOptions(crop_of=part)), maps)
    for words in (
        ("crop.npy", "truth.pfm", "--crop-of", part),
        ("crop.npy", "--truth", "truth.pfm", "--crop-of", part),
        ("depth", "truth.pfm"),
        ("depth", "cut"),
        ("depth", "cut", "--truth", "truth.pfm"),
    ):
        found = json.loads(call("evaluate", *words, "--json").stdout)
        assert same(found["paper"]["all"], expected["paper"]["all"]), words
    # nothing is cut by guess
    for wrong, size in ((f"64x63+{left}+{top}", (64, 64)), ("64x64+40+40", (24, 24))):
        told = call("evaluate", "crop.npy", "truth.pfm", "--crop-of", wrong)
        assert (told.exit_code, told.stderr.count("\n")) == (1, 1)
        assert str(size) in told.stderr
        assert str(SIZE) in told.stderr
