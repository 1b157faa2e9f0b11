"""Pictures of a scene, and what the page needs of it.

Reference view, ground truth, disparity after each stage, errors, masks and other methods' maps as PNG; a sheet of them
all, the confidence's curves and single pixels as figures (PNG and PDF).
"""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

import click
import cv2
import numpy as np

from sepi.command import SepiCommand
from sepi.evaluate import WHOLE_MAP
from sepi.io.external_maps import read_external
from sepi.io.files import atomic_path
from sepi.io.hdf5 import read_light_field, read_stage
from sepi.io.images import write_png
from sepi.io.scores import Evaluation, read_evaluations
from sepi.lightfield import LightField
from sepi.report.plan import MAIN_VARIANT, Plan
from sepi.report.plots.pictures import (
    ERROR_LIMIT,
    Picture,
    centre_picture,
    disparity_limits,
    error_picture,
    map_picture,
    mask_picture,
    outline_picture,
)
from sepi.report.plots.saving import BOTH, new_figure, save
from sepi.report.probes.figure import write_probes
from sepi.report.probes.pixels import InterestingPixel
from sepi.report.probes.probe import Probe, to_json
from sepi.report.probes.scene_probes import scene_probes
from sepi.report.tabular.confidence import write_curves
from sepi.report.web.scene_panels import SceneResults, compared_pair, viewer_of
from sepi.stage import StageMaps

_ASKED = "asked for"

# width of a panel of the overview in inches, and dots in an inch
_PANEL = 3.0
_DOTS = 100


@dataclass(frozen=True)
class Panel:
    """A picture, the name of its file below the scene's folder (without ending), and its title on the overview."""

    name: str
    title: str
    picture: Picture


def scene_panels(light_field: LightField, evaluation: Evaluation) -> list[Panel]:
    """What does not depend on the variant: reference view, and ground truth with its regions where there is any."""
    centre = centre_picture(light_field)
    panels = [Panel("centre", "reference view", centre)]
    if light_field.ground_truth is not None:
        ground_truth = map_picture(light_field.ground_truth, disparity_limits(light_field))
        panels.append(Panel("ground_truth", "ground truth", ground_truth))
    for region, mask in evaluation.regions.items():
        panels.append(Panel(f"{region}_ground_truth", f"{region}, for scoring", mask_picture(centre, mask)))
    return panels


def stage_panels(light_field: LightField, variant: str, maps: Mapping[str, StageMaps]) -> list[Panel]:
    """Disparity after each stage of a variant, at the scene's one colour scale."""
    limits = disparity_limits(light_field)
    return [
        Panel(f"{variant}/{number}_{stage}", f"{variant}: {stage}", map_picture(found.disparity, limits))
        for number, (stage, found) in enumerate(maps.items(), start=1)
    ]


def detail_panels(light_field: LightField, variant: str, final: StageMaps) -> list[Panel]:
    """Confidence, and what a variant took for occluded and textureless, with the superpixels it used."""
    centre = centre_picture(light_field)
    panels = [Panel(f"{variant}/confidence", f"{variant}: confidence", map_picture(final.confidence, (0, 1), "gray"))]
    for region in ("occluded", "textureless"):
        if region in final.extra:
            picture = mask_picture(centre, final.mask(region))
            panels.append(Panel(f"{variant}/{region}", f"{variant}: {region}, detected", picture))
    if "superpixels" in final.extra:
        picture = outline_picture(centre, final.extra["superpixels"])
        panels.append(Panel(f"{variant}/superpixels", f"{variant}: superpixels", picture))
    if "lti" in final.extra:
        panels.append(Panel(f"{variant}/lti", f"{variant}: LTI", map_picture(final.extra["lti"], (0, 1), "gray")))
    return panels


def change_panels(evaluations: Mapping[str, Evaluation]) -> list[Panel]:
    """How much larger a variant's error is than that of the one it is compared with; nothing without ground truth."""
    errors = {name: evaluation.error for name, evaluation in evaluations.items() if evaluation.error is not None}
    panels = []
    for variant in errors:
        if variant != MAIN_VARIANT:
            better, worse = compared_pair(variant)
            title = f"{better} beside {worse}\n(red: mended, blue: harmed)"
            picture = error_picture(np.abs(errors[worse]) - np.abs(errors[better]))
            panels.append(Panel(f"{variant}/change", title, picture))
    return panels


def error_panels(variant: str, evaluation: Evaluation) -> list[Panel]:
    """The signed error of a variant's final map; nothing without ground truth."""
    if evaluation.error is None:
        return []
    mse = evaluation.scores["paper"][WHOLE_MAP]["mse100"]
    title = f"{variant}: error\n(±{ERROR_LIMIT:g}; MSE x100 {mse:.2f})"
    return [Panel(f"{variant}/error", title, error_picture(evaluation.error))]


def imported_panels(results: SceneResults) -> list[Panel]:
    """Other methods' maps, and their errors where there is ground truth."""
    limits = disparity_limits(results.light_field)
    panels = []
    for method, (disparity, evaluation) in results.imported.items():
        picture = map_picture(disparity, limits)
        panels.append(Panel(f"imported/{method}/disparity", f"{method} (imported)", picture))
        panels += [
            Panel(f"imported/{method}/error", error.title, error.picture)
            for error in error_panels(f"{method} (imported)", evaluation)
        ]
    return panels


def write_overview(
    folder: Path, name: str, title: str, rows: Sequence[Sequence[Panel]], endings: Sequence[str] = BOTH
) -> None:
    """All panels on one sheet, with their titles; equal panels give equal bytes."""
    filled = [row for row in rows if row]
    columns = max(len(row) for row in filled)
    height, width = filled[0][0].picture.shape[:2]
    panel_height = _PANEL * height / width + 0.4
    head = 0.4 if title else 0.0
    size = (_PANEL * columns, panel_height * len(filled) + head)
    figure = new_figure(*size, layout=None)
    # one frame for all pictures, whose unit is an inch: many frames are slow to draw
    sheet = figure.add_axes((0, 0, 1, 1))
    sheet.set_axis_off()
    sheet.text(size[0] / 2, size[1] - 0.1, title, fontsize=12, ha="center", va="top", parse_math=False)
    for number, row in enumerate(filled):
        bottom = size[1] - head - (number + 1) * panel_height
        for column, panel in enumerate(row):
            left, top = column * _PANEL + 0.05, bottom + panel_height - 0.35
            extent = (left, left + _PANEL - 0.1, bottom + 0.05, top)
            sheet.imshow(_in_dots(panel.picture, extent), extent=extent, aspect="auto", interpolation="none")
            place = (left + _PANEL / 2 - 0.05, top + 0.04)
            sheet.text(*place, panel.title, fontsize=8, ha="center", va="bottom", parse_math=False)
    # pictures set limits of their own
    sheet.set_xlim(0, size[0])
    sheet.set_ylim(0, size[1])
    save(figure, folder, name, endings)


def _in_dots(picture: Picture, extent: tuple[float, float, float, float]) -> Picture:
    """A picture in the size in dots at which it is drawn; matplotlib would take longer, and once for each file."""
    left, right, bottom, top = extent
    size = (round((right - left) * _DOTS), round((top - bottom) * _DOTS))
    shrinks = size[0] < picture.shape[1]
    dots = cv2.resize(picture, size, interpolation=cv2.INTER_AREA if shrinks else cv2.INTER_LINEAR)
    return np.asarray(dots, np.uint8)


def read_results(plan: Plan, dataset: str, scene: str) -> SceneResults:
    """Everything that is shown of a scene, from its files."""
    # variants that begin alike share files
    read = cache(read_stage)
    maps = {
        variant: {stage: read(plan.stage_file(dataset, scene, variant, stage)) for stage in plan.stages}
        for variant in plan.listed
    }
    keys = {variant: plan.stage_key(variant, plan.stages[-1]) for variant in maps}
    scored = read_evaluations(plan.scores_file(dataset, scene), list(keys.values()))
    imported = read_external(plan.external_file(dataset, scene)) if plan.external else {}
    return SceneResults(
        light_field=read_light_field(plan.light_field_file(dataset, scene)),
        maps=maps,
        evaluations={variant: scored[key].evaluation for variant, key in keys.items()},
        compared=plan.compared,
        imported={
            method: (found.disparity, found.evaluation)
            for method, found in imported.items()
            if found.disparity is not None
        },
        problems={method: found.problem for method, found in imported.items() if found.disparity is None},
    )


def write_scene(results: SceneResults, title: str, folder: Path) -> None:
    """Write every picture of a scene below ``folder``, and the sheet ``overview`` of them."""
    light_field = results.light_field
    for variant in results.compared:
        error = results.evaluations[variant].error
        if error is not None and np.isfinite(error).any():
            write_curves(folder / variant, results.final(variant).confidence, error)
    common = scene_panels(light_field, results.evaluations[MAIN_VARIANT])
    stages = {variant: stage_panels(light_field, variant, found) for variant, found in results.maps.items()}
    details = {variant: detail_panels(light_field, variant, results.final(variant)) for variant in results.maps}
    errors = {variant: error_panels(variant, evaluation) for variant, evaluation in results.evaluations.items()}
    imported = imported_panels(results)
    changes = change_panels(results.evaluations)
    groups = [panels for group in (stages, details, errors) for panels in group.values()]
    for panel in [*common, *(panel for panels in groups for panel in panels), *changes, *imported]:
        write_png(folder / f"{panel.name}.png", panel.picture)
    others = [variant for variant in results.maps if variant != MAIN_VARIANT]
    sheet = [
        common,
        [*stages[MAIN_VARIANT], *errors[MAIN_VARIANT]],
        details[MAIN_VARIANT],
        [stages[variant][-1] for variant in others],
        [panel for variant in others for panel in errors[variant]],
        changes,
        [panel for panel in imported if not panel.name.endswith("/error")],
        [panel for panel in imported if panel.name.endswith("/error")],
    ]
    write_overview(folder, "overview", title, sheet)


def page_json(results: SceneResults, dataset: str, scene: str, probes: Sequence[Probe]) -> dict[str, Any]:
    """What the page needs of a scene."""
    viewer = viewer_of(results)
    seen = [to_json(found) for found in probes]
    # pixels that were asked for come on top of a scene's share
    reserved = len(json.dumps([found for found in seen if found["label"] != _ASKED]))
    best = f"{results.compared[0]}/{list(results.maps[results.compared[0]])[-1]}"
    return {
        "dataset": dataset,
        "scene": scene,
        "grid": list(results.light_field.grid),
        "first": {"a": "centre", "b": best},
        **viewer.to_json(reserved),
        "probes": seen,
        "problems": dict(results.problems),
    }


@click.command(name="python -m sepi.report.figures", cls=SepiCommand)
@click.option("--results", type=click.Path(path_type=Path), required=True, help="Folder of the results.")
@click.option("--plan", "plan_text", required=True, help="JSON: scenes per dataset, choices per variant and stage.")
@click.option("--dataset", required=True, help="Dataset of the scene.")
@click.option("--scene", required=True, help="Scene to draw.")
@click.option("--pixels", default="[]", show_default=True, help="JSON: pixels to look into, [[row, column], ...].")
@click.option("--output", type=click.Path(path_type=Path), required=True, help="Folder to write to.")
@click.option("--page", type=click.Path(path_type=Path), help="JSON file to write: the scene for the page.")
def command(
    results: Path, plan_text: str, dataset: str, scene: str, pixels: str, output: Path, page: Path | None
) -> None:
    """Write the pictures of one scene."""
    plan = Plan.from_json(results, plan_text)
    found = read_results(plan, dataset, scene)
    asked = [InterestingPixel(int(y), int(x), _ASKED) for y, x in json.loads(pixels)]
    probes = scene_probes(found, plan.stage_file(dataset, scene, MAIN_VARIANT, plan.stages[-1]), asked)
    write_scene(found, f"{dataset}/{scene}", output)
    if probes:
        write_probes(output / "pixels", probes)
    if page is not None:
        with atomic_path(page) as temporary:
            text = json.dumps(page_json(found, dataset, scene, probes), separators=(",", ":"))
            temporary.write_text(text, encoding="utf-8")


if __name__ == "__main__":
    command()
