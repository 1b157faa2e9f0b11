"""Tables 1 to 4: this project's figures beside those the paper prints."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence

from sepi.evaluate import PROTOCOLS, REGIONS, WHOLE_MAP
from sepi.report import published
from sepi.report.layout import Cell, Report, Row, Section, Table, printed, short
from sepi.report.plan import BEST_VARIANT, MAIN_VARIANT, Plan, Runs
from sepi.report.published import Method, SceneTable

# what a row is, as the CSV files say it
_SCENE, _AVERAGE, _PRINTED_AVERAGE = "scene", "average", "average printed"

_PROTOCOL = f"Protocol: paper (border {PROTOCOLS['paper']}, the whole map)."
_LEARNED = "* learned, supervised; ** learned, unsupervised."
REGIONS_NOTE = (
    "Regions are those of `sepi.regions`, or the exact ones that a built-in scene brings; the paper's are not known."
)


def scene_table(runs: Runs, score: str, paper: SceneTable, title: str) -> Report:
    """Table 1 or 2: a row per scene; our figure and the published one of every method.

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
    methods = [method for method in published.methods().values() if method.column]
    rows: list[Row] = []
    for dataset in _datasets(runs.plan):
        ours = {
            scene: [runs.final(dataset, scene, score, variant=variant) for variant in runs.plan.compared]
            for scene in runs.scored(dataset)
        }
        rows += _scene_rows(dataset, ours, paper, methods, len(runs.plan.compared))
        rows += _average_rows(dataset, ours, paper, methods, len(runs.plan.compared))
    heads = ["scene", *map(_own_head, runs.plan.compared), *(_head(method) for method in methods)]
    return Report(
        title,
        f"{_PROTOCOL} This code: variants {_own_names(runs.plan)}. Other columns: as the paper prints them; empty "
        f"where the scene was in the method's training set. {_LEARNED} A scene without a figure of this code is not at "
        "hand; one without published figures is not in the paper. The average of the scenes at hand is empty where a "
        "method has no figure for one of them.",
        Table(["dataset", "scene", "row", *_own_keys(runs.plan), *(method.key for method in methods)], rows),
        [
            Section(_dataset_title(dataset), Table(heads, [[row[1], *row[3:]] for row in group]))
            for dataset, group in _by_dataset(rows).items()
        ],
    )


def region_table(runs: Runs) -> Report:
    """Table 3: average MSE over occluded and texture-less regions, ours and published."""
    regions = [region for region in REGIONS if region != WHOLE_MAP]
    datasets = [dataset for dataset in _datasets(runs.plan) if dataset in published.DATASETS or runs.scored(dataset)]
    columns = [(dataset, region) for dataset in datasets for region in regions]
    rows: list[Row] = [
        [key, "none", *(_region_average(runs, dataset, region, variant) for dataset, region in columns)]
        for key, variant in zip(_own_keys(runs.plan), runs.plan.compared, strict=True)
    ]
    labels: list[Cell] = [_own_head(variant) for variant in runs.plan.compared]
    for method in published.methods().values():
        theirs = {dataset: published.table3().get(dataset, {}).get(method.key) for dataset in datasets}
        if any(theirs.values()):
            rows.append(
                [method.key, method.learning, *(_printed(theirs[dataset], region) for dataset, region in columns)]
            )
            labels.append(_head(method))
    at_hand = "; ".join(f"{dataset}: {', '.join(runs.scored(dataset)) or 'none'}" for dataset in datasets)
    heads = ["method", *(f"{dataset}, {region}" for dataset, region in columns)]
    return Report(
        "Table 3: MSE x100 in occluded and texture-less regions",
        f"{_PROTOCOL} This code: variants {_own_names(runs.plan)}, average of the scenes at hand that have such a "
        f"region ({at_hand}). Other rows: as the paper prints them, over all scenes of the data set. "
        f"{REGIONS_NOTE} {_LEARNED}",
        Table(["method", "learning", *(f"{dataset}_{region}" for dataset, region in columns)], rows),
        [Section("", Table(heads, [[label, *row[2:]] for label, row in zip(labels, rows, strict=True)]))],
    )


def ablation_table(runs: Runs) -> Report:
    """Table 4: MSE of every variant over the map and both regions, per scene, averaged, and published."""
    variants = runs.plan.listed
    cells = [(variant, region) for variant in variants for region in REGIONS]
    rows: list[Row] = []
    for dataset in _datasets(runs.plan):
        scenes = runs.scored(dataset)
        ours = {
            scene: {cell: runs.final(dataset, scene, "mse100", variant=cell[0], region=cell[1]) for cell in cells}
            for scene in scenes
        }
        for scene in scenes:
            rows += _ablation_rows([dataset, scene, _SCENE], variants, ours[scene])
        if scenes:
            means = {cell: _mean(ours[scene][cell] for scene in scenes) for cell in cells}
            rows += _ablation_rows([dataset, _average_label(len(scenes)), _AVERAGE], variants, means)
        if dataset in published.table4():
            paper = published.table4()[dataset]
            label = _printed_label(len(published.table1().scenes(dataset)))
            figures = {cell: _printed(paper.get(cell[0]), cell[1]) for cell in cells}
            rows += _ablation_rows([dataset, label, _PRINTED_AVERAGE], variants, figures)
    return Report(
        "Table 4: ablation, MSE x100 (whole map / occluded / texture-less)",
        f"{_PROTOCOL} The first five variants are the columns of the paper's table 4 in its order; `wang` is the "
        f"comparison in its text (published for the whole map only), `{BEST_VARIANT}` this project's own. "
        f"{REGIONS_NOTE}",
        Table(["dataset", "scene", "row", "region", *variants], rows),
        [Section(_dataset_title(dataset), _joined(variants, group)) for dataset, group in _by_dataset(rows).items()],
    )


def _scene_rows(
    dataset: str, ours: Mapping[str, Sequence[float]], paper: SceneTable, methods: Sequence[Method], own: int
) -> list[Row]:
    """The paper's scenes in its order, then those it does not have; ``own`` figures of ours in each row."""
    own_names = {published.paper_scene(dataset, scene) or scene: scene for scene in ours}
    rows: list[Row] = []
    for name in dict.fromkeys([*paper.scenes(dataset), *own_names]):
        figures = paper.cells.get((dataset, name), {})
        found: Sequence[Cell] = ours[own_names[name]] if name in own_names else [None] * own
        rows.append([dataset, name, _SCENE, *found, *(printed(figures.get(method.key)) for method in methods)])
    return rows


def _average_rows(
    dataset: str, ours: Mapping[str, Sequence[float]], paper: SceneTable, methods: Sequence[Method], own: int
) -> list[Row]:
    rows: list[Row] = []
    if ours:
        figures = [paper.cells.get((dataset, published.paper_scene(dataset, scene) or ""), {}) for scene in ours]
        theirs = [printed(_mean_of_all([cells.get(method.key) for cells in figures])) for method in methods]
        means = [_mean(figures) for figures in zip(*ours.values(), strict=True)]
        rows.append([dataset, _average_label(len(ours)), _AVERAGE, *means, *theirs])
    if dataset in paper.averages:
        theirs = [printed(paper.averages[dataset].get(method.key)) for method in methods]
        rows.append([dataset, _printed_label(len(paper.scenes(dataset))), _PRINTED_AVERAGE, *[None] * own, *theirs])
    return rows


def _ablation_rows(
    start: Sequence[Cell], variants: Sequence[str], figures: Mapping[tuple[str, str], Cell]
) -> list[Row]:
    return [[*start, region, *(figures[variant, region] for variant in variants)] for region in REGIONS]


def _joined(variants: Sequence[str], rows: Sequence[Row]) -> Table:
    """The rows of a data set, one per scene: the regions of a variant in one cell, as the paper has them."""
    groups: dict[Cell, list[Row]] = {}
    for row in rows:
        groups.setdefault(row[1], []).append(row[4:])
    lines: list[Row] = []
    for name, regions in groups.items():
        cells = [[short(row[column]) for row in regions] for column in range(len(variants))]
        # a figure published without those of the regions stands alone
        lines.append([name, *("/".join(filter(None, cell)) or None for cell in cells)])
    return Table(["scene", *variants], lines)


def _region_average(runs: Runs, dataset: str, region: str, variant: str) -> float | None:
    scenes = runs.scored(dataset)
    return _mean(runs.final(dataset, scene, "mse100", region, variant) for scene in scenes) if scenes else None


def _own_head(variant: str) -> str:
    return f"this code, {variant}"


def _own_names(plan: Plan) -> str:
    return " and ".join(f"`{variant}`" for variant in plan.compared)


def _own_keys(plan: Plan) -> list[str]:
    """Names of our own figures in the CSV files: ``ours`` is the paper's method."""
    return ["ours" if variant == MAIN_VARIANT else f"ours_{variant}" for variant in plan.compared]


def _mean(values: Iterable[float]) -> float:
    """Mean of the scores that exist; NaN where none does (a scene may have no such region)."""
    known = [value for value in values if not math.isnan(value)]
    return sum(known) / len(known) if known else math.nan


def _mean_of_all(values: Sequence[float | None]) -> float | None:
    """Mean, or None where a value is missing: an average over other scenes would not compare."""
    known = [value for value in values if value is not None]
    return sum(known) / len(known) if known and len(known) == len(values) else None


def _printed(figures: published.Regions | None, region: str) -> str | None:
    return None if figures is None else printed(getattr(figures, "overall" if region == WHOLE_MAP else region))


def _datasets(plan: Plan) -> list[str]:
    """Data sets at hand, then the paper's others."""
    return list(dict.fromkeys([*plan.scenes, *published.DATASETS]))


def _by_dataset(rows: Sequence[Row]) -> dict[str, list[Row]]:
    groups: dict[str, list[Row]] = {}
    for row in rows:
        groups.setdefault(str(row[0]), []).append(row)
    return groups


def _average_label(count: int) -> str:
    return f"Average of {count} scene{'s' * (count != 1)} at hand"


def _printed_label(count: int) -> str:
    return f"Average as printed ({count} scenes)"


def _head(method: Method) -> str:
    return method.label + {"none": "", "supervised": "*", "unsupervised": "**"}[method.learning]


def _dataset_title(dataset: str) -> str:
    return f"{dataset}: {published.DATASETS[dataset]}" if dataset in published.DATASETS else dataset
