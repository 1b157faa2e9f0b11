"""The command that makes the folder of final maps from a variant's last stage file."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import click

from sepi.io.hdf5 import read_light_field, read_stage
from sepi.io.provenance import history_of
from sepi.io.result_files import remove_result
from sepi.io.result_folder import write_result
from sepi.matching.unknown import with_unknown
from sepi.process.command import PATH, SepiCommand
from sepi.stage import MadeBy


@click.command(cls=SepiCommand)
@click.option("--light-field", "light_field_path", type=PATH, required=True, help="HDF5 file from ingest.")
@click.option("--maps", type=PATH, required=True, help="File of the last stage.")
@click.option("--variant", required=True, help="Name of the variant, for the attributes of the files.")
@click.option("--output", type=PATH, required=True, help="Folder to write.")
def main(light_field_path: Path, maps: Path, variant: str, output: Path) -> None:
    """Write disparity.pfm, result.h5 and pictures of a stage file, with unknown pixels marked."""
    light_field = read_light_field(light_field_path)
    made_by = MadeBy(variant, tuple(history_of(maps)), light_field.require_disparity_range())
    # the folder is the workflow's own, which has removed what says so
    remove_result(output)
    finished = replace(with_unknown(light_field, read_stage(maps)), made_by=made_by)
    write_result(output, light_field, finished, force=True)


if __name__ == "__main__":
    main()
