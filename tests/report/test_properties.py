"""The report of the rendered scenes: figures by property, of all scenes' pixels together, and over several seeds."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from click.testing import CliRunner
from report_results import GLOSSY, VARIANTS, cells_of, csv_rows, numbers_of, only, report_of, with_results

from sepi import variants as built_in
from sepi.evaluate import evaluations_of
from sepi.io.scores import write_scores
from sepi.lightfield import LightField
from sepi.report import numbers
from sepi.report.plan import RENDERED_TABLES, Plan
from sepi.report.pooled import pooled_q25


@pytest.fixture(scope="session")
def found(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Any]:
    """Numbers of two scenes, without noise and with little of two seeds; one method has a map of one scene alone."""
    variants = VARIANTS | {"best": built_in.VARIANTS["best"].labels}
    whole = Plan(tmp_path_factory.mktemp("rendered"), {"hci": ["cotton"]}, variants, ("SPO",))
    return numbers_of(with_results(whole.rendered(list(GLOSSY), ["sticks"])))


def test_tables_are_those_of_the_properties_and_name_the_split(found: dict[str, Any]) -> None:
    assert tuple(found["tables"]) == RENDERED_TABLES
    for table in found["tables"].values():
        assert "For choosing parameters: sticks; held out from that: foliage." in table["caption"]
    heads = [column["head"] for column in found["tables"]["scenes_mse"]["sections"][0]["columns"]]
    assert heads == ["method", "sticks", "foliage (held out)"]


def test_pixels_of_all_scenes_count_alike(found: dict[str, Any]) -> None:
    """The error is 0.1 on sticks and 0.3 on foliage, of which a fifth and four fifths of the glossy pixels are.

    An average of the two scenes' figures would be 5 and 20 for all regions.
    """
    for table, glossy, whole in (("mse", 7.4, 5), ("q25", 30, 10), ("badpix", 100, 100)):
        row = only(csv_rows(found, f"properties_{table}"), noise="off", method="paper")
        assert [float(row[region]) for region in ("glossy", "all")] == pytest.approx([glossy, whole], rel=1e-3), table
    assert "glossy 31.2 %" in found["tables"]["properties_mse"]["caption"]
    # no pixel is of a mirror, none beside a depth step
    assert {"mirror", "discontinuities"}.isdisjoint(report_of(found, "properties_mse").heads)


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
    assert pooled_q25(plan)["paper"]["off 1"]["all"] == pytest.approx(expected)


def test_intervals_are_told_by_noise_and_property(found: dict[str, Any]) -> None:
    """Coverage beside width; scenes of unlike noise are not pooled. Best is off by 0.05 and, on foliage, 0.25."""
    rows = [row for row in csv_rows(found, "error_bars") if row["variant"] == "best"]
    row = only(rows, scene="all scenes, noise off", region="glossy")
    assert float(row["coverage"]) == pytest.approx(20)
    assert float(row["width"]) == pytest.approx(0.2, abs=1e-4)
    assert {row["scene"] for row in rows if row["scene"].startswith("all")} == {
        "all scenes, noise off",
        "all scenes, noise low",
    }


def test_several_seeds_tell_how_far_scores_vary(found: dict[str, Any]) -> None:
    """Of seed 1 errors are 0.2 and 0.3, of seed 2 0.4 and 0.5; without noise there is one light field alone."""
    low, off = (only(csv_rows(found, "properties_mse"), noise=noise, method="paper") for noise in ("low", "off"))
    assert (float(low["all"]), float(low["all_sd"])) == (pytest.approx(13.5, rel=1e-3), pytest.approx(9.8995, rel=1e-3))
    assert (low["seeds"], off["seeds"], off["all_sd"]) == ("2", "1", "")
    heading = "Noise low, 2 seeds"
    assert cells_of(found, "properties_mse", heading, "this code, paper")["whole"]["text"] == "13.50 (± 9.90)"
    row = only(csv_rows(found, "scenes_mse"), noise="low", method="paper")
    assert (float(row["foliage"]), float(row["foliage_sd"])) == pytest.approx((17, 16 / 2**0.5), rel=1e-3)


def test_the_best_is_marked_and_a_method_without_a_map_says_so(found: dict[str, Any]) -> None:
    """``best`` is off by 0.05 more to the other side; the method's one map is better than all of ours."""
    best = cells_of(found, "properties_mse", "Noise off", "this code, best")
    assert (best["whole"]["mark"], best["whole"]["kind"]) == ("best", "ours")
    other = cells_of(found, "properties_mse", "Noise off", "SPO (external)")
    assert (other["whole"]["text"], other["whole"]["mark"]) == ("1 of 2 scenes", None)
    assert cells_of(found, "properties_q25", "Noise low, 2 seeds", "SPO (external)")["whole"]["text"] == "no file"
    row = cells_of(found, "scenes_mse", "Noise off", "SPO (external)")
    assert (row["sticks"]["text"], row["foliage (held out)"]["text"]) == ("0.04", "no file")


def test_pictures_are_of_one_seed_and_variants_those_that_are_asked_for() -> None:
    """Two pictures that differ in their noise alone show nothing new."""
    plan = Plan(Path(), {"hci": ["cotton"]}, VARIANTS).rendered(list(GLOSSY), [], ["wang"])
    assert [scene for _, scene in plan.pictured] == ["sticks", "foliage", "sticks_low", "foliage_low"]
    assert plan.compared == plan.listed == ["wang", "paper"]
    assert plan.scores_file("rendered", "sticks").name == "scores_rendered.h5"


@pytest.mark.extension("page")
def test_the_page_averages_nothing_over_scenes_and_levels(
    found: dict[str, Any], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """One figure of all would hide what each property does; and of further seeds it has no scene to read."""
    from sepi.extensions.page import page

    text = page.page_of(found, [], "<svg></svg>")
    assert "<h1>Light field depth: scenes rendered like photographs</h1>" in text
    assert "rendered, average of" not in text
    assert "whole map, average of" not in text
    assert "published figures only" not in text
    shown: list[str] = []
    monkeypatch.setattr(page, "read_scene", lambda path: shown.append(path.stem))
    monkeypatch.setattr(page, "page_of", lambda *given: "")
    (tmp_path / "numbers.json").write_text(numbers.as_text(found))
    (tmp_path / "graph.svg").touch()
    words = ["--numbers", "numbers.json", "--graph", "graph.svg", "--scenes", "scenes", "--output", "index.html"]
    files = [str(tmp_path / word) if not word.startswith("--") else word for word in words]
    assert CliRunner().invoke(page.command, files, catch_exceptions=False).exit_code == 0
    assert shown == ["sticks", "foliage", "sticks_low", "foliage_low"]
