"""Tables 1 to 4: this project's figures beside the published ones, and those of external methods' maps."""

from __future__ import annotations

import itertools
from functools import partial

import pandas as pd

from sepi.report import published
from sepi.report.plan import BEST_VARIANT, Plan
from sepi.report.published import PAPERS_METHOD
from sepi.report.runs import EXTERNAL_NOTE, PROTOCOL_NOTE, REGIONS_NOTE, Runs, count_note, datasets_of, own_key
from sepi.report.table import Head, Kind, Section, Table, ranks, section, shown
from sepi.scoring.scores import REGIONS

SCENE, AVERAGE, PRINTED_AVERAGE = "scene", "average", "average printed"
"""Kinds of rows in the CSV files."""

LEARNED_NOTE = "* learned, supervised; ** learned, unsupervised."


def scene_table(runs: Runs, score: str, paper: pd.DataFrame, title: str) -> Table:
    """Table 1 or 2, a row per scene: our figures, the published ones, and those of external methods' maps.

    Parameters
    ----------
    runs : Runs
        The scores.
    score : str
        ``mse100`` or ``q25``.
    paper : DataFrame
        The published figures.
    title : str
        Title on the page.
    """
    plan = runs.plan
    counterparts = f"the paper's method, {published.methods()['label'][PAPERS_METHOD]}"
    if plan.report:
        counterparts = f"the same method, for this project's own variants {counterparts}"
    elsewhere = published.methods().index.difference(paper.columns)
    parts = [_dataset_section(runs, dataset, score, paper, elsewhere) for dataset in datasets_of(plan)]
    return Table(
        title,
        f"{PROTOCOL_NOTE} This code: variants {own_names(plan)}; then each figure of these divided by "
        f"the published one of {counterparts}. Other columns: as the "
        f"paper prints them; empty where the scene was in the method's training set. {LEARNED_NOTE} A scene "
        "without a figure of this code is not available or has no ground truth here; one without published figures is "
        "not in the paper. The average of the scenes available is empty where a method has no figure for one of them."
        + (f" {EXTERNAL_NOTE}" if plan.external else ""),
        pd.concat([rows for rows, _ in parts]),
        [found for rows, found in parts if len(rows)],
        "Marked: best and second best in a row, of this code and the published methods that are not learned",
    )


def own_names(plan: Plan) -> str:
    """Names of the compared variants, for a caption."""
    *names, last = (f"`{variant}`" for variant in plan.compared)
    return f"{', '.join(names)} and {last}" if names else last


def dataset_title(dataset: str) -> str:
    """Title of a dataset, with the paper's name if it has one."""
    return f"{dataset}: {published.DATASETS[dataset]}" if dataset in published.DATASETS else dataset


def average_label(count: int) -> str:
    """Name of the row with averages of our figures."""
    return f"Average of {count} scene{'s' * (count != 1)} available"


def printed_label(dataset: str) -> str:
    """Name of the row with the paper's averages."""
    return f"Average as printed ({len(published.scenes(dataset))} scenes)"


def _dataset_section(
    runs: Runs, dataset: str, score: str, paper: pd.DataFrame, elsewhere: pd.Index
) -> tuple[pd.DataFrame, Section]:
    """Rows of the paper's scenes, of others, of the average of those available, and of the paper's average."""
    known = runs.methods.drop(elsewhere)
    ours, external = known["kind"] == Kind.OURS, known["kind"] == Kind.EXTERNAL
    scenes = runs.scored(dataset)
    here = runs.of(score, dataset)
    names: list[str] = []
    for scene in scenes:
        name = published.paper_scene(dataset, scene) or scene
        # of two folders that differ in capitals alone, one has the paper's name
        names.append(f"{scene} (folder)" if name in names else name)
    here.index = pd.Index(names)
    theirs = paper.loc[dataset] if dataset in published.DATASETS else paper.iloc[:0].droplevel("dataset")
    every = dict.fromkeys([*published.scenes(dataset), *names])
    of_scenes = theirs.drop(index=published.AVERAGE, errors="ignore")
    figures = of_scenes.reindex([*every]).join(here).reindex(columns=known.index)
    kinds = [SCENE] * len(figures)
    # of external methods, then of averages
    unknown = (100 * runs.of("non_finite", dataset) / runs.of("pixels", dataset)).set_axis(names)
    unknown = unknown[unknown.columns.intersection(known.index[external])]
    notes = [unknown.map(lambda share: f"{share:.0f} % unknown" if share > 0 else "")]

    def add(label: str, kind: str, averages: pd.Series, counts: pd.Series, most: int) -> None:
        figures.loc[label] = averages
        notes.append(pd.DataFrame([[count_note([count], most) for count in counts]], [label], known.index))
        kinds.append(kind)

    if names:
        available = figures.loc[names]
        averages = available.mean().where(ours | available.notna().all())
        add(average_label(len(names)), AVERAGE, averages, available.count().where(ours, 0), len(names))
    if dataset in published.DATASETS:
        counts = pd.Series(published.averaged(paper, dataset)).reindex(known.index, fill_value=0)
        averages = theirs.loc[published.AVERAGE].reindex(known.index)
        add(printed_label(dataset), PRINTED_AVERAGE, averages, counts, len(published.scenes(dataset)))
    ratios = known.loc[known["kind"] == Kind.RATIO, "name"]
    divided = figures.reindex(columns=map(published.counterpart, ratios))
    figures[ratios.index] = figures[[own_key(name) for name in ratios]].to_numpy() / divided.to_numpy()
    told = {name: runs.problems(dataset, [scene]) for name, scene in zip(names, scenes, strict=True)}
    problems = shown(pd.DataFrame(told).T.reindex_like(figures))
    is_shown = known.index.isin(runs.external_of(dataset).index) | ours | (~external & figures.notna().any())
    there = known[is_shown]
    heads = {"scene": Head("scene", Kind.TEXT)}
    heads |= {str(key): Head(row["head"], row["kind"]) for key, row in there.iterrows()}
    # published figures with the two decimals that the paper prints
    printed = shown(figures.loc[:, known["kind"] == Kind.PUBLISHED])
    cells = figures.astype(object).assign(**printed).where(problems == "", problems)
    marks = ranks(cells[there.index[there["learning"] == "none"]].T).T
    cells = cells.assign(dataset=dataset, scene=cells.index, row=kinds)
    rows = cells[["dataset", "scene", "row", *known.index]]
    return rows, section(dataset_title(dataset), heads, cells, marks, pd.concat(notes), kinds)


def region_table(runs: Runs) -> Table:
    """Table 3: average MSE x100 in occluded and textureless regions: ours, published, and of external methods' maps."""
    plan, paper = runs.plan, published.table3()
    datasets = [one for one in datasets_of(plan) if one in published.DATASETS or runs.scored(one)]
    known = runs.methods
    known = known[known["kind"].isin([Kind.OURS, Kind.EXTERNAL]) | known.index.isin(paper.index)]
    here = known["kind"] != Kind.PUBLISHED
    heads = {"name": Head("method", Kind.TEXT)}
    figures, counts, notes, ranked = (pd.DataFrame(index=known.index) for _ in range(4))
    for dataset, region in itertools.product(datasets, REGIONS[1:]):
        column, scenes, of_paper = f"{dataset}_{region}", runs.scored(dataset), published.scenes(dataset)
        heads[column] = Head(f"{dataset}, {region}")
        own = runs.of("mse100", dataset, region).reindex(columns=known.index)
        problems = runs.problems(dataset, scenes)[known.index]
        means, found = own.mean().mask(problems != ""), own.count().mask(problems != "", 0)
        if of_paper:
            means = means.fillna(paper[dataset, region])
            found = found.where(here, pd.Series(published.averaged(published.table1(), dataset))).where(means.notna())
        problems = problems.mask(here & (problems == "") & bool(scenes), "n/a")
        figures[column] = means.astype(object).where(means.notna(), problems)
        counts[f"{column}_scenes"] = found.where(found > 0).astype("Int64")
        most = here.map({True: len(scenes), False: len(of_paper)})
        notes[column] = [count_note([n], m) for n, m in zip(found.fillna(0).astype(int), most, strict=True)]
        # ours rank among published averages only if the scenes are the same
        theirs = filter(None, map(partial(published.paper_scene, dataset), scenes))
        compares = not of_paper or sorted(of_paper) == sorted(theirs)
        ranked[column] = (known["learning"] == "none") & (compares | ~here)
    cells = figures.where(here, shown(figures), axis=0)
    rows = cells.replace("n/a", "").join(counts)
    rows = known[["learning"]].join(rows[[name for pair in zip(figures, counts, strict=True) for name in pair]])
    available = "; ".join(f"{dataset}: {', '.join(runs.scored(dataset)) or 'none'}" for dataset in datasets)
    return Table(
        "Table 3: MSE x100 in occluded and textureless regions",
        f"{PROTOCOL_NOTE} This code: variants {own_names(plan)}, average of the scenes available that "
        f"have such a region ({available}). Other rows: as the paper prints them, over all scenes of the dataset "
        "where none or fewer are named. "
        f"{REGIONS_NOTE} {LEARNED_NOTE}" + (f" {EXTERNAL_NOTE}" if plan.external else ""),
        rows.reset_index(names="method"),
        [section("", heads, cells.assign(name=known["head"]), ranks(cells.where(ranked)), notes, list(known["kind"]))],
        "Marked: best and second best in a column, of the published methods that are not learned, and of this code "
        "where it ran on every scene that the published averages are over",
    )


def ablation_table(runs: Runs) -> Table:
    """Table 4: MSE of every variant over the map and both regions, per scene, averaged, and published."""
    variants = list(runs.plan.variants)
    parts = [_ablation_section(runs, dataset, variants) for dataset in datasets_of(runs.plan)]
    return Table(
        "Table 4: ablation, MSE x100 (whole map / occluded / textureless)",
        f"{PROTOCOL_NOTE} The first five variants are the columns of the paper's table 4 in its order; `wang` "
        f"is the comparison in its text (published for the whole map only), `{BEST_VARIANT}` this project's own. "
        f"{REGIONS_NOTE}",
        pd.concat([rows for rows, _ in parts]),
        [found for rows, found in parts if len(rows)],
    )


def mean_by_region(runs: Runs, dataset: str, variants: list[str]) -> tuple[pd.DataFrame, pd.DataFrame]:
    """Mean MSE x100 of a dataset's scenes, and number of scenes that have the region; rows regions."""
    found = {region: _of(runs, dataset, region, variants) for region in REGIONS}
    means, counts = ({region: getattr(one, of)() for region, one in found.items()} for of in ("mean", "count"))
    return pd.DataFrame(means).T, pd.DataFrame(counts).T


def _of(runs: Runs, dataset: str, region: str, variants: list[str]) -> pd.DataFrame:
    return runs.of("mse100", dataset, region).reindex(columns=map(own_key, variants)).set_axis(variants, axis=1)


def _ablation_section(runs: Runs, dataset: str, variants: list[str]) -> tuple[pd.DataFrame, Section]:
    """Rows of the CSV file and of the page: scenes, their average, and the paper's average."""
    scenes, rows, cells, kinds = runs.scored(dataset), [], {}, []
    notes = pd.DataFrame(index=[], columns=variants)
    of_regions = {region: _of(runs, dataset, region, variants) for region in REGIONS}

    def add(name: str, kind: str, figures: pd.DataFrame, names: list[str], missing: str) -> None:
        rows.append(figures.assign(dataset=dataset, scene=names, row=kind, region=REGIONS))
        # a variant's regions share a cell, as in the paper; a figure published without them is alone
        cells[name] = shown(figures, missing=missing).agg(lambda texts: "/".join(filter(None, texts)))
        kinds.append(kind)

    for scene in scenes:
        add(scene, SCENE, pd.DataFrame({r: of_regions[r].loc[scene] for r in REGIONS}).T, [scene] * 3, "n/a")
    if scenes:
        means, counts = mean_by_region(runs, dataset, variants)
        label = average_label(len(scenes))
        add(label, AVERAGE, means, list(map(average_label, counts.max(axis=1))), "n/a")
        notes.loc[label] = [count_note(list(counts[variant]), len(scenes)) for variant in variants]
    if dataset in published.DATASETS:
        label = printed_label(dataset)
        paper = shown(published.table4().loc[dataset].T).reindex(index=REGIONS, columns=variants)
        add(label, PRINTED_AVERAGE, paper, [label] * 3, "")
    heads = {"scene": Head("scene", Kind.TEXT), **{variant: Head(variant, Kind.OURS) for variant in variants}}
    texts = pd.DataFrame(cells).T.reindex(columns=variants)
    order = ["dataset", "scene", "row", "region", *variants]
    every = pd.concat(rows)[order] if rows else pd.DataFrame(columns=order)
    return every, section(dataset_title(dataset), heads, texts.assign(scene=texts.index), notes=notes, rows=kinds)
