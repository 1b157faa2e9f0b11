"""Stage ingest: read a light field of any format, settle its disparity range, write one HDF5 file."""

from __future__ import annotations

import time
from pathlib import Path

import click

from sepi.cli.input_options import Reading, reading_flags
from sepi.command import SepiCommand, use_threads, write_timing
from sepi.errors import SepiError
from sepi.io.hdf5 import write_light_field
from sepi.lightfield import DisparityRange, LightField

_PATH = click.Path(path_type=Path)


def settle_range(light_field: LightField, given: tuple[float, float] | None = None) -> LightField:
    """The light field with a disparity range: the given one, else its own, else one estimated from the views.

    Raises
    ------
    SepiError
        If the given range is none, or nothing is known and the views do not tell, or a disparity of the range would
        move every pixel out of the neighbouring view.
    """
    if given is not None:
        light_field = light_field.with_range(DisparityRange(*given, "given"))
    if light_field.disparity_range is None:
        from sepi.inspection.disparity_range import estimate_range

        return light_field.with_range(estimate_range(light_field))
    known, side = light_field.disparity_range, max(light_field.shape)
    if max(-known.minimum, known.maximum) >= side:
        raise SepiError(
            f"{light_field.source or light_field.name}: disparity range ({known.source}) of {known.minimum:g} to "
            f"{known.maximum:g} pixels per view step; expected less than the {side} pixels of a view"
        )
    return light_field


@click.command(name="python -m sepi.ingest", cls=SepiCommand)
@click.argument("path", type=_PATH, required=False)
@click.option("--builtin", help="Render this built-in scene in place of reading PATH.")
@click.option("--size", type=click.IntRange(min=1), default=192, show_default=True, help="Built-in: pixels a side.")
@click.option("--views", type=click.IntRange(min=2), default=9, show_default=True, help="Built-in: views a side.")
@click.option("--disparity-range", nargs=2, type=float, metavar="MIN MAX", help="Pixels per view step.")
@reading_flags
@click.option("--threads", type=click.IntRange(min=1), default=1, show_default=True, help="Threads to use.")
@click.option("--output", type=_PATH, required=True, help="HDF5 file to write.")
@click.option("--timing", type=_PATH, help="JSON file to write: seconds and peak memory.")
def main(
    path: Path | None,
    builtin: str | None,
    size: int,
    views: int,
    disparity_range: tuple[float, float] | None,
    reading: Reading,
    threads: int,
    output: Path,
    timing: Path | None,
) -> None:
    """Read the light field at PATH and write it as one HDF5 file with a disparity range."""
    started = time.perf_counter()
    use_threads(threads)
    if (path is None) == (builtin is None):
        raise click.UsageError("expected either PATH or --builtin NAME")
    if path is not None:
        light_field = reading.read(path)
    else:
        from sepi.scenes import render

        assert builtin is not None  # one of them is given
        light_field = render(builtin, size=size, views=views)
    write_light_field(output, settle_range(light_field, disparity_range))
    if timing is not None:
        write_timing(timing, started, threads)


if __name__ == "__main__":
    main()
