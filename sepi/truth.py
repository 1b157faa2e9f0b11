"""Ground truth of a scene as a file of its own, so that a new one asks for scores and for no map."""

from __future__ import annotations

from pathlib import Path

import click

from sepi.cli.input_options import Reading, builtin_flags, reading_flags
from sepi.command import SepiCommand
from sepi.io.truth import write_truth
from sepi.lightfield import Truth

_PATH = click.Path(path_type=Path)


@click.command(name="python -m sepi.truth", cls=SepiCommand)
@click.argument("path", type=_PATH, required=False)
@builtin_flags
@click.option("--rendered", type=_PATH, help="File of a rendered scene, from sepi.rendered.command, in place of PATH.")
@reading_flags
@click.option("--output", type=_PATH, required=True, help="HDF5 file to write.")
def main(
    path: Path | None,
    builtin: str | None,
    size: int,
    views: int,
    rendered: Path | None,
    reading: Reading,
    output: Path,
) -> None:
    """Write ground truth and masks of the light field at PATH; without one that is named, that there are none."""
    truth: Truth = (None, {})
    if path is not None:
        from sepi.io.readers.formats import read_truth

        truth = read_truth(path, reading.options, reading.file_format)
    elif rendered is not None:
        from sepi.rendered.exposure import read_render_truth

        truth = read_render_truth(rendered)
    elif builtin is not None:
        from sepi.scenes.light_field import scene_truth

        truth = scene_truth(builtin, size, views)
    write_truth(output, truth)


if __name__ == "__main__":
    main()
