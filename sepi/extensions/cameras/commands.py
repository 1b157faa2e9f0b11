"""The commands ``sepi calibrate`` and ``sepi poses``."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING

import click

from sepi.cli.input_options import Geometry, Reading, camera_flags, default_folder, reading_flags
from sepi.errors import SepiError
from sepi.process.command import PATH, SepiCommand, progress_bar

if TYPE_CHECKING:
    from sepi.lightfield import FloatMap


@click.command(cls=SepiCommand)
@click.argument("folder", type=PATH)
@click.option("-o", "--output", type=PATH, help="Folder to make; default: NAME-cameras for a FOLDER called NAME.")
@click.option("--lens", default="SIMPLE_RADIAL", show_default=True, help="COLMAP's lens model: RADIAL, OPENCV, ...")
@click.option(
    "--cameras",
    type=click.Choice(["one", "each"]),
    default="one",
    show_default=True,
    help="Whether one camera took all pictures, or each has its own.",
)
@click.option("--force", is_flag=True, help="Go on even if a check of a few pictures fails.")
@click.option("--threads", type=click.IntRange(min=1), help="Threads to use; default: one per core.")
def calibrate(folder: Path, output: Path | None, lens: str, cameras: str, force: bool, threads: int | None) -> None:
    """Find the cameras that took the pictures in FOLDER, and write them as a COLMAP model for 'sepi depth'.

    Move one camera sideways past a static scene, with a constant viewing direction, along a grid, a row or any path.
    A first check of a few reduced pictures refuses a camera that hardly moved, moved forward or turned too far. The
    last lines tell how many pictures are placed, and how far the cameras stand off a plane. The focal length comes
    from the pictures if they determine it, else from EXIF, else it is a usual one. Lenses are SIMPLE_PINHOLE, RADIAL,
    OPENCV, OPENCV_FISHEYE and others of COLMAP. Needs pycolmap: pip install 'sepi[colmap]'.

    \b
    Examples:
      sepi calibrate sweep
      sepi depth sweep-cameras
    """
    from sepi.extensions.cameras.calibration import calibrate as calibrated
    from sepi.io.files import name_of
    from sepi.process.threads import available_cores, use_threads

    threads = threads or available_cores()
    use_threads(threads)
    target = output or default_folder(folder, "cameras")
    with progress_bar(name_of(folder).name) as progress:
        made = calibrated(folder, target, lens=lens, cameras=cameras, force=force, threads=threads, progress=progress)
    count = len(made.placed)
    missing = f"; not placed: {', '.join(made.left_out)}" if made.left_out else ""
    click.echo(f"placed: {count} of {count + len(made.left_out)} pictures{missing}")
    click.echo(f"mean reprojection error of the points: {made.error:.2g} pixels")
    for note in made.notes:
        click.echo(note)
    click.echo(f"written: {target}/")
    if made.unusable is not None:
        raise SepiError(f"'sepi depth' cannot use these cameras: {made.unusable}")
    click.echo(f"next: sepi depth {target}")


@click.command(cls=SepiCommand)
@click.argument("light_field_path", metavar="INPUT", type=PATH)
@click.argument("result_path", metavar="RESULT", type=PATH)
@click.option(
    "--to",
    "kind",
    type=click.Choice(["colmap", "nerfstudio"]),
    default="colmap",
    show_default=True,
    help="Program to write for.",
)
@click.option("-o", "--output", type=PATH, help="Folder to make; default: NAME-colmap for an INPUT called NAME.")
@click.option("--min-confidence", type=float, help="Least confidence of points; default: the median of all pixels.")
@click.option("--points", type=click.IntRange(min=0), default=10000, show_default=True, help="At most so many points.")
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
    from sepi.cli.input_options import camera_of, read_light_field_of
    from sepi.extensions.cameras.data_sets import write_colmap, write_nerfstudio
    from sepi.extensions.cameras.posed_views import PosedViews
    from sepi.io.result_folder import read_result

    light_field = read_light_field_of(light_field_path, result_path, reading, bare=False)
    result = read_result(result_path, reading.options.view)
    folder = output or default_folder(light_field_path, kind)
    posed = PosedViews(
        light_field,
        result.disparity,
        result.confidence,
        unknown=result.unknown,
        camera=camera_of(result_path, reading.options.view, result, geometry),
        min_confidence=min_confidence,
        max_points=points,
        surfaces=_surfaces_of(result_path),
        sigma=result.sigma,
        sigmas=_surfaces_of(result_path, "sigma"),
    )
    with progress_bar(light_field.name) as progress:
        {"colmap": write_colmap, "nerfstudio": write_nerfstudio}[kind](folder, posed, progress)
    if not posed.metric:
        click.echo(
            "the camera is unknown: a nominal one sees the scene at a distance of 1 to 2; pixels fit exactly, but "
            "positions and depth are neither in metres nor to scale"
        )
    units = posed.units.partition(",")[0]
    click.echo(f"written: {folder}/ ({len(posed.positions)} views, {posed.chosen.sum()} points, {units})")


def _surfaces_of(path: Path, name: str = "disparity") -> Callable[[tuple[int, int]], FloatMap] | None:
    """Function from a view to its map, (H, W) float32, NaN where unknown; None without maps of all views.

    Parameters
    ----------
    path : Path
        As for :func:`sepi.read_result`.
    name : str
        ``"disparity"`` or ``"sigma"``.
    """
    import numpy as np

    from sepi.io.result_folder import all_views_file, read_result

    if all_views_file(path, (0, 0)) is None or getattr(read_result(path), name) is None:
        return None

    def surface(view: tuple[int, int]) -> FloatMap:
        result = read_result(path, view)
        return np.where(result.unknown, np.float32(np.nan), getattr(result, name))

    return surface
