"""Tables 1 and 2: this project's figures beside those the paper prints, and beside those of imported maps."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field

from sepi.evaluate import PROTOCOLS, WHOLE_MAP
from sepi.external import NO_FILE
from sepi.report import published
from sepi.report.plan import MAIN_VARIANT, Plan
from sepi.report.published import Method, SceneTable
from sepi.report.runs import Runs
from sepi.report.tabular.layout import (
    IMPORTED,
    OURS,
    PUBLISHED,
    RATIO,
    TEXT,
    Cell,
    Column,
    Entry,
    Grid,
    Line,
    Report,
    Row,
    Section,
    Table,
    printed,
    ranks,
)

SCENE, AVERAGE, PRINTED_AVERAGE = "scene", "average", "average printed"
"""What a row is, as the CSV files say it."""

PROTOCOL_NOTE = f"Protocol: paper (border {PROTOCOLS['paper']}, the whole map)."
LEARNED_NOTE = "* learned, supervised; ** learned, unsupervised."
IMPORTED_NOTE = (
    "Imported: maps that other methods made, scored here as ours are; they are not ranked, since nothing says whether "
    "their method is learned."
)
REGIONS_NOTE = (
    "Regions are those of `sepi.scoring.regions`, or the exact ones that a built-in scene brings; the paper's are "
    "not known."
)


@dataclass(frozen=True)
class _Compared:
    """A row of table 1 or 2: figures of our variants, of the published methods by key, and of the imported ones."""

    name: str
    kind: str
    ours: Sequence[float | None]
    theirs: Mapping[str, float | None]
    imported: Mapping[str, Cell]
    notes: Mapping[str, str] = field(default_factory=dict)

    @property
    def ratios(self) -> list[float | None]:
        """Our figures divided by that of the paper's method."""
        paper = self.theirs.get(published.PAPERS_METHOD)
        return [figure / paper if figure is not None and paper else None for figure in self.ours]

    def row(self, methods: Sequence[Method]) -> list[Cell]:
        """For the CSV file."""
        theirs = [printed(self.theirs.get(method.key)) for method in methods]
        return [self.name, self.kind, *self.ours, *self.ratios, *theirs, *self.imported.values()]

    def line(self, methods: Sequence[Method], imported: Sequence[str]) -> Line:
        """For the page: with marks, and with some of the imported methods."""
        unlearned = [self.theirs.get(method.key) if method.learning == "none" else None for method in methods]
        marks = ranks([*self.ours, *unlearned])
        texts = [printed(self.theirs.get(method.key)) for method in methods]
        own = len(self.ours)
        entries = [
            Entry(self.name, TEXT),
            *(Entry(figure, OURS, mark) for figure, mark in zip(self.ours, marks[:own], strict=True)),
            *(Entry(ratio, RATIO) for ratio in self.ratios),
            *(Entry(text, PUBLISHED, mark) for text, mark in zip(texts, marks[own:], strict=True)),
            *(Entry(self.imported.get(name), IMPORTED, note=self.notes.get(name, "")) for name in imported),
        ]
        return Line(entries, self.kind, at_hand=any(figure is not None for figure in self.ours))


def scene_table(runs: Runs, score: str, paper: SceneTable, title: str) -> Report:
    """Table 1 or 2: a row per scene; our figure, the published one of every method, and those of imported maps.

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
    methods = [method for method in published.methods().values() if method.column]
    rows: list[Row] = []
    sections = []
    for dataset in datasets_of(plan):
        found = [*_scene_rows(runs, dataset, score, paper), *_average_rows(runs, dataset, score, paper)]
        imported = [method for method in plan.external if has_column(runs, dataset, method)]
        columns = [
            Column("scene", TEXT),
            *(Column(own_head(variant), OURS) for variant in plan.compared),
            *(Column(f"{variant} / published", RATIO) for variant in plan.compared),
            *(Column(method_head(method), PUBLISHED) for method in methods),
            *(Column(imported_head(method), IMPORTED) for method in imported),
        ]
        rows += [[dataset, *one.row(methods)] for one in found]
        grid = Grid(columns, [one.line(methods, imported) for one in found])
        if found:
            sections.append(Section(dataset_title(dataset), grid.without_empty()))
    ratios = ["ratio" if variant == MAIN_VARIANT else f"ratio_{variant}" for variant in plan.compared]
    keys = ["dataset", "scene", "row", *own_keys(plan), *ratios, *(method.key for method in methods)]
    return Report(
        title,
        f"{PROTOCOL_NOTE} This code: variants {own_names(plan)}; then each figure of these divided by the published "
        f"one of the paper's method, {published.methods()[published.PAPERS_METHOD].label}. Other columns: as the paper "
        f"prints them; empty where the scene was in the method's training set. {LEARNED_NOTE} A scene without a figure "
        "of this code is not available or has no ground truth here; one without published figures is not in the paper. "
        "The average of the scenes available is empty where a method has no figure for one of them."
        + (f" {IMPORTED_NOTE}" if plan.external else ""),
        Table([*keys, *imported_keys(plan, keys)], rows),
        sections,
        "Marked: best and second best in a row, of this code and the published methods that are not learned",
    )


def _scene_rows(runs: Runs, dataset: str, score: str, paper: SceneTable) -> list[_Compared]:
    """The paper's scenes in its order, then those it does not have."""
    own_names = {published.paper_scene(dataset, scene) or scene: scene for scene in runs.scored(dataset)}
    rows = []
    for name in dict.fromkeys([*paper.scenes(dataset), *own_names]):
        scene = own_names.get(name)
        ours: list[float | None] = [None] * len(runs.plan.compared)
        imported: dict[str, Cell] = dict.fromkeys(runs.plan.external)
        notes: dict[str, str] = {}
        if scene is not None:
            ours = [runs.final(dataset, scene, score, variant=variant) for variant in runs.plan.compared]
            imported = {method: imported_cell(runs, dataset, scene, method, score) for method in runs.plan.external}
            notes = {method: unknown_note(runs, dataset, scene, method) for method in runs.plan.external}
        rows.append(_Compared(name, SCENE, ours, paper.cells.get((dataset, name), {}), imported, notes))
    return rows


def _average_rows(runs: Runs, dataset: str, score: str, paper: SceneTable) -> list[_Compared]:
    plan, scenes = runs.plan, runs.scored(dataset)
    nothing: dict[str, Cell] = dict.fromkeys(plan.external)
    rows = []
    if scenes:
        figures = [paper.cells.get((dataset, published.paper_scene(dataset, scene) or ""), {}) for scene in scenes]
        theirs = {key: _mean_of_all([cells.get(key) for cells in figures]) for key in published.methods()}
        ours = [mean(runs.final(dataset, scene, score, variant=name) for scene in scenes) for name in plan.compared]
        imported = {
            method: _mean_of_all([runs.external_score(dataset, scene, method, score) for scene in scenes])
            for method in plan.external
        }
        rows.append(_Compared(average_label(len(scenes)), AVERAGE, ours, theirs, nothing | imported))
    if dataset in paper.averages:
        label = printed_label(len(paper.scenes(dataset)))
        rows.append(_Compared(label, PRINTED_AVERAGE, [None] * len(plan.compared), paper.averages[dataset], nothing))
    return rows


def has_column(runs: Runs, dataset: str, method: str) -> bool:
    """Whether an imported method belongs on a dataset's page.

    One that has files, but none for this dataset, does not; one without any file does, or nobody would see that.
    """
    with_file = {name for name, scene in runs.plan.pairs if runs.external_problem(name, scene, method) != NO_FILE}
    return dataset in with_file or (not with_file and dataset in runs.plan.scenes)


def imported_cell(runs: Runs, dataset: str, scene: str, method: str, score: str) -> Cell:
    """The score of an imported map by the paper's protocol, or what is wrong with it."""
    figure = runs.external_score(dataset, scene, method, score)
    return (runs.external_problem(dataset, scene, method) or None) if figure is None else figure


def unknown_note(runs: Runs, dataset: str, scene: str, method: str) -> str:
    """How much of an imported map is not finite, which its mean squared error does not show; empty where all is."""
    scores = runs.external_scores(dataset, scene, method)
    whole = scores["paper"][WHOLE_MAP] if scores else {"pixels": 0}
    return f"{100 * whole['non_finite'] / whole['pixels']:.0f} % unknown" if whole.get("non_finite") else ""


def imported_keys(plan: Plan, taken: Iterable[str]) -> list[str]:
    """Names of the imported methods in the CSV files; one that is taken is told apart."""
    known = set(taken)
    return [imported_head(method) if method in known else method for method in plan.external]


def imported_head(method: str) -> str:
    """Head of an imported method's column."""
    return f"{method} (imported)"


def own_head(variant: str) -> str:
    """Head of a column of our figures."""
    return f"this code, {variant}"


def own_names(plan: Plan) -> str:
    """The variants whose figures are compared, for a caption."""
    return " and ".join(f"`{variant}`" for variant in plan.compared)


def own_keys(plan: Plan) -> list[str]:
    """Names of our own figures in the CSV files: ``ours`` is the paper's method."""
    return ["ours" if variant == MAIN_VARIANT else f"ours_{variant}" for variant in plan.compared]


def method_head(method: Method) -> str:
    """Head of a published method's column."""
    return method.label + {"none": "", "supervised": "*", "unsupervised": "**"}[method.learning]


def datasets_of(plan: Plan) -> list[str]:
    """Datasets available, then the paper's others."""
    return list(dict.fromkeys([*plan.scenes, *published.DATASETS]))


def dataset_title(dataset: str) -> str:
    """Name of a dataset, with the paper's where it has one."""
    return f"{dataset}: {published.DATASETS[dataset]}" if dataset in published.DATASETS else dataset


def average_label(count: int) -> str:
    """Name of the row with averages of our figures."""
    return f"Average of {count} scene{'s' * (count != 1)} available"


def printed_label(count: int) -> str:
    """Name of the row with the paper's averages."""
    return f"Average as printed ({count} scenes)"


def mean(values: Iterable[float]) -> float:
    """Mean of the scores that exist; NaN where none does (a scene may have no such region)."""
    known = [value for value in values if not math.isnan(value)]
    return sum(known) / len(known) if known else math.nan


def _mean_of_all(values: Sequence[float | None]) -> float | None:
    """Mean, or None where a value is missing: an average over other scenes would not compare."""
    known = [value for value in values if value is not None]
    return sum(known) / len(known) if known and len(known) == len(values) else None
