"""Tables 1 and 2: this project's figures beside those the paper prints, and beside those of other methods' maps."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

from sepi.report import published
from sepi.report.published import PAPERS_METHOD, SceneTable
from sepi.report.runs import Runs
from sepi.report.tabular import methods
from sepi.report.tabular.layout import Cell, Column, Entry, Kind, Line, Report, Row, Section, entry, ranks
from sepi.report.tabular.methods import Method


@dataclass(frozen=True)
class _SceneRow:
    """A row of table 1 or 2: figures and notes by the keys of the methods."""

    name: str
    kind: str
    figures: Mapping[str, Cell]
    notes: Mapping[str, str] = field(default_factory=dict)

    def figure(self, method: Method) -> Cell:
        """Of a method; of a ratio, ours divided by the paper's."""
        if method.kind != Kind.RATIO:
            return self.figures.get(method.key)
        ours, paper = self.figures.get(f"ours{method.key.removeprefix('ratio')}"), self.figures.get(PAPERS_METHOD)
        return ours / paper if isinstance(ours, float) and isinstance(paper, float) and paper else None

    def cells(self, columns: Sequence[Method]) -> list[Cell]:
        """For the CSV file."""
        return [method.shown(self.figure(method)) for method in columns]

    def line(self, columns: Sequence[Method]) -> Line:
        """For the page, with marks and notes."""
        ranked = [self.figure(method) if method.learning == "none" else None for method in columns]
        marks = ranks([figure if isinstance(figure, float) else None for figure in ranked])
        entries: list[Entry] = [entry(self.name, Kind.TEXT)]
        for method, cell, mark in zip(columns, self.cells(columns), marks, strict=True):
            entries.append(entry(cell, method.kind, mark, self.notes.get(method.key, "")))
        available = any(one.text for one in entries if one.kind == Kind.OURS)
        return Line(entries, self.kind, available)


def scene_table(runs: Runs, score: str, paper: SceneTable, title: str) -> Report:
    """Table 1 or 2: a row per scene; our figure, the published one of every method, and those of other methods' maps.

    Parameters
    ----------
    runs : Runs
        The scores.
    score : str
        ``mse100`` or ``q25``.
    paper : SceneTable
        The published figures.
    title : str
        Of the page.
    """
    plan = runs.plan
    elsewhere = {method.key for method in published.methods().values() if not method.column}
    columns = [method for method in methods.compared_methods(plan) if method.key not in elsewhere]
    data: list[Row] = []
    sections = []
    for dataset in methods.datasets_of(plan):
        found = _rows(runs, dataset, score, paper, columns)
        data += [[dataset, row.name, row.kind, *row.cells(columns)] for row in found]
        shown = [method for method in columns if _is_shown(runs, dataset, method, found)]
        heads = [Column("scene", Kind.TEXT), *(Column(method.head, method.kind) for method in shown)]
        if found:
            sections.append(Section(methods.dataset_title(dataset), heads, [row.line(shown) for row in found]))
    return Report(
        title,
        f"{methods.PROTOCOL_NOTE} This code: variants {methods.own_names(plan)}; then each figure of these divided by "
        f"the published one of the paper's method, {published.methods()[PAPERS_METHOD].label}. Other columns: as the "
        f"paper prints them; empty where the scene was in the method's training set. {methods.LEARNED_NOTE} A scene "
        "without a figure of this code is not available or has no ground truth here; one without published figures is "
        "not in the paper. The average of the scenes available is empty where a method has no figure for one of them."
        + (f" {methods.EXTERNAL_NOTE}" if plan.external else ""),
        ["dataset", "scene", "row", *(method.key for method in columns)],
        data,
        sections,
        "Marked: best and second best in a row, of this code and the published methods that are not learned",
    )


def _is_shown(runs: Runs, dataset: str, method: Method, rows: Sequence[_SceneRow]) -> bool:
    """Whether a method has a column on a dataset's page: ours always, others where something stands in it."""
    if method.kind == Kind.EXTERNAL and not methods.has_column(runs, dataset, method.name):
        return False
    return method.kind == Kind.OURS or any(row.figure(method) is not None for row in rows)


def _rows(runs: Runs, dataset: str, score: str, paper: SceneTable, columns: Sequence[Method]) -> list[_SceneRow]:
    """The paper's scenes in its order, those it does not have, the average of those available, and the paper's."""
    own_names = {published.paper_scene(dataset, scene) or scene: scene for scene in runs.scored(dataset)}
    rows = []
    for name in dict.fromkeys([*paper.scenes(dataset), *own_names]):
        figures: dict[str, Cell] = dict(paper.cells.get((dataset, name), {}))
        notes = {}
        for method in columns if name in own_names else ():
            scene = own_names[name]
            if method.kind == Kind.OURS:
                figures[method.key] = runs.final(dataset, scene, score, variant=method.name)
            elif method.kind == Kind.EXTERNAL:
                figures[method.key] = methods.external_cell(runs, dataset, scene, method.name, score)
                notes[method.key] = methods.unknown_note(runs, dataset, scene, method.name)
        rows.append(_SceneRow(name, methods.SCENE, figures, notes))
    if own_names:
        available = [row for row in rows if row.name in own_names]
        means = {method.key: _average(method, [row.figure(method) for row in available]) for method in columns}
        rows.append(_SceneRow(methods.average_label(len(available)), methods.AVERAGE, means))
    if dataset in paper.averages:
        label = methods.printed_label(dataset)
        rows.append(_SceneRow(label, methods.PRINTED_AVERAGE, dict(paper.averages[dataset])))
    return rows


def _average(method: Method, figures: Sequence[Cell]) -> Cell:
    """Mean; of other methods None where a figure is missing: an average over other scenes would not compare."""
    known = [figure for figure in figures if isinstance(figure, float)]
    if method.kind == Kind.OURS:
        return methods.mean(known)
    return sum(known) / len(known) if known and len(known) == len(figures) else None
