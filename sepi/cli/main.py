"""The command ``sepi``."""

from __future__ import annotations

import json
import re
import time
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from sepi.cli.compare import compare
from sepi.cli.convert import convert
from sepi.cli.evaluate import evaluate
from sepi.cli.export import export
from sepi.cli.info import check, info, range_text, size_text
from sepi.cli.input_options import (
    Geometry,
    Reading,
    camera_flags,
    default_folder,
    range_to_search,
    reading_flags,
)  # fmt: skip
from sepi.cli.poses import poses
from sepi.cli.refocus import refocus
from sepi.cli.results import check_submission, points, submission
from sepi.cli.scenes import scenes
from sepi.command import SepiGroup, progress_bar
from sepi.errors import SepiError
from sepi.io.provenance import package_version, result_attributes
from sepi.threads import available_cores, use_threads
from sepi.validation import require_known

# Modules that are slow to import, such as the stages, are imported in the commands that need them.
if TYPE_CHECKING:
    from sepi.stage import MadeBy
    from sepi.variants import Variant

_PATH = click.Path(path_type=Path)


@click.group(cls=SepiGroup, context_settings={"help_option_names": ["-h", "--help"]})
@click.version_option(package_version(), message="%(prog)s %(version)s")
def main() -> None:
    """Depth from light fields by stitched epipolar plane images.

    A light field is a grid of views of one scene, each taken from a camera position a little to the side of the next.
    Its disparity map says, for each pixel of the centre view, by how many pixels it moves from view to view: the
    more, the nearer.

    \b
    Try it on a built-in scene:
      sepi scenes pyramids -o scenes
      sepi depth scenes/pyramids
      sepi evaluate pyramids-depth scenes/pyramids
    """


@main.command(short_help="Compute the disparity map of the light field INPUT.")
@click.argument("light_field_path", metavar="INPUT", type=_PATH)
@click.option("-o", "--output", type=_PATH, help="Folder to write; ./NAME-depth after INPUT's name unless given.")
@click.option("--variant", default="best", show_default=True, help="Named choice of stages; see above.")
@range_to_search
@click.option("--threads", type=click.IntRange(min=1), help="Threads to use; one per core unless given.")
@click.option(
    "--memory",
    type=click.IntRange(min=1),
    metavar="MB",
    help="Stay within so much memory; the same maps, more slowly. As much as is of use unless given.",
)
@click.option(
    "--set",
    "settings",
    multiple=True,
    metavar="KEY=VALUE",
    help="Set a parameter, STAGE.CHOICE.NAME=VALUE; repeatable. config.yaml lists them.",
)
@click.option("--force", is_flag=True, help="Write to a folder with other files or another light field's result, too.")
@click.option("--timing", is_flag=True, help="Also write runtime.txt: seconds, as a benchmark submission needs.")
@click.option("--all-views", is_flag=True, help="Also write all_views.h5: a map for each view, which takes longer.")
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
    all_views: bool,
    geometry: Geometry | None,
    reading: Reading,
) -> None:
    """Compute the disparity map of the light field INPUT.

    INPUT is a folder of views, a Lytro picture (*_eslf.png), an array (.mat, .npy, .npz) or an HDF5 file; 'sepi info'
    shows how it is read, 'sepi check' whether its views are in the right order. Writes the disparity as numbers and in
    colour, confidence, masks and a point cloud; depth in metres where the camera is known. With --all-views a map for
    every view, too, made from those of a few: docs/depth/all_views.md.

    Variants: best (the most accurate), fast (half its time), paper (the method as published), no_sepi, no_occlusion,
    no_textureless, no_occlusion_no_textureless (parts of it switched off), wang (another treatment of occlusion);
    best_no_detail and others that docs/method/best.md lists (parts of best switched off); acc, cae, mishiba, oavc, occ,
    pobr, spo (other authors' methods), onnx (a network of yours), which docs/reproduce/compared.md explains.

    \b
    Examples:
      sepi depth cotton
      sepi depth cotton -o maps --disparity-range -2 2
      sepi depth cotton --all-views
      sepi depth flowers_eslf.png --central 7
      sepi depth views --grid 5x5 --exclude 0,0 --exclude 0,4
      sepi depth cotton --variant paper --set initial.sepi.num_disparities=91
    """
    from sepi.inspection.disparity_range import settle_range
    from sepi.io.result_folder import ALL_VIEWS, require_own, require_target, write_result
    from sepi.matching.unknown import UNKNOWN
    from sepi.pipeline import estimate_depth
    from sepi.variants import stage_parameters, variant_named

    started = time.perf_counter()
    use_threads(threads or available_cores())
    chosen = variant_named(variant)
    parameters = _parameters(settings, variant, chosen)
    stage_parameters(chosen, parameters)
    folder = output or default_folder(light_field_path, "depth")
    require_target(folder)
    if light_field_path.resolve() == folder.resolve():
        raise SepiError(f"{folder}: is the light field itself; choose another folder for the result")
    light_field = reading.read(light_field_path, disparity_range=disparity_range)
    require_own(folder, light_field, force=force)
    if geometry is not None:
        light_field = replace(light_field, camera=geometry(shape=light_field.shape))
    light_field = settle_range(light_field)
    with progress_bar(light_field.name) as progress:
        maps = estimate_depth(light_field, variant, parameters, progress, memory and memory * 2**20)
    seconds = time.perf_counter() - started if timing else None
    beside = (ALL_VIEWS,) if all_views else ()
    files = write_result(folder, light_field, maps, force=force, seconds=seconds, beside=beside)
    if all_views:
        from sepi.applications.all_views import maps_of_all_views
        from sepi.io.all_views import write_all_views

        made_by = result_attributes(light_field, maps)
        with progress_bar(f"{light_field.name}, all views") as progress:
            views = maps_of_all_views(light_field, maps, chosen, parameters, progress, memory and memory * 2**20)
            write_all_views(folder / ALL_VIEWS, light_field, ((view.position, view.maps) for view in views), made_by)
        files = (*files, ALL_VIEWS)
    click.echo(f"{light_field.name}: {size_text(light_field)}")
    click.echo(f"disparity range: {range_text(light_field.require_disparity_range())}{_candidates(maps.made_by)}")
    unknown = float(maps.mask(UNKNOWN).mean())
    if unknown:
        click.echo(f"unknown: {100 * unknown:.2g} % of the pixels; no view knows anything about them")
    click.echo(f"written to {folder}/: {' '.join(files)}")


for command in (
    scenes, info, check, export, evaluate, compare, refocus, points, poses, convert, submission, check_submission,
):  # fmt: skip
    main.add_command(command)


def _candidates(made_by: MadeBy | None) -> str:
    """How many candidates there are in the range; nothing where no stage has any."""
    history = () if made_by is None else made_by.history
    known = [step["parameters"]["num_disparities"] for step in history if "num_disparities" in step["parameters"]]
    return f", {' and '.join(map(str, dict.fromkeys(known)))} candidates" if known else ""


def _parameters(settings: tuple[str, ...], name: str, variant: Variant) -> dict[str, dict[str, Any]]:
    """Stage to field to value from ``STAGE.CHOICE.NAME=VALUE`` of the command line."""
    parameters: dict[str, dict[str, Any]] = {}
    for setting in settings:
        match = re.fullmatch(r"(\w+)\.(\w+)\.(\w+)=(.*)", setting)
        if match is None:
            raise SepiError(
                f"--set {setting}: expected STAGE.CHOICE.NAME=VALUE, such as initial.semi_global.num_disparities=91"
            )
        stage, choice, field, text = match.groups()
        used = [f"{stage}.{choice}" for stage, choice in variant.choices.items()]
        require_known(f"--set {setting}: stages of variant {name}", [f"{stage}.{choice}"], used)
        try:
            value = json.loads(text)
        except (ValueError, RecursionError):
            value = text
        parameters.setdefault(stage, {})[field] = value
    return parameters
