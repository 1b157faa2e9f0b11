"""Which cases a run of the benchmark has, and the run itself."""

from __future__ import annotations

from typing import Any

import click
from tqdm import tqdm

from bench import floor, growth, plain, solvers, stages, storage
from bench.measure import Case, Measurement, measured
from bench.scene import VARIANT, Scene, prepare_files, prepare_grown, prepare_render
from sepi.errors import SepiError
from sepi.io.hdf5 import read_light_field
from sepi.pipeline import stage_parameters, variant_named

GROWTH_REPEATS = 3
"""Long enough to see how time grows, short enough to wait for."""

GROUPS = ("stages", "growth", "beside", "solvers", "storage", "large")
GROWING_SCENE = "curved_occluders"


def measure(scene: Scene, settings: dict[str, Any], groups: set[str], small: bool) -> tuple[list[Measurement], int]:
    """Prepare the files that the cases share, then measure case by case.

    Parameters
    ----------
    scene : Scene
    settings : dict
        ``num_disparities``, ``threads`` and ``repeats``; what is known of the scene once it is read is added.
    groups : set of str
        Of ``GROUPS``.
    small : bool

    Returns
    -------
    list of Measurement
    int
        How many cases failed; each was warned of.

    Raises
    ------
    SepiError
        If the scene cannot be prepared.
    """
    threads, num_disparities, repeats = settings["threads"], settings["num_disparities"], settings["repeats"]
    variant = variant_named(VARIANT)
    parameters = stage_parameters(
        variant, {stage: {"num_disparities": num_disparities} for stage in ("initial", "occlusion")}
    )
    measured(Case("preparation", "scene", prepare_files, (scene, variant, parameters), threads=threads, once=True), 1)
    light_field = read_light_field(scene.light_field)
    (T, S), (H, W) = light_field.grid, light_field.shape
    settings.update(
        size=f"{W}x{H}", views=f"{T}x{S}", pixels=f"{light_field.views.dtype} x {light_field.views.shape[4]}"
    )
    steps = stages.cases(
        scene, variant, parameters, threads, light_field.require_disparity_range().source == "estimated"
    )
    cases = []
    if "stages" in groups:
        tiny = (GROWING_SCENE, 64, 3, scene.folder / "tiny.h5")
        cases = [Case("preparation", "a tiny scene", prepare_render, tiny, once=True), *floor.cases(threads), *steps]
    elif "beside" in groups:
        cases = [case for case in steps if case.name == "initial"]
    if "beside" in groups:
        cases += plain.cases(scene.light_field, 3 if small else 20, threads)
    if "solvers" in groups:
        cases += solvers.cases(scene, threads)
    if "storage" in groups:
        cases += storage.cases(scene, threads, list(storage.OPTIONS)[: 2 if small else None])
    if groups & {"growth", "large"}:
        cases += _growth_cases(scene, num_disparities, threads, groups, small)
    found, failed = _all_measured(cases, repeats)
    if "stages" in groups:
        tiny_files = scene.folder / "tiny.h5", scene.folder / "tiny-initial.h5"
        found[:0] = [stages.command(scene, threads, repeats, num_disparities), stages.job(*tiny_files, repeats)]
    return found, failed


def _all_measured(cases: list[Case], repeats: int) -> tuple[list[Measurement], int]:
    """Every case but those of preparation; a case that fails is warned of and left out."""
    found, failed = [], 0
    with tqdm(cases, disable=None, leave=False, bar_format="{n}/{total} {desc} |{bar}|") as bar:
        for case in bar:
            bar.set_description(f"{case.group}: {case.name}"[:50].ljust(50))
            try:
                few = min(repeats, GROWTH_REPEATS) if case.group.startswith("growth") else repeats
                measurement = measured(case, few)
            except SepiError as error:
                click.echo(f"sepi: warning: {error}", err=True)
                failed += 1
                continue
            if case.group != "preparation":
                found.append(measurement)
    return found, failed


def _growth_cases(scene: Scene, num_disparities: int, threads: int, groups: set[str], small: bool) -> list[Case]:
    """Light fields of every size, and kernels compiled for them; then the cases."""
    axes = growth.SMALL if small else growth.FULL
    if "growth" not in groups:
        axes = {axis: [] for axis in axes}
    large, variant = "large" in groups, variant_named(VARIANT)
    whole = scene.folder / "whole.h5"
    needed = growth.sizes(axes, large)
    render = (GROWING_SCENE, 64 if small else 192, max(views for _, views in needed.values()), whole)
    return [
        Case("preparation", "scene to grow", prepare_render, render, once=True),
        Case("preparation", "growth", prepare_grown, (whole, needed, scene.folder), once=True),
        Case("preparation", "kernels", stages.whole, (whole, variant, {}), threads=threads, once=True),
        *growth.cases(scene.folder, axes, num_disparities, threads, variant, large),
    ]
