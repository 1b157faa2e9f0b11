"""Pictures of a scene: reference view, truth, disparity after each stage, errors, masks; and one sheet of them all."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import click
import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from sepi.command import SepiCommand
from sepi.evaluate import WHOLE_MAP
from sepi.io.files import atomic_path
from sepi.io.hdf5 import read_light_field, read_stage
from sepi.io.images import write_png
from sepi.io.scores import Evaluation, read_evaluation
from sepi.lightfield import LightField
from sepi.report.confidence import write_curves
from sepi.report.pictures import (
    ERROR_LIMIT,
    Picture,
    centre_picture,
    disparity_limits,
    error_picture,
    map_picture,
    mask_picture,
    outline_picture,
)
from sepi.report.plan import MAIN_VARIANT, Plan
from sepi.stage import StageMaps

# width of a panel of the overview in inches; 100 dots each
_PANEL = 3.0


@dataclass(frozen=True)
class Panel:
    """A picture, the name of its file below the scene's folder (without ending), and its title on the overview."""

    name: str
    title: str
    picture: Picture


def scene_panels(light_field: LightField, evaluation: Evaluation) -> list[Panel]:
    """What does not depend on the variant: reference view, and ground truth with its regions where there is any."""
    centre = centre_picture(light_field)
    panels = [Panel("centre", "centre view", centre)]
    if light_field.truth is not None:
        truth = map_picture(light_field.truth, disparity_limits(light_field))
        panels.append(Panel("truth", "ground truth", truth))
    for region, mask in evaluation.regions.items():
        panels.append(Panel(f"{region}_truth", f"{region}, for scoring", mask_picture(centre, mask)))
    return panels


def stage_panels(light_field: LightField, variant: str, maps: Mapping[str, StageMaps]) -> list[Panel]:
    """Disparity after each stage of a variant, at the scene's one colour scale."""
    limits = disparity_limits(light_field)
    return [
        Panel(f"{variant}/{number}_{stage}", f"{variant}: {stage}", map_picture(found.disparity, limits))
        for number, (stage, found) in enumerate(maps.items(), start=1)
    ]


def detail_panels(light_field: LightField, variant: str, final: StageMaps) -> list[Panel]:
    """Confidence, and what a variant took for occluded and texture-less, with the superpixels it used."""
    centre = centre_picture(light_field)
    panels = [Panel(f"{variant}/confidence", f"{variant}: confidence", map_picture(final.confidence, (0, 1), "gray"))]
    for region in ("occluded", "textureless"):
        if region in final.extra:
            picture = mask_picture(centre, final.mask(region))
            panels.append(Panel(f"{variant}/{region}", f"{variant}: {region}, detected", picture))
    if "superpixels" in final.extra:
        picture = outline_picture(centre, final.extra["superpixels"])
        panels.append(Panel(f"{variant}/superpixels", f"{variant}: superpixels", picture))
    return panels


def error_panels(variant: str, evaluation: Evaluation) -> list[Panel]:
    """The signed error of a variant's final map; nothing without ground truth."""
    if evaluation.error is None:
        return []
    mse = evaluation.scores["paper"][WHOLE_MAP]["mse100"]
    title = f"{variant}: error\n(±{ERROR_LIMIT:g}; MSE x100 {mse:.2f})"
    return [Panel(f"{variant}/error", title, error_picture(evaluation.error))]


def write_overview(path: Path, title: str, rows: Sequence[Sequence[Panel]]) -> None:
    """All panels on one sheet, with their titles; equal panels give equal bytes."""
    filled = [row for row in rows if row]
    columns = max(len(row) for row in filled)
    height, width = filled[0][0].picture.shape[:2]
    panel_height = _PANEL * height / width + 0.4
    # no pyplot: its figures are global state
    figure = Figure(figsize=(_PANEL * columns, panel_height * len(filled) + 0.4), dpi=100, layout="constrained")
    FigureCanvasAgg(figure)
    figure.suptitle(title)
    axes = figure.subplots(len(filled), columns, squeeze=False)
    for row_axes, row in zip(axes, filled, strict=True):
        for axis in row_axes:
            axis.set_axis_off()
        for axis, panel in zip(row_axes, row, strict=False):
            axis.imshow(panel.picture, interpolation="antialiased")
            axis.set_title(panel.title, fontsize=8)
    with atomic_path(path) as temporary:
        # matplotlib would write its version into the file
        figure.savefig(temporary, format="png", metadata={"Software": None})


def write_scene(plan: Plan, dataset: str, scene: str, folder: Path) -> None:
    """Write every picture of a scene below ``folder``, and ``overview.png``."""
    light_field = read_light_field(plan.light_field_file(dataset, scene))
    maps = {
        variant: {stage: read_stage(plan.stage_file(dataset, scene, variant, stage)) for stage in plan.stages}
        for variant in plan.listed
    }
    last = plan.stages[-1]
    evaluations = {
        variant: read_evaluation(plan.stage_file(dataset, scene, variant, last, "scores.h5")) for variant in maps
    }
    for variant in plan.compared:
        error = evaluations[variant].error
        if error is not None and np.isfinite(error).any():
            write_curves(folder / variant / "sparsification.png", maps[variant][last].confidence, error)
    common = scene_panels(light_field, evaluations[MAIN_VARIANT])
    stages = {variant: stage_panels(light_field, variant, found) for variant, found in maps.items()}
    details = {variant: detail_panels(light_field, variant, found[last]) for variant, found in maps.items()}
    errors = {variant: error_panels(variant, evaluation) for variant, evaluation in evaluations.items()}
    for panel in [*common, *(p for group in (stages, details, errors) for panels in group.values() for p in panels)]:
        write_png(folder / f"{panel.name}.png", panel.picture)
    others = [variant for variant in maps if variant != MAIN_VARIANT]
    sheet = [
        common,
        [*stages[MAIN_VARIANT], *errors[MAIN_VARIANT]],
        details[MAIN_VARIANT],
        [stages[variant][-1] for variant in others],
        [panel for variant in others for panel in errors[variant]],
    ]
    write_overview(folder / "overview.png", f"{dataset}/{scene}", sheet)


@click.command(name="python -m sepi.report.figures", cls=SepiCommand)
@click.option("--results", type=click.Path(path_type=Path), required=True, help="Folder of the results.")
@click.option("--plan", "plan_text", required=True, help="JSON: scenes per data set, choices per variant and stage.")
@click.option("--dataset", required=True, help="Data set of the scene.")
@click.option("--scene", required=True, help="Scene to draw.")
@click.option("--output", type=click.Path(path_type=Path), required=True, help="Folder to write to.")
def command(results: Path, plan_text: str, dataset: str, scene: str, output: Path) -> None:
    """Write the pictures of one scene."""
    write_scene(Plan.from_json(results, plan_text), dataset, scene, output)


if __name__ == "__main__":
    command()
