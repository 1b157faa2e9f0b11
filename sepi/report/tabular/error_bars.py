"""Table of the error bars: coverage and width of the intervals, and ranking of errors by the confidence.

:mod:`sepi.scoring.error_bars` computes the scores.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from sepi.io.scores import Scores
from sepi.report.plan import BEST_VARIANT, FAST_VARIANT, MAIN_VARIANT
from sepi.report.runs import Runs
from sepi.report.tabular.layout import Cell, Column, Kind, Line, Record, Report, Section, line, section
from sepi.report.tabular.methods import PROTOCOL_NOTE
from sepi.report.tabular.properties import split_note
from sepi.scoring.error_bars import ERROR_BAR_SCORES, Reliability
from sepi.scoring.scores import WHOLE_MAP
from sepi.workflow.rendered_scenes import DATASET, rendered_scene

# widths are hundredths of a pixel or less
_DECIMALS = {"width": 4}
_COLUMNS = {
    "scene": Column("scene", Kind.TEXT),
    "variant": Column("variant", Kind.TEXT),
    **{name: Column(head, decimals=_DECIMALS.get(name, 2)) for name, head in ERROR_BAR_SCORES.items()},
}


def variants_with_bars(runs: Runs) -> list[str]:
    """Those of ``best``, ``fast`` and ``paper`` whose final maps have error bars."""
    named = [name for name in (BEST_VARIANT, FAST_VARIANT, MAIN_VARIANT) if name in runs.plan.listed]
    return [name for name in named if any("width" in whole(runs, pair, name) for pair in runs.scored_pairs())]


def whole(runs: Runs, pair: tuple[str, str], variant: str, region: str = WHOLE_MAP) -> Scores:
    """Scores of a final map by the paper's protocol; empty if the scene lacks the region."""
    return runs.scores(*pair, variant)["paper"].get(region, {})


def error_bar_table(runs: Runs) -> Report:
    """Scores of error bars by scene; then coverage and width by region, of the first variant."""
    pairs, variants = runs.scored_pairs(), variants_with_bars(runs)
    records = _records(runs, pairs, variants)
    sections = [section("", _COLUMNS, _scene_lines(records, variants))]
    return Report(
        "Error bars",
        f"{PROTOCOL_NOTE} Coverage: how often the interval of 90 % holds the ground truth; width: its median in pixels "
        "per view step, without which coverage says nothing. NLL: mean negative log likelihood of the errors, in nats, "
        "under normal distributions of the standard deviations that were said. AUSE: mean absolute error of the "
        "pixels that are left while those of largest standard deviation, or least confidence, are taken away, minus "
        "that in the order of the errors, divided by the error of all pixels; 0 is best. Confidence's gap: the "
        "confidence says with which probability the error is at most 0.07 (for 9x9 views); the largest difference to "
        "the share found in a tenth of 0 to 1. All scenes: coverage, NLL and gap of all pixels together; "
        "means of width and AUSE, by pixels." + (f" {split_note(runs)}" if runs.plan.report == DATASET else ""),
        ["dataset", "scene", "variant", "region", "pixels", *ERROR_BAR_SCORES],
        records,
        [*sections, *(_region_section(records, variant) for variant in variants[:1])],
    )


def _records(runs: Runs, pairs: Sequence[tuple[str, str]], variants: Sequence[str]) -> list[Record]:
    """Rows of the CSV file: each scene, variant and region, then all scenes of each level of noise together."""
    records: list[Record] = []
    levels: dict[str, list[tuple[str, str]]] = {}
    for pair in pairs:
        levels.setdefault(_together(*pair), []).append(pair)
    for variant in variants:
        by_region: dict[tuple[str, str], list[Scores]] = {}
        for dataset, scene in pairs:
            for region, scores in runs.scores(dataset, scene, variant)["paper"].items():
                about = {"dataset": dataset, "scene": scene, "variant": variant, "region": region}
                records.append({**about, **{name: scores[name] for name in ("pixels", *ERROR_BAR_SCORES)}})
                by_region.setdefault((_together(dataset, scene), region), []).append(scores)
        for (level, region), found in by_region.items():
            if len(levels[level]) > 1:
                pooled = _pooled(found)
                if region == WHOLE_MAP:
                    pooled["gap"] = pooled_reliability(runs, variant, levels[level]).gap
                records.append({"scene": level, "variant": variant, "region": region, **pooled})
    return records


def _together(dataset: str, scene: str) -> str:
    """Name of the scenes with which a scene is pooled."""
    return f"all scenes, noise {rendered_scene(scene).noise}" if dataset == DATASET else "all scenes"


def _pooled(scores: Sequence[Scores]) -> dict[str, Cell]:
    """Means over the pixels of several scenes, without the gap, which is not a mean."""
    there = [one for one in scores if one["pixels"]]
    weights = [one["pixels"] for one in there]
    found: dict[str, Cell] = {"pixels": int(sum(weights))}
    for name in ERROR_BAR_SCORES:
        if name != "gap":
            found[name] = float(np.average([one[name] for one in there], weights=weights)) if there else math.nan
    return found


def pooled_reliability(runs: Runs, variant: str, pairs: Sequence[tuple[str, str]]) -> Reliability:
    """Reliability of a variant's confidence over the pixels of several scenes together."""
    every = [runs.reliability(*pair, variant) for pair in pairs]
    pixels = np.sum([one.pixels for one in every], axis=0)
    there = np.where(pixels > 0, pixels, np.nan)
    said, found = (
        np.nansum([one.pixels * getattr(one, name) for one in every], axis=0) / there for name in ("said", "found")
    )
    return Reliability(pixels, said, found)


def _scene_lines(records: Sequence[Record], variants: Sequence[str]) -> list[Line]:
    """Lines of whole maps, with the variants of a scene one below the other."""
    shown = [record for record in records if record["region"] == WHOLE_MAP]
    rows: dict[str, list[Record]] = {}
    for record in shown:
        rows.setdefault(_title(record), []).append(record)
    return [line(_COLUMNS, {**record, "scene": title}) for title, found in rows.items() for record in found]


def _region_section(records: Sequence[Record], variant: str) -> Section:
    """A section with a row for each scene: coverage and width of each region."""
    own = [record for record in records if record["variant"] == variant]
    regions = dict.fromkeys(str(record["region"]) for record in own)
    pairs = {f"{region} {name}": (region, name) for region in regions for name in ("coverage", "width")}
    columns = {"scene": Column("scene", Kind.TEXT)}
    columns |= {
        key: replace(_COLUMNS[name], head=f"{region}, {ERROR_BAR_SCORES[name]}")
        for key, (region, name) in pairs.items()
    }
    rows: dict[str, dict[str, Cell]] = {}
    for record in own:
        row = rows.setdefault(_title(record), {"scene": _title(record)})
        row |= {f"{record['region']} {name}": record[name] for name in ("coverage", "width")}
    return section(f"Regions, variant {variant}", columns, [line(columns, row) for row in rows.values()])


def _title(record: Record) -> str:
    return f"{record['dataset']}/{record['scene']}" if "dataset" in record else str(record["scene"])
