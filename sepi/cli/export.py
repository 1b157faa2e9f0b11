"""The commands ``sepi export`` and ``sepi scenes``, which write light fields; not the stage :mod:`sepi.export`."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

import click

from sepi.cli.info import range_text, size_text
from sepi.cli.input_options import Geometry, Reading, camera_flags, range_to_search, reading_flags, truth_flags
from sepi.errors import SepiError
from sepi.process.command import SepiCommand

if TYPE_CHECKING:
    from sepi.io.disparity_maps import TruthFile

_PATH = click.Path(path_type=Path)


@click.command(cls=SepiCommand)
@click.argument("light_field_path", metavar="INPUT", type=_PATH)
@click.argument("output", metavar="OUT", type=_PATH)
@range_to_search
@click.option("--force", is_flag=True, help="Also replace existing files.")
@truth_flags
@camera_flags
@reading_flags
def export(
    light_field_path: Path,
    output: Path,
    disparity_range: tuple[float, float] | None,
    force: bool,
    own: TruthFile | None,
    geometry: Geometry | None,
    reading: Reading,
) -> None:
    """Save the light field INPUT, read with these flags, as OUT, which needs no flags.

    OUT is one HDF5 file if its name ends with .h5; else a folder with a picture for each view, named by row and column:
    PNG of 8 or 16 bit, or TIFF of floats. Both hold the positions of the views, the disparity range, the camera, the
    view whose depth is estimated, ground truth and masks. The folder has them in light_field.json, which you may edit
    (docs/reference/folders.md).

    \b
    Examples:
      sepi export pictures lego.h5 --order flip-columns --exclude 0,0 --row-spacing 2
      sepi export LF.mat lego --axes HWTSC --disparity-range -2 2
      sepi depth lego
    """
    from sepi.inspection.disparity_range import settle_range
    from sepi.io.readers.exported import require_room, write_exported

    if output.resolve() == light_field_path.resolve():
        raise SepiError(f"{output}: is the light field itself; choose another name")
    require_room(output, force=force)
    light_field = reading.read(light_field_path, geometry, disparity_range=disparity_range)
    if own is not None:
        part = reading.options.part if light_field.rig is None else None
        light_field = replace(light_field, ground_truth=own.read(light_field.shape, part))
    # notes on assumptions and flags do not apply to what is read from OUT
    note = f"exported from {light_field_path}"
    light_field = replace(settle_range(light_field), source="", reading="", notes=(note,))
    write_exported(output, light_field, force=force)
    click.echo(f"{light_field.name}: {size_text(light_field)}")
    click.echo(f"disparity range: {range_text(light_field.require_disparity_range())}")
    click.echo(f"written: {output}{'/' if output.is_dir() else ''}")


@click.command(cls=SepiCommand)
@click.argument("names", metavar="[NAME]...", nargs=-1)
@click.option("-o", "--output", type=_PATH, default=Path("scenes"), show_default=True, help="Folder to write to.")
@click.option("--size", type=click.IntRange(min=1), default=192, show_default=True, help="Pixels a side of a view.")
@click.option("--views", type=click.IntRange(min=2), default=9, show_default=True, help="Views a side of the grid.")
@click.option("--list", "only_list", is_flag=True, help="List the scenes and write nothing.")
def scenes(names: tuple[str, ...], output: Path, size: int, views: int, only_list: bool) -> None:
    """Write scenes, with exact ground truth, as HCI 4D benchmark folders.

    Without NAMEs, all scenes are written. Built-in scenes consist of planar shapes and take seconds.

    \b
    Examples:
      sepi scenes --list
      sepi scenes pyramids stripes -o scenes --size 256
    """
    from sepi.scenes import SCENES, render, write_hci
    from sepi.validation import require_known

    if only_list:
        list_scenes(SCENES)
        return
    require_known("built-in scenes", names, SCENES)
    chosen = dict.fromkeys(names or SCENES)
    require_new(output, chosen)
    for name in chosen:
        write_hci(render(name, size=size, views=views), output / name)
        click.echo(f"written: {output / name}/")


def list_scenes(told: dict[str, str]) -> None:
    """Print names and descriptions."""
    width = max(map(len, told))
    for name, description in told.items():
        click.echo(f"{name.ljust(width)}  {description}")


def require_new(output: Path, folders: Iterable[str]) -> None:
    """Raise if one of the folders exists."""
    for name in folders:
        if (output / name).exists():
            raise SepiError(f"{output / name}: exists already; remove it, or choose another folder with -o")
