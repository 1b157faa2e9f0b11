"""Pictures of a scene, and its data for the page.

Every panel becomes a PNG. A sheet of panels, curves of the confidence and single pixels become figures (PNG and PDF).
"""

from __future__ import annotations

import json
from collections.abc import Sequence
from functools import cache
from itertools import groupby
from pathlib import Path
from typing import Any

import click
import numpy as np

from sepi.command import SepiCommand
from sepi.io.files import atomic_folder, atomic_path
from sepi.io.hdf5 import read_stage
from sepi.io.images import write_png
from sepi.io.scores import read_evaluations, read_external
from sepi.io.truth import read_with_truth
from sepi.matching.unknown import with_unknown
from sepi.report.panels import Panel, SceneResults, first_final, panels_of
from sepi.report.plan import MAIN_VARIANT, Plan
from sepi.report.plots.overview import write_overview
from sepi.report.plots.pictures import disparity_limits, panel_picture, reference_picture
from sepi.report.plots.sparsification import write_curves
from sepi.report.probes.figure import write_probes
from sepi.report.probes.pixels import InterestingPixel
from sepi.report.probes.probe import Probe, to_json
from sepi.report.probes.scene_probes import scene_probes
from sepi.report.web.viewer import viewer_json


def read_results(plan: Plan, dataset: str, scene: str) -> SceneResults:
    """All results of a scene that the report shows, from its files."""
    # variants with the same first stages share files
    read = cache(read_stage)
    maps = {
        variant: {stage: read(plan.stage_file(dataset, scene, variant, stage)) for stage in plan.stages}
        for variant in plan.listed
    }
    light_field = read_with_truth(plan.light_field_file(dataset, scene), plan.truth_file(dataset, scene))
    for stages in maps.values():
        stages[plan.stages[-1]] = with_unknown(light_field, stages[plan.stages[-1]])
    keys = {variant: plan.stage_key(variant, plan.stages[-1]) for variant in maps}
    scored = read_evaluations(plan.scores_file(dataset, scene), list(keys.values()))
    external = read_external(plan.external_file(dataset, scene)) if plan.external else {}
    return SceneResults(
        light_field=light_field,
        maps=maps,
        evaluations={variant: scored[key] for variant, key in keys.items()},
        detailed=plan.detailed,
        external={
            method: (found.disparity, found.evaluation)
            for method, found in external.items()
            if found.disparity is not None
        },
        problems={method: found.problem for method, found in external.items() if found.disparity is None},
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


def page_json(
    results: SceneResults, panels: Sequence[Panel], dataset: str, scene: str, probes: Sequence[Probe]
) -> dict[str, Any]:
    """Data of a scene for the page."""
    shown = [panel for panel in panels if panel.in_page]
    return {
        "dataset": dataset,
        "scene": scene,
        "grid": list(results.light_field.grid),
        "first": {"a": "reference_view", "b": first_final(shown)},
        **viewer_json(shown, disparity_limits(results.light_field), results.light_field),
        "probes": [to_json(found) for found in probes],
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
    panels = panels_of(found)
    asked = [InterestingPixel(int(y), int(x), "asked for") for y, x in json.loads(pixels)]
    probes = scene_probes(found, plan.stage_file(dataset, scene, MAIN_VARIANT, plan.stages[-1]), asked)
    # an incomplete set of pictures would count as made
    with atomic_folder(output, replace=True) as folder:
        write_scene(found, panels, f"{dataset}/{scene}", folder)
        if probes:
            write_probes(folder / "pixels", probes, reference_picture(found.light_field))
    if page is not None:
        with atomic_path(page) as temporary:
            text = json.dumps(page_json(found, panels, dataset, scene, probes), separators=(",", ":"))
            temporary.write_text(text, encoding="utf-8")


if __name__ == "__main__":
    command()
