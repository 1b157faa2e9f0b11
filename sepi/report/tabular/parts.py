"""The ablation of variant ``best``: what each of its parts gains, and what it costs."""

from __future__ import annotations

from sepi.evaluate import PROTOCOLS, WHOLE_MAP
from sepi.pipeline import PARTS_OF_BEST
from sepi.report.plan import BEST_VARIANT
from sepi.report.runs import Runs
from sepi.report.tabular.layout import FIGURE, OURS, TEXT, Cell, Column, Entry, Grid, Line, Report, Row, Section, Table

_SCORES = {"mse100": "MSE x100", "q25": "Q25 x100", "badpix007": "BadPix 0.07 %"}


def parts_table(runs: Runs) -> Report:
    """Scores and seconds of the best variant and of those with one part of it switched off."""
    rows: list[Row] = []
    sections = []
    scores_columns = [Column(head, OURS) for head in _SCORES.values()]
    columns = [Column("variant", TEXT), Column("what differs", TEXT), *scores_columns, Column("seconds", FIGURE)]
    for dataset in runs.plan.scenes:
        for scene in runs.scored(dataset, BEST_VARIANT) if runs.plan.parts else ():
            lines: list[Line] = []
            for variant in runs.plan.parts:
                scores = runs.scores(dataset, scene, variant)["paper"][WHOLE_MAP]
                seconds = sum(runs.timing(dataset, scene, variant, stage).seconds for stage in runs.plan.stages)
                figures: list[Cell] = [*(scores[name] for name in _SCORES), seconds]
                rows.append([dataset, scene, variant, *figures])
                cells = [variant, PARTS_OF_BEST[variant], *figures]
                lines.append(Line([Entry(cell, column.kind) for cell, column in zip(cells, columns, strict=True)]))
            sections.append(Section(f"{dataset}/{scene}", Grid(columns, lines)))
    return Report(
        "Ablation of variant best",
        f"Protocol: paper (border {PROTOCOLS['paper']}, the whole map). Each row switches one part of `best` off, or "
        "puts the paper's in its place. Seconds: sum of the stages' processes, reading and writing included; variants "
        "that begin alike share their first stages, which ran once.",
        Table(["dataset", "scene", "variant", *_SCORES, "seconds"], rows),
        sections,
    )
