"""Tables of scores, seconds and memory: of variants by scene, beside depth discontinuities, and after each stage.

External methods' maps are among the scores as stage ``external``.
"""

from __future__ import annotations

import itertools
from collections.abc import Iterable, Mapping

import numpy as np
import pandas as pd

from sepi.report import published
from sepi.report.plan import MAIN_VARIANT
from sepi.report.runs import EXTERNAL, KEYS, PROTOCOL_NOTE, REGIONS_NOTE, Runs, own_key
from sepi.report.table import Head, Kind, Section, Table, ranks, section, shown
from sepi.scoring.regions import LEAST_DISCONTINUITY, REACH
from sepi.scoring.scores import COUNTS, DISCONTINUITIES, EDGE_SCORES, PROTOCOLS, REGIONS, SCORES, WHOLE_MAP, score_heads
from sepi.variants.built_in import PARTS_OF_BEST

_PARTS = [region for region in REGIONS if region != WHOLE_MAP]
_PUBLISHED = {"mse100": published.table1, "q25": published.table2}


def computed_methods_table(runs: Runs) -> Table:
    """A section per scene with a row per variant: scores, published ones, ratios, time and memory."""
    heads = {"variant": Head("variant", Kind.TEXT), "method": Head("published as", Kind.TEXT)}
    for score in _PUBLISHED:
        heads[score] = Head(SCORES[score], Kind.OURS)
        heads[f"{score}_published"] = Head(f"{SCORES[score]}, published", Kind.PUBLISHED)
        heads[f"{score}_ratio"] = Head(f"{SCORES[score]}, ratio", Kind.RATIO)
    heads |= _score_heads(runs, ["badpix007"])
    heads |= {region: Head(f"{SCORES['mse100']}, {region}", Kind.OURS) for region in _PARTS}
    ranked = [key for key, head in heads.items() if head.kind == Kind.OURS]
    heads |= {"seconds": Head("time / s"), "peak_memory_mb": Head("peak memory / MB")}
    rows, sections = _by_scene(runs, heads, ranked)
    return Table(
        "Methods, computed and published",
        f"{PROTOCOL_NOTE} Every row is computed here, by this project's implementation of the method; beside it what "
        "the paper prints for that method, and the computed figure divided by the published one. Empty where the paper "
        "prints none. Time: seconds of all stages' processes on the machine that ran them, other jobs beside them; in "
        "the first run after an installation they also compiled their kernels.",
        rows,
        sections,
        "Marked: best and second best in a column, of what is computed here",
    )


def parts_table(runs: Runs) -> Table:
    """Scores and seconds of the best variant and of the variants with one part switched off or replaced."""
    heads = {"variant": Head("variant", Kind.TEXT), "difference": Head("what differs", Kind.TEXT)}
    heads |= _score_heads(runs, ["mse100", "q25", "badpix007"]) | {"seconds": Head("seconds")}
    rows, sections = _by_scene(runs, heads)
    return Table(
        "Ablation of variant best",
        f"{PROTOCOL_NOTE} Each row switches one part of `best` off, or puts the paper's in its place. Seconds: "
        "sum of the stages' processes, reading and writing included; variants that begin alike share their first "
        "stages, which ran once.",
        rows.drop(columns="difference"),
        sections,
    )


def _score_heads(runs: Runs, scores: Iterable[str]) -> dict[str, Head]:
    """Heads of scores, and of those for the user's thresholds."""
    heads = score_heads(runs.plan.bad_thresholds)
    return {name: Head(heads[name], Kind.OURS) for name in (*scores, *[one for one in heads if one not in SCORES])}


def _by_scene(runs: Runs, heads: Mapping[str, Head], ranked: Iterable[str] = ()) -> tuple[pd.DataFrame, list[Section]]:
    """Rows of the compared variants, and a section for each scene with marks in some columns."""
    rows = [_variant_rows(runs, pair)[["dataset", "scene", *heads]] for pair in runs.scored_pairs]
    pairs = zip(runs.scored_pairs, rows, strict=True)
    sections = [section("/".join(pair), heads, of, ranks(of[[*ranked]]), missing="n/a") for pair, of in pairs]
    return pd.concat(rows or [pd.DataFrame(columns=["dataset", "scene", *heads])]), sections


def _variant_rows(runs: Runs, pair: tuple[str, str]) -> pd.DataFrame:
    """All that is known of the compared variants' final maps of a scene, and of what is published for it."""
    variants = runs.plan.compared
    scores = runs.final.sort_index().loc[pair].unstack("region").loc[map(own_key, variants)].set_axis(variants)
    counterparts = [published.counterpart(variant) for variant in variants]
    found = scores.xs(WHOLE_MAP, axis=1, level="region")
    found = found.assign(dataset=pair[0], scene=pair[1], variant=variants)
    labels = list(published.methods()["label"][counterparts])
    found = found.assign(method=labels, difference=found["variant"].map(PARTS_OF_BEST))
    place = (pair[0], published.paper_scene(*pair))
    for score, table in _PUBLISHED.items():
        theirs = table().reindex(index=[place], columns=counterparts).iloc[0].to_numpy()
        found[f"{score}_published"] = shown(pd.DataFrame(theirs))[0].to_list()
        found[f"{score}_ratio"] = (found[score] / theirs).astype(object).where(~np.isnan(theirs), "")
    return found.assign(**{region: scores["mse100", region] for region in _PARTS}, **runs.totals.loc[pair])


_EDGES = {
    "scene": Head("scene", Kind.TEXT),
    "variant": Head("variant", Kind.TEXT),
    "area": Head("area / %"),
    "squared_error": Head("squared error there / %"),
    **{
        f"{name}_{where}": Head(f"{SCORES[name]}, {where}")
        for name in ("mse100", "badpix007")
        for where in ("there", "away")
    },
    **{name: Head(head) for name, head in EDGE_SCORES.items()},
}


def edge_table(runs: Runs) -> Table:
    """Scores beside depth discontinuities and away from them, of the compared variants and external methods' maps."""
    ours = list(map(own_key, runs.plan.compared))
    maps = [(*pair, key) for pair in runs.scored_pairs for key in (*ours, *runs.external_of(pair[0]).index)]
    names = ["dataset", "scene", "method", "region"]
    whole, there = (
        runs.final.reindex(pd.MultiIndex.from_tuples([(*one, region) for one in maps], names=names)).reset_index()
        for region in (WHOLE_MAP, DISCONTINUITIES)
    )
    rows = whole[["dataset", "scene", "variant"]].join(edge_budget(whole, there))[whole["pixels"].notna()]
    cells = rows.assign(scene=rows["dataset"] + "/" + rows["scene"])
    stages = whole["stage"][rows.index]
    return Table(
        "Depth discontinuities",
        f"{PROTOCOL_NOTE} There: up to {REACH} pixels beside a depth discontinuity of the ground truth, where "
        f"neighbours differ by more than {LEAST_DISCONTINUITY} pixels per view step; away: everywhere else. Area and "
        "squared error: the part of the pixels, and of the sum of squared errors, that lies there. Fattening: of the "
        "background's pixels there, those whose estimate is nearer than the middle between both surfaces; thinning: of "
        "the foreground's, those whose estimate is more distant.",
        rows[["dataset", *_EDGES]],
        [section("", _EDGES, cells, rows=list(stages.where(stages == EXTERNAL, "")), missing="n/a")],
    )


def edge_budget(whole: pd.DataFrame, there: pd.DataFrame) -> pd.DataFrame:
    """Share of maps' errors beside depth discontinuities.

    Parameters
    ----------
    whole, there : DataFrame
        Scores of the whole map, and of the region beside depth discontinuities, a row for each map.

    Returns
    -------
    DataFrame
        The table's figures; NaN over no pixels.
    """
    finite_whole, finite_there = (scores["pixels"] - scores["non_finite"] for scores in (whole, there))
    # a score over no pixels adds nothing
    squared = [(f * s["mse100"]).fillna(0.0) for f, s in ((finite_whole, whole), (finite_there, there))]
    squared_whole, squared_there = squared
    bad_whole, bad_there = ((scores["pixels"] * scores["badpix007"]).fillna(0.0) for scores in (whole, there))
    figures = {
        "area": (100 * there["pixels"], whole["pixels"]),
        "squared_error": (100 * squared_there, squared_whole),
        "mse100_away": (squared_whole - squared_there, finite_whole - finite_there),
        "badpix007_away": (bad_whole - bad_there, whole["pixels"] - there["pixels"]),
    }
    # rounding may make a mean of squares negative
    shares = {name: part.clip(lower=0) / of.replace(0, np.nan) for name, (part, of) in figures.items()}
    beside = there[["mse100", "badpix007"]].add_suffix("_there")
    return pd.concat([pd.DataFrame(shares), beside, there[[*EDGE_SCORES]]], axis=1)


# height and width of the views, and rows and columns of views, for which the seconds were published
_PUBLISHED_SIZE = ([512, 512], [9, 9])


def stage_table(runs: Runs) -> Table:
    """All scores after each stage of each variant, and of external methods' maps, by both protocols."""
    plan, scores = runs.plan, score_heads(runs.plan.bad_thresholds)
    maps = [(variant, *one) for variant, choices in plan.variants.items() for one in choices.items()]
    maps += [(name, EXTERNAL, "") for name in plan.external]
    order = itertools.product(runs.scored_pairs, PROTOCOLS, maps, REGIONS)
    index = [(*pair, *one, protocol, region) for pair, protocol, one, region in order]
    rows = runs.maps.reindex(pd.MultiIndex.from_tuples(index, names=KEYS))[[*scores, *COUNTS]].reset_index()
    rows = rows.astype(dict.fromkeys(COUNTS, "Int64"))
    missing = rows["pixels"].isna()
    rows[[*scores]] = rows[[*scores]].astype(object).mask(missing, "")
    after = (rows["stage"] + " (" + rows["choice"] + ")").where(rows["choice"] != "", rows["stage"])
    cells = rows.assign(after=after)
    for region in _PARTS:
        cells.loc[cells["region"] == WHOLE_MAP, region] = cells.loc[cells["region"] == region, "mse100"].to_numpy()
    problems = [runs.problem(row.dataset, [row.scene], row.variant) for row in rows[missing].itertuples()]
    for of in (rows, cells):
        of.loc[missing, "mse100"] = problems
    heads = {"variant": Head("variant", Kind.TEXT), "after": Head("after stage", Kind.TEXT)}
    heads |= {score: Head(head) for score, head in scores.items()}
    heads |= {region: Head(f"{SCORES['mse100']}, {region}") for region in _PARTS}
    sections = []
    for (dataset, scene, protocol), found in cells.groupby(["dataset", "scene", "protocol"], sort=False):
        here = (found["stage"] != EXTERNAL) | found["variant"].isin(runs.external_of(dataset)["name"])
        found = found[(found["region"] == WHOLE_MAP) & here]
        heading = f"{dataset}/{scene}, protocol {protocol} (border {PROTOCOLS[protocol]})"
        kinds = list(found["stage"].where(found["stage"] == EXTERNAL, ""))
        sections.append(section(heading, heads, found, rows=kinds, missing="n/a"))
    return Table(
        "Scores after each stage",
        "Whole map unless a region is named; both protocols. A non-finite estimate counts as bad; how many there are, "
        "and every score in the regions, is in the CSV file. Scenes without ground truth have no scores. "
        + ("Maps of other methods stand below ours as stage `external`. " if plan.external else "")
        + REGIONS_NOTE,
        rows,
        sections,
    )


def runtime_table(runs: Runs) -> Table:
    """Seconds and peak memory of each stage of each variant, beside the paper's seconds."""
    plan, paper = runs.plan, published.runtime()
    steps = [*plan.stages, "total"]
    heads = {"variant": Head("variant", Kind.TEXT), **{step: Head(f"{step} / s") for step in steps}}
    heads |= {"ratio": Head("published / this code", Kind.RATIO), "peak_memory_mb": Head("peak memory / MB")}
    times = pd.concat([runs.times, runs.totals.assign(stage="total").set_index("stage", append=True)])
    index = [(*pair, variant, step) for pair in plan.pairs for variant in plan.variants for step in steps]
    rows = times.reindex(pd.MultiIndex.from_tuples(index, names=KEYS[:4])).reset_index()
    # published seconds belong to the paper's method only, and to light fields of one size
    theirs = rows["stage"].map(paper).where(rows["variant"] == MAIN_VARIANT)
    sizes = {pair: (one["light_field"]["shape"], one["light_field"]["grid"]) for pair, one in runs.scenes.items()}
    of_size = pd.Series([sizes[index_of[:2]] == _PUBLISHED_SIZE for index_of in index], rows.index, dtype=bool)
    rows.insert(4, "choice", [plan.variants[variant].get(step, "") for *_, variant, step in index])
    rows["published_seconds"] = shown(theirs.to_frame())
    rows["ratio"] = (theirs / rows["seconds"].where(rows["seconds"] > 0)).where(of_size)
    sections = []
    for (dataset, scene), found in rows.groupby(["dataset", "scene"], sort=False):
        totals = found[found["stage"] == "total"].set_index("variant")
        seconds = found.pivot(index="variant", columns="stage", values="seconds").loc[totals.index]
        cells = shown(seconds.join(totals[["ratio", "peak_memory_mb"]]).reset_index())
        took = {step: f"{seconds:.2f}" for step, seconds in paper.items()}
        printed = pd.DataFrame([{"variant": "paper, as published"} | took])
        cells = pd.concat([cells, printed], ignore_index=True).fillna("")
        sections.append(section(f"{dataset}/{scene}", heads, cells, rows=[*[""] * len(totals), Kind.PUBLISHED]))
    return Table(
        "Run time per stage",
        "Wall-clock seconds of each stage's process, reading and writing included, on the machine that ran it; in the "
        "first run after an installation, the first stages also compiled their kernels. Variants that begin alike "
        "share their first stages: such a stage is listed with each of them, but ran once. A stage that hands its maps "
        "on (choice `none`) is no process and has no time. Published: the paper's averages for 512x512 pixels and 9x9 "
        "views on an Intel Core i7-8700, nothing in parallel; published / this code is how many times the total of "
        "this code's `paper` fits into theirs, for scenes of that size only; the machines differ.",
        rows,
        sections,
    )
