"""Table 3: averages over occluded and textureless regions, ours, published and of other methods' maps."""

from __future__ import annotations

from collections.abc import Sequence

from sepi.evaluate import REGIONS, WHOLE_MAP
from sepi.report import published
from sepi.report.runs import Runs
from sepi.report.tabular import methods
from sepi.report.tabular.layout import Cell, Column, Kind, Line, Report, Section, entry, ranks
from sepi.report.tabular.methods import Method


def region_table(runs: Runs) -> Report:
    """Table 3: average MSE x100 over occluded and textureless regions."""
    plan = runs.plan
    datasets = [one for one in methods.datasets_of(plan) if one in published.DATASETS or runs.scored(one)]
    columns = [(dataset, region) for dataset in datasets for region in REGIONS if region != WHOLE_MAP]
    in_paper = {key for figures in published.table3().values() for key in figures}
    rows = [
        method
        for method in methods.compared_methods(plan)
        if method.kind in (Kind.OURS, Kind.EXTERNAL) or method.key in in_paper
    ]
    figures = {method: [_average(runs, method, *column) for column in columns] for method in rows}
    cells = {method: [method.shown(figure) for figure in figures[method]] for method in rows}
    marks = list(
        zip(*(_marks(runs, figures, index, dataset) for index, (dataset, _) in enumerate(columns)), strict=True)
    )
    lines = [
        Line(
            [entry(m.head, Kind.TEXT), *(entry(cell, m.kind, mark) for cell, mark in zip(cells[m], row, strict=True))],
            available=m.kind != Kind.PUBLISHED,
        )
        for m, row in zip(rows, marks, strict=True)
    ]
    available = "; ".join(f"{dataset}: {', '.join(runs.scored(dataset)) or 'none'}" for dataset in datasets)
    return Report(
        "Table 3: MSE x100 in occluded and textureless regions",
        f"{methods.PROTOCOL_NOTE} This code: variants {methods.own_names(plan)}, average of the scenes available that "
        f"have such a region ({available}). Other rows: as the paper prints them, over all scenes of the dataset. "
        f"{methods.REGIONS_NOTE} {methods.LEARNED_NOTE}" + (f" {methods.EXTERNAL_NOTE}" if plan.external else ""),
        ["method", "learning", *(f"{dataset}_{region}" for dataset, region in columns)],
        [[method.key, method.learning, *cells[method]] for method in rows],
        [Section("", [Column("method", Kind.TEXT), *(Column(", ".join(column)) for column in columns)], lines)],
        "Marked: best and second best in a column, of the published methods that are not learned, and of this code "
        "where it ran on every scene that the published averages are over",
    )


def _average(runs: Runs, method: Method, dataset: str, region: str) -> Cell:
    """The published average, or that over the scenes available.

    Where another method's map is missing, it is the problem, or how many scenes have one.
    """
    if method.kind == Kind.PUBLISHED:
        figures = published.table3().get(dataset, {}).get(method.key)
        return None if figures is None else figures.of(region)
    scenes = runs.scored(dataset)
    if not scenes:
        return None
    if method.kind == Kind.OURS:
        return methods.mean(runs.final(dataset, scene, "mse100", region, method.name) for scene in scenes)
    found = [runs.external_score(dataset, scene, method.name, "mse100", region) for scene in scenes]
    known = [figure for figure in found if figure is not None]
    if len(known) == len(scenes):
        return methods.mean(known)
    problems = {runs.external_problem(dataset, scene, method.name) for scene in scenes}
    return problems.pop() or None if not known and len(problems) == 1 else f"{len(known)} of {len(scenes)} scenes"


def _marks(runs: Runs, figures: dict[Method, list[Cell]], index: int, dataset: str) -> list[str | None]:
    """Marks of a column: ours are ranked among published averages only if they are over the same scenes."""
    kinds = {Kind.PUBLISHED} if dataset in published.table3() else {Kind.OURS}
    if _is_complete(dataset, runs.scored(dataset)):
        kinds.add(Kind.OURS)
    ranked = [found[index] if m.kind in kinds and m.learning == "none" else None for m, found in figures.items()]
    return ranks([figure if isinstance(figure, float) else None for figure in ranked])


def _is_complete(dataset: str, scenes: Sequence[str]) -> bool:
    """Whether the scenes available are those of the paper."""
    of_paper = published.table1().scenes(dataset)
    return sorted(of_paper) == sorted(published.paper_scene(dataset, scene) or scene for scene in scenes)
