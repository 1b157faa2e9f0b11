"""What each stage of each variant contributed and took: scores after every stage, seconds and peak memory.

Other methods' maps stand among the scores as stage ``external``.
"""

from __future__ import annotations

from collections.abc import Mapping

from sepi.evaluate import COUNTS, PROTOCOLS, REGIONS, SCORES, WHOLE_MAP
from sepi.io.scores import Scores
from sepi.report import published
from sepi.report.plan import MAIN_VARIANT
from sepi.report.runs import Runs
from sepi.report.tabular.layout import Cell, Column, Kind, Line, Report, Row, Section, entries, printed
from sepi.report.tabular.methods import REGIONS_NOTE, has_column

_STAGE_OF_EXTERNAL = "external"
_PARTS = [region for region in REGIONS if region != WHOLE_MAP]

# height and width of the views and number of view rows and columns that the published seconds are for
_PUBLISHED_SIZE = ([512, 512], [9, 9])


def stage_table(runs: Runs) -> Report:
    """Every score after every stage of every variant, and of other methods' maps, by both protocols."""
    data: list[Row] = []
    sections = []
    for dataset in runs.plan.scenes:
        for scene in runs.scored(dataset):
            for protocol, border in PROTOCOLS.items():
                rows, lines = _score_rows(runs, dataset, scene, protocol)
                data += rows
                title = f"{dataset}/{scene}, protocol {protocol} (border {border})"
                sections.append(Section(title, _SCORE_COLUMNS, lines))
    return Report(
        "Scores after each stage",
        "Whole map unless a region is named; both protocols. A non-finite estimate counts as bad; how many there are, "
        "and every score in the regions, is in the CSV file. Scenes without ground truth have no scores. "
        + ("Maps of other methods stand below ours as stage `external`. " if runs.plan.external else "")
        + REGIONS_NOTE,
        ["dataset", "scene", "variant", "stage", "choice", "protocol", "region", *SCORES, *COUNTS],
        data,
        sections,
    )


_SCORE_COLUMNS = [
    *(Column(head, Kind.TEXT) for head in ("variant", "after stage")),
    *(Column(head) for head in SCORES.values()),
    *(Column(f"{SCORES['mse100']}, {region}") for region in _PARTS),
]


def _score_rows(runs: Runs, dataset: str, scene: str, protocol: str) -> tuple[list[Row], list[Line]]:
    """A row for each map and region, and a line for each map."""
    data: list[Row] = []
    lines = []

    def add(name: str, stage: str, choice: str | None, scores: Mapping[str, Scores] | None, problem: str = "") -> None:
        missing: list[Cell] = [problem or None, *[None] * (len(SCORES) + len(COUNTS) - 1)]
        for region in REGIONS:
            cells = missing
            if scores is not None:
                cells = [
                    *(scores[region][score] for score in SCORES),
                    *(int(scores[region][count]) for count in COUNTS),
                ]
            data.append([dataset, scene, name, stage, choice, protocol, region, *cells])
        kind = Kind.EXTERNAL if stage == _STAGE_OF_EXTERNAL else Kind.OURS
        if kind == Kind.OURS or has_column(runs, dataset, name):
            after = stage if choice is None else f"{stage} ({choice})"
            shown = missing[: len(SCORES) + len(_PARTS)]
            if scores is not None:
                shown = [*(scores[WHOLE_MAP][score] for score in SCORES), *(scores[part]["mse100"] for part in _PARTS)]
            lines.append(Line(entries(_SCORE_COLUMNS, [name, after, *shown], kind)))

    for variant in runs.plan.listed:
        for stage, choice in runs.plan.variants[variant].items():
            add(variant, stage, choice, runs.scores(dataset, scene, variant, stage)[protocol])
    for method in runs.plan.external:
        scores = runs.external_scores(dataset, scene, method).get(protocol)
        add(method, _STAGE_OF_EXTERNAL, None, scores, runs.external_problem(dataset, scene, method))
    return data, lines


def runtime_table(runs: Runs) -> Report:
    """Seconds and peak memory of every stage of every variant, beside the paper's seconds."""
    data: list[Row] = []
    sections = []
    steps = [*runs.plan.stages, "total"]
    columns = [
        Column("variant", Kind.TEXT),
        *(Column(f"{step} / s") for step in steps),
        Column("published / this code", Kind.RATIO),
        Column("peak memory / MB"),
    ]
    paper = ["paper, as published", *(printed(published.runtime().get(step)) for step in steps), None, None]
    for dataset, scene in runs.plan.pairs:
        lines = []
        for variant in runs.plan.listed:
            found = _time_rows(runs, dataset, scene, variant)
            data += [[dataset, scene, variant, *row] for row in found]
            *_, peak, _, ratio = found[-1]
            lines.append(Line(entries(columns, [variant, *(row[2] for row in found), ratio, peak])))
        lines.append(Line(entries(columns, paper, Kind.PUBLISHED), available=False))
        sections.append(Section(f"{dataset}/{scene}", columns, lines))
    heads = ["dataset", "scene", "variant", "stage", "choice", "seconds", "peak_memory_mb"]
    return Report(
        "Run time per stage",
        "Wall-clock seconds of each stage's process, reading and writing included, on the machine that ran it; in the "
        "first run after an installation, the first stages also compiled their kernels. Variants that begin alike "
        "share their first stages: such a stage is listed with each of them, but ran once. A stage that hands its maps "
        "on (choice `none`) is no process and has no time. Published: the paper's averages for 512x512 pixels and 9x9 "
        "views on an Intel Core i7-8700, nothing in parallel; published / this code is how many times the total of "
        "this code's `paper` fits into theirs, for scenes of that size only; the machines differ.",
        [*heads, "published_seconds", "ratio"],
        data,
        sections,
    )


def _time_rows(runs: Runs, dataset: str, scene: str, variant: str) -> list[list[Cell]]:
    """Stage, choice, seconds, peak memory, published seconds and their ratio: every stage, then the total."""
    choices = runs.plan.variants[variant]
    # the published seconds are those of the paper's method
    paper = published.runtime() if variant == MAIN_VARIANT else {}
    light_field = runs.light_field(dataset, scene)
    compares = (light_field["shape"], light_field["grid"]) == _PUBLISHED_SIZE
    timings = {
        stage: runs.timing(dataset, scene, variant, stage) for stage in choices if runs.plan.runs_stage(variant, stage)
    }

    def row(step: str, seconds: float | None, peak: float | None) -> list[Cell]:
        theirs = paper.get(step)
        ratio = theirs / seconds if compares and theirs is not None and seconds else None
        return [step, choices.get(step), seconds, peak, printed(theirs), ratio]

    each = [
        row(stage, timings[stage].seconds, timings[stage].peak_memory_mb)
        if stage in timings
        else row(stage, None, None)
        for stage in choices
    ]
    total = sum(timing.seconds for timing in timings.values())
    peak = max((timing.peak_memory_mb for timing in timings.values()), default=0.0)
    return [*each, row("total", total, peak)]
