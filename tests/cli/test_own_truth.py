"""Ground truth of a user's own, beside a light field that has none, on the command line."""

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from error_lines import call, error_of

from sepi.io.disparity_maps import write_pfm
from sepi.io.hdf5 import write_light_field
from sepi.io.images import write_png
from sepi.io.result_folder import write_result
from sepi.io.scores import without_nan
from sepi.lightfield import LightField
from sepi.reading import read_light_field
from sepi.scenes import render
from sepi.scoring.scores import region_masks, score_regions
from sepi.stage import StageMaps

# row and column of the view whose truth it is, not the centre
VIEW = (1, 2)
SCALE = 1 / 32


@pytest.fixture
def seen(here: Path) -> LightField:
    """The light field as its truth has it; in the current folder that without truth, its map, and truth as a picture.

    The truth is a fiction: scores ask no more of it than that it is the one in the file.
    """
    plain = replace(render("curved_occluders", size=64, views=3), ground_truth=None, masks={})
    write_light_field(Path("plain.h5"), plain)
    levels = np.full((64, 64), 20, np.uint8)
    levels[20:40, 20:40] = 90
    levels[:10] = 0
    write_png(Path("truth.png"), levels)
    write_pfm(Path("small.pfm"), np.zeros((60, 64), np.float32))
    write_png(Path("nothing.png"), np.zeros((64, 64), np.uint8))
    Path("text.png").write_text("hello")
    truth = np.where(levels > 0, np.float32(SCALE) * levels, np.float32(np.nan))
    estimate = np.nan_to_num(truth) + np.random.default_rng(1).normal(0, 0.2, (64, 64)).astype(np.float32)
    found = replace(plain.seen_from(VIEW), ground_truth=truth)
    write_result("map", found, StageMaps(estimate, np.ones((64, 64), np.float32)))
    np.save("map.npy", estimate)
    return found


def test_a_map_is_scored_against_a_file(seen: LightField) -> None:
    """Of the view that the map is of, with the regions that its views show; or without the light field."""
    estimate = np.load("map.npy")
    flags = ("--truth", "truth.png", "--truth-scale", SCALE, "--bad", 0.25, "--json")
    expected: Any = without_nan(score_regions(estimate, seen.ground_truth, region_masks(seen), thresholds=[0.25]))
    assert expected["paper"]["occluded"]["pixels"] > 0
    told = json.loads(call("evaluate", "map", "plain.h5", *flags).stdout)
    assert told["paper"]["occluded"] == expected["paper"]["occluded"]
    alone = json.loads(call("evaluate", "map.npy", *flags).stdout)
    assert alone["paper"]["all"] == told["paper"]["all"] == expected["paper"]["all"]
    assert alone["paper"]["all"]["pixels"] == 54 * 64
    assert alone["paper"].keys() == {"all", "discontinuities"}
    head, row, *_ = call("evaluate", "map", *flags[:-1]).stdout.splitlines()
    assert head.split("BadPix ")[-1].startswith("0.25 %")
    assert f"{expected['paper']['all']['badpix_0.25']:.3f}" in row.split()


@pytest.mark.extension("formats")
def test_export_keeps_it_for_every_command(seen: LightField) -> None:
    """Named once, it needs no flags any more: neither file, nor scale, nor view."""
    flags = ("--truth", "truth.png", "--truth-scale", SCALE, "--view", "1,2", "--disparity-range", -3, 3)
    assert call("export", "plain.h5", "both", *flags).exit_code == 0
    np.testing.assert_array_equal(read_light_field("both").ground_truth, seen.ground_truth)
    assert read_light_field("both").reference_position == VIEW
    wanted = call("evaluate", "map", "plain.h5", "--truth", "truth.png", "--truth-scale", SCALE).stdout
    assert call("evaluate", "map", "both").stdout == wanted
    assert call("compare", "map", "map.npy", "plain.h5", *flags[:4]).stdout.startswith(f"map\n{wanted}")


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (("map", "--truth", "absent.pfm"), "absent.pfm: no such file"),
        (("map", "--truth", "truth.png"), "truth.png: a PNG without the text chunks 'scale' and 'offset' does not say"),
        (("map", "--truth", "nothing.png", "--truth-scale", 1), "nothing.png: no pixel is known; 0 in whole numbers"),
        (("map", "plain.h5", "--truth", "small.pfm"), "small.pfm: ground truth is (60, 64), the views are (64, 64)"),
        (
            ("map", "--truth", "truth.png", "--truth-scale", 1, "--view", "1,1"),
            "map: depth of view 1,2, not of view 1,1",
        ),
        (("map", "plain.h5", "--truth", "truth.png", "--view", "3,0"), "view 3,0 lies outside the grid"),
    ],
)
def test_what_is_wrong_with_it_is_one_line(seen: LightField, words: tuple[object, ...], message: str) -> None:
    assert message in error_of(call("evaluate", *words))


def test_truth_of_another_convention_is_told_beside_the_scores(seen: LightField) -> None:
    """A map that is right looks hopeless when the truth is read upside down."""
    known = np.nan_to_num(seen.ground_truth)
    write_pfm(Path("upside.pfm"), known[::-1])
    np.save("right.npy", known)
    called = call("evaluate", "right.npy", "upside.pfm", "--json")
    assert "upside.pfm: the ground truth fits right.npy far better upside down" in called.stderr
    assert json.loads(called.stdout)["paper"]["all"]["pixels"] == 64 * 64
    write_pfm(Path("upside.pfm"), known)
    assert call("evaluate", "right.npy", "upside.pfm").stderr == ""
