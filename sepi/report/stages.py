"""What each stage of each variant contributed and took: scores after every stage, seconds and peak memory."""

from __future__ import annotations

from sepi.evaluate import PROTOCOLS, REGIONS, WHOLE_MAP
from sepi.report import published
from sepi.report.comparison import REGIONS_NOTE
from sepi.report.layout import Cell, Report, Row, Section, Table, printed
from sepi.report.plan import MAIN_VARIANT, Runs

SCORES = {
    "mse100": "MSE x100",
    "q25": "Q25 x100",
    "badpix007": "BadPix 0.07 %",
    "badpix003": "BadPix 0.03 %",
    "badpix001": "BadPix 0.01 %",
}
COUNTS = ("non_finite", "pixels")


def stage_table(runs: Runs) -> Report:
    """Every score after every stage of every variant, by both protocols."""
    rows: list[Row] = []
    sections = []
    for dataset in runs.plan.scenes:
        for scene in runs.scored(dataset):
            for protocol, border in PROTOCOLS.items():
                rows += _score_rows(runs, dataset, scene, protocol)
                title = f"{dataset}/{scene}, protocol {protocol} (border {border})"
                sections.append(Section(title, _score_page(runs, dataset, scene, protocol)))
    return Report(
        "Scores after each stage",
        "Whole map unless a region is named; both protocols. A non-finite estimate counts as bad; how many there are, "
        "and every score in the regions, is in the CSV file. Scenes without ground truth have no scores. "
        f"{REGIONS_NOTE}",
        Table(["dataset", "scene", "variant", "stage", "choice", "protocol", "region", *SCORES, *COUNTS], rows),
        sections,
    )


def runtime_table(runs: Runs) -> Report:
    """Seconds and peak memory of every stage of every variant, beside the paper's seconds."""
    rows: list[Row] = []
    sections = []
    seconds = published.runtime()
    stages = runs.plan.stages
    for dataset, scene in runs.plan.pairs:
        lines: list[Row] = []
        for variant in runs.plan.listed:
            choices = runs.plan.variants[variant]
            timings = {stage: runs.timing(dataset, scene, variant, stage) for stage in stages}
            total = sum(timing.seconds for timing in timings.values())
            peak = max(timing.peak_memory_mb for timing in timings.values())
            # the published seconds are those of the paper's method
            paper = {stage: printed(value) for stage, value in seconds.items()} if variant == MAIN_VARIANT else {}
            for stage, timing in timings.items():
                figures: list[Cell] = [timing.seconds, timing.peak_memory_mb, paper.get(stage)]
                rows.append([dataset, scene, variant, stage, choices[stage], *figures])
            rows.append([dataset, scene, variant, "total", None, total, peak, paper.get("total")])
            lines.append([variant, *(timing.seconds for timing in timings.values()), total, peak])
        lines.append(["paper, as published", *(printed(seconds.get(stage)) for stage in [*stages, "total"]), None])
        heads = ["variant", *(f"{stage} / s" for stage in stages), "total / s", "peak memory / MB"]
        sections.append(Section(f"{dataset}/{scene}", Table(heads, lines)))
    return Report(
        "Run time per stage",
        "Wall-clock seconds of each stage's process, reading and writing included, on the machine that made this "
        "report. Variants that begin alike share their first stages: such a stage is listed with each of them, but ran "
        "once. Published: the paper's averages for 512x512 pixels and 9x9 views on an Intel Core i7-8700, nothing in "
        "parallel.",
        Table(
            ["dataset", "scene", "variant", "stage", "choice", "seconds", "peak_memory_mb", "published_seconds"], rows
        ),
        sections,
    )


def _score_rows(runs: Runs, dataset: str, scene: str, protocol: str) -> list[Row]:
    rows: list[Row] = []
    for variant in runs.plan.listed:
        for stage, choice in runs.plan.variants[variant].items():
            for region, scores in _regions(runs, dataset, scene, variant, stage, protocol):
                figures: list[Cell] = [scores[name] for name in SCORES]
                counts = [int(scores[name]) for name in COUNTS]
                rows.append([dataset, scene, variant, stage, choice, protocol, region, *figures, *counts])
    return rows


def _score_page(runs: Runs, dataset: str, scene: str, protocol: str) -> Table:
    lines: list[Row] = []
    for variant in runs.plan.listed:
        for stage, choice in runs.plan.variants[variant].items():
            cells = dict(_regions(runs, dataset, scene, variant, stage, protocol))
            regions = [scores["mse100"] for region, scores in cells.items() if region != WHOLE_MAP]
            lines.append([variant, f"{stage} ({choice})", *(cells[WHOLE_MAP][name] for name in SCORES), *regions])
    regions_heads = [f"MSE x100, {region}" for region in REGIONS if region != WHOLE_MAP]
    return Table(["variant", "after stage", *SCORES.values(), *regions_heads], lines)


def _regions(
    runs: Runs, dataset: str, scene: str, variant: str, stage: str, protocol: str
) -> list[tuple[str, dict[str, float]]]:
    scores = runs.scores(dataset, scene, variant, stage)[protocol]
    return [(region, scores[region]) for region in REGIONS]
