"""The ablation of variant ``best``: what each of its parts gains, and what it costs."""

from __future__ import annotations

from sepi.evaluate import SCORES, WHOLE_MAP
from sepi.pipeline import PARTS_OF_BEST
from sepi.report.plan import BEST_VARIANT
from sepi.report.runs import Runs
from sepi.report.tabular.layout import Cell, Column, Kind, Line, Report, Row, Section, entries
from sepi.report.tabular.methods import PROTOCOL_NOTE

_SCORES = ("mse100", "q25", "badpix007")


def parts_table(runs: Runs) -> Report:
    """Scores and seconds of the best variant and of those with one part of it switched off."""
    data: list[Row] = []
    sections = []
    columns = [
        *(Column(head, Kind.TEXT) for head in ("variant", "what differs")),
        *(Column(SCORES[name], Kind.OURS) for name in _SCORES),
        Column("seconds"),
    ]
    for dataset in runs.plan.scenes:
        for scene in runs.scored(dataset, BEST_VARIANT) if runs.plan.parts else ():
            lines = []
            for variant in runs.plan.parts:
                scores = runs.scores(dataset, scene, variant)["paper"][WHOLE_MAP]
                seconds = sum(runs.timing(dataset, scene, variant, stage).seconds for stage in runs.plan.stages)
                figures: list[Cell] = [*(scores[name] for name in _SCORES), seconds]
                data.append([dataset, scene, variant, *figures])
                lines.append(Line(entries(columns, [variant, PARTS_OF_BEST[variant], *figures])))
            sections.append(Section(f"{dataset}/{scene}", columns, lines))
    return Report(
        "Ablation of variant best",
        f"{PROTOCOL_NOTE} Each row switches one part of `best` off, or puts the paper's in its place. Seconds: sum of "
        "the stages' processes, reading and writing included; variants that begin alike share their first stages, "
        "which ran once.",
        ["dataset", "scene", "variant", *_SCORES, "seconds"],
        data,
        sections,
    )
