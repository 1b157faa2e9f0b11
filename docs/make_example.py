"""The picture in README.md: a built-in scene and its depth. ``python docs/make_example.py docs/example.png``."""

from __future__ import annotations

from pathlib import Path

import click

from sepi.pipeline import estimate_depth
from sepi.report.figures import Panel, write_overview
from sepi.report.plots.pictures import centre_picture, disparity_limits, error_picture, map_picture
from sepi.scenes import render

SCENE = "curved_occluders"
SIZE = 256


def panels() -> list[Panel]:
    """Reference view, ground truth, estimate and signed error of the example scene."""
    light_field = render(SCENE, size=SIZE)
    assert light_field.ground_truth is not None
    disparity = estimate_depth(light_field).disparity
    limits = disparity_limits(light_field)
    return [
        Panel("reference", "reference view", centre_picture(light_field)),
        Panel("ground_truth", "ground truth", map_picture(light_field.ground_truth, limits)),
        Panel("disparity", "estimated disparity", map_picture(disparity, limits)),
        Panel("error", "error, ±0.2 px", error_picture(disparity - light_field.ground_truth)),
    ]


@click.command()
@click.argument("output", type=click.Path(path_type=Path))
def main(output: Path) -> None:
    """Write the example picture to OUTPUT."""
    write_overview(output.parent, output.stem, "", [panels()], endings=("png",))


if __name__ == "__main__":
    main()
