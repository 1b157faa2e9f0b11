"""The report of the rendered scenes: figures by property, of all scenes' pixels together, and over several seeds."""

from pathlib import Path

import numpy as np
import pytest
from report_results import GLOSSY, VARIANTS, csv_rows, report_of

from sepi.evaluate import evaluations_of
from sepi.io.scores import write_scores
from sepi.lightfield import LightField
from sepi.report.numbers import pooled_q25
from sepi.report.plan import Plan
from sepi.report.runs import Runs


def test_properties_that_no_scene_has_have_no_column(rendered: Runs) -> None:
    """No pixel is of a mirror, none beside a depth step."""
    assert "glossy 31.2 %" in report_of(rendered, "properties_mse").caption
    assert {"mirror", "discontinuities"}.isdisjoint(report_of(rendered, "properties_mse").rows)


def test_pixels_without_a_depth_are_the_worst_of_those_that_are_pooled(tmp_path: Path) -> None:
    """Of one scene's map, what is pooled is what the scorer says; a method would else gain by leaving pixels out."""
    plan = Plan(tmp_path, {"hci": ["cotton"]}, VARIANTS).rendered(["sticks"], [], ["paper"])
    truth = np.zeros((40, 40), np.float32)
    map_of_a_third = np.linspace(0, 1, truth.size, dtype=np.float32).reshape(truth.shape)
    map_of_a_third[13:] = np.nan
    scene = LightField(np.zeros((2, 2, 40, 40, 3), np.uint8), "sticks", ground_truth=truth)
    key = plan.stage_key("paper", "optimize")
    scored = evaluations_of(scene, {key: map_of_a_third})
    write_scores(plan.scores_file("rendered", "sticks"), scored, {"scene": "sticks"})
    expected = scored[key].scores["paper"]["all"]["q25"]
    assert 24 < expected < 26
    (pooled,) = [figure for *_, region, figure in pooled_q25(plan) if region == "all"]
    assert pooled == pytest.approx(expected)


def test_scenes_of_unlike_noise_are_not_pooled(rendered: Runs) -> None:
    levels = {row["scene"] for row in csv_rows(rendered, "error_bars") if row["scene"].startswith("all")}
    assert levels == {"all scenes, noise off", "all scenes, noise low"}


def test_pictures_are_of_one_seed_and_variants_those_that_are_asked_for() -> None:
    """Two pictures that differ in their noise alone show nothing new."""
    plan = Plan(Path(), {"hci": ["cotton"]}, VARIANTS).rendered(list(GLOSSY), [], ["wang"])
    assert [scene for _, scene in plan.pictured] == ["sticks", "foliage", "sticks_low", "foliage_low"]
    assert plan.compared == list(plan.variants) == ["wang", "paper"]
    assert plan.scores_file("rendered", "sticks").name == "scores_rendered.h5"
