"""Tables of the rendered scenes: scores of each method by property (such as gloss or noise) and by scene."""

from __future__ import annotations

import itertools
from collections.abc import Mapping

import pandas as pd

from sepi.report.pooled import level_of
from sepi.report.runs import Runs, weighted_means
from sepi.report.tabular import methods
from sepi.report.tabular.table import Head, Kind, Table, ranks, section, shown
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
    first = scenes[(scenes[_LEVEL] == scenes[_LEVEL].iloc[0]).all(axis=1)]
    pixels = first.groupby("region")["pixels"].sum()
    titles = {region: title for region, title in PROPERTIES.items() if pixels.get(region)}
    # the squared error counts finite estimates only
    counted = scenes["pixels"] - (scenes["non_finite"] if score == "mse100" else 0)
    by = [scenes[name] for name in (*_LEVEL, "region")]
    figures = (
        together.set_index([*_LEVEL, "region"]) if score == "q25" else weighted_means(scenes[[score]], counted, by)
    )
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
    known = runs.methods[runs.methods["kind"].isin([Kind.OURS, Kind.EXTERNAL])]
    shows = [kind == Kind.OURS or runs.has_column(DATASET, name) for name, kind in known[["name", "kind"]].to_numpy()]
    known = known[shows]
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
        texts, precise = (shown(means, n, "" if by_scene else "n/a").where(problems == "", problems) for n in (2, 4))
        rows.append(precise.join(spreads.add_suffix("_sd")).assign(noise=noise, seeds=len(seeds), method=known["name"]))
        over = f", {len(seeds)} seeds: mean (± standard deviation)" if len(seeds) > 1 else ""
        cells, marks = texts.assign(method=known["head"]), ranks(texts[known["learning"] != ""])
        notes = shown(spreads).map(lambda text: text and f"± {text}")
        sections.append(section(f"Noise {noise}{over}", heads, cells, marks, notes, list(known["kind"])))
    # one seed has no spread
    table = pd.concat(rows)[["noise", "seeds", "method", *titles, *(f"{key}_sd" for key in titles)]]
    table = table if (table["seeds"] > 1).any() else table.drop(columns=[f"{key}_sd" for key in titles])
    return Table(
        title,
        f"{methods.PROTOCOL_NOTE} {caption}{split_note(runs)}"
        + (f" {methods.EXTERNAL_NOTE}" if runs.plan.external else ""),
        table,
        sections,
        "Marked: best and second best in a column, of what is computed here",
    )


def split_note(runs: Runs) -> str:
    """Sentence on the scenes on which parameters may be chosen."""
    parts = (("For choosing parameters", True), ("held out from that", False))
    named = [
        (title, [one for one in _worlds(runs) if (one in runs.plan.choosing) == chosen]) for title, chosen in parts
    ]
    return "; ".join(f"{title}: {', '.join(names)}" for title, names in named if names) + "."


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
