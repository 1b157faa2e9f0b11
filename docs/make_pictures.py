"""Every drawing of these pages, and what they quote: ``python docs/make_pictures.py docs/_made``."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import click
from pictures import failures, geometry, stages, stitching
from pictures.style import Draw, write_drawing

from sepi.io.files import atomic_path
from sepi.process.command import progress_bar

SIZE = 128
"""Height and width in pixels of the built-in scenes on them."""


def drawings(size: int) -> dict[str, Callable[[], Draw]]:
    """Name of every drawing to what computes it."""
    found: dict[str, Callable[[], Draw]] = {
        "grid-of-views": lambda: geometry.grid_of_views,
        "seen-from-above": lambda: geometry.seen_from_above,
        "points-in-views": lambda: geometry.points_in_views,
        "corresponding-epis": lambda: stitching.corresponding_epis(stitching.example(size)),
        "stitched-epi": lambda: stitching.stitched_picture(stitching.example(size)),
        "stages-paper": lambda: stages.drawing("wall", "paper", size),
        "stages-best": lambda: stages.drawing("wall", "best", size),
    }
    for name, make in failures.DRAWINGS.items():
        found[name] = lambda make=make: make(size)  # type: ignore[misc]
    return found


@click.command()
@click.argument("folder", type=click.Path(path_type=Path))
@click.option("--size", type=click.IntRange(64, 512), default=SIZE, show_default=True, help="Size of the scenes, px.")
@click.option("--only", multiple=True, help="A drawing by its name; all unless given.")
def main(folder: Path, size: int, only: tuple[str, ...]) -> None:
    """Write every drawing to FOLDER, for light pages and for dark ones."""
    folder.mkdir(parents=True, exist_ok=True)
    wanted = drawings(size)
    names = only or tuple(wanted)
    with progress_bar("drawings") as progress:
        for number, name in enumerate(names):
            write_drawing(folder, name, wanted[name]())
            progress((number + 1) / len(names))
    with atomic_path(folder / "said-of-order.txt") as temporary:
        temporary.write_text(failures.said_of_order(size))


if __name__ == "__main__":
    main()
