"""Tables 1 to 3: this project's figures beside the published ones, and those of external methods' maps."""

from __future__ import annotations

import itertools
from collections.abc import Mapping, Sequence

from sepi.report import published
from sepi.report.plan import Plan
from sepi.report.published import PAPERS_METHOD, SceneTable
from sepi.report.runs import Runs
from sepi.report.tabular import methods
from sepi.report.tabular.layout import Cell, Column, Kind, Record, Report, line, ranks, section
from sepi.report.tabular.methods import Mean, Method
from sepi.scoring.scores import REGIONS, WHOLE_MAP


def scene_table(runs: Runs, score: str, paper: SceneTable, title: str) -> Report:
    """Table 1 or 2, a row per scene: our figures, the published ones, and those of external methods' maps.

    Parameters
    ----------
    runs : Runs
        The scores.
    score : str
        ``mse100`` or ``q25``.
    paper : SceneTable
        The published figures.
    title : str
        Title on the page.
    """
    plan = runs.plan
    elsewhere = {method.key for method in published.methods().values() if not method.column}
    compared = [method for method in methods.compared_methods(plan) if method.key not in elsewhere]
    records: list[Record] = []
    sections = []
    for dataset in methods.datasets_of(plan):
        rows = _scene_records(runs, dataset, score, paper, compared)
        shown = [method for method in compared if _is_shown(runs, dataset, method, [row for row, _ in rows])]
        columns = {"scene": Column("scene", Kind.TEXT), **{m.key: Column(m.head, m.kind) for m in shown}}
        lines = []
        for row, notes in rows:
            marks = ranks({method.key: row.get(method.key) for method in shown if method.learning == "none"})
            lines.append(line(columns, row, kind=str(row["row"]), marks=marks, notes=notes))
        records += [row for row, _ in rows]
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
    """The methods whose published figures divide ours, for the caption."""
    papers = f"the paper's method, {published.methods()[PAPERS_METHOD].label}"
    return f"the same method, for this project's own variants {papers}" if plan.report else papers


def _is_shown(runs: Runs, dataset: str, method: Method, rows: Sequence[Record]) -> bool:
    """Whether a method has a column on a dataset's page: ours always, others if it is not empty."""
    if method.kind == Kind.EXTERNAL and not methods.has_column(runs, dataset, method.name):
        return False
    return method.kind == Kind.OURS or any(row.get(method.key) is not None for row in rows)


def _own_names(runs: Runs, dataset: str) -> dict[str, str]:
    """Name of each scene in the tables (the paper's if it has one) to the name of its folder."""
    return {published.paper_scene(dataset, scene) or scene: scene for scene in runs.scored(dataset)}


def _scene_records(
    runs: Runs, dataset: str, score: str, paper: SceneTable, compared: Sequence[Method]
) -> list[tuple[Record, Mapping[str, str]]]:
    """Rows of the paper's scenes, of others, of the average of those available, and of the paper's average.

    Each row comes with notes on its figures, by method.
    """
    own_names = _own_names(runs, dataset)
    external = [method for method in compared if method.kind == Kind.EXTERNAL]
    found: list[tuple[str, str, dict[str, Cell], dict[str, str]]] = []
    for name in dict.fromkeys([*paper.scenes(dataset), *own_names]):
        figures: dict[str, Cell] = {**paper.cells.get((dataset, name), {})}
        notes: dict[str, str] = {}
        if name in own_names:
            scene = own_names[name]
            here = [method for method in compared if method.is_here]
            figures |= {m.key: _own_figure(runs, m, dataset, [scene], score, WHOLE_MAP).value for m in here}
            notes = {m.key: methods.unknown_note(runs, dataset, scene, m.name) for m in external}
        found.append((name, methods.SCENE, figures, notes))
    if own_names:
        available = [figures for name, _, figures, _ in found if name in own_names]
        means = {m.key: _average(m, [figures.get(m.key) for figures in available]) for m in compared}
        notes = {key: methods.count_note([mean.scenes], len(available)) for key, mean in means.items()}
        figures = {key: mean.value for key, mean in means.items()}
        found.append((methods.average_label(len(available)), methods.AVERAGE, figures, notes))
    if dataset in paper.averages:
        every = len(paper.scenes(dataset))
        notes = {m.key: methods.count_note([paper.averaged(dataset, m.key)], every) for m in compared}
        found.append((methods.printed_label(dataset), methods.PRINTED_AVERAGE, {**paper.averages[dataset]}, notes))
    return [
        ({"dataset": dataset, "scene": name, "row": kind} | {m.key: m.shown(_figure(m, row)) for m in compared}, notes)
        for name, kind, row, notes in found
    ]


def _figure(method: Method, figures: Record) -> Cell:
    """Figure of a method, or for a ratio, ours divided by the published one."""
    if method.kind != Kind.RATIO:
        return figures.get(method.key)
    ours = figures.get(f"ours{method.key.removeprefix('ratio')}")
    paper = figures.get(published.counterpart(method.name).key)
    return ours / paper if isinstance(ours, float) and isinstance(paper, float) and paper else None


def _average(method: Method, figures: Sequence[Cell]) -> Mean:
    """Mean of figures; None for other methods with a figure missing, since scenes must be the same."""
    mean = methods.mean(figures)
    return mean if method.kind == Kind.OURS or mean.scenes == len(figures) else Mean(None, 0)


def region_table(runs: Runs) -> Report:
    """Table 3: average MSE x100 in occluded and textureless regions: ours, published, and of external methods' maps."""
    plan = runs.plan
    datasets = [one for one in methods.datasets_of(plan) if one in published.DATASETS or runs.scored(one)]
    cells = {f"{dataset}_{region}": (dataset, region) for dataset in datasets for region in REGIONS[1:]}
    in_paper = {key for figures in published.table3().values() for key in figures}
    rows = [m for m in methods.compared_methods(plan) if m.is_here or m.key in in_paper]
    means = {key: {m.key: _region_average(runs, m, *cell) for m in rows} for key, cell in cells.items()}
    figures = {key: {m.key: m.shown(means[key][m.key].value) for m in rows} for key in cells}
    marks = {key: ranks({m.key: figures[key][m.key] for m in _ranked(runs, rows, cells[key][0])}) for key in cells}
    columns = {"name": Column("method", Kind.TEXT), **{key: Column(", ".join(cell)) for key, cell in cells.items()}}
    counts = {key: f"{key}_scenes" for key in cells}
    records: list[Record] = []
    lines = []
    for m in rows:
        record: dict[str, Cell] = {"name": m.head, "method": m.key, "learning": m.learning}
        record |= {key: figures[key][m.key] for key in cells}
        record |= {counts[key]: means[key][m.key].scenes or None for key in cells}
        notes = {key: _region_note(runs, m, means[key][m.key], dataset) for key, (dataset, _) in cells.items()}
        records.append(record)
        lines.append(line(columns, record, m.kind, marks={key: marks[key].get(m.key) for key in cells}, notes=notes))
    available = "; ".join(f"{dataset}: {', '.join(runs.scored(dataset)) or 'none'}" for dataset in datasets)
    return Report(
        "Table 3: MSE x100 in occluded and textureless regions",
        f"{methods.PROTOCOL_NOTE} This code: variants {methods.own_names(plan)}, average of the scenes available that "
        f"have such a region ({available}). Other rows: as the paper prints them, over all scenes of the dataset "
        "where none or fewer are named. "
        f"{methods.REGIONS_NOTE} {methods.LEARNED_NOTE}" + (f" {methods.EXTERNAL_NOTE}" if plan.external else ""),
        ["method", "learning", *itertools.chain(*counts.items())],
        records,
        [section("", columns, lines)],
        "Marked: best and second best in a column, of the published methods that are not learned, and of this code "
        "where it ran on every scene that the published averages are over",
    )


def _region_average(runs: Runs, method: Method, dataset: str, region: str) -> Mean:
    """A method's published average, or ours over the scenes available."""
    if method.is_here:
        return _own_figure(runs, method, dataset, runs.scored(dataset), "mse100", region)
    figure = published.table3().get(dataset, {}).get(method.key, {}).get(region)
    return Mean(figure, 0 if figure is None else published.table1().averaged(dataset, method.key))


def _region_note(runs: Runs, method: Method, mean: Mean, dataset: str) -> str:
    """Note on the number of scenes in an average, if the caption says another."""
    scenes = runs.scored(dataset) if method.is_here else published.table1().scenes(dataset)
    return methods.count_note([mean.scenes], len(scenes))


def _own_figure(runs: Runs, method: Method, dataset: str, scenes: Sequence[str], score: str, region: str) -> Mean:
    """Average of scores; if an external map is missing, its problem, or the number of maps."""
    if not scenes:
        return Mean(None, 0)
    if method.kind == Kind.OURS:
        return methods.average(runs, dataset, scenes, score, region, method.name)
    found = [runs.external_scores(dataset, scene, method.name) for scene in scenes]
    known = [scores["paper"][region][score] for scores in found if scores]
    if len(known) == len(scenes):
        return methods.mean(known)
    problems = {runs.external_problem(dataset, scene, method.name) for scene in scenes}
    alike = not known and len(problems) == 1
    return Mean(problems.pop() if alike else f"{len(known)} of {len(scenes)} scenes", 0)


def _ranked(runs: Runs, rows: Sequence[Method], dataset: str) -> list[Method]:
    """Methods ranked in a column; ours rank among published averages only if the scenes are the same."""
    of_paper = published.table1().scenes(dataset)
    compares = not of_paper or sorted(of_paper) == sorted(_own_names(runs, dataset))
    return [method for method in rows if method.learning == "none" and (compares or not method.is_here)]
