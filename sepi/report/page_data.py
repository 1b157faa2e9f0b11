"""Contents of the page apart from the tables: headline figures, ablation, times, provenance."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

from sepi.report import published
from sepi.report.comparison import mean_by_region
from sepi.report.runs import Runs, count_note, datasets_of, own_key
from sepi.scoring.scores import REGIONS, WHOLE_MAP


def headline(runs: Runs) -> list[dict[str, Any]]:
    """Our figures beside the published ones for the paper's scenes, then averages over the other scenes.

    Returns
    -------
    list of dict
        ``scene``; ``published``: MSE x100 and Q25 x100; ``ours``: variant to the same two; ``notes``: variant to the
        number of scenes, if lower than in the row.
    """

    def ours(dataset: str, scenes: list[str]) -> dict[str, Any]:
        found = [runs.of(score, dataset).loc[scenes] for score in ("mse100", "q25")]
        keys = {variant: own_key(variant) for variant in runs.plan.compared}
        return {
            "ours": {variant: [_known(one[key].mean()) for one in found] for variant, key in keys.items()},
            "notes": {v: count_note([int(one[key].count()) for one in found], len(scenes)) for v, key in keys.items()},
        }

    rows: list[dict[str, Any]] = []
    for dataset in published.DATASETS:
        for scene in runs.scored(dataset):
            name = published.paper_scene(dataset, scene)
            if name is not None:
                tables = (published.table1(), published.table2())
                theirs = [_known(table.at[(dataset, name), published.PAPERS_METHOD]) for table in tables]
                rows.append({"scene": f"{dataset}/{scene}", "published": theirs, **ours(dataset, [scene])})
    for dataset in runs.plan.scenes:
        others = [scene for scene in runs.scored(dataset) if published.paper_scene(dataset, scene) is None]
        if others:
            title = f"{dataset}, average of {len(others)}" if len(others) > 1 else f"{dataset}/{others[0]}"
            rows.append({"scene": title, "published": [None, None], **ours(dataset, others)})
    return rows


def missing_scenes(runs: Runs) -> dict[str, list[str]]:
    """Scenes of the paper that are not available, by dataset."""
    found = {}
    for dataset in published.DATASETS:
        here = {published.paper_scene(dataset, scene) for scene in runs.plan.scenes.get(dataset, ())}
        found[dataset] = [scene for scene in published.scenes(dataset) if scene not in here]
    return found


@dataclass(frozen=True)
class Bar:
    """MSE x100 of a variant (None if not available), with a note if ours is over fewer scenes than the group's."""

    variant: str
    ours: float | None
    published: float | None = None
    note: str = ""


@dataclass(frozen=True)
class BarGroup:
    """Bars with one scale.

    Attributes
    ----------
    dataset, region : str
        Dataset and region of the figures.
    scenes, available : int
        Number of scenes in our averages, and number available; not all have each region.
    rows : list of Bar
    """

    dataset: str
    region: str
    scenes: int
    available: int
    rows: list[Bar]

    @property
    def over(self) -> str:
        """Text on the scenes in our averages; empty if there is one scene or none."""
        if self.scenes in (0, self.available):
            return f"{self.scenes} scenes" if self.scenes > 1 else ""
        return f"{self.scenes} of {self.available} scenes"

    @property
    def figures(self) -> list[float]:
        """All figures that are available."""
        return [figure for row in self.rows for figure in (row.ours, row.published) if figure is not None]

    @property
    def largest(self) -> float:
        """The largest figure; 1 if all are zero."""
        return max(self.figures) or 1.0


def ablation_bars(runs: Runs) -> list[BarGroup]:
    """Average MSE x100 of each listed variant beside the published one, a group per dataset and region."""
    groups = []
    variants = list(runs.plan.variants)
    for dataset in datasets_of(runs.plan):
        means, counts = mean_by_region(runs, dataset, variants)
        in_paper = published.table4().loc[dataset] if dataset in published.DATASETS else published.table4().iloc[:0]
        theirs = in_paper.reindex(variants)
        for region in REGIONS:
            most = int(counts.loc[region].max())
            rows = [
                Bar(v, _known(mean), _known(theirs.at[v, region]), count_note([int(counts.at[region, v])], most))
                for v, mean in means.loc[region].items()
            ]
            title = "whole map" if region == WHOLE_MAP else region
            groups.append(BarGroup(dataset, title, most, len(runs.scored(dataset)), rows))
    return [group for group in groups if group.figures]


def part_bars(parts: Runs) -> list[BarGroup]:
    """MSE x100 of the variants in the ablation of ``best``, a group per scene."""
    found = {pair: parts.of("mse100", pair[0]).loc[pair[1]] for pair in parts.scored_pairs}
    return [
        BarGroup("/".join(pair), "whole map", 1, 1, [Bar(v, _known(errors[own_key(v)])) for v in parts.plan.variants])
        for pair, errors in found.items()
    ]


@dataclass(frozen=True)
class StageTimes:
    """Seconds and peak memory in MB of a variant on a scene, by stage."""

    scene: str
    variant: str
    seconds: dict[str, float]
    memory: dict[str, float]

    @property
    def total(self) -> float:
        """Seconds of all stages."""
        return sum(self.seconds.values())

    @property
    def peak(self) -> float:
        """Peak memory of the largest stage, MB."""
        return max(self.memory.values())


def stage_times(runs: Runs) -> list[StageTimes]:
    """Seconds and memory of the compared variants' stages, per scene."""
    rows = []
    for pair in runs.plan.pairs:
        for variant in runs.plan.compared:
            took = runs.took(pair, variant).fillna(0.0)
            rows.append(
                StageTimes("/".join(pair), variant, took["seconds"].to_dict(), took["peak_memory_mb"].to_dict())
            )
    return rows


def total_seconds(*reports: Runs) -> float:
    """Total seconds of all stages in these numbers, each counted once."""
    seconds = {
        (row.dataset, row.scene, runs.plan.stage_key(row.variant, row.stage)): row.value
        for runs in reports
        for row in runs.numbers[runs.numbers["score"] == "seconds"].itertuples()
    }
    return float(sum(seconds.values()))


def parameter_rows(runs: Runs) -> list[tuple[str, list[tuple[str, Any]]]]:
    """Stage and choice with its parameters; repeated if scenes have different ones."""
    return [
        (
            f"{stage}: {choice}",
            [(name, "by range and grid" if value is None else value) for name, value in values.items()],
        )
        for stage, choices in runs.facts["parameters"].items()
        for choice, found in choices.items()
        for values in found
    ]


def shown_variants(runs: Runs, parts: Runs | None) -> dict[str, dict[str, str]]:
    """Variants with figures on the page, and their choices of stages."""
    found = {**runs.plan.variants, **({} if parts is None else parts.plan.variants)}
    return {name: dict(choices) for name, choices in found.items()}


def first_scene(runs: Runs) -> str:
    """The scene to show first: one of the paper's, else the last one, by the order of built-in scenes."""
    known = [pair for pair in runs.plan.pairs if published.paper_scene(*pair) is not None]
    return "/".join(known[0] if known else runs.plan.pairs[-1])


def _known(figure: float) -> float | None:
    return None if math.isnan(figure) else float(figure)
