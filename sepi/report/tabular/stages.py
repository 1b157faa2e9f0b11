"""What each stage of each variant contributed and took: scores after every stage, seconds and peak memory.

Imported maps stand among the scores as stage ``imported``.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from sepi.evaluate import PROTOCOLS, REGIONS, WHOLE_MAP
from sepi.io.scores import Scores
from sepi.report import published
from sepi.report.plan import MAIN_VARIANT
from sepi.report.runs import Runs
from sepi.report.tabular.comparison import REGIONS_NOTE, has_column
from sepi.report.tabular.layout import (
    FIGURE,
    IMPORTED,
    OURS,
    PUBLISHED,
    RATIO,
    TEXT,
    Cell,
    Column,
    Entry,
    Grid,
    Line,
    Report,
    Row,
    Section,
    Table,
    printed,
)

SCORES = {
    "mse100": "MSE x100",
    "q25": "Q25 x100",
    "badpix007": "BadPix 0.07 %",
    "badpix003": "BadPix 0.03 %",
    "badpix001": "BadPix 0.01 %",
}
COUNTS = ("non_finite", "pixels")

_STAGE_OF_IMPORTED = "imported"

# height and width of the views and number of view rows and columns that the published seconds are for
_PUBLISHED_SIZE = ([512, 512], [9, 9])


def stage_table(runs: Runs) -> Report:
    """Every score after every stage of every variant, and of imported maps, by both protocols."""
    rows: list[Row] = []
    sections = []
    for dataset in runs.plan.scenes:
        for scene in runs.scored(dataset):
            for protocol, border in PROTOCOLS.items():
                rows += _score_rows(runs, dataset, scene, protocol)
                rows += _imported_rows(runs, dataset, scene, protocol)
                title = f"{dataset}/{scene}, protocol {protocol} (border {border})"
                sections.append(Section(title, _score_page(runs, dataset, scene, protocol)))
    return Report(
        "Scores after each stage",
        "Whole map unless a region is named; both protocols. A non-finite estimate counts as bad; how many there are, "
        "and every score in the regions, is in the CSV file. Scenes without ground truth have no scores. "
        + ("Maps of other methods stand below ours as stage `imported`. " if runs.plan.external else "")
        + REGIONS_NOTE,
        Table(["dataset", "scene", "variant", "stage", "choice", "protocol", "region", *SCORES, *COUNTS], rows),
        sections,
    )


def runtime_table(runs: Runs) -> Report:
    """Seconds and peak memory of every stage of every variant, beside the paper's seconds."""
    rows: list[Row] = []
    sections = []
    stages = runs.plan.stages
    columns = [
        Column("variant", TEXT),
        *(Column(f"{stage} / s", FIGURE) for stage in stages),
        Column("total / s", FIGURE),
        Column("published / this code", RATIO),
        Column("peak memory / MB", FIGURE),
    ]
    for dataset, scene in runs.plan.pairs:
        lines = []
        for variant in runs.plan.listed:
            found = _time_rows(runs, dataset, scene, variant)
            rows += [[dataset, scene, variant, *row] for row in found]
            *_, (_, _, total, peak, _, ratio) = found
            seconds = [Entry(row[2]) for row in found[:-1]]
            lines.append(Line([Entry(variant, TEXT), *seconds, Entry(total), Entry(ratio, RATIO), Entry(peak)]))
        paper = [Entry(printed(published.runtime().get(stage)), PUBLISHED) for stage in [*stages, "total"]]
        entries = [Entry("paper, as published", TEXT), *paper, Entry(None, RATIO), Entry(None)]
        lines.append(Line(entries, at_hand=False))
        sections.append(Section(f"{dataset}/{scene}", Grid(columns, lines)))
    heads = ["dataset", "scene", "variant", "stage", "choice", "seconds", "peak_memory_mb"]
    return Report(
        "Run time per stage",
        "Wall-clock seconds of each stage's process, reading and writing included, on the machine that ran it; in the "
        "first run after an installation, the first stages also compiled their kernels. Variants that begin alike "
        "share their first stages: such a stage is listed with each of them, but ran once. A stage that hands its maps "
        "on (choice `none`) is no process and has no time. Published: the paper's averages for 512x512 pixels and 9x9 "
        "views on an Intel Core i7-8700, nothing in parallel; published / this code is how many times the total of "
        "this code's `paper` fits into theirs, for scenes of that size only; the machines differ.",
        Table([*heads, "published_seconds", "ratio"], rows),
        sections,
    )


def _time_rows(runs: Runs, dataset: str, scene: str, variant: str) -> list[list[Cell]]:
    """Stage, choice, seconds, peak memory, published seconds and their ratio: every stage, then the total."""
    choices = runs.plan.variants[variant]
    timings = {stage: runs.timing(dataset, scene, variant, stage) for stage in runs.plan.stages}
    # the published seconds are those of the paper's method
    paper = published.runtime() if variant == MAIN_VARIANT else {}
    light_field = runs.light_field(dataset, scene)
    compares = (light_field["shape"], light_field["grid"]) == _PUBLISHED_SIZE

    def row(stage: str, choice: str | None, seconds: float | None, peak: float | None) -> list[Cell]:
        theirs = paper.get(stage)
        ratio = theirs / seconds if compares and theirs is not None and seconds else None
        return [stage, choice, seconds, peak, printed(theirs), ratio]

    total = sum(timing.seconds for timing in timings.values())
    peak = max(timing.peak_memory_mb for timing in timings.values())
    each = [
        row(stage, choices[stage], found.seconds, found.peak_memory_mb)
        if runs.plan.runs_stage(variant, stage)
        else row(stage, choices[stage], None, None)
        for stage, found in timings.items()
    ]
    return [*each, row("total", None, total, peak)]


def _score_rows(runs: Runs, dataset: str, scene: str, protocol: str) -> list[Row]:
    rows: list[Row] = []
    for variant in runs.plan.listed:
        for stage, choice in runs.plan.variants[variant].items():
            for region, scores in runs.scores(dataset, scene, variant, stage)[protocol].items():
                rows.append([dataset, scene, variant, stage, choice, protocol, region, *_figures(scores)])
    return rows


def _imported_rows(runs: Runs, dataset: str, scene: str, protocol: str) -> list[Row]:
    rows: list[Row] = []
    for method in runs.plan.external:
        scores = runs.external_scores(dataset, scene, method).get(protocol)
        problem = runs.external_problem(dataset, scene, method) or None
        missing: list[Cell] = [problem, *[None] * (len(SCORES) + len(COUNTS) - 1)]
        for region in REGIONS:
            figures = missing if scores is None else _figures(scores[region])
            rows.append([dataset, scene, method, _STAGE_OF_IMPORTED, None, protocol, region, *figures])
    return rows


def _figures(scores: Scores) -> list[Cell]:
    return [*(scores[name] for name in SCORES), *(int(scores[name]) for name in COUNTS)]


def _score_page(runs: Runs, dataset: str, scene: str, protocol: str) -> Grid:
    lines = []
    for variant in runs.plan.listed:
        for stage, choice in runs.plan.variants[variant].items():
            cells = _page_figures(runs.scores(dataset, scene, variant, stage)[protocol])
            lines.append(_page_line(variant, f"{stage} ({choice})", cells, OURS))
    regions = [region for region in REGIONS if region != WHOLE_MAP]
    for method in runs.plan.external:
        if has_column(runs, dataset, method):
            scores = runs.external_scores(dataset, scene, method).get(protocol)
            problem = runs.external_problem(dataset, scene, method) or None
            missing: list[Cell] = [problem, *[None] * (len(SCORES) + len(regions) - 1)]
            cells = missing if scores is None else _page_figures(scores)
            lines.append(_page_line(method, _STAGE_OF_IMPORTED, cells, IMPORTED))
    heads = [*SCORES.values(), *(f"MSE x100, {region}" for region in regions)]
    columns = [Column("variant", TEXT), Column("after stage", TEXT), *(Column(head, FIGURE) for head in heads)]
    return Grid(columns, lines)


def _page_figures(scores: Mapping[str, Scores]) -> list[Cell]:
    regions = [found["mse100"] for region, found in scores.items() if region != WHOLE_MAP]
    return [*(scores[WHOLE_MAP][name] for name in SCORES), *regions]


def _page_line(name: str, stage: str, cells: Sequence[Cell], kind: str) -> Line:
    return Line([Entry(name, TEXT), Entry(stage, TEXT), *(Entry(cell, kind) for cell in cells)])
