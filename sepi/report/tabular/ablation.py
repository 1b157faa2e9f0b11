"""Table 4: the error of every variant over the map and both regions, beside the figures that the paper prints."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from sepi.evaluate import REGIONS, WHOLE_MAP
from sepi.report import published
from sepi.report.plan import BEST_VARIANT
from sepi.report.runs import Runs
from sepi.report.tabular.comparison import (
    AVERAGE,
    PRINTED_AVERAGE,
    PROTOCOL_NOTE,
    REGIONS_NOTE,
    SCENE,
    average_label,
    dataset_title,
    datasets_of,
    mean,
    printed_label,
)
from sepi.report.tabular.layout import (
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
    short,
)

# name and kind of a row, and its figures by variant and region
_Figures = Mapping[tuple[str, str], Cell]
_Group = tuple[str, str, _Figures]


def ablation_table(runs: Runs) -> Report:
    """Table 4: MSE of every variant over the map and both regions, per scene, averaged, and published."""
    variants = runs.plan.listed
    columns = [Column("scene", TEXT), *(Column(variant, OURS) for variant in variants)]
    rows: list[Row] = []
    sections = []
    for dataset in datasets_of(runs.plan):
        groups = _groups(runs, dataset, variants)
        for name, kind, figures in groups:
            rows += [[dataset, name, kind, region, *(figures[v, region] for v in variants)] for region in REGIONS]
        if groups:
            grid = Grid(columns, [_line(group, variants) for group in groups])
            sections.append(Section(dataset_title(dataset), grid))
    return Report(
        "Table 4: ablation, MSE x100 (whole map / occluded / textureless)",
        f"{PROTOCOL_NOTE} The first five variants are the columns of the paper's table 4 in its order; `wang` is the "
        f"comparison in its text (published for the whole map only), `{BEST_VARIANT}` this project's own. "
        f"{REGIONS_NOTE}",
        Table(["dataset", "scene", "row", "region", *variants], rows),
        sections,
    )


def _groups(runs: Runs, dataset: str, variants: Sequence[str]) -> list[_Group]:
    """The rows of a dataset: its scenes, their average, and the paper's."""
    cells = [(variant, region) for variant in variants for region in REGIONS]
    scenes = runs.scored(dataset)
    ours = {
        scene: {
            (variant, region): runs.final(dataset, scene, "mse100", variant=variant, region=region)
            for variant, region in cells
        }
        for scene in scenes
    }
    groups: list[_Group] = [(scene, SCENE, dict(ours[scene])) for scene in scenes]
    if scenes:
        means = {cell: mean(ours[scene][cell] for scene in scenes) for cell in cells}
        groups.append((average_label(len(scenes)), AVERAGE, dict(means)))
    if dataset in published.table4():
        paper = published.table4()[dataset]
        figures = {cell: _printed(paper.get(cell[0]), cell[1]) for cell in cells}
        groups.append((printed_label(len(published.table1().scenes(dataset))), PRINTED_AVERAGE, dict(figures)))
    return groups


def _line(group: _Group, variants: Sequence[str]) -> Line:
    """The regions of a variant in one cell, as the paper has them."""
    name, kind, figures = group
    entries = [Entry(name, TEXT)]
    for variant in variants:
        # a figure published without those of the regions stands alone
        texts = filter(None, (short(figures[variant, region]) for region in REGIONS))
        entries.append(Entry("/".join(texts) or None, PUBLISHED if kind == PRINTED_AVERAGE else OURS))
    return Line(entries, kind, at_hand=kind != PRINTED_AVERAGE)


def _printed(figures: published.Regions | None, region: str) -> str | None:
    return None if figures is None else printed(getattr(figures, "overall" if region == WHOLE_MAP else region))
