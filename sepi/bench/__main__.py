"""The command ``python -m sepi.bench``."""

from __future__ import annotations

import os
import tempfile
from pathlib import Path
from typing import Any

import click
from tqdm import tqdm

from sepi.bench import floor, growth, plain, plot, solvers, stages, storage, tables
from sepi.bench.measure import Case, Measurement, measured
from sepi.bench.result import Result, read, this_machine, write
from sepi.bench.scene import Scene, prepare_files, prepare_grown, prepare_render
from sepi.command import SepiGroup
from sepi.errors import SepiError
from sepi.io.files import atomic_path
from sepi.pipeline import stage_parameters, variant_named
from sepi.report.layout import Report, Section, Table, as_markdown
from sepi.scenes import SCENES

_PATH = click.Path(path_type=Path)
VARIANT = "paper"
# long enough to see how time grows, short enough to wait for
_GROWTH_REPEATS = 3
_SCENE_OF_GROWTH = "curved_occluders"
_GROUPS = ("stages", "growth", "beside", "solvers", "storage", "large")


@click.group(cls=SepiGroup, name="python -m sepi.bench", context_settings={"help_option_names": ["-h", "--help"]})
def main() -> None:
    """Measure time, memory and growth of the pipeline."""


@main.command()
@click.option(
    "--scene", default="curved_occluders", show_default=True, help="Built-in scene, or path of a light field."
)
@click.option("--repeats", type=click.IntRange(min=1), default=5, show_default=True, help="Timed calls of each case.")
@click.option("--threads", type=click.IntRange(min=1), help="Threads to use; one per core unless given.")
@click.option("--group", "groups", type=click.Choice(_GROUPS), multiple=True, help="Measure only this; repeatable.")
@click.option("--small", is_flag=True, help="A tiny scene, once: shows that everything runs, not how fast.")
@click.option("--output", type=_PATH, default=Path("reports"), show_default=True, help="Folder to write to.")
def run(scene: str, repeats: int, threads: int | None, groups: tuple[str, ...], small: bool, output: Path) -> None:
    """Measure, and write bench.json, bench.md and bench.png."""
    if scene not in SCENES and not Path(scene).exists():
        raise SepiError(f"{scene}: neither a built-in scene ({', '.join(SCENES)}) nor a file or folder")
    settings: dict[str, Any] = {
        "scene": scene if scene in SCENES else Path(scene).name,
        "size": 64 if small else 512,
        "views": 5 if small else 9,
        "candidates": 21 if small else 181,
        "threads": threads or len(os.sched_getaffinity(0)),
        "repeats": 1 if small else repeats,
    }
    chosen = set(groups or (_GROUPS[:-1] if small else _GROUPS))
    with tempfile.TemporaryDirectory(prefix="sepi-bench-") as folder:
        name = scene if scene in SCENES else str(Path(scene).absolute())
        at = Scene(name, settings["size"], settings["views"], Path(folder))
        found = _measure(at, settings, chosen, small)
    result = Result(this_machine(), settings, tuple(found))
    output.mkdir(parents=True, exist_ok=True)
    write(result, output / "bench.json")
    plot.write(result, output / "bench.png")
    with atomic_path(output / "bench.md") as temporary:
        temporary.write_text(_page(result), encoding="utf-8")
    click.echo(f"written to {output}/: bench.json bench.md bench.png")


@main.command()
@click.argument("before", type=_PATH)
@click.argument("after", type=_PATH)
def compare(before: Path, after: Path) -> None:
    """Print the results BEFORE and AFTER, two files bench.json, side by side."""
    old, new = read(before), read(after)
    table = tables.comparison(old, new)
    if not table.rows:
        raise SepiError(f"{before} and {after}: nothing was measured in both")
    for difference in tables.differences(old, new):
        click.echo(f"sepi: warning: not the same {difference}", err=True)
    click.echo(as_markdown(Report("Before and after", "Median seconds of each case.", table, [Section("", table)])))


def _measure(scene: Scene, settings: dict[str, Any], groups: set[str], small: bool) -> list[Measurement]:
    """Prepare the files that the cases share, then measure case by case."""
    threads, candidates, repeats = settings["threads"], settings["candidates"], settings["repeats"]
    variant = variant_named(VARIANT)
    swept = {stage: {"candidates": candidates} for stage in ("initial", "occlusion")}
    parameters = stage_parameters(variant, swept)
    cases = [Case("preparation", "scene", prepare_files, (scene, variant, parameters), threads=threads, once=True)]
    if "stages" in groups:
        tiny = (_SCENE_OF_GROWTH, 64, 3, scene.folder / "tiny.h5")
        cases.append(Case("preparation", "a tiny scene", prepare_render, tiny, once=True))
        cases += floor.cases(threads) + stages.cases(scene, variant, parameters, threads)
    if "beside" in groups:
        cases += plain.cases(scene.light_field, 3 if small else 5, threads)
    if "solvers" in groups:
        cases += solvers.cases(scene, threads)
    if "storage" in groups:
        cases += storage.cases(scene, threads, list(storage.OPTIONS)[: 2 if small else None])
    if groups & {"growth", "large"}:
        cases += _growth_cases(scene, settings, groups, small)
    found = []
    with tqdm(cases, disable=None, leave=False, bar_format="{n}/{total} {desc} |{bar}|") as bar:
        for case in bar:
            bar.set_description(f"{case.group}: {case.name}"[:50].ljust(50))
            few = min(repeats, _GROWTH_REPEATS) if case.group.startswith(("growth", "beside")) else repeats
            measurement = measured(case, few)
            if case.group != "preparation":
                found.append(measurement)
    if "stages" in groups:
        found.insert(0, stages.command(scene, threads, repeats, candidates))
        found.insert(1, stages.job(scene.folder / "tiny.h5", scene.folder / "tiny-initial.h5", repeats))
    return found


def _growth_cases(scene: Scene, settings: dict[str, Any], groups: set[str], small: bool) -> list[Case]:
    """Light fields of every size, then the cases on them."""
    axes = growth.SMALL if small else growth.FULL
    if "growth" not in groups:
        axes = {axis: [] for axis in axes}
    large = "large" in groups
    whole = scene.folder / "whole.h5"
    needed = growth.sizes(axes, large)
    render = (_SCENE_OF_GROWTH, 192 if not small else 64, max(views for _, views in needed.values()), whole)
    prepared = [
        Case("preparation", "scene to grow", prepare_render, render, once=True),
        Case("preparation", "growth", prepare_grown, (whole, needed, scene.folder), once=True),
    ]
    return prepared + growth.cases(
        scene.folder, axes, settings["candidates"], settings["threads"], variant_named(VARIANT), large
    )


def _page(result: Result) -> str:
    machine = ", ".join(f"{key} {value}" for key, value in result.machine.items())
    settings = ", ".join(f"{key} {value}" for key, value in result.settings.items())
    caption = f"Medians. {settings}.\n\nMachine: {machine}."
    return as_markdown(Report("Benchmark", caption, Table((), ()), tables.sections(result)))


if __name__ == "__main__":
    main()
