"""Table 4 (error of every variant over the map and both regions) and the ablation of variant ``best``."""

from __future__ import annotations

from sepi.report import published
from sepi.report.plan import BEST_VARIANT
from sepi.report.runs import Runs
from sepi.report.tabular import methods
from sepi.report.tabular.layout import Column, Kind, Record, Report, line, printed, section, short
from sepi.scoring.scores import REGIONS, WHOLE_MAP, own_bad_pixel, score_heads
from sepi.variants.built_in import PARTS_OF_BEST

_Means = dict[str, dict[str, methods.Mean]]
"""Region to variant to figure; published figures have no count."""

_SCORES = ("mse100", "q25", "badpix007")


def ablation_table(runs: Runs) -> Report:
    """Table 4: MSE of every variant over the map and both regions, per scene, averaged, and published."""
    variants = runs.plan.listed
    columns = {"scene": Column("scene", Kind.TEXT), **{variant: Column(variant, Kind.OURS) for variant in variants}}
    records: list[Record] = []
    sections = []
    for dataset in methods.datasets_of(runs.plan):
        lines = []
        for name, kind, means in _rows(runs, dataset):
            for region in REGIONS:
                figures = {variant: mean.value for variant, mean in means[region].items()}
                over = max((mean.scenes for mean in means[region].values()), default=0)
                scene = methods.average_label(over) if kind == methods.AVERAGE else name
                records.append({"dataset": dataset, "scene": scene, "row": kind, "region": region, **figures})
            # a variant's regions share a cell, as in the paper; a figure published without them is alone
            cells = {v: [means[r][v] for r in REGIONS if v in means[r]] for v in variants}
            texts = {v: "/".join(filter(None, (short(mean.value) for mean in cells[v]))) for v in variants}
            scenes = len(runs.scored(dataset)) if kind == methods.AVERAGE else 1
            notes = {v: methods.count_note([mean.scenes for mean in found], scenes) for v, found in cells.items()}
            source = Kind.PUBLISHED if kind == methods.PRINTED_AVERAGE else Kind.OURS
            lines.append(line(columns, {"scene": name, **texts}, source, kind, notes=notes))
        if lines:
            sections.append(section(methods.dataset_title(dataset), columns, lines))
    return Report(
        "Table 4: ablation, MSE x100 (whole map / occluded / textureless)",
        f"{methods.PROTOCOL_NOTE} The first five variants are the columns of the paper's table 4 in its order; `wang` "
        f"is the comparison in its text (published for the whole map only), `{BEST_VARIANT}` this project's own. "
        f"{methods.REGIONS_NOTE}",
        ["dataset", "scene", "row", "region", *variants],
        records,
        sections,
    )


def _rows(runs: Runs, dataset: str) -> list[tuple[str, str, _Means]]:
    """Name, kind and figures of each row: scenes, their average, and the paper's average."""
    scenes = runs.scored(dataset)
    rows = [(scene, methods.SCENE, _averages(runs, dataset, [scene])) for scene in scenes]
    if scenes:
        rows.append((methods.average_label(len(scenes)), methods.AVERAGE, _averages(runs, dataset, scenes)))
    paper = published.table4().get(dataset)
    if paper is not None:
        theirs = {r: {v: methods.Mean(printed(paper[v].get(r)), 0) for v in paper} for r in REGIONS}
        rows.append((methods.printed_label(dataset), methods.PRINTED_AVERAGE, theirs))
    return rows


def _averages(runs: Runs, dataset: str, scenes: list[str]) -> _Means:
    def average(region: str, variant: str) -> methods.Mean:
        return methods.average(runs, dataset, scenes, "mse100", region, variant)

    return {region: {variant: average(region, variant) for variant in runs.plan.listed} for region in REGIONS}


def parts_table(runs: Runs) -> Report:
    """Scores and seconds of the best variant and of the variants with one part switched off or replaced."""
    own = runs.plan.bad_thresholds
    heads = {name: score_heads(own)[name] for name in (*_SCORES, *own_bad_pixel(own))}
    columns = {
        "variant": Column("variant", Kind.TEXT),
        "difference": Column("what differs", Kind.TEXT),
        **{name: Column(head, Kind.OURS) for name, head in heads.items()},
        "seconds": Column("seconds"),
    }
    records: list[Record] = []
    sections = []
    for dataset, scene in runs.scored_pairs(BEST_VARIANT) if runs.plan.parts else ():
        found = [
            {
                **{"dataset": dataset, "scene": scene, "variant": variant, "difference": PARTS_OF_BEST[variant]},
                **runs.scores(dataset, scene, variant)["paper"][WHOLE_MAP],
                "seconds": sum(runs.timing(dataset, scene, variant, stage).seconds for stage in runs.plan.stages),
            }
            for variant in runs.plan.parts
        ]
        records += found
        sections.append(section(f"{dataset}/{scene}", columns, [line(columns, record) for record in found]))
    return Report(
        "Ablation of variant best",
        f"{methods.PROTOCOL_NOTE} Each row switches one part of `best` off, or puts the paper's in its place. Seconds: "
        "sum of the stages' processes, reading and writing included; variants that begin alike share their first "
        "stages, which ran once.",
        ["dataset", "scene", "variant", *heads, "seconds"],
        records,
        sections,
    )
