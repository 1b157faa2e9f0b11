"""Results for the report's tests: stage files with known errors, the numbers of them, and ways to look into tables."""

import csv
import json
import re
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from click.testing import CliRunner, Result

from sepi import variants as built_in
from sepi.evaluate import evaluation_of, evaluations_of
from sepi.external import NO_FILE
from sepi.io.hdf5 import read_stage, write_light_field, write_stage, write_truth
from sepi.io.scores import Evaluation, map_name, write_scores
from sepi.lightfield import DisparityRange, LightField
from sepi.report import numbers, tables
from sepi.report.plan import Plan
from sepi.report.runs import Runs, read_numbers
from sepi.report.table import Table, as_csv, as_markdown
from sepi.stage import StageMaps
from sepi.variants import HANDED_ON

SIZE = 40
SCENES = {"builtin": ["dots", "flat"], "hci": ["cotton", "mine", "picture"]}
VARIANTS = {
    "paper": {"initial": "sepi", "occlusion": "half_sepi", "textureless": "lti", "optimize": "wls"},
    "no_occlusion": {"initial": "sepi", "occlusion": "none", "textureless": "lti", "optimize": "wls"},
    "wang": {"initial": "sepi", "occlusion": "wang", "textureless": "lti", "optimize": "wls"},
}
# error added to the ground truth after each stage; the scenes' own is added too
STAGE_ERROR = {"initial": 0.4, "occlusion": 0.3, "textureless": 0.2, "optimize": 0.1}
VARIANT_ERROR = {
    "paper": 0.0,
    "no_occlusion": 0.1,
    "wang": 0.2,
    "best": -0.05,
    "best_wls": 0.3,
    "fast": 0.05,
    "spo": 0.1,
}
SCENE_ERROR = {"dots": 0.0, "flat": 0.1, "cotton": 0.0, "mine": 0.1, "picture": 0.0}
# error bars of final maps, of all variants but one: how far intervals reach
SIGMA, BELOW, ABOVE = 0.1, 0.15, 0.05
WITHOUT_BARS = "spo"
# rendered scenes: the rows that are glossy, and what is added to the ground truth
GLOSSY = {"sticks": 5, "foliage": 20, "sticks_low": 5, "sticks_low_2": 5, "foliage_low": 20, "foliage_low_2": 20}
SCENE_ERROR |= {"sticks": 0, "foliage": 0.2, "sticks_low": 0.1, "sticks_low_2": 0.3}
SCENE_ERROR |= {"foliage_low": 0.2, "foliage_low_2": 0.4}
# what is added to the ground truth of a scene in another method's map, or what is wrong with it; one method has the
# name of a column that is there anyway, and is the most accurate of all
EXTERNAL: dict[str, dict[str, float | str]] = {
    "SPO": {"cotton": 0.2, "mine": NO_FILE, "picture": 0.2, "dots": NO_FILE}
    | dict.fromkeys(GLOSSY, NO_FILE)
    | {"sticks": 0.02},
    "zhou": {"cotton": 0.02, "mine": 0.04, "picture": NO_FILE, "dots": NO_FILE},
    "odd|_name_": {"cotton": "80x40 instead of 40x40", "mine": "not readable", "picture": NO_FILE, "dots": NO_FILE},
}


def choices(*names: str) -> dict[str, Mapping[str, str]]:
    """Variants of the package."""
    return {name: built_in.VARIANTS[name].labels for name in names}


MACHINE = {"processor": "of a cluster", "cores": 64, "python": "3.12.1", "sepi": "0.0.1", "numpy": "1.26.4"}


def light_field(name: str) -> LightField:
    random = np.random.default_rng(len(name))
    views = random.integers(0, 256, (3, 3, SIZE, SIZE, 3), np.uint8)
    ground_truth = (
        None if name == "picture" else np.linspace(-1, 1, SIZE, dtype=np.float32) * np.ones((SIZE, 1), np.float32)
    )
    masks = {"occluded": np.zeros((SIZE, SIZE), bool), "textureless": np.ones((SIZE, SIZE), bool)}
    if name != "flat":
        masks["occluded"][5:10] = True
    if name in GLOSSY:
        masks["glossy"] = np.arange(SIZE)[:, None] * np.ones(SIZE) < GLOSSY[name]
        masks["mirror"] = np.zeros((SIZE, SIZE), bool)
    known = DisparityRange(-1.5, 1.5, "given")
    return LightField(views, name, "test", disparity_range=known, ground_truth=ground_truth, masks=masks)


def stage_maps(scene: LightField, variant: str, stage: str) -> StageMaps:
    ground_truth = scene.ground_truth if scene.ground_truth is not None else np.zeros(scene.shape, np.float32)
    step = np.float32(STAGE_ERROR[stage] + VARIANT_ERROR[variant] + SCENE_ERROR[scene.name])
    extra = {
        "occluded": scene.masks["occluded"],
        "textureless": scene.masks["textureless"],
        "superpixels": (np.indices(scene.shape) // 10).sum(0).astype(np.int32),
    }
    if stage == "optimize" and variant != WITHOUT_BARS:
        disparity, ones = ground_truth + step, np.ones(scene.shape, np.float32)
        extra |= {"sigma": SIGMA * ones, "low": disparity - np.float32(BELOW), "high": disparity + np.float32(ABOVE)}
    return StageMaps(ground_truth + step, np.full(scene.shape, 0.5, np.float32), extra)


def with_results(made: Plan) -> Plan:
    """The plan, its result files written."""
    for dataset, name in made.pairs:
        scene = light_field(name)
        write_light_field(made.files(dataset, name).light_field, replace(scene, ground_truth=None, masks={}))
        write_truth(made.files(dataset, name).truth, (scene.ground_truth, scene.masks))
        for variant in made.variants:
            for stage in (stage for stage in made.stages if made.variants[variant][stage] != HANDED_ON):
                maps = stage_maps(scene, variant, stage)
                step = {"stage": stage, "choice": made.variants[variant][stage], "parameters": "{}", "made_from": "[]"}
                write_stage(made.stage_file(dataset, name, variant, stage), maps, step)
                timing = made.stage_file(dataset, name, variant, stage, "time.json")
                took = {"seconds": 1.5, "peak_memory_mb": 200 + 10 * len(stage)}
                timing.write_text(json.dumps({**took, "machine": MACHINE, "parameters": {"words": len(stage)}}))
        folder = made.files(dataset, name).stages
        for one in (made,) if made.report else (made, made.parts_of_best()):
            files = one.scored_files(dataset, name)
            scored = evaluations_of(scene, {map_name(folder, file): read_stage(file) for file in files})
            write_scores(one.scores_file(dataset, name), scored, {"scene": name})
        if made.external:
            maps = {method: external_map(scene, EXTERNAL[method][name]) for method in made.external}
            write_scores(made.files(dataset, name).external, maps, {})
    return made


def external_map(scene: LightField, what: float | str) -> Evaluation:
    """A map with this error added to the ground truth, or one with this problem."""
    if isinstance(what, str):
        return Evaluation(source="/maps/none.pfm", problem=what)
    ground_truth = np.zeros(scene.shape, np.float32) if scene.ground_truth is None else scene.ground_truth
    disparity = ground_truth + np.float32(what)
    scores = Evaluation() if scene.ground_truth is None else evaluation_of(scene, disparity)
    return replace(scores, source="/maps/some.pfm", sha256=64 * "a", disparity=disparity)


def numbers_of(plan: Plan) -> Runs:
    """The numbers of a plan as their files bring them."""
    path = plan.results / f"report{plan.ending}.json"
    numbers.write_numbers(numbers.collect(plan), path)
    json.loads(path.read_text(), parse_constant=pytest.fail)
    return read_numbers(path)


def linked(plan: Plan, folder: Path) -> Plan:
    """The plan in a folder that has the inputs of its numbers and nothing else."""
    for path in plan.number_inputs():
        copied = folder / path.relative_to(plan.results)
        copied.parent.mkdir(parents=True, exist_ok=True)
        copied.hardlink_to(path)
    return replace(plan, results=folder)


def run(command: Any, plan: Plan, output: Path, *more: str) -> Result:
    """Call a command of the report."""
    arguments = ["--results", str(plan.results), "--plan", plan.to_json(), "--output", str(output), *more]
    return CliRunner().invoke(command, arguments, catch_exceptions=False)


def report_of(found: Runs, table: str) -> Table:
    return tables.BUILDERS[table](found)


def markdown(found: Runs, table: str) -> str:
    """A table's Markdown, its columns not aligned."""
    return re.sub(" +", " ", as_markdown(report_of(found, table)))


def csv_rows(found: Runs, table: str) -> list[dict[str, str]]:
    """Rows of a table's CSV file, in which cells may hold line breaks."""
    return list(csv.DictReader(as_csv(report_of(found, table)).splitlines(keepends=True)))


def only(rows: list[dict[str, str]], **cells: str) -> dict[str, str]:
    found = [row for row in rows if all(row[key] == value for key, value in cells.items())]
    assert len(found) == 1, (cells, found)
    return found[0]


def cells_of(found: Runs, table: str, heading: str, row: str) -> dict[str, tuple[str, float | None, str, str]]:
    """Head of each column to a cell in one row of one section of a table: text, figure, mark, its column's kind."""
    (section,) = [one for one in report_of(found, table).sections if one.heading.split(":")[0] == heading]
    (line,) = [cells for _, _, cells in section.lines if cells[0][0] == row]
    return {head.text: (*cell, head.kind) for head, cell in zip(section.heads, line, strict=True)}


def renamed(found: Runs, names: dict[str, str]) -> Runs:
    """Numbers in which keys and texts have other names."""
    return Runs(renamed_facts(found.facts, names), found.numbers.replace(names))


def renamed_facts(value: Any, names: dict[str, str]) -> Any:
    """JSON in which keys and texts have other names."""
    if isinstance(value, dict):
        return {names.get(key, key): renamed_facts(inner, names) for key, inner in value.items()}
    if isinstance(value, list):
        return [renamed_facts(inner, names) for inner in value]
    return names.get(value, value) if isinstance(value, str) else value
