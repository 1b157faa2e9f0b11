"""Table 3: averages over occluded and textureless regions, ours, published and of imported maps."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from sepi.evaluate import REGIONS, WHOLE_MAP
from sepi.report import published
from sepi.report.runs import Runs
from sepi.report.tabular.comparison import (
    IMPORTED_NOTE,
    LEARNED_NOTE,
    PROTOCOL_NOTE,
    REGIONS_NOTE,
    datasets_of,
    imported_head,
    imported_keys,
    mean,
    method_head,
    own_head,
    own_keys,
    own_names,
)
from sepi.report.tabular.layout import (
    FIGURE,
    IMPORTED,
    OURS,
    PUBLISHED,
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

# dataset and region
_Place = tuple[str, str]


@dataclass(frozen=True)
class _MethodRow:
    """A method's averages: key for the CSV file, head for the page, kind of its cells, how it learned, figures."""

    key: str
    head: str
    kind: str
    learning: str | None
    figures: Sequence[Cell]

    @property
    def cells(self) -> list[Cell]:
        """Figures as they are shown."""
        return [printed(c) if self.kind == PUBLISHED and isinstance(c, float) else c for c in self.figures]

    def line(self, marks: Sequence[str | None]) -> Line:
        """For the page, with a mark for each figure."""
        entries = [Entry(cell, self.kind, mark) for cell, mark in zip(self.cells, marks, strict=True)]
        return Line([Entry(self.head, TEXT), *entries], at_hand=self.kind != PUBLISHED)


def region_table(runs: Runs) -> Report:
    """Table 3: average MSE x100 over occluded and textureless regions."""
    plan = runs.plan
    datasets = [dataset for dataset in datasets_of(plan) if dataset in published.DATASETS or runs.scored(dataset)]
    places = [(dataset, region) for dataset in datasets for region in REGIONS if region != WHOLE_MAP]
    found = [*_own_rows(runs, places), *_published_rows(places)]
    found += _imported_rows(runs, places, [row.key for row in found])
    marks = list(zip(*(_column_marks(runs, found, column, place) for column, place in enumerate(places)), strict=True))
    lines = [row.line(of_row) for row, of_row in zip(found, marks, strict=True)]
    columns = [Column("method", TEXT), *(Column(f"{dataset}, {region}", FIGURE) for dataset, region in places)]
    at_hand = "; ".join(f"{dataset}: {', '.join(runs.scored(dataset)) or 'none'}" for dataset in datasets)
    data: list[Row] = [[row.key, row.learning, *row.cells] for row in found]
    return Report(
        "Table 3: MSE x100 in occluded and textureless regions",
        f"{PROTOCOL_NOTE} This code: variants {own_names(plan)}, average of the scenes available that have such a "
        f"region ({at_hand}). Other rows: as the paper prints them, over all scenes of the dataset. "
        f"{REGIONS_NOTE} {LEARNED_NOTE}" + (f" {IMPORTED_NOTE}" if plan.external else ""),
        Table(["method", "learning", *(f"{dataset}_{region}" for dataset, region in places)], data),
        [Section("", Grid(columns, lines))],
        "Marked: best and second best in a column, of the published methods that are not learned, and of this code "
        "where it ran on every scene that the published averages are over",
    )


def _own_rows(runs: Runs, places: Sequence[_Place]) -> list[_MethodRow]:
    return [
        _MethodRow(key, own_head(variant), OURS, "none", [_own_average(runs, *place, variant) for place in places])
        for key, variant in zip(own_keys(runs.plan), runs.plan.compared, strict=True)
    ]


def _published_rows(places: Sequence[_Place]) -> list[_MethodRow]:
    rows = []
    for method in published.methods().values():
        regions = [published.table3().get(dataset, {}).get(method.key) for dataset, _ in places]
        if any(regions):
            figures = [
                None if found is None else getattr(found, region)
                for found, (_, region) in zip(regions, places, strict=True)
            ]
            rows.append(_MethodRow(method.key, method_head(method), PUBLISHED, method.learning, figures))
    return rows


def _imported_rows(runs: Runs, places: Sequence[_Place], taken: Sequence[str]) -> list[_MethodRow]:
    return [
        _MethodRow(
            key, imported_head(method), IMPORTED, None, [_imported_average(runs, *place, method) for place in places]
        )
        for key, method in zip(imported_keys(runs.plan, taken), runs.plan.external, strict=True)
    ]


def _own_average(runs: Runs, dataset: str, region: str, variant: str) -> float | None:
    scenes = runs.scored(dataset)
    return mean(runs.final(dataset, scene, "mse100", region, variant) for scene in scenes) if scenes else None


def _imported_average(runs: Runs, dataset: str, region: str, method: str) -> Cell:
    """Average over the scenes available; where a map is missing, its problem or how many scenes have one."""
    scenes = runs.scored(dataset)
    figures = [runs.external_score(dataset, scene, method, "mse100", region) for scene in scenes]
    known = [figure for figure in figures if figure is not None]
    if known and len(known) == len(scenes):
        return mean(known)
    problems = {runs.external_problem(dataset, scene, method) for scene in scenes}
    if not known and len(problems) == 1:
        return problems.pop() or None
    return f"{len(known)} of {len(scenes)} scenes" if scenes else None


def _column_marks(runs: Runs, rows: Sequence[_MethodRow], column: int, place: _Place) -> list[str | None]:
    """Marks of a column: ours are ranked among published averages only if they are over the same scenes."""
    kinds = {OURS} if place[0] not in published.table3() else {PUBLISHED}
    if _is_complete(place[0], runs.scored(place[0])):
        kinds.add(OURS)
    figures = [row.figures[column] if row.kind in kinds and row.learning == "none" else None for row in rows]
    return ranks([figure if isinstance(figure, float) else None for figure in figures])


def _is_complete(dataset: str, scenes: Sequence[str]) -> bool:
    """Whether the scenes available are those of the paper."""
    of_paper = published.table1().scenes(dataset)
    return sorted(of_paper) == sorted(published.paper_scene(dataset, scene) or scene for scene in scenes)
