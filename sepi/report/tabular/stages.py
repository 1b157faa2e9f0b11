"""Tables of each stage of each variant: scores, seconds and peak memory.

External methods' maps are among the scores as stage ``external``.
"""

from __future__ import annotations

from dataclasses import asdict

from sepi.report import published
from sepi.report.plan import MAIN_VARIANT
from sepi.report.runs import Runs, Timing
from sepi.report.tabular.layout import Cell, Column, Kind, Record, Report, line, printed, section
from sepi.report.tabular.methods import REGIONS_NOTE, has_column
from sepi.scoring.scores import COUNTS, PROTOCOLS, REGIONS, SCORES, WHOLE_MAP, score_heads

_PARTS = [region for region in REGIONS if region != WHOLE_MAP]

# height and width of the views, and rows and columns of views, for which the seconds were published
_PUBLISHED_SIZE = ([512, 512], [9, 9])


def stage_table(runs: Runs) -> Report:
    """All scores after each stage of each variant, and of external methods' maps, by both protocols."""
    heads = score_heads(runs.plan.bad_thresholds)
    columns = {
        "variant": Column("variant", Kind.TEXT),
        "after": Column("after stage", Kind.TEXT),
        **{score: Column(head) for score, head in heads.items()},
        **{region: Column(f"{SCORES['mse100']}, {region}") for region in _PARTS},
    }
    records: list[Record] = []
    sections = []
    for dataset, scene in runs.scored_pairs():
        for protocol, border in PROTOCOLS.items():
            found = _score_records(runs, dataset, scene, protocol)
            records += found
            lines = [
                line(columns, record, Kind.OURS if record["choice"] else Kind.EXTERNAL)
                for record in found
                if record["region"] == WHOLE_MAP
                and (record["choice"] or has_column(runs, dataset, str(record["variant"])))
            ]
            sections.append(section(f"{dataset}/{scene}, protocol {protocol} (border {border})", columns, lines))
    return Report(
        "Scores after each stage",
        "Whole map unless a region is named; both protocols. A non-finite estimate counts as bad; how many there are, "
        "and every score in the regions, is in the CSV file. Scenes without ground truth have no scores. "
        + ("Maps of other methods stand below ours as stage `external`. " if runs.plan.external else "")
        + REGIONS_NOTE,
        ["dataset", "scene", "variant", "stage", "choice", "protocol", "region", *heads, *COUNTS],
        records,
        sections,
    )


def _score_records(runs: Runs, dataset: str, scene: str, protocol: str) -> list[Record]:
    """A record for each map and region, with the page's columns; external methods' maps have no choice."""
    maps = [
        (variant, stage, choice, runs.scores(dataset, scene, variant, stage))
        for variant in runs.plan.listed
        for stage, choice in runs.plan.variants[variant].items()
    ]
    maps += [(name, "external", "", runs.external_scores(dataset, scene, name)) for name in runs.plan.external]
    records: list[Record] = []
    for name, stage, choice, scores in maps:
        after = f"{stage} ({choice})" if choice else stage
        heads = {"dataset": dataset, "scene": scene, "variant": name, "stage": stage, "choice": choice, "after": after}
        for region in REGIONS:
            record: Record = {**heads, "protocol": protocol, "region": region}
            if scores:
                parts = {part: scores[protocol][part]["mse100"] for part in _PARTS}
                records.append({**record, **scores[protocol][region], **parts})
            else:
                records.append({**record, "mse100": runs.external_problem(dataset, scene, name)})
    return records


def runtime_table(runs: Runs) -> Report:
    """Seconds and peak memory of each stage of each variant, beside the paper's seconds."""
    steps = [*runs.plan.stages, "total"]
    columns = {
        "variant": Column("variant", Kind.TEXT),
        **{step: Column(f"{step} / s") for step in steps},
        "ratio": Column("published / this code", Kind.RATIO),
        "peak_memory_mb": Column("peak memory / MB"),
    }
    paper = {"variant": "paper, as published"} | {step: printed(published.runtime().get(step)) for step in steps}
    records: list[Record] = []
    sections = []
    for dataset, scene in runs.plan.pairs:
        lines = []
        for variant in runs.plan.listed:
            found = _time_records(runs, dataset, scene, variant)
            records += found
            # name, ratio and peak of a line are those of its total
            lines.append(line(columns, {**found[-1], **{str(row["stage"]): row.get("seconds") for row in found}}))
        lines.append(line(columns, paper, Kind.PUBLISHED))
        sections.append(section(f"{dataset}/{scene}", columns, lines))
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
        records,
        sections,
    )


def _time_records(runs: Runs, dataset: str, scene: str, variant: str) -> list[Record]:
    """A record for each stage, then one for the total."""
    choices = runs.plan.variants[variant]
    # published seconds belong to the paper's method only
    paper = published.runtime() if variant == MAIN_VARIANT else {}
    light_field = runs.light_field(dataset, scene)
    compares = (light_field["shape"], light_field["grid"]) == _PUBLISHED_SIZE
    took = {
        stage: runs.timing(dataset, scene, variant, stage) for stage in choices if runs.plan.runs_stage(variant, stage)
    }
    took["total"] = Timing(
        sum(timing.seconds for timing in took.values()),
        max((timing.peak_memory_mb for timing in took.values()), default=0.0),
    )
    records: list[Record] = []
    for stage in [*choices, "total"]:
        record: dict[str, Cell] = {"dataset": dataset, "scene": scene, "variant": variant, "stage": stage}
        record |= {"choice": choices.get(stage), "published_seconds": printed(paper.get(stage))}
        if stage in took:
            record |= asdict(took[stage])
            if compares and stage in paper and took[stage].seconds:
                record["ratio"] = paper[stage] / took[stage].seconds
        records.append(record)
    return records
