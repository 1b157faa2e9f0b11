"""Tables of the rendered scenes by property (such as gloss or noise) and by scene; table of the error bars.

Error bars: coverage and width of the intervals, and ranking of errors by the confidence
(:mod:`sepi.scoring.error_bars`).
"""

from __future__ import annotations

import itertools
from collections.abc import Mapping

import pandas as pd

from sepi.report.numbers import level_of
from sepi.report.plan import BEST_VARIANT, FAST_VARIANT, MAIN_VARIANT
from sepi.report.runs import EXTERNAL_NOTE, PROTOCOL_NOTE, Runs, own_key, weighted_means
from sepi.report.table import Head, Kind, Section, Table, ranks, section, shown
from sepi.scoring.error_bars import ERROR_BAR_SCORES
from sepi.scoring.scores import DISCONTINUITIES, SCORES, WHOLE_MAP
from sepi.workflow.rendered_scenes import DATASET, rendered_scene

PROPERTIES = {
    "textured": "textured",
    "textureless": "plain",
    **{name: name for name in ("glossy", "mirror", "glass", "thin")},
    DISCONTINUITIES: "depth steps",
    "occluded": "occluded",
    "alone": "alone",
    WHOLE_MAP: "whole",
}
"""Region to its name in the tables, in their order."""


_LEVEL = ["noise", "seed", "method"]


def property_table(runs: Runs, score: str) -> Table:
    """A section per level of noise, a row per method, a column per property, over the pixels of all scenes."""
    found = _final(runs)
    scenes, together = found[found["world"] != ""], found[found["world"] == ""]
    pixels = scenes[(scenes[_LEVEL] == scenes[_LEVEL].iloc[0]).all(axis=1)].groupby("region")["pixels"].sum()
    titles = {region: title for region, title in PROPERTIES.items() if pixels.get(region)}
    # the squared error counts finite estimates only
    counted = scenes["pixels"] - (scenes["non_finite"] if score == "mse100" else 0)
    by = [scenes[name] for name in (*_LEVEL, "region")]
    figures = weighted_means(scenes[[score]], counted, by)
    if score == "q25":
        figures = together.set_index([*_LEVEL, "region"])
    shares = ", ".join(f"{title} {100 * pixels[region] / pixels[WHOLE_MAP]:.1f} %" for region, title in titles.items())
    return _table(
        runs,
        f"{SCORES[score]} by property",
        f"Of the pixels of all scenes together, not an average of scenes. Part of all pixels: {shares}; properties "
        "overlap. Depth steps: beside discontinuities of the ground truth; occluded: some view does not see it; alone: "
        "no other view sees it. ",
        titles,
        figures[score].unstack("region"),
    )


def scene_table(runs: Runs, score: str) -> Table:
    """A section per level of noise, a row per method, a column per scene."""
    found = _final(runs)
    heads = {name: name if name in runs.plan.choosing else f"{name} (held out)" for name in _worlds(runs)}
    found = found[(found["region"] == WHOLE_MAP) & (found["world"] != "")]
    figures = found.set_index([*_LEVEL, "world"])[score].unstack("world")
    return _table(runs, f"{SCORES[score]} by scene", "", heads, figures, by_scene=True)


def _table(
    runs: Runs, title: str, caption: str, titles: Mapping[str, str], figures: pd.DataFrame, by_scene: bool = False
) -> Table:
    """The table of figures with rows noise, seed and method, and columns that have these titles."""
    known = pd.concat([runs.methods[runs.methods["kind"] == Kind.OURS], runs.external_of(DATASET)])
    scenes = {name: rendered_scene(name) for name in runs.plan.scenes[DATASET]}
    heads = {"method": Head("method", Kind.TEXT), **{key: Head(head, Kind.OURS) for key, head in titles.items()}}
    rows, sections = [], []
    for noise in dict.fromkeys(scene.noise for scene in scenes.values()):
        seeds = sorted({scene.seed for scene in scenes.values() if scene.noise == noise})
        every = pd.MultiIndex.from_product([[noise], seeds, known.index], names=_LEVEL)
        of_seeds = figures.reindex(index=every, columns=[*titles]).groupby("method", sort=False)
        means = of_seeds.agg(lambda column: column.mean(skipna=False))
        problems = pd.DataFrame("", means.index, means.columns)
        for column, seed in itertools.product(titles, reversed(seeds)):
            alike = [name for name, one in scenes.items() if one[1:] == (noise, seed)]
            told = runs.problems(DATASET, [one for one in alike if not by_scene or scenes[one].world == column])
            problems[column] = problems[column].mask(told[known.index] != "", told)
        spreads = of_seeds.std().where((problems == "") & means.notna())
        cells = means.astype(object).where(means.notna(), "" if by_scene else "n/a").where(problems == "", problems)
        rows.append(cells.join(spreads.add_suffix("_sd")).assign(noise=noise, seeds=len(seeds), method=known["name"]))
        over = f", {len(seeds)} seeds: mean (± standard deviation)" if len(seeds) > 1 else ""
        marks, notes = ranks(cells[known["learning"] != ""]), shown(spreads).map(lambda text: text and f"± {text}")
        cells = cells.assign(method=known["head"])
        sections.append(section(f"Noise {noise}{over}", heads, cells, marks, notes, list(known["kind"])))
    # one seed has no spread
    table = pd.concat(rows)[["noise", "seeds", "method", *titles, *(f"{key}_sd" for key in titles)]]
    table = table if (table["seeds"] > 1).any() else table.drop(columns=[f"{key}_sd" for key in titles])
    return Table(
        title,
        f"{PROTOCOL_NOTE} {caption}{split_note(runs)}" + (f" {EXTERNAL_NOTE}" if runs.plan.external else ""),
        table,
        sections,
        "Marked: best and second best in a column, of what is computed here",
    )


def split_note(runs: Runs) -> str:
    """Sentence on the scenes on which parameters may be chosen."""
    parts = (("For choosing parameters", True), ("held out from that", False))
    named = {title: [one for one in _worlds(runs) if (one in runs.plan.choosing) == kept] for title, kept in parts}
    return "; ".join(f"{title}: {', '.join(names)}" for title, names in named.items() if names) + "."


def _worlds(runs: Runs) -> list[str]:
    """Rendered scenes, without their noise."""
    return list(dict.fromkeys(rendered_scene(name).world for name in runs.plan.scenes[DATASET]))


def _final(runs: Runs) -> pd.DataFrame:
    """Scores of the final maps of each scene, and of all of the same noise together, which have no world."""
    names = {name: rendered_scene(name) for name in runs.plan.scenes[DATASET]}
    names |= {level_of(name): scene._replace(world="") for name, scene in names.items()}
    found = runs.final.loc[[DATASET]].reset_index()
    parsed = pd.DataFrame(found["scene"].map(names).tolist(), columns=["world", "noise", "seed"])
    return pd.concat([found, parsed], axis=1)


_HEADS = {
    "title": Head("scene", Kind.TEXT),
    "variant": Head("variant", Kind.TEXT),
    **{name: Head(head) for name, head in ERROR_BAR_SCORES.items()},
}


def variants_with_bars(runs: Runs) -> list[str]:
    """Those of ``best``, ``fast`` and ``paper`` whose final maps have error bars."""
    named = [name for name in (BEST_VARIANT, FAST_VARIANT, MAIN_VARIANT) if name in runs.plan.variants]
    found = runs.final["width"].groupby("method").count()
    return [name for name in named if found.get(own_key(name), 0)]


def error_bar_table(runs: Runs) -> Table:
    """Scores of error bars by scene; then coverage and width by region, of the first variant."""
    variants = variants_with_bars(runs)
    rows = pd.concat([_rows(runs, variant) for variant in variants] or [_rows(runs, MAIN_VARIANT).iloc[:0]])
    # widths are hundredths of a pixel or less
    texts = shown(rows, missing="n/a").assign(width=shown(rows[["width"]], 4, "n/a"))
    whole = texts[texts["region"] == WHOLE_MAP]
    whole = whole.sort_values("title", key=lambda titles: pd.factorize(titles)[0], kind="stable")
    return Table(
        "Error bars",
        f"{PROTOCOL_NOTE} Coverage: how often the interval of 90 % holds the ground truth; width: its median in pixels "
        "per view step, without which coverage says nothing. NLL: mean negative log likelihood of the errors, in nats, "
        "under normal distributions of the standard deviations that were said. AUSE: mean absolute error of the "
        "pixels that are left while those of largest standard deviation, or least confidence, are taken away, minus "
        "that in the order of the errors, divided by the error of all pixels; 0 is best. Confidence's gap: the "
        "confidence says with which probability the error is at most 0.07 (for 9x9 views); the largest difference to "
        "the share found in a tenth of 0 to 1. All scenes: coverage, NLL and gap of all pixels together; "
        "means of width and AUSE, by pixels." + (f" {split_note(runs)}" if runs.plan.report == DATASET else ""),
        rows[["dataset", "scene", "variant", "region", "pixels", *ERROR_BAR_SCORES]],
        [section("", _HEADS, whole), *(_region_section(texts, variant) for variant in variants[:1])],
    )


def _rows(runs: Runs, variant: str) -> pd.DataFrame:
    """Rows of the CSV file: each scene and region, then all scenes of each level of noise together."""
    found = runs.final[runs.final.index.get_level_values("method") == own_key(variant)].reset_index()
    found = found.set_index(["dataset", "scene"]).loc[runs.scored_pairs].reset_index()
    found = found[["dataset", "scene", "region", "pixels", *ERROR_BAR_SCORES]]
    found["title"] = found["dataset"] + "/" + found["scene"]
    levels = [
        f"all scenes, noise {rendered_scene(scene).noise}" if dataset == DATASET else "all scenes"
        for dataset, scene in zip(found["dataset"], found["scene"], strict=True)
    ]
    parts = [found]
    for level, of_level in found.groupby(levels, sort=False):
        pairs = list(dict.fromkeys(zip(of_level["dataset"], of_level["scene"], strict=True)))
        if len(pairs) > 1:
            pooled = weighted_means(of_level[[*ERROR_BAR_SCORES]], of_level["pixels"], of_level["region"]).reset_index()
            # not a mean
            gap = runs.reliability(variant, pairs).gap
            pooled["gap"] = [gap if region == WHOLE_MAP else None for region in pooled["region"]]
            parts.append(pooled.assign(scene=level, title=level))
    return pd.concat(parts, ignore_index=True).assign(variant=variant).astype({"pixels": "Int64"})


def _region_section(texts: pd.DataFrame, variant: str) -> Section:
    """A section with a row for each scene: coverage and width of each region."""
    own = texts[texts["variant"] == variant]
    regions, titles = (list(dict.fromkeys(own[name])) for name in ("region", "title"))
    cells = own.pivot(index="title", columns="region", values=["coverage", "width"]).reindex(titles).fillna("")
    cells.columns = [f"{region} {name}" for name, region in cells.columns]
    every = itertools.product(regions, ("coverage", "width"))
    heads = {f"{region} {name}": Head(f"{region}, {ERROR_BAR_SCORES[name]}") for region, name in every}
    return section(f"Regions, variant {variant}", {"title": _HEADS["title"], **heads}, cells.reset_index())
