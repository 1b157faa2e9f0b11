"""`sepi evaluate` of results with error bars: coverage beside width, and what rounded ground truth means for it."""

import json
from pathlib import Path

import numpy as np
import pytest
from click.testing import Result
from error_lines import done

from sepi.cli.evaluate import NO_INTERVAL
from sepi.io.disparity_maps import write_pfm
from sepi.io.hdf5 import write_light_field
from sepi.io.images import write_png
from sepi.io.provenance import origin_attributes
from sepi.io.result_folder import write_result
from sepi.scenes import render
from sepi.stage import StageMaps

HEADS = ("coverage %", "width", "NLL", "AUSE", "AUSE, confidence")
SCALE = 1 / 8


def call(*words: object) -> Result:
    result = done(*words)
    return result


@pytest.fixture
def files(here: Path) -> StageMaps:
    """In the current folder a scene, a result with error bars, its map alone, and the truth as a picture of levels.

    The truth lies 0.15 below the left half of the map and 0.05 below the right one; intervals reach 0.1 down.
    """
    levels = np.full((64, 64), 40, np.uint8)
    write_png(Path("truth.png"), levels)
    light_field = render("dots", size=64, views=3)
    write_light_field("scene.h5", light_field)
    estimate = np.full((64, 64), 40 * SCALE + 0.05, np.float32)
    estimate[:, :32] += 0.1
    ones = np.ones_like(estimate)
    bars = {"sigma": 0.1 * ones, "low": estimate - np.float32(0.1), "high": estimate + np.float32(0.2)}
    maps = StageMaps(estimate, 0.5 * ones, bars)
    write_result("map", light_field, maps)
    write_pfm(Path("bare.pfm"), estimate)
    write_pfm(Path("exact.pfm"), np.full((64, 64), 40 * SCALE, np.float32))
    return maps


def test_a_result_has_columns_of_its_error_bars(files: StageMaps) -> None:
    """And the confidence's gap where the scene tells how far views stand apart; a map alone says that it has none."""
    shown = call("evaluate", "map", "exact.pfm").stdout
    head, row = shown.splitlines()[:2]
    assert all(name in head for name in HEADS)
    assert {"50.000", "0.300"} <= set(row.split())
    assert NO_INTERVAL not in shown
    told = json.loads(call("evaluate", "map", "exact.pfm", "--json").stdout)
    assert told["paper"]["all"]["coverage"] == 50
    assert "gap" not in told["paper"]["all"]
    assert "gap" in json.loads(call("evaluate", "map", "scene.h5", "--json").stdout)["paper"]["all"]
    bare = call("evaluate", "bare.pfm", "exact.pfm").stdout
    assert bare.splitlines()[-1] == NO_INTERVAL
    assert "coverage" not in bare
    assert "coverage" not in json.loads(call("evaluate", "bare.pfm", "exact.pfm", "--json").stdout)["paper"]["all"]


def test_rounded_truth_may_be_half_a_step_off(files: StageMaps) -> None:
    """By a flag, or by what a level of the picture stands for: 0.0625 more than the interval's 0.1 reach 0.15."""
    flags = ("--truth", "truth.png", "--truth-scale", SCALE)

    def held(*words: object) -> float:
        return float(json.loads(call("evaluate", "map", *words, "--json").stdout)["paper"]["all"]["coverage"])

    steps = [held("exact.pfm"), held("exact.pfm", "--truth-step", 0.09), held("exact.pfm", "--truth-step", 0.12)]
    assert steps == [50, 50, 100]
    assert held(*flags) == 100
    assert held(*flags, "--truth-step", 0) == 50
    assert "ground truth in steps of 0.125" in call("evaluate", "map", *flags).stdout
    assert json.loads(call("evaluate", "map", *flags, "--json").stdout)["truth_step"] == SCALE
    # numbers that are not whole have no step
    assert held("--truth", "exact.pfm") == 50


def test_a_crop_has_the_error_bars_of_its_pixels(files: StageMaps) -> None:
    """Its left half is 22 columns wide, its right one 28."""
    part = np.s_[10:50, 10:60]
    cut = {name: values[part] for name, values in files.extra.items()}
    light_field = render("dots", size=64, views=3)
    small = StageMaps(files.disparity[part], files.confidence[part], cut)
    cropped = type(light_field)(light_field.views[:, :, 10:50, 10:60], "dots", "test")
    write_result("part", cropped, small)
    told = json.loads(call("evaluate", "part", "exact.pfm", "--offset", "10,10", "--json").stdout)
    assert told["paper"]["all"]["coverage"] == pytest.approx(100 * 28 / 50)


@pytest.mark.extension("views")
def test_maps_of_all_views_have_those_of_the_view(files: StageMaps) -> None:
    """With the view that is meant, and without one those of the reference view, as its disparity is read."""
    from sepi.extensions.views.files import write_all_views

    light_field = render("dots", size=64, views=3)
    views = [
        ((t, s), {**files.all(), "extended": np.zeros((64, 64), bool), "low": files.low - np.float32(t)})
        for t, s in np.ndindex(3, 3)
    ]
    write_all_views(Path("all.h5"), light_field, views, {"scene": "dots", **origin_attributes(light_field)})
    for flags, width in (((), 1.3), (("--view", "1,1"), 1.3), (("--view", "2,0"), 2.3)):
        scores = json.loads(call("evaluate", "all.h5", "exact.pfm", *flags, "--json").stdout)
        assert scores["paper"]["all"]["width"] == pytest.approx(width, abs=1e-4)
