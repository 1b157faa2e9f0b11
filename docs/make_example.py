"""The pictures of README.md and of the rendered scenes, from what ``snakemake rendered`` made.

``python docs/make_example.py results docs/example.png docs/reproduce/rendered.png``
"""

from __future__ import annotations

from pathlib import Path

import click

from sepi.io.hdf5 import read_stage
from sepi.io.truth import read_with_truth
from sepi.lightfield import FloatMap, LightField
from sepi.rendered.catalogue import RENDERED
from sepi.report.plots.overview import write_overview
from sepi.report.plots.pictures import Picture, disparity_limits, error_picture, map_picture, reference_picture
from sepi.variants import VARIANTS
from sepi.workflow.result_paths import scene_files

SCENE = "sticks"
ACROSS = 2
"""Scenes side by side."""


def scene(results: Path, name: str) -> tuple[LightField, FloatMap]:
    """A rendered light field without noise, and its map by variant ``best``."""
    files = scene_files("rendered", name, results)
    return read_with_truth(files.light_field, files.truth), read_stage(
        files.stage(VARIANTS["best"].labels, "optimize")
    ).disparity


def pictures(light_field: LightField, disparity: FloatMap) -> list[tuple[str, Picture]]:
    """Reference view, ground truth and estimate, with their titles."""
    assert light_field.ground_truth is not None
    limits = disparity_limits(light_field)
    return [
        (f"{light_field.name}: reference view", reference_picture(light_field)),
        ("ground truth", map_picture(light_field.ground_truth, limits)),
        ("best", map_picture(disparity, limits)),
    ]


@click.command()
@click.argument("results", type=click.Path(path_type=Path, exists=True))
@click.argument("example", type=click.Path(path_type=Path))
@click.argument("every", type=click.Path(path_type=Path))
def main(results: Path, example: Path, every: Path) -> None:
    """Write the picture of one scene to EXAMPLE, and that of all of them to EVERY."""
    light_field, disparity = scene(results, SCENE)
    assert light_field.ground_truth is not None
    error = ("error, ±0.2 px", error_picture(disparity - light_field.ground_truth))
    write_overview(example.parent, example.stem, "", [[*pictures(light_field, disparity), error]], endings=("png",))
    names = list(RENDERED)
    rows = [
        [panel for name in names[start : start + ACROSS] for panel in pictures(*scene(results, name))]
        for start in range(0, len(names), ACROSS)
    ]
    write_overview(every.parent, every.stem, "", rows, endings=("png",))


if __name__ == "__main__":
    main()
