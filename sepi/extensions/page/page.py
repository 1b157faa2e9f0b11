"""The page ``reports/index.html``, one file that opens from disk and loads nothing else."""

import base64
import json
import math
import re
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import click
from jinja2 import Environment, PackageLoader, StrictUndefined
from markupsafe import Markup, escape
from matplotlib.colors import Colormap

from sepi.io.files import write_whole
from sepi.io.scores import without_nan
from sepi.process.command import PATH, SepiCommand
from sepi.report import charts, published
from sepi.report.pictures import error_scale, scale_colours
from sepi.report.runs import Runs, count_note, own_key, read_json, read_numbers
from sepi.report.tables import table
from sepi.workflow.rendered_scenes import DATASET

SCRIPTS = ("unpack.js", "panels.js", "viewer.js", "cloud.js", "pixel.js", "tables.js", "page.js")
"""Scripts of a page, in the order in which they run."""


def environment() -> Environment:
    """Jinja2's environment for the page's templates; an undefined name is an error."""
    loader = PackageLoader("sepi.extensions.page")
    made = Environment(loader=loader, autoescape=True, undefined=StrictUndefined, trim_blocks=True, lstrip_blocks=True)
    made.filters |= {"embedded": embedded, "prose": prose, "breakable": breakable}
    return made


def embedded(value: Any) -> Markup:
    """A value as JSON that may stand inside a script element."""
    # "</script" and "<!--" would end or change it
    return Markup(json.dumps(value, separators=(",", ":"), ensure_ascii=False).replace("<", "\\u003c"))


def prose(text: str) -> Markup:
    """HTML of a text; words in backticks become code."""
    return Markup(re.sub("`([^`]+)`", r"<code>\1</code>", str(escape(text))))


def breakable(name: str) -> Markup:
    """HTML of a name that may break after ``_`` and ``/``."""
    return Markup(re.sub("([_/])", r"\1<wbr>", str(escape(name))))


def colour_scales() -> dict[str, str]:
    """The colour scales of the viewer, 256 times RGB each, in base64."""
    scales: dict[str, str | Colormap] = {"disparity": "viridis", "grey": "gray", "error": error_scale()}
    return {name: base64.b64encode(scale_colours(scale).tobytes()).decode("ascii") for name, scale in scales.items()}


def headline(runs: Runs) -> list[dict[str, Any]]:
    """Our figures beside the published ones for the paper's scenes, then averages over the other scenes.

    Returns
    -------
    list of dict
        ``scene``; ``published``: MSE x100 and Q25 x100; ``ours``: variant to the same two; ``notes``: variant to the
        number of scenes, if lower than in the row.
    """
    papers = [pair for pair in runs.scored_pairs if published.paper_scene(*pair) is not None]
    others = [pair for pair in runs.scored_pairs if pair not in papers]
    groups = [[pair] for pair in papers]
    groups += [[pair for pair in others if pair[0] == dataset] for dataset in runs.plan.scenes]
    rows = []
    for pairs in filter(None, groups):
        dataset, scenes = pairs[0][0], [scene for _, scene in pairs]
        place = (dataset, published.paper_scene(dataset, scenes[0]))
        theirs = [
            table[published.PAPERS_METHOD].get(place, math.nan) for table in (published.table1(), published.table2())
        ]
        ours = [runs.of(score, dataset).loc[scenes] for score in ("mse100", "q25")]
        keys = {variant: own_key(variant) for variant in runs.plan.compared}
        rows.append(
            {
                "scene": f"{dataset}, average of {len(scenes)}" if len(scenes) > 1 else f"{dataset}/{scenes[0]}",
                "published": theirs,
                "ours": {variant: [one[key].mean() for one in ours] for variant, key in keys.items()},
                "notes": {
                    v: count_note([int(one[key].count()) for one in ours], len(scenes)) for v, key in keys.items()
                },
            }
        )
    found: list[dict[str, Any]] = without_nan(rows)
    return found


def missing_scenes(runs: Runs) -> dict[str, list[str]]:
    """Scenes of the paper that are not available, by dataset."""
    here = {(dataset, published.paper_scene(dataset, scene)) for dataset, scene in runs.plan.pairs}
    return {name: [one for one in published.scenes(name) if (name, one) not in here] for name in published.DATASETS}


def total_seconds(*reports: Runs) -> float:
    """Total seconds of all stages in these numbers, each counted once."""
    seconds = {
        (row.dataset, row.scene, runs.plan.stage_key(row.variant, row.stage)): row.value
        for runs in reports
        for row in runs.numbers[runs.numbers["score"] == "seconds"].itertuples()
    }
    return float(sum(seconds.values()))


def page_of(runs: Runs, scenes: Sequence[Mapping[str, Any]], parts: Runs | None = None) -> str:
    """The page of a report.

    Parameters
    ----------
    runs : Runs
        The numbers of the report.
    scenes : sequence of mapping
        From ``sepi.report.figures``.
    parts : Runs, optional
        Numbers of the ablation of the best variant.

    Returns
    -------
    str
        HTML.
    """
    # averages over rendered scenes and levels of noise mean nothing, and no published figures exist
    averaged = runs.plan.report != DATASET
    # to show first: one of the paper's, else the last one, by the order of built-in scenes
    papers = [pair for pair in runs.plan.pairs if published.paper_scene(*pair) is not None]
    first_title = "/".join((papers or runs.plan.pairs[-1:])[0])
    shown = [scene for scene in scenes if f"{scene['dataset']}/{scene['scene']}" == first_title] or scenes
    tables = {name: table(name, found) for found in (runs, parts) if found is not None for name in found.plan.tables}
    template = environment().get_template("index.html.j2")
    return template.render(
        title="sepi: light field depth by stitched epipolar plane images",
        numbers=runs.facts,
        report=runs.plan.report,
        variants={**runs.plan.variants, **({} if parts is None else parts.plan.variants)},
        tables=tables,
        headline=headline(runs) if averaged else [],
        missing=missing_scenes(runs) if averaged else {},
        dataset_titles=published.DATASETS,
        bars=charts.ablation_bars(runs) if averaged else {},
        part_bars={} if parts is None else charts.part_bars(parts),
        times=charts.stage_times(runs),
        total_seconds=total_seconds(*filter(None, (runs, parts))),
        scenes=embedded_scenes(scenes),
        first=shown[0] if shown else None,
        first_title=first_title,
        scales=colour_scales(),
        scripts=SCRIPTS,
    )


def embedded_scenes(scenes: Sequence[Mapping[str, Any]]) -> list[dict[str, Any]]:
    """Scenes for the template: identifier, title, and JSON."""
    return [
        {"id": f"scene-{number}", "title": f"{scene['dataset']}/{scene['scene']}", "text": embedded(scene)}
        for number, scene in enumerate(scenes)
    ]


def read_scene(path: Path) -> dict[str, Any]:
    """Data of a scene for the page, from the file that ``sepi.report.figures`` wrote.

    Raises
    ------
    SepiError
        If the file is missing or has other contents.
    """
    kind = "scene of a report (written by python -m sepi.report.figures)"
    return read_json(path, {"dataset", "scene", "panels", "arrays"}, kind)


@click.command(name="python -m sepi.extensions.page.page", cls=SepiCommand)
@click.option("--numbers", "numbers_path", type=PATH, required=True, help="Numbers of the report (JSON).")
@click.option("--parts", "parts_path", type=PATH, help="Numbers of the best variant's parts (JSON).")
@click.option("--output", type=PATH, required=True, help="Page to write.")
@click.option("--scenes", type=PATH, required=True, help="Folder of DATASET/SCENE.json, from sepi.report.figures.")
def command(numbers_path: Path, parts_path: Path | None, output: Path, scenes: Path) -> None:
    """Write the page of a report, with the scenes of its numbers."""
    runs = read_numbers(numbers_path)
    html = page_of(
        runs,
        [read_scene(scenes / dataset / f"{scene}.json") for dataset, scene in runs.plan.pictured],
        None if parts_path is None else read_numbers(parts_path),
    )
    write_whole(output, html)


if __name__ == "__main__":
    command()
