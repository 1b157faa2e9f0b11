"""The command ``sepi poses``."""

from __future__ import annotations

from pathlib import Path

import click

from sepi.cli.input_options import (
    Geometry,
    Reading,
    camera_flags,
    camera_of,
    default_folder,
    read_light_field_of,
    reading_flags,
)
from sepi.process.command import SepiCommand, progress_bar

_PATH = click.Path(path_type=Path)


@click.command(cls=SepiCommand)
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
@click.option("-o", "--output", type=_PATH, help="Folder to make; default: NAME-colmap for an INPUT called NAME.")
@click.option(
    "--min-confidence", type=float, metavar="X", help="Least confidence of points; default: the median of all pixels."
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

    RESULT is the folder that 'sepi depth' wrote for INPUT, or its result.h5; it records how INPUT was read. Poses are
    exact and need no matching. Each view has its own principal point; a program that ignores it sees another scene.
    Depth of other views comes from 'sepi depth --all-views', else from RESULT's map, warped to them; 0 is unknown.
    Positions are in metres if the camera is known. If RESULT has error bars, COLMAP's points have an error, and
    nerfstudio's depth has a standard deviation. docs/depth/other_programs.md describes the files.

    \b
    Examples:
      sepi poses cotton cotton-depth
      sepi poses cotton cotton-depth --to nerfstudio -o cotton-nerf
    """
    from sepi.extensions.cameras.colmap import write_colmap
    from sepi.extensions.cameras.nerfstudio import write_nerfstudio
    from sepi.extensions.cameras.posed_views import posed_views
    from sepi.io.all_views import read_result_at, surfaces_of

    light_field = read_light_field_of(light_field_path, result_path, reading, bare=False)
    result = read_result_at(result_path, reading.options.view)
    folder = output or default_folder(light_field_path, kind)
    posed = posed_views(
        light_field,
        result.disparity,
        result.confidence,
        unknown=result.unknown,
        camera=camera_of(result_path, reading.options.view, result, geometry),
        min_confidence=min_confidence,
        max_points=points,
        surfaces=surfaces_of(result_path),
        sigma=result.sigma,
        sigmas=surfaces_of(result_path, "sigma"),
    )
    with progress_bar(light_field.name) as progress:
        {"colmap": write_colmap, "nerfstudio": write_nerfstudio}[kind](folder, posed, progress)
    if not posed.metric:
        click.echo(
            "the camera is unknown: a nominal one sees the scene at a distance of 1 to 2; pixels fit exactly, but "
            "positions and depth are neither in metres nor to scale"
        )
    units = posed.units.partition(",")[0]
    click.echo(f"written: {folder}/ ({len(posed.poses)} views, {posed.chosen.sum()} points, {units})")
