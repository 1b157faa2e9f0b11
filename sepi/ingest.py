"""Stage ingest: one HDF5 file from a light field of any format, with a disparity range.

Ground truth has a file of its own (:mod:`sepi.truth`), so that a change of it runs no stage again.
"""

from __future__ import annotations

from dataclasses import replace
from importlib import import_module
from pathlib import Path

import click

from sepi.cli.input_options import Reading, range_to_search, reading_flags, scene_flags
from sepi.inspection.coded_views import comparable
from sepi.inspection.disparity_range import settle_range
from sepi.io.hdf5 import write_light_field
from sepi.process.command import PATH, SepiCommand
from sepi.process.threads import use_threads
from sepi.validation import settings_of


@click.command(name="python -m sepi.ingest", cls=SepiCommand)
@click.argument("path", type=PATH)
@scene_flags
@range_to_search
@reading_flags
@click.option("--threads", type=click.IntRange(min=1), default=1, show_default=True, help="Threads to use.")
@click.option("--output", type=PATH, required=True, help="HDF5 file to write.")
def main(
    path: Path,
    module: str | None,
    settings: tuple[str, ...],
    disparity_range: tuple[float, float] | None,
    reading: Reading,
    threads: int,
    output: Path,
) -> None:
    """Read the light field at PATH and write it as one HDF5 file with a disparity range."""
    use_threads(threads)
    if module is None:
        light_field = reading.read(path, truth=False)
    else:
        light_field = import_module(module).read_scene(path, **settings_of(settings, "seed=2"))
        light_field = replace(light_field, ground_truth=None, masks={})
    light_field = settle_range(light_field, disparity_range)
    # found out here once for all stages
    write_light_field(output, light_field, comparable(light_field) is light_field)


if __name__ == "__main__":
    main()
