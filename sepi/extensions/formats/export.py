"""The command ``sepi export``, which writes light fields; not the stage :mod:`sepi.export`."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

import click

from sepi.cli.info import range_text, size_text
from sepi.cli.input_options import Geometry, Reading, camera_flags, range_to_search, reading_flags, truth_flags
from sepi.errors import SepiError
from sepi.process.command import PATH, SepiCommand

if TYPE_CHECKING:
    from sepi.io.disparity_maps import TruthFile


@click.command(cls=SepiCommand)
@click.argument("light_field_path", metavar="INPUT", type=PATH)
@click.argument("output", metavar="OUT", type=PATH)
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
    from sepi.extensions.formats.exported import require_room, write_exported
    from sepi.inspection.disparity_range import settle_range

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
