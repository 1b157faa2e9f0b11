"""Pictures of a scene."""

from dataclasses import replace
from pathlib import Path

import cv2
import numpy as np
from report_results import VARIANTS, light_field, run, with_results

from sepi.io.hdf5 import write_light_field
from sepi.report import figures
from sepi.report.panels import panels_of
from sepi.report.plan import Plan


def draw(plan: Plan, folder: Path, dataset: str, scene: str) -> None:
    result = run(figures.command, replace(plan, scenes={dataset: (scene,)}), folder)
    assert result.exit_code == 0, result.output


def test_pictures_of_a_scene(plan: Plan, tmp_path: Path) -> None:
    """Those for the screen and those for a paper; the same bytes each time, and no others the second time."""
    one, two = tmp_path / "one", tmp_path / "two"
    for folder in (one, two):
        draw(plan, folder, "hci", "cotton")
    drawn = {path.relative_to(one) for path in one.rglob("*.*")}
    assert {path.suffix for path in drawn} == {".png", ".pdf"}
    assert drawn == {path.relative_to(two) for path in two.rglob("*.*")}
    for path in drawn:
        assert (one / path).read_bytes() == (two / path).read_bytes(), path
    written = {str(path) for path in drawn if path.suffix == ".png"}
    common = {"overview.png", "ground_truth.png", "occluded_ground_truth.png", "paper/sparsification.png", "pixels.png"}
    assert (
        common | {f"{variant}/{name}.png" for variant in VARIANTS for name in ("1_initial", "error", "sigma")}
        <= written
    )
    assert {f"{variant}/change.png" in written for variant in VARIANTS if variant != "paper"} == {True}
    centre = cv2.imread(str(one / "reference_view.png"))[:, :, ::-1]
    np.testing.assert_array_equal(centre, light_field("cotton").views[1, 1])


def test_what_no_view_knows_is_shown(tmp_path: Path) -> None:
    """Else the smooth surface that stands over a black corner passes for depth on the page."""
    plan = with_results(Plan(tmp_path / "results", {"hci": ["cotton"]}, VARIANTS))
    scene = light_field("cotton")
    scene.views[:, :, :15, :20] = 0
    write_light_field(plan.files("hci", "cotton").light_field, scene)
    panels = {panel.key: panel for panel in panels_of(figures.read_results(plan, "hci", "cotton"))}
    for variant in VARIANTS:
        expected = np.zeros(scene.shape, bool)
        expected[:15, :20] = True
        np.testing.assert_array_equal(panels[f"{variant}/unknown"].values, expected)
        assert not panels[f"{variant}/confidence"].values[expected].any()
    draw(plan, tmp_path / "pictures", "hci", "cotton")
    assert (tmp_path / "pictures" / "paper" / "unknown.png").is_file()
    assert (cv2.imread(str(tmp_path / "pictures" / "paper" / "confidence.png"))[:15, :20] == 0).all()


def test_pictures_without_ground_truth(plan: Plan, tmp_path: Path) -> None:
    """A real picture: maps, but neither truth nor errors."""
    draw(plan, tmp_path, "hci", "picture")
    written = {path.stem for path in tmp_path.rglob("*.png")}
    assert {"overview", "reference_view", "4_optimize"} <= written
    assert not written & {"ground_truth", "error", "occluded_truth", "textureless_truth"}
