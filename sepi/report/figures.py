"""Pictures of a scene.

Every panel becomes a PNG. A sheet of panels and curves of the confidence become figures (PNG and PDF); extensions add
more.
"""

from __future__ import annotations

import json
from collections.abc import Sequence
from functools import cache
from importlib import import_module
from itertools import groupby
from pathlib import Path

import click
import numpy as np

from sepi.io.files import atomic_folder
from sepi.io.hdf5 import read_stage, read_with_truth
from sepi.io.images import write_png
from sepi.io.scores import read_evaluations
from sepi.matching.unknown import with_unknown
from sepi.process.command import PATH, SepiCommand
from sepi.registry import added
from sepi.report.drawing import write_curves, write_overview
from sepi.report.panels import Panel, SceneResults, panels_of
from sepi.report.pictures import disparity_limits, panel_picture, reference_picture
from sepi.report.plan import Plan


def read_results(plan: Plan, dataset: str, scene: str) -> SceneResults:
    """All results of a scene that the report shows, from its files."""
    # variants with the same first stages share files
    read = cache(read_stage)
    maps = {v: {stage: read(plan.stage_file(dataset, scene, v, stage)) for stage in plan.stages} for v in plan.variants}
    light_field = read_with_truth(plan.files(dataset, scene).light_field, plan.files(dataset, scene).truth)
    for stages in maps.values():
        stages[plan.stages[-1]] = with_unknown(light_field, stages[plan.stages[-1]])
    keys = {variant: plan.stage_key(variant, plan.stages[-1]) for variant in maps}
    scored = read_evaluations(plan.scores_file(dataset, scene), list(keys.values()))
    return SceneResults(
        light_field=light_field,
        maps=maps,
        evaluations={variant: scored[key] for variant, key in keys.items()},
        detailed=plan.detailed,
        external=read_evaluations(plan.files(dataset, scene).external) if plan.external else {},
    )


def write_scene(results: SceneResults, panels: Sequence[Panel], title: str, folder: Path) -> None:
    """Write every panel of a scene below ``folder``, and the sheet ``overview`` with a row for each group."""
    for variant in results.detailed:
        error = results.evaluations[variant].error
        if error is not None and np.isfinite(error).any():
            write_curves(folder / variant, results.final(variant).confidence, error)
    view, limits = reference_picture(results.light_field), disparity_limits(results.light_field)
    pictures = {panel.key: panel_picture(panel, view, limits) for panel in panels}
    for key, picture in pictures.items():
        write_png(folder / f"{key}.png", picture)
    shown = [panel for panel in panels if panel.in_page]
    rows = [
        [("\n".join(filter(None, (panel.title, panel.note))), pictures[panel.key]) for panel in group]
        for _, group in groupby(shown, key=lambda panel: panel.group)
    ]
    write_overview(folder, "overview", title, rows)


@click.command(name="python -m sepi.report.figures", cls=SepiCommand)
@click.option("--results", type=PATH, required=True, help="Folder of the results.")
@click.option("--plan", "text", required=True, help="JSON: one scene of a dataset, choices per variant and stage.")
@click.option("--pixels", default="[]", show_default=True, help="JSON: pixels to look into, [[row, column], ...].")
@click.option("--output", type=PATH, required=True, help="Folder to write to.")
@click.option("--page", type=PATH, help="JSON file to write: the scene for a page.")
def command(results: Path, text: str, pixels: str, output: Path, page: Path | None) -> None:
    """Write the pictures of one scene."""
    plan = Plan.from_json(results, text)
    ((dataset, scene),) = plan.pairs
    found = read_results(plan, dataset, scene)
    panels = panels_of(found)
    asked = [(int(y), int(x)) for y, x in json.loads(pixels)]
    more = [import_module(module).write_scene for module in added("scenes").values()]
    # an incomplete set of pictures would count as made
    with atomic_folder(output, replace=True) as folder:
        write_scene(found, panels, f"{dataset}/{scene}", folder)
        for write in more:
            write(folder, page, plan, found, panels, asked)


if __name__ == "__main__":
    command()
