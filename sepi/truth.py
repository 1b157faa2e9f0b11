"""Ground truth of a scene in a file of its own, so that a change of it runs no stage again."""

from __future__ import annotations

from importlib import import_module
from pathlib import Path

import click

from sepi.cli.input_options import Reading, reading_flags, scene_flags, truth_flags
from sepi.io.disparity_maps import TruthFile
from sepi.io.hdf5 import read_light_field, write_truth
from sepi.lightfield import Truth
from sepi.process.command import PATH, SepiCommand
from sepi.validation import settings_of


@click.command(name="python -m sepi.truth", cls=SepiCommand)
@click.argument("path", type=PATH, required=False)
@scene_flags
@reading_flags
@truth_flags
@click.option("--light-field", type=PATH, help="HDF5 file from ingest, whose size --truth must have.")
@click.option("--output", type=PATH, required=True, help="HDF5 file to write.")
def main(
    path: Path | None,
    module: str | None,
    settings: tuple[str, ...],
    reading: Reading,
    own: TruthFile | None,
    light_field: Path | None,
    output: Path,
) -> None:
    """Write ground truth and masks of the light field at PATH; without PATH, a file that says there are none.

    --truth replaces the light field's own ground truth.
    """
    truth: Truth = (None, {})
    if path is not None and module is not None:
        truth = import_module(module).read_truth(path, **settings_of(settings, "seed=2"))
    elif path is not None:
        from sepi.io.readers.formats import read_truth

        truth = read_truth(path, reading.options, reading.file_format)
    if own is not None:
        known = None if light_field is None else read_light_field(light_field)
        part = reading.options.part if known is None or known.rig is None else None
        truth = own.read(None if known is None else known.shape, part), truth[1]
    write_truth(output, truth)


if __name__ == "__main__":
    main()
