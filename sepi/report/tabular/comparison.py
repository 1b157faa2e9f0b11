"""Tables 1 to 3: this project's figures beside those the paper prints, and beside those of other methods' maps."""

from __future__ import annotations

from collections.abc import Sequence

from sepi.report import published
from sepi.report.plan import Plan
from sepi.report.published import PAPERS_METHOD, SceneTable
from sepi.report.runs import Runs
from sepi.report.tabular import methods
from sepi.report.tabular.layout import Cell, Column, Kind, Record, Report, line, ranks, section
from sepi.report.tabular.methods import Method
from sepi.scoring.scores import REGIONS, WHOLE_MAP


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
    compared = [method for method in methods.compared_methods(plan) if method.key not in elsewhere]
    records: list[Record] = []
    sections = []
    for dataset in methods.datasets_of(plan):
        rows = _scene_records(runs, dataset, score, paper, compared)
        shown = [method for method in compared if _is_shown(runs, dataset, method, rows)]
        columns = {"scene": Column("scene", Kind.TEXT), **{m.key: Column(m.head, m.kind) for m in shown}}
        own_names = _own_names(runs, dataset)
        lines = []
        for row in rows:
            marks = ranks({method.key: row.get(method.key) for method in shown if method.learning == "none"})
            scene = own_names.get(str(row["scene"]))
            external = [method for method in shown if scene and method.kind == Kind.EXTERNAL]
            notes = {method.key: methods.unknown_note(runs, dataset, scene or "", method.name) for method in external}
            lines.append(line(columns, row, kind=str(row["row"]), marks=marks, notes=notes))
        records += rows
        if lines:
            sections.append(section(methods.dataset_title(dataset), columns, lines))
    return Report(
        title,
        f"{methods.PROTOCOL_NOTE} This code: variants {methods.own_names(plan)}; then each figure of these divided by "
        f"the published one of {_counterparts(plan)}. Other columns: as the "
        f"paper prints them; empty where the scene was in the method's training set. {methods.LEARNED_NOTE} A scene "
        "without a figure of this code is not available or has no ground truth here; one without published figures is "
        "not in the paper. The average of the scenes available is empty where a method has no figure for one of them."
        + (f" {methods.EXTERNAL_NOTE}" if plan.external else ""),
        ["dataset", "scene", "row", *(method.key for method in compared)],
        records,
        sections,
        "Marked: best and second best in a row, of this code and the published methods that are not learned",
    )


def _counterparts(plan: Plan) -> str:
    """Whose published figures ours are divided by, for the caption."""
    papers = f"the paper's method, {published.methods()[PAPERS_METHOD].label}"
    return f"the same method, for this project's own variants {papers}" if plan.is_comparison else papers


def _is_shown(runs: Runs, dataset: str, method: Method, rows: Sequence[Record]) -> bool:
    """Whether a method has a column on a dataset's page: ours always, others where something stands in it."""
    if method.kind == Kind.EXTERNAL and not methods.has_column(runs, dataset, method.name):
        return False
    return method.kind == Kind.OURS or any(row.get(method.key) is not None for row in rows)


def _own_names(runs: Runs, dataset: str) -> dict[str, str]:
    """Name of a scene in the tables, the paper's where it has one, to that of its folder."""
    return {published.paper_scene(dataset, scene) or scene: scene for scene in runs.scored(dataset)}


def _scene_records(runs: Runs, dataset: str, score: str, paper: SceneTable, compared: Sequence[Method]) -> list[Record]:
    """The paper's scenes in its order, those it does not have, the average of those available, and the paper's."""
    own_names = _own_names(runs, dataset)
    found: list[tuple[str, str, dict[str, Cell]]] = []
    for name in dict.fromkeys([*paper.scenes(dataset), *own_names]):
        figures: dict[str, Cell] = {**paper.cells.get((dataset, name), {})}
        if name in own_names:
            scenes = [own_names[name]]
            figures |= {m.key: _own_figure(runs, m, dataset, scenes, score, WHOLE_MAP) for m in compared if m.is_here}
        found.append((name, methods.SCENE, figures))
    if own_names:
        available = [figures for name, _, figures in found if name in own_names]
        means = {m.key: _average(m, [figures.get(m.key) for figures in available]) for m in compared}
        found.append((methods.average_label(len(available)), methods.AVERAGE, means))
    if dataset in paper.averages:
        found.append((methods.printed_label(dataset), methods.PRINTED_AVERAGE, {**paper.averages[dataset]}))
    return [
        {"dataset": dataset, "scene": name, "row": kind, **{m.key: m.shown(_figure(m, figures)) for m in compared}}
        for name, kind, figures in found
    ]


def _figure(method: Method, figures: Record) -> Cell:
    """Of a method; of a ratio, ours divided by the published one."""
    if method.kind != Kind.RATIO:
        return figures.get(method.key)
    ours = figures.get(f"ours{method.key.removeprefix('ratio')}")
    paper = figures.get(published.counterpart(method.name).key)
    return ours / paper if isinstance(ours, float) and isinstance(paper, float) and paper else None


def _average(method: Method, figures: Sequence[Cell]) -> Cell:
    """Mean; of other methods None where a figure is missing: an average over other scenes would not compare."""
    known = [figure for figure in figures if isinstance(figure, float)]
    if method.kind == Kind.OURS:
        return methods.mean(known)
    return sum(known) / len(known) if known and len(known) == len(figures) else None


def region_table(runs: Runs) -> Report:
    """Table 3: average MSE x100 over occluded and textureless regions, ours, published and of other methods' maps."""
    plan = runs.plan
    datasets = [one for one in methods.datasets_of(plan) if one in published.DATASETS or runs.scored(one)]
    cells = {f"{dataset}_{region}": (dataset, region) for dataset in datasets for region in REGIONS[1:]}
    in_paper = {key for figures in published.table3().values() for key in figures}
    rows = [m for m in methods.compared_methods(plan) if m.is_here or m.key in in_paper]
    figures = {key: {m.key: m.shown(_region_average(runs, m, *cell)) for m in rows} for key, cell in cells.items()}
    marks = {key: ranks({m.key: figures[key][m.key] for m in _ranked(runs, rows, cells[key][0])}) for key in cells}
    columns = {"name": Column("method", Kind.TEXT), **{key: Column(", ".join(cell)) for key, cell in cells.items()}}
    records = [
        {"name": m.head, "method": m.key, "learning": m.learning, **{key: figures[key][m.key] for key in cells}}
        for m in rows
    ]
    lines = [
        line(columns, record, m.kind, marks={key: marks[key].get(m.key) for key in cells})
        for m, record in zip(rows, records, strict=True)
    ]
    available = "; ".join(f"{dataset}: {', '.join(runs.scored(dataset)) or 'none'}" for dataset in datasets)
    return Report(
        "Table 3: MSE x100 in occluded and textureless regions",
        f"{methods.PROTOCOL_NOTE} This code: variants {methods.own_names(plan)}, average of the scenes available that "
        f"have such a region ({available}). Other rows: as the paper prints them, over all scenes of the dataset. "
        f"{methods.REGIONS_NOTE} {methods.LEARNED_NOTE}" + (f" {methods.EXTERNAL_NOTE}" if plan.external else ""),
        ["method", "learning", *cells],
        records,
        [section("", columns, lines)],
        "Marked: best and second best in a column, of the published methods that are not learned, and of this code "
        "where it ran on every scene that the published averages are over",
    )


def _region_average(runs: Runs, method: Method, dataset: str, region: str) -> Cell:
    """The published average, or that over the scenes available."""
    if method.is_here:
        return _own_figure(runs, method, dataset, runs.scored(dataset), "mse100", region)
    return published.table3().get(dataset, {}).get(method.key, {}).get(region)


def _own_figure(runs: Runs, method: Method, dataset: str, scenes: Sequence[str], score: str, region: str) -> Cell:
    """Average of what was scored here; where another method's map is missing, the problem, or how many are there."""
    if not scenes:
        return None
    if method.kind == Kind.OURS:
        return methods.average(runs, dataset, scenes, score, region, method.name)
    found = [runs.external_scores(dataset, scene, method.name) for scene in scenes]
    known = [scores["paper"][region][score] for scores in found if scores]
    if len(known) == len(scenes):
        return methods.mean(known)
    problems = {runs.external_problem(dataset, scene, method.name) for scene in scenes}
    return problems.pop() if not known and len(problems) == 1 else f"{len(known)} of {len(scenes)} scenes"


def _ranked(runs: Runs, rows: Sequence[Method], dataset: str) -> list[Method]:
    """Methods that are ranked in a column: ours among published averages only if they are over the same scenes."""
    of_paper = published.table1().scenes(dataset)
    compares = not of_paper or sorted(of_paper) == sorted(_own_names(runs, dataset))
    return [method for method in rows if method.learning == "none" and (compares or not method.is_here)]
