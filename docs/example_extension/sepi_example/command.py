"""A command."""

from pathlib import Path

import click

from sepi.cli.input_options import Reading, reading_flags
from sepi.process.command import SepiCommand


@click.command(cls=SepiCommand)
@click.argument("path", type=click.Path(path_type=Path))
@reading_flags
def brightness(path: Path, reading: Reading) -> None:
    """Print the mean of the light field at PATH."""
    click.echo(f"{reading.read(path).views.mean():.1f}")
