"""Table of the error bars: coverage and width of the intervals, and ranking of errors by the confidence.

:mod:`sepi.scoring.error_bars` computes the scores.
"""

from __future__ import annotations

import pandas as pd

from sepi.report.plan import BEST_VARIANT, FAST_VARIANT, MAIN_VARIANT
from sepi.report.runs import Runs, weighted_means
from sepi.report.tabular.methods import PROTOCOL_NOTE, own_key
from sepi.report.tabular.properties import split_note
from sepi.report.tabular.table import Head, Kind, Section, Table, section, shown
from sepi.scoring.error_bars import ERROR_BAR_SCORES
from sepi.scoring.scores import WHOLE_MAP
from sepi.workflow.rendered_scenes import DATASET, rendered_scene

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
    together = whole["title"].map({title: place for place, title in enumerate(dict.fromkeys(whole["title"]))})
    whole = whole.assign(together=together).sort_values("together", kind="stable")
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
    found["level"] = [_together(*pair) for pair in zip(found["dataset"], found["scene"], strict=True)]
    found["title"] = found["dataset"] + "/" + found["scene"]
    parts = [found]
    for level, of_level in found.groupby("level", sort=False):
        pairs = list(dict.fromkeys(zip(of_level["dataset"], of_level["scene"], strict=True)))
        if len(pairs) > 1:
            pooled = weighted_means(of_level[[*ERROR_BAR_SCORES]], of_level["pixels"], of_level["region"]).reset_index()
            # not a mean
            gap = runs.reliability(variant, pairs).gap
            pooled["gap"] = [gap if region == WHOLE_MAP else None for region in pooled["region"]]
            parts.append(pooled.assign(scene=level, title=level))
    return pd.concat(parts, ignore_index=True).assign(variant=variant).astype({"pixels": "Int64"})


def _together(dataset: str, scene: str) -> str:
    """Name of the scenes with which a scene is pooled."""
    return f"all scenes, noise {rendered_scene(scene).noise}" if dataset == DATASET else "all scenes"


def _region_section(texts: pd.DataFrame, variant: str) -> Section:
    """A section with a row for each scene: coverage and width of each region."""
    own = texts[texts["variant"] == variant]
    regions, titles = (list(dict.fromkeys(own[name])) for name in ("region", "title"))
    cells = own.pivot(index="title", columns="region", values=["coverage", "width"]).reindex(titles).fillna("")
    cells.columns = [f"{region} {name}" for name, region in cells.columns]
    heads = {
        f"{region} {name}": Head(f"{region}, {ERROR_BAR_SCORES[name]}")
        for region in regions
        for name in ("coverage", "width")
    }
    return section(f"Regions, variant {variant}", {"title": _HEADS["title"], **heads}, cells.reset_index())
