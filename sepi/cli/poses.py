"""The command ``sepi poses``."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

import click
import numpy as np

from sepi.cli.input_options import Geometry, Reading, camera_flags, reading_flags
from sepi.cli.scene_argument import view_of
from sepi.command import SepiCommand, progress_bar
from sepi.errors import SepiError

if TYPE_CHECKING:
    from sepi.io.result_folder import Result
    from sepi.lightfield import LightField

_PATH = click.Path(path_type=Path)


@click.command(cls=SepiCommand, short_help="Write camera poses and depth for COLMAP or nerfstudio.")
@click.argument("light_field_path", metavar="INPUT", type=_PATH)
@click.argument("result_path", metavar="RESULT", type=_PATH)
@click.option(
    "--to",
    "kind",
    type=click.Choice(["colmap", "nerfstudio"]),
    default="colmap",
    show_default=True,
    help="Program to write for.",
)
@click.option("-o", "--output", type=_PATH, help="Folder to make; ./NAME-colmap after INPUT's name unless given.")
@click.option(
    "--min-confidence", type=float, metavar="X", help="No points of less sure pixels; else of the surer half."
)
@click.option(
    "--points", type=click.IntRange(min=0), default=10000, show_default=True, metavar="N", help="At most N points."
)
@camera_flags
@reading_flags
def poses(
    light_field_path: Path,
    result_path: Path,
    kind: str,
    output: Path | None,
    min_confidence: float | None,
    points: int,
    geometry: Geometry | None,
    reading: Reading,
) -> None:
    """Write the views of the light field INPUT with camera poses, depth and points, for COLMAP or nerfstudio.

    RESULT is the folder that 'sepi depth' wrote for INPUT, or its result.h5; give the flags here that 'sepi depth' had.
    Poses are exact, so nothing has to be matched. Each view has a principal point of its own: programs that ignore it
    see another scene. Depth of the other views is RESULT's, carried over; 0 where it does not say. Positions are in
    metres where the camera is known. docs/reference/outputs.md describes the files.

    \b
    Examples:
      sepi poses cotton cotton-depth
      sepi poses cotton cotton-depth --to nerfstudio -o cotton-nerf
    """
    from sepi.applications.posed_views import posed_views
    from sepi.io.colmap import write_colmap
    from sepi.io.nerfstudio import write_nerfstudio
    from sepi.io.result_folder import read_result

    result = read_result(result_path)
    light_field = _belonging(light_field_path, result_path, result, reading)
    whole = light_field_path.resolve()
    folder = output or Path(f"{whole.name if whole.is_dir() else whole.stem}-{kind}")
    posed = posed_views(
        light_field,
        result.disparity,
        result.confidence,
        unknown=result.unknown,
        camera=result.camera if geometry is None else geometry(shape=light_field.shape),
        min_confidence=min_confidence,
        max_points=points,
    )
    with progress_bar(light_field.name) as progress:
        {"colmap": write_colmap, "nerfstudio": write_nerfstudio}[kind](folder, posed, progress)
    if not posed.metric:
        click.echo(
            "the camera is not known: a nominal one is taken, that sees the scene at a distance of 1 to 2; pixels fit "
            "exactly, positions and depth are neither in metres nor to scale"
        )
    units = "metres" if posed.metric else "nominal units"
    click.echo(f"written: {folder}/ ({len(posed.poses)} views, {posed.chosen.sum()} points, {units})")


def _belonging(path: Path, result_path: Path, result: Result, reading: Reading) -> LightField:
    """The light field that a result was made from, with the result's view as reference view.

    Raises
    ------
    SepiError
        If it cannot be read, or is another.
    """
    from sepi.io.hdf5 import read_attributes

    attributes = read_attributes(result_path / "result.h5" if result_path.is_dir() else result_path)
    belongs = view_of(result_path)
    options = reading.options
    if belongs is not None and options.view is None:
        options = replace(options, view=belongs[0])
    if options.row_spacing is None and attributes.get("positions") == "grid":
        # found out from the views, perhaps
        options = replace(options, row_spacing=float(attributes["row_spacing"]))
    light_field = replace(reading, options=options).read(path, check_order=False)
    told = float(attributes.get("row_spacing", light_field.row_spacing))
    if (
        belongs != (light_field.reference_position, light_field.grid)
        or not np.array_equal(light_field.views[light_field.reference_position], result.picture)
        or not np.isclose(told, light_field.row_spacing)
        or attributes.get("positions", "grid") != ("grid" if light_field.positions is None else "given")
    ):
        raise SepiError(
            f"{result_path}: is not of {path} as it is read here; give the result of this light field, and the flags "
            "that 'sepi depth' had"
        )
    return light_field
