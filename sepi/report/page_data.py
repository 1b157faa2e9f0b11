"""What the page shows beside the tables, from the numbers: headline figures, ablation, times, provenance."""

from __future__ import annotations

import math
from collections.abc import Iterable
from typing import Any

from sepi.evaluate import REGIONS, WHOLE_MAP
from sepi.report import published
from sepi.report.runs import Numbers, Runs

_METHOD_OF_THE_PAPER = "zhou"

# a stage of 0.00 s would have no bar at all
_LEAST_SHARE = 0.3


def headline(runs: Runs) -> list[dict[str, Any]]:
    """Scenes that the paper has too: our figures beside the published ones.

    Returns
    -------
    list of dict
        ``scene``; ``published``: MSE x100 and Q25 x100; ``ours``: variant to the same two.
    """
    rows = []
    for dataset in published.DATASETS:
        for scene in runs.scored(dataset):
            name = published.paper_scene(dataset, scene)
            if name is None:
                continue
            theirs = [
                table.cells[dataset, name].get(_METHOD_OF_THE_PAPER)
                for table in (published.table1(), published.table2())
            ]
            ours = {
                variant: [runs.final(dataset, scene, score, variant=variant) for score in ("mse100", "q25")]
                for variant in runs.plan.compared
            }
            rows.append({"scene": f"{dataset}/{scene}", "published": theirs, "ours": ours})
    return rows


def missing_scenes(runs: Runs) -> dict[str, list[str]]:
    """Scenes of the paper that are not at hand, by data set."""
    found = {}
    for dataset in published.DATASETS:
        here = {published.paper_scene(dataset, scene) for scene in runs.plan.scenes.get(dataset, ())}
        found[dataset] = [scene for scene in published.table1().scenes(dataset) if scene not in here]
    return found


def ablation_bars(runs: Runs) -> list[dict[str, Any]]:
    """Average MSE x100 of every listed variant beside the published one, a group per data set and region.

    Returns
    -------
    list of dict
        ``dataset``, ``region``, ``scenes`` (how many are averaged), ``largest``, and ``rows``: ``variant``, ``ours``,
        ``published``; None where there is no figure.
    """
    groups = []
    for dataset in dict.fromkeys([*published.DATASETS, *runs.plan.scenes]):
        scenes = runs.scored(dataset)
        theirs = published.table4().get(dataset, {})
        for region in REGIONS:
            rows = [
                {
                    "variant": variant,
                    "ours": _mean(runs.final(dataset, scene, "mse100", region, variant) for scene in scenes),
                    "published": _published(theirs.get(variant), region),
                }
                for variant in runs.plan.listed
            ]
            figures = [row[key] for row in rows for key in ("ours", "published")]
            known = [figure for figure in figures if isinstance(figure, float)]
            if known:
                groups.append(
                    {
                        "dataset": dataset,
                        "region": "whole map" if region == WHOLE_MAP else region,
                        "scenes": len(scenes),
                        "largest": max(known),
                        "rows": rows,
                    }
                )
    return groups


def part_bars(parts: Runs) -> list[dict[str, Any]]:
    """MSE x100 of the best variant and of those with a part of it switched off, a group per scene."""
    groups = []
    for dataset, scene in parts.plan.pairs:
        if not parts.plan.parts or not parts.scores(dataset, scene, parts.plan.parts[0]):
            continue
        rows = [
            {"variant": variant, "ours": parts.final(dataset, scene, "mse100", variant=variant), "published": None}
            for variant in parts.plan.parts
        ]
        largest = max(row["ours"] for row in rows)
        groups.append(
            {"dataset": f"{dataset}/{scene}", "region": "whole map", "scenes": 1, "largest": largest, "rows": rows}
        )
    return groups


def stage_times(runs: Runs) -> list[dict[str, Any]]:
    """What every stage of the compared variants took, per scene.

    Returns
    -------
    list of dict
        ``scene``, ``variant``, ``total`` seconds, ``peak`` MB, and ``stages``: ``stage``, ``seconds``, ``memory`` and
        ``share`` of the longest total in percent.
    """
    rows = []
    for dataset, scene in runs.plan.pairs:
        for variant in runs.plan.compared:
            timings = {stage: runs.timing(dataset, scene, variant, stage) for stage in runs.plan.stages}
            rows.append(
                {
                    "scene": f"{dataset}/{scene}",
                    "variant": variant,
                    "total": sum(timing.seconds for timing in timings.values()),
                    "peak": max(timing.peak_memory_mb for timing in timings.values()),
                    "stages": [
                        {"stage": stage, "seconds": timing.seconds, "memory": timing.peak_memory_mb}
                        for stage, timing in timings.items()
                    ],
                }
            )
    longest = max((row["total"] for row in rows), default=1.0) or 1.0
    largest = max((row["peak"] for row in rows), default=1.0) or 1.0
    for row in rows:
        row["peak_share"] = 100 * row["peak"] / largest
        for stage in row["stages"]:
            stage["share"] = max(_LEAST_SHARE, 100 * stage["seconds"] / longest)
            stage["memory_share"] = max(_LEAST_SHARE, 100 * stage["memory"] / largest)
    return rows


def total_seconds(numbers: Numbers) -> float:
    """Seconds of all stage processes, each once."""
    return float(sum(stage["seconds"] for scene in numbers["scenes"] for stage in scene["stages"].values()))


def parameter_rows(numbers: Numbers) -> list[tuple[str, list[tuple[str, Any]]]]:
    """Stage and choice, and its parameters."""
    return [
        (f"{stage}: {choice}", list(values.items()))
        for stage, choices in numbers["parameters"].items()
        for choice, values in choices.items()
    ]


def shown_variants(runs: Runs, parts: Numbers | None) -> dict[str, dict[str, str]]:
    """Variants that the page has figures of, and their choice for each stage."""
    names = [*runs.plan.listed, *(runs.plan.parts if parts is not None else ())]
    return {name: dict(runs.plan.variants[name]) for name in dict.fromkeys(names)}


def first_scene(runs: Runs) -> str:
    """The scene that is shown first: one that the paper has, else the last, the built-in ones being ordered so."""
    known = [pair for pair in runs.plan.pairs if published.paper_scene(*pair) is not None]
    return "/".join(known[0] if known else runs.plan.pairs[-1])


def _published(figures: published.Regions | None, region: str) -> float | None:
    if figures is None:
        return None
    name = "overall" if region == WHOLE_MAP else region
    found: float | None = getattr(figures, name)
    return found


def _mean(values: Iterable[float]) -> float | None:
    known = [value for value in values if not math.isnan(value)]
    return sum(known) / len(known) if known else None
