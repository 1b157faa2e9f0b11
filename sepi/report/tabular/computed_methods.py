"""Table of the compared methods: figures computed here, published ones, and their ratios."""

from __future__ import annotations

from collections.abc import Iterable

from sepi.report import published
from sepi.report.runs import Runs
from sepi.report.tabular.layout import Cell, Column, Kind, Record, Report, line, printed, ranks, section
from sepi.report.tabular.methods import PROTOCOL_NOTE
from sepi.scoring.scores import SCORES, WHOLE_MAP, own_bad_pixel, score_heads

_PUBLISHED = {"mse100": published.table1, "q25": published.table2}

_HEADS = {
    "variant": Column("variant", Kind.TEXT),
    "method": Column("published as", Kind.TEXT),
    **{
        f"{score}{ending}": Column(f"{SCORES[score]}{head}", kind)
        for score in _PUBLISHED
        for ending, head, kind in (
            ("", "", Kind.OURS),
            ("_published", ", published", Kind.PUBLISHED),
            ("_ratio", ", ratio", Kind.RATIO),
        )
    },
}
_REGIONS = {region: Column(f"{SCORES['mse100']}, {region}", Kind.OURS) for region in ("occluded", "textureless")}
_TOOK = {"seconds": Column("time / s"), "peak_memory_mb": Column("peak memory / MB")}


def computed_methods_table(runs: Runs) -> Report:
    """A section per scene with a row per variant: scores, published ones, ratios, time and memory."""
    heads = score_heads(runs.plan.bad_thresholds)
    bad = {name: Column(heads[name], Kind.OURS) for name in ("badpix007", *own_bad_pixel(runs.plan.bad_thresholds))}
    columns = _HEADS | bad | _REGIONS | _TOOK
    ranked = (*_PUBLISHED, *bad, *_REGIONS)
    records: list[Record] = []
    sections = []
    for dataset, scene in runs.scored_pairs():
        found = [_record(runs, dataset, scene, variant, bad) for variant in runs.plan.compared]
        records += found
        marks = {key: ranks({str(row["variant"]): row[key] for row in found}) for key in ranked}
        lines = [
            line(columns, row, marks={key: marks[key].get(str(row["variant"])) for key in ranked}) for row in found
        ]
        sections.append(section(f"{dataset}/{scene}", columns, lines))
    return Report(
        "Methods, computed and published",
        f"{PROTOCOL_NOTE} Every row is computed here, by this project's implementation of the method; beside it what "
        "the paper prints for that method, and the computed figure divided by the published one. Empty where the paper "
        "prints none. Time: seconds of all stages' processes on the machine that ran them, other jobs beside them; in "
        "the first run after an installation they also compiled their kernels.",
        ["dataset", "scene", *columns],
        records,
        sections,
        "Marked: best and second best in a column, of what is computed here",
    )


def _record(runs: Runs, dataset: str, scene: str, variant: str, bad: Iterable[str]) -> Record:
    scores = runs.scores(dataset, scene, variant)["paper"]
    method = published.counterpart(variant)
    record: dict[str, Cell] = {"dataset": dataset, "scene": scene, "variant": variant, "method": method.label}
    for score, table in _PUBLISHED.items():
        theirs = table().cells.get((dataset, published.paper_scene(dataset, scene) or ""), {}).get(method.key)
        record[score] = scores[WHOLE_MAP][score]
        record[f"{score}_published"] = printed(theirs)
        record[f"{score}_ratio"] = scores[WHOLE_MAP][score] / theirs if theirs else None
    took = [runs.timing(dataset, scene, variant, stage) for stage in runs.plan.stages]
    record |= {name: scores[WHOLE_MAP][name] for name in bad}
    record |= {region: scores[region]["mse100"] for region in _REGIONS}
    record |= {"seconds": sum(timing.seconds for timing in took)}
    return record | {"peak_memory_mb": max(timing.peak_memory_mb for timing in took)}
