"""The picture in README.md: a built-in scene and its depth. ``python docs/make_example.py docs/example.png``."""

from __future__ import annotations

from pathlib import Path

import click

from sepi.pipeline import estimate_depth
from sepi.report.plots.overview import write_overview
from sepi.report.plots.pictures import Picture, disparity_limits, error_picture, map_picture, reference_picture
from sepi.scenes import render

SCENE = "curved_occluders"
SIZE = 256


def pictures() -> list[tuple[str, Picture]]:
    """Reference view, ground truth, estimate and signed error of the example scene, with their titles."""
    light_field = render(SCENE, size=SIZE)
    assert light_field.ground_truth is not None
    disparity = estimate_depth(light_field).disparity
    limits = disparity_limits(light_field)
    return [
        ("reference view", reference_picture(light_field)),
        ("ground truth", map_picture(light_field.ground_truth, limits)),
        ("estimated disparity", map_picture(disparity, limits)),
        ("error, ±0.2 px", error_picture(disparity - light_field.ground_truth)),
    ]


@click.command()
@click.argument("output", type=click.Path(path_type=Path))
def main(output: Path) -> None:
    """Write the example picture to OUTPUT."""
    write_overview(output.parent, output.stem, "", [pictures()], endings=("png",))


if __name__ == "__main__":
    main()
