"""The workflow's command that renders a path-traced scene into a file."""

from __future__ import annotations

from pathlib import Path

import click

from sepi.extensions.rendered.rendering import RenderOptions, render_world
from sepi.extensions.rendered.tracing import require_mitsuba
from sepi.extensions.rendered.worlds import world_of
from sepi.process.command import SepiCommand, progress_bar
from sepi.process.threads import use_threads
from sepi.validation import settings_of
from sepi.validation.models import validated


@click.command(name="python -m sepi.extensions.rendered.command", cls=SepiCommand)
@click.argument("name")
@click.option("--set", "settings", multiple=True, metavar="KEY=VALUE", help="Options of rendering.")
@click.option("--threads", type=click.IntRange(min=1), default=1, show_default=True, help="Threads to use.")
@click.option("--output", type=click.Path(path_type=Path), required=True, help="HDF5 file to write.")
def main(name: str, settings: tuple[str, ...], threads: int, output: Path) -> None:
    """Render the scene NAME; an interrupted run keeps finished views."""
    options = validated(RenderOptions, settings_of(settings, "lens=0.5"), "rendered")
    require_mitsuba()
    use_threads(threads)
    with progress_bar(name) as progress:
        render_world(name, world_of(name), options, output, progress)


if __name__ == "__main__":
    main()
