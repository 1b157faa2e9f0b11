"""The command ``sepi points``."""

from __future__ import annotations

from pathlib import Path

import click

from sepi.cli.input_options import Geometry, camera_flags, view_of_result
from sepi.cli.scene_argument import camera_of
from sepi.errors import SepiError
from sepi.process.command import SepiCommand

_PATH = click.Path(path_type=Path)


@click.command(cls=SepiCommand)
@click.argument("result_path", metavar="RESULT", type=_PATH)
@click.option(
    "-o", "--output", type=_PATH, help="PLY file to write; default: points.ply or points_ROW_COLUMN.ply in RESULT."
)
@click.option("--min-confidence", type=float, default=0.0, metavar="X", help="Least confidence of points, 0 to 1.")
@click.option("--max-depth", type=float, metavar="M", help="Leave out points farther than this, metres.")
@click.option(
    "--max-sigma",
    type=float,
    metavar="X",
    help="Leave out points of a larger standard deviation: of the depth in metres if the camera is known, else of "
    "the disparity in pixels per view step.",
)
@click.option("--step", type=click.IntRange(min=1), default=1, metavar="N", help="Use every Nth row and column only.")
@click.option("--keep-unknown", is_flag=True, help="Keep unknown pixels, for whose depth no view has evidence.")
@view_of_result
@camera_flags
def points(
    result_path: Path,
    output: Path | None,
    min_confidence: float,
    max_depth: float | None,
    max_sigma: float | None,
    step: int,
    keep_unknown: bool,
    view: tuple[int, int] | None,
    geometry: Geometry | None,
) -> None:
    """Write the coloured point cloud of RESULT as a PLY file.

    RESULT is a folder that 'sepi depth' wrote, its result.h5 or its all_views.h5. Points are in metres if the scene's
    files or the flags give the camera; else they are a relief with x and y in pixels. If RESULT has error bars, each
    point has a sigma, in metres or in pixels per view step. docs/depth/metric_depth.md describes both.

    \b
    Examples:
      sepi points cotton-depth --min-confidence 0.5 --max-depth 6
      sepi points cotton-depth --max-sigma 0.02
      sepi points views-depth -o views.ply --focal-length 50 --baseline 10 --focus-distance 2 --sensor-size 36
    """
    from sepi.io.all_views import read_result_at
    from sepi.io.point_cloud import point_cloud, write_ply

    result = read_result_at(result_path, view)
    if max_sigma is not None and result.sigma is None:
        raise SepiError(f"{result_path}: --max-sigma: the result has no error bars, like those of compared methods")
    cloud = point_cloud(
        result.picture,
        result.disparity,
        result.confidence,
        camera=camera_of(result_path, view, result, geometry),
        from_centre=result.from_centre,
        min_confidence=min_confidence,
        max_depth=max_depth,
        step=step,
        unknown=None if keep_unknown else result.unknown,
        rig=None if geometry is not None else result.rig,
        sigma=result.sigma,
        max_sigma=max_sigma,
    )
    if not len(cloud.positions):
        tried = "lower --min-confidence, raise --max-depth or --max-sigma, give --keep-unknown"
        raise SepiError(f"{result_path}: no point is left; {tried}")
    name = "_".join(["points", *map(str, view or ())]) + ".ply"
    path = output or (result_path if result_path.is_dir() else result_path.parent) / name
    if path.suffix.lower() != ".ply":
        raise SepiError(f"{path}: expected a name that ends with .ply, the format of the file")
    write_ply(path, cloud)
    units = cloud.units or "metres" if cloud.metric else "relief, not to scale, since the camera is unknown"
    click.echo(f"written: {path} ({len(cloud.positions)} points, {units})")
