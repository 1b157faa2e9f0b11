"""The command ``sepi calibrate``."""

from __future__ import annotations

from pathlib import Path

import click

from sepi.cli.input_options import default_folder
from sepi.errors import SepiError
from sepi.process.command import SepiCommand, progress_bar

_PATH = click.Path(path_type=Path)


@click.command(cls=SepiCommand)
@click.argument("folder", type=_PATH)
@click.option("-o", "--output", type=_PATH, help="Folder to make; default: NAME-cameras for a FOLDER called NAME.")
@click.option(
    "--lens",
    default="SIMPLE_RADIAL",
    show_default=True,
    metavar="MODEL",
    help="COLMAP's lens model: SIMPLE_PINHOLE, RADIAL, OPENCV, OPENCV_FISHEYE, ...",
)
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
    from the pictures if they determine it, else from EXIF, else it is a usual one. Needs pycolmap: pip install
    'sepi[colmap]'.

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
