"""The command ``sepi depth``."""

from __future__ import annotations

import time
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from sepi.cli.info import range_text, size_text
from sepi.cli.input_options import Geometry, Reading, camera_flags, default_folder, range_to_search, reading_flags
from sepi.errors import SepiError
from sepi.process.command import PATH, SepiCommand, progress_bar

# other imports stand in the functions, since `sepi depth --help` does not need them
if TYPE_CHECKING:
    from sepi.lightfield import LightField
    from sepi.stage import MadeBy, StageMaps
    from sepi.variants import Variant

    # writes maps of all views: folder of the result, light field, maps, variant, parameters, limit of memory in bytes
    _Also = Callable[[Path, LightField, StageMaps, Variant, dict[str, dict[str, Any]], int | None], None]


AMBIGUOUS = 0.5
"""Confidence below which a depth is more likely wrong than right."""


@click.command(cls=SepiCommand)
@click.argument("light_field_path", metavar="INPUT", type=PATH)
@click.option("-o", "--output", type=PATH, help="Folder to write; default: NAME-depth for an INPUT called NAME.")
@click.option("--variant", default="best", show_default=True, help="Named choice of stages; see above.")
@range_to_search
@click.option("--threads", type=click.IntRange(min=1), help="Threads to use; default: one per core.")
@click.option(
    "--memory",
    type=click.IntRange(min=1),
    metavar="MB",
    help="Largest memory of the process; less memory takes more time, for the same maps. Default: no limit.",
)
@click.option(
    "--set",
    "settings",
    multiple=True,
    metavar="KEY=VALUE",
    help="Set a parameter, STAGE.CHOICE.NAME=VALUE; repeatable. config.yaml lists all.",
)
@click.option("--force", is_flag=True, help="Also write to a folder with other files or another light field's result.")
@click.option("--timing", is_flag=True, help="Also write runtime.txt: seconds, for a benchmark submission.")
@camera_flags
@reading_flags
def depth(
    light_field_path: Path,
    output: Path | None,
    variant: str,
    disparity_range: tuple[float, float] | None,
    threads: int | None,
    memory: int | None,
    settings: tuple[str, ...],
    force: bool,
    timing: bool,
    geometry: Geometry | None,
    reading: Reading,
    also: _Also | None = None,
) -> None:
    """Compute the disparity map of the light field INPUT.

    INPUT is a folder of views, a Lytro picture (*_eslf.png), an array (.mat, .npy, .npz) or an HDF5 file. 'sepi info'
    shows how it is read, 'sepi check' whether its views are in the right order. The command writes disparity (numbers
    and picture), error bars, confidence, masks and a point cloud, and depth in metres if the camera is known.

    Variants: best (the most accurate), fast (less accurate), paper (the method as published); no_sepi, no_occlusion,
    no_textureless, no_occlusion_no_textureless, no_noise_correction (paper with parts switched off), wang (paper with
    another occlusion model); best_no_detail and others (best with parts switched off, docs/method/best.md); acc, cae,
    mishiba, oavc, occ, pobr, spo (other authors' methods), onnx (a network of yours, docs/reproduce/compared.md).

    \b
    Examples:
      sepi depth cotton
      sepi depth cotton -o maps --disparity-range -2 2
      sepi depth flowers_eslf.png --central 7
      sepi depth views --grid 5x5 --exclude 0,0 --exclude 0,4
      sepi depth cotton --variant paper --set initial.sepi.num_disparities=91
    """
    from sepi.process.threads import available_cores, use_threads

    started = time.perf_counter()
    use_threads(threads or available_cores())
    from sepi.io.result_files import ALL_VIEWS, names_of_others, require_own, require_target
    from sepi.variants import stage_parameters, variant_named

    chosen = variant_named(variant)
    parameters = _parameters(settings, variant, chosen)
    stage_parameters(chosen, parameters)
    folder = output or default_folder(light_field_path, "depth")
    require_target(folder)
    if light_field_path.resolve() == folder.resolve():
        raise SepiError(f"{folder}: is the light field itself; choose another folder for the result")
    light_field = reading.read(light_field_path, geometry, disparity_range=disparity_range)
    from sepi.inspection.disparity_range import settle_range
    from sepi.io.result_folder import write_result
    from sepi.matching.unknown import UNKNOWN
    from sepi.pipeline import estimate_depth

    require_own(folder, light_field, force=force)
    light_field = settle_range(light_field)
    with progress_bar(light_field.name) as progress:
        maps = estimate_depth(light_field, variant, parameters, progress, memory and memory * 2**20)
    seconds = time.perf_counter() - started if timing else None
    others = () if also is None else (ALL_VIEWS, *names_of_others(light_field, with_sigma=maps.sigma is not None))
    files = write_result(folder, light_field, maps, force=force, seconds=seconds, beside=others)
    if also is not None:
        also(folder, light_field, maps, chosen, parameters, memory and memory * 2**20)
        files = (*files, *others)
    click.echo(f"{light_field.name}: {size_text(light_field)}")
    for note in light_field.notes:
        click.echo(f"note: {note}")
    click.echo(f"disparity range: {range_text(light_field.require_disparity_range())}{_candidates(maps.made_by)}")
    unknown = float(maps.mask(UNKNOWN).mean())
    if unknown:
        click.echo(f"unknown: {100 * unknown:.2g} % of the pixels; no view has evidence for their depth")
    click.echo(_interval(maps, variant))
    click.echo(f"written to {folder}/: {' '.join(files)}")


def _interval(maps: StageMaps, variant: str) -> str:
    """Line on the width of the intervals of known pixels and on how many are ambiguous, or that there are none."""
    import numpy as np

    from sepi.matching.unknown import UNKNOWN

    if maps.low is None or maps.high is None:
        return f"no interval: {variant} has no error bars"
    width, known = maps.high - maps.low, ~maps.mask(UNKNOWN)
    half = float(np.median(width[known] if known.any() else width)) / 2
    doubtful = known & (maps.confidence < AMBIGUOUS)
    plain = float((doubtful & maps.mask("textureless")).mean())
    return (
        f"90 % interval: median half width {half:.2g} pixels per view step\n"
        f"ambiguous: {100 * float(doubtful.mean()):.2g} % of the pixels (confidence below {AMBIGUOUS:g}), "
        f"{100 * plain:.2g} % in regions without texture"
    )


def _candidates(made_by: MadeBy | None) -> str:
    """Text on the number of candidates in the range; empty if no stage has any."""
    history = () if made_by is None else made_by.history
    known = [step["parameters"]["num_disparities"] for step in history if "num_disparities" in step["parameters"]]
    return f", {' and '.join(map(str, dict.fromkeys(known)))} candidates" if known else ""


def _parameters(settings: tuple[str, ...], name: str, variant: Variant) -> dict[str, dict[str, Any]]:
    """Stage to field to value from ``STAGE.CHOICE.NAME=VALUE`` of the command line."""
    from sepi.validation import require_known, settings_of

    parameters: dict[str, dict[str, Any]] = {}
    for key, value in settings_of(settings, "optimize.wls.alpha=1e-5", "STAGE.CHOICE.NAME=VALUE").items():
        stage, choice, field = key.split(".")
        used = [f"{stage}.{choice}" for stage, choice in variant.choices.items()]
        require_known(f"--set {key}: stages of variant {name}", [f"{stage}.{choice}"], used)
        parameters.setdefault(stage, {})[field] = value
    return parameters
