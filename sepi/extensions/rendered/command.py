"""The workflow's command that renders a path-traced scene into a file."""

from __future__ import annotations

import time
from pathlib import Path

import click

from sepi.extensions.rendered.catalogue import world_of
from sepi.extensions.rendered.options import RenderOptions
from sepi.extensions.rendered.rendering import render_world
from sepi.extensions.rendered.tracing import require_mitsuba
from sepi.process.command import SepiCommand, progress_bar, write_timing
from sepi.process.threads import use_threads
from sepi.validation import settings_of
from sepi.validation.models import validated

_PATH = click.Path(path_type=Path)


@click.command(name="python -m sepi.extensions.rendered.command", cls=SepiCommand)
@click.argument("name")
@click.option("--size", type=int, default=512, show_default=True, help="Height and width of a view in pixels.")
@click.option("--views", type=int, default=9, show_default=True, help="Rows and columns of views.")
@click.option("--samples", type=int, default=64, show_default=True, help="Paths of light for each pixel.")
@click.option("--set", "settings", multiple=True, metavar="KEY=VALUE", help="Other options of the package.")
@click.option("--threads", type=click.IntRange(min=1), default=1, show_default=True, help="Threads to use.")
@click.option("--output", type=_PATH, required=True, help="HDF5 file to write.")
@click.option("--timing", type=_PATH, help="JSON file to write: seconds and peak memory.")
def main(
    name: str,
    size: int,
    views: int,
    samples: int,
    settings: tuple[str, ...],
    threads: int,
    output: Path,
    timing: Path | None,
) -> None:
    """Render the scene NAME; an interrupted run keeps finished views."""
    started = time.perf_counter()
    values = {"size": size, "grid": [views, views], "samples": samples, **settings_of(settings, "lens=0.5")}
    options, world = validated(RenderOptions, values, "rendered"), world_of(name)
    require_mitsuba()
    use_threads(threads)
    with progress_bar(name) as progress:
        render_world(name, world, options, output, progress)
    if timing is not None:
        write_timing(timing, started, threads)


if __name__ == "__main__":
    main()
