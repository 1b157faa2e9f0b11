"""The command ``sepi scenes``, which writes built-in scenes."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path

import click

from sepi.errors import SepiError
from sepi.process.command import PATH, SepiCommand


@click.command(cls=SepiCommand)
@click.argument("names", metavar="[NAME]...", nargs=-1)
@click.option("-o", "--output", type=PATH, default=Path("scenes"), show_default=True, help="Folder to write to.")
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
