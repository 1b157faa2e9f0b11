"""A small report, computed for real: variants paper and best on three scenes of 64 pixels, and other methods' maps."""

import json
import warnings
from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np

from sepi.camera import Camera
from sepi.errors import SepiWarning
from sepi.evaluate import evaluations_of
from sepi.extensions.page.page import page_of
from sepi.extensions.page.pixels import InterestingPixel
from sepi.extensions.page.scene import page_json, scene_probes
from sepi.external import ExternalSource, external_maps
from sepi.io.disparity_maps import write_pfm
from sepi.io.hdf5 import read_light_field, read_stage, write_light_field, write_stage, write_truth
from sepi.io.provenance import scene_attributes, stage_attributes
from sepi.io.scores import Evaluation, map_name, write_scores
from sepi.lightfield import FloatMap, LightField
from sepi.process.machine import this_machine
from sepi.report import numbers
from sepi.report.figures import read_results
from sepi.report.panels import panels_of
from sepi.report.plan import MAIN_VARIANT, Plan
from sepi.report.runs import Runs, read_numbers
from sepi.scenes import render
from sepi.stage import StageMaps, entry, no_progress
from sepi.variants import STAGES, VARIANTS, stage_parameters

SIZE, VIEWS = 64, 5
COTTON, DOTS, PICTURE = ("hci", "cotton"), ("builtin", "dots"), ("own", "picture")
COTTON_TITLE, DOTS_TITLE, PICTURE_TITLE = ("/".join(scene) for scene in (COTTON, DOTS, PICTURE))
ASKED = {COTTON: (20, 41)}
"""Pixels, row and column, that the configuration asks for."""

UNKNOWN = (slice(30, 34), slice(6, 12))
"""Rows and columns that the external map does not know."""

# of a camera that sees the scene in front of it
_CAMERA = Camera(scale=40.0, offset=8.0, focal_px=90.0)


@dataclass(frozen=True)
class Example:
    """Results in a folder, and the page made of them.

    Attributes
    ----------
    plan : Plan
    numbers : Runs
        As ``sepi.report.numbers`` collects them.
    scenes : list of dict
        What the page has of every scene.
    page : Path
    """

    plan: Plan
    numbers: Runs
    scenes: list[dict[str, Any]]
    page: Path

    def light_field(self, scene: tuple[str, str]) -> LightField:
        return read_light_field(self.plan.files(*scene).light_field)

    def final(self, scene: tuple[str, str], variant: str) -> StageMaps:
        """The maps after the last stage, from their file."""
        return self.stage(scene, variant, self.plan.stages[-1])

    def stage(self, scene: tuple[str, str], variant: str, stage: str) -> StageMaps:
        return read_stage(self.plan.stage_file(*scene, variant, stage))

    @cached_property
    def external(self) -> FloatMap:
        """The map of the other method for the scene cotton."""
        ground_truth = self.light_field(COTTON).ground_truth
        return external_map(ground_truth)


def small_light_field(scene: tuple[str, str]) -> LightField:
    """A scene of the example: with a camera and a hole in its truth, as it is, or without ground truth."""
    name = "curved_occluders" if scene == COTTON else "dots"
    found = replace(render(name, size=SIZE, views=VIEWS), name=scene[1])
    if scene == COTTON:
        ground_truth = found.ground_truth.copy()
        ground_truth[:3, :3] = np.nan
        return replace(found, camera=_CAMERA, ground_truth=ground_truth)
    if scene == PICTURE:
        # told where they stand although it is where a grid has them
        where = np.indices((VIEWS, VIEWS)).transpose(1, 2, 0).astype(np.float64)
        return replace(found, ground_truth=None, masks={}, positions=where)
    return found


def external_map(ground_truth: FloatMap) -> FloatMap:
    """The truth with an error, unknown in places."""
    noise = np.random.default_rng(3).normal(0, 0.05, ground_truth.shape).astype(np.float32)
    found = np.nan_to_num(ground_truth) + noise
    found[UNKNOWN] = np.nan
    return found


def make_example(folder: Path) -> Example:
    """Run the stages, score them, and make the page."""
    variants = {name: VARIANTS[name].choices for name in (MAIN_VARIANT, "best")}
    pairs = (DOTS, COTTON, PICTURE)
    plan = Plan(folder / "results", {dataset: [name] for dataset, name in pairs}, variants, ("SPO", "wrong_size"))
    for scene in pairs:
        write_results(plan, scene)
    numbers.write_numbers(numbers.collect(plan), folder / "report.json")
    found = read_numbers(folder / "report.json")
    scenes = [scene_json(plan, scene) for scene in pairs]
    page = folder / "index.html"
    page.write_text(page_of(found, scenes), encoding="utf-8")
    return Example(plan, found, scenes, page)


def write_results(plan: Plan, scene: tuple[str, str]) -> None:
    """Every file of a scene that the report reads."""
    light_field = small_light_field(scene)
    write_light_field(plan.files(*scene).light_field, light_field)
    write_truth(plan.files(*scene).truth, (light_field.ground_truth, light_field.masks))
    for variant in plan.variants:
        run_stages(plan, scene, light_field, variant)
    write_plan_scores(plan, scene, light_field)
    maps = methods_maps(plan, light_field) if scene == COTTON else {}
    absent = {
        method: Evaluation(source=f"/maps/{method}/{light_field.name}.pfm", problem="no file")
        for method in plan.external
    }
    write_scores(plan.files(*scene).external, absent | maps, {})


def run_stages(plan: Plan, scene: tuple[str, str], light_field: LightField, variant: str) -> None:
    settings = stage_parameters(VARIANTS[variant])
    maps: StageMaps | None = None
    steps = []
    for number, (stage, choice) in enumerate(plan.variants[variant].items()):
        maps = STAGES[stage][choice].run(light_field, maps, settings[stage], no_progress)
        steps.append(entry(stage, choice, settings[stage], light_field))
        attributes = stage_attributes(light_field, steps)
        write_stage(plan.stage_file(*scene, variant, stage), maps, attributes)
        timing = {"seconds": 1.5 + number, "peak_memory_mb": 200 + 10 * number, "machine": this_machine()}
        timing["parameters"] = settings[stage].model_dump(mode="json")
        plan.stage_file(*scene, variant, stage, "time.json").write_text(json.dumps(timing))


def write_plan_scores(plan: Plan, scene: tuple[str, str], light_field: LightField) -> None:
    """The score file of a scene, from its stage files."""
    folder = plan.files(*scene).stages
    maps = {map_name(folder, file): read_stage(file) for file in plan.scored_files(*scene)}
    write_scores(plan.scores_file(*scene), evaluations_of(light_field, maps), scene_attributes(light_field))


def methods_maps(plan: Plan, light_field: LightField) -> Mapping[str, Evaluation]:
    """One method's map with unknown pixels, and one of the wrong size."""
    files = {"SPO": external_map(light_field.ground_truth), "wrong_size": np.zeros((5, 7), np.float32)}
    for method, values in files.items():
        write_pfm(plan.results / f"{method}.pfm", values)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", SepiWarning)
        return external_maps(
            light_field, {name: ExternalSource(path=str(plan.results / f"{name}.pfm")) for name in files}
        )


def scene_json(plan: Plan, scene: tuple[str, str]) -> dict[str, Any]:
    """What the page has of a scene, as its JSON file brings it."""
    results = read_results(plan, *scene)
    asked = [InterestingPixel(*ASKED[scene], "asked for")] if scene in ASKED else []
    probes = scene_probes(results, plan.stage_file(*scene, MAIN_VARIANT, plan.stages[-1]), asked)
    found: dict[str, Any] = json.loads(json.dumps(page_json(results, panels_of(results), *scene, probes)))
    return found
