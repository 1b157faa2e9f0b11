"""Table 4: the error of every variant over the map and both regions, beside the figures that the paper prints."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from sepi.evaluate import REGIONS
from sepi.report import published
from sepi.report.plan import BEST_VARIANT
from sepi.report.runs import Runs
from sepi.report.tabular import methods
from sepi.report.tabular.layout import Cell, Column, Kind, Line, Report, Row, Section, entries, printed, short

# name and kind of a row, and its figures by variant and region
_Group = tuple[str, str, Mapping[tuple[str, str], Cell]]


def ablation_table(runs: Runs) -> Report:
    """Table 4: MSE of every variant over the map and both regions, per scene, averaged, and published."""
    variants = runs.plan.listed
    columns = [Column("scene", Kind.TEXT), *(Column(variant, Kind.OURS) for variant in variants)]
    data: list[Row] = []
    sections = []
    for dataset in methods.datasets_of(runs.plan):
        groups = _groups(runs, dataset, variants)
        for name, kind, figures in groups:
            data += [[dataset, name, kind, region, *(figures[v, region] for v in variants)] for region in REGIONS]
        if groups:
            lines = [_line(group, variants, columns) for group in groups]
            sections.append(Section(methods.dataset_title(dataset), columns, lines))
    return Report(
        "Table 4: ablation, MSE x100 (whole map / occluded / textureless)",
        f"{methods.PROTOCOL_NOTE} The first five variants are the columns of the paper's table 4 in its order; `wang` "
        f"is the comparison in its text (published for the whole map only), `{BEST_VARIANT}` this project's own. "
        f"{methods.REGIONS_NOTE}",
        ["dataset", "scene", "row", "region", *variants],
        data,
        sections,
    )


def _groups(runs: Runs, dataset: str, variants: Sequence[str]) -> list[_Group]:
    """The rows of a dataset: its scenes, their average, and the paper's."""
    cells = [(variant, region) for variant in variants for region in REGIONS]
    scenes = runs.scored(dataset)
    ours = {
        scene: {(v, region): runs.final(dataset, scene, "mse100", region, v) for v, region in cells} for scene in scenes
    }
    groups: list[_Group] = [(scene, methods.SCENE, figures) for scene, figures in ours.items()]
    if scenes:
        means = {cell: methods.mean(ours[scene][cell] for scene in scenes) for cell in cells}
        groups.append((methods.average_label(len(scenes)), methods.AVERAGE, means))
    if dataset in published.table4():
        paper = published.table4()[dataset]
        figures = {(v, region): printed(paper[v].of(region)) if v in paper else None for v, region in cells}
        groups.append((methods.printed_label(dataset), methods.PRINTED_AVERAGE, figures))
    return groups


def _line(group: _Group, variants: Sequence[str], columns: Sequence[Column]) -> Line:
    """The regions of a variant in one cell, as the paper has them."""
    name, kind, figures = group
    # a figure published without those of the regions stands alone
    cells = ["/".join(filter(None, (short(figures[v, region]) for region in REGIONS))) or None for v in variants]
    is_ours = kind != methods.PRINTED_AVERAGE
    return Line(entries(columns, [name, *cells], Kind.OURS if is_ours else Kind.PUBLISHED), kind, is_ours)
