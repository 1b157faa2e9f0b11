"""The compared methods side by side: what is computed here, what is published, and how the two compare."""

from __future__ import annotations

from sepi.report import published
from sepi.report.runs import Runs
from sepi.report.tabular.layout import Cell, Column, Kind, Record, Report, line, printed, ranks, section
from sepi.report.tabular.methods import PROTOCOL_NOTE
from sepi.scoring.scores import SCORES, WHOLE_MAP

_PUBLISHED = {"mse100": published.table1, "q25": published.table2}

_COLUMNS = {
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
    "badpix007": Column(SCORES["badpix007"], Kind.OURS),
    "occluded": Column(f"{SCORES['mse100']}, occluded", Kind.OURS),
    "textureless": Column(f"{SCORES['mse100']}, textureless", Kind.OURS),
    "seconds": Column("time / s"),
    "peak_memory_mb": Column("peak memory / MB"),
}
_RANKED = ("mse100", "q25", "badpix007", "occluded", "textureless")


def computed_methods_table(runs: Runs) -> Report:
    """A section per scene, a row per variant: scores, the published ones, their ratios, time and memory."""
    records: list[Record] = []
    sections = []
    for dataset, scene in runs.scored_pairs():
        found = [_record(runs, dataset, scene, variant) for variant in runs.plan.compared]
        records += found
        marks = {key: ranks({str(row["variant"]): row[key] for row in found}) for key in _RANKED}
        lines = [
            line(_COLUMNS, row, marks={key: marks[key].get(str(row["variant"])) for key in _RANKED}) for row in found
        ]
        sections.append(section(f"{dataset}/{scene}", _COLUMNS, lines))
    return Report(
        "Methods, computed and published",
        f"{PROTOCOL_NOTE} Every row is computed here, by this project's implementation of the method; beside it what "
        "the paper prints for that method, and the computed figure divided by the published one. Empty where the paper "
        "prints none. Time: seconds of all stages' processes on the machine that ran them, other jobs beside them; in "
        "the first run after an installation they also compiled their kernels.",
        ["dataset", "scene", *_COLUMNS],
        records,
        sections,
        "Marked: best and second best in a column, of what is computed here",
    )


def _record(runs: Runs, dataset: str, scene: str, variant: str) -> Record:
    scores = runs.scores(dataset, scene, variant)["paper"]
    method = published.counterpart(variant)
    record: dict[str, Cell] = {"dataset": dataset, "scene": scene, "variant": variant, "method": method.label}
    for score, table in _PUBLISHED.items():
        theirs = table().cells.get((dataset, published.paper_scene(dataset, scene) or ""), {}).get(method.key)
        record[score] = scores[WHOLE_MAP][score]
        record[f"{score}_published"] = printed(theirs)
        record[f"{score}_ratio"] = scores[WHOLE_MAP][score] / theirs if theirs else None
    took = [runs.timing(dataset, scene, variant, stage) for stage in runs.plan.stages]
    record |= {"badpix007": scores[WHOLE_MAP]["badpix007"]}
    record |= {region: scores[region]["mse100"] for region in ("occluded", "textureless")}
    record |= {"seconds": sum(timing.seconds for timing in took)}
    return record | {"peak_memory_mb": max(timing.peak_memory_mb for timing in took)}
