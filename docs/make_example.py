"""Pictures of README.md and of the rendered scenes, and their tables, from what ``snakemake rendered`` made.

``python docs/make_example.py . docs`` after a run here; the first word is the folder that it was run in.
"""

from __future__ import annotations

import re
from pathlib import Path

import click
from PIL import Image

from sepi.extensions.rendered.worlds import RENDERED
from sepi.io.hdf5 import read_stage, read_with_truth
from sepi.lightfield import FloatMap, LightField
from sepi.report.drawing import write_overview
from sepi.report.pictures import Picture, disparity_limits, error_picture, map_picture, reference_picture
from sepi.report.plan import TABLES
from sepi.variants import VARIANTS
from sepi.workflow.rendered_scenes import DATASET
from sepi.workflow.result_paths import RESULTS, scene_files

SCENE = "sticks"
ACROSS = 2
"""Scenes side by side."""


def scene(results: Path, name: str) -> tuple[LightField, FloatMap]:
    """A rendered light field without noise, and its map by variant ``best``."""
    files = scene_files(DATASET, name, results)
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


def tables(reports: Path) -> str:
    """The tables of the rendered scenes, one after the other."""
    found = [(reports / f"{name}.md").read_text(encoding="utf-8") for name in TABLES["rendered"]]
    # a title of the page, and one level less for all others
    return "# Results on the rendered scenes\n\n" + re.sub(r"^#", "##", "\n".join(found), flags=re.MULTILINE)


@click.command()
@click.argument("run", type=click.Path(path_type=Path, exists=True))
@click.argument("docs", type=click.Path(path_type=Path, exists=True))
def main(run: Path, docs: Path) -> None:
    """Write pictures and tables into DOCS from the results below RUN."""
    results = run / RESULTS
    light_field, disparity = scene(results, SCENE)
    assert light_field.ground_truth is not None
    error = ("error, ±0.2 px", error_picture(disparity - light_field.ground_truth))
    write_overview(docs, "example", "", [[*pictures(light_field, disparity), error]], endings=("png",))
    names = list(RENDERED)
    rows = [
        [panel for name in names[start : start + ACROSS] for panel in pictures(*scene(results, name))]
        for start in range(0, len(names), ACROSS)
    ]
    write_overview(docs / "reproduce", "rendered", "", rows, endings=("png",))
    # a third of the bytes, and no difference that one sees
    every = docs / "reproduce" / "rendered.png"
    with Image.open(every) as picture:
        smaller = picture.convert("RGB").resize(
            (picture.width * 2 // 3, picture.height * 2 // 3), Image.Resampling.LANCZOS
        )
    smaller.quantize(256, dither=Image.Dither.NONE).save(every, optimize=True)
    text = tables(run / "reports" / DATASET)
    (docs / "reproduce" / "rendered_results.md").write_text(text, encoding="utf-8")


if __name__ == "__main__":
    main()
