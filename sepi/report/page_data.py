"""Contents of the page apart from the tables: headline figures, ablation, times, provenance."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from sepi.report import published
from sepi.report.runs import Numbers, Runs
from sepi.report.tabular.methods import Mean, average, count_note, datasets_of
from sepi.scoring.scores import REGIONS, WHOLE_MAP


def headline(runs: Runs) -> list[dict[str, Any]]:
    """Our figures beside the published ones for the paper's scenes, then averages over the other scenes.

    Returns
    -------
    list of dict
        ``scene``; ``published``: MSE x100 and Q25 x100; ``ours``: variant to the same two; ``notes``: variant to the
        number of scenes, if lower than in the row.
    """

    def ours(dataset: str, scenes: Sequence[str]) -> dict[str, Any]:
        found = {
            variant: [average(runs, dataset, scenes, score, WHOLE_MAP, variant) for score in ("mse100", "q25")]
            for variant in runs.plan.compared
        }
        return {
            "ours": {variant: [_known(mean) for mean in means] for variant, means in found.items()},
            "notes": {v: count_note([mean.scenes for mean in means], len(scenes)) for v, means in found.items()},
        }

    rows: list[dict[str, Any]] = []
    for dataset in published.DATASETS:
        for scene in runs.scored(dataset):
            name = published.paper_scene(dataset, scene)
            if name is not None:
                tables = (published.table1(), published.table2())
                theirs = [table.cells[dataset, name].get(published.PAPERS_METHOD) for table in tables]
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
        found[dataset] = [scene for scene in published.table1().scenes(dataset) if scene not in here]
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
    for dataset in datasets_of(runs.plan):
        scenes = runs.scored(dataset)
        theirs = published.table4().get(dataset, {})
        for region in REGIONS:
            means = {v: average(runs, dataset, scenes, "mse100", region, v) for v in runs.plan.listed}
            most = max((mean.scenes for mean in means.values()), default=0)
            rows = [
                Bar(v, _known(mean), theirs.get(v, {}).get(region), count_note([mean.scenes], most))
                for v, mean in means.items()
            ]
            title = "whole map" if region == WHOLE_MAP else region
            groups.append(BarGroup(dataset, title, most, len(scenes), rows))
    return [group for group in groups if group.figures]


def part_bars(parts: Runs) -> list[BarGroup]:
    """MSE x100 of the variants in the ablation of ``best``, a group per scene."""
    names = parts.plan.parts
    pairs = [pair for pair in parts.plan.pairs if names and parts.scores(*pair, names[0])]
    return [
        BarGroup(
            f"{dataset}/{scene}",
            "whole map",
            1,
            1,
            [Bar(variant, parts.final(dataset, scene, "mse100", variant=variant)) for variant in names],
        )
        for dataset, scene in pairs
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
    for dataset, scene in runs.plan.pairs:
        for variant in runs.plan.compared:
            timings = {stage: runs.timing(dataset, scene, variant, stage) for stage in runs.plan.stages}
            rows.append(
                StageTimes(
                    f"{dataset}/{scene}",
                    variant,
                    {stage: timing.seconds for stage, timing in timings.items()},
                    {stage: timing.peak_memory_mb for stage, timing in timings.items()},
                )
            )
    return rows


def total_seconds(*reports: Numbers) -> float:
    """Total seconds of all stages in these numbers, each counted once."""
    seconds = {
        (scene["dataset"], scene["scene"], key): stage["seconds"]
        for numbers in reports
        for scene in numbers["scenes"]
        for key, stage in scene["stages"].items()
    }
    return float(sum(seconds.values()))


def parameter_rows(numbers: Numbers) -> list[tuple[str, list[tuple[str, Any]]]]:
    """Stage and choice with its parameters; repeated if scenes have different ones."""
    return [
        (
            f"{stage}: {choice}",
            [(name, "by range and grid" if value is None else value) for name, value in values.items()],
        )
        for stage, choices in numbers["parameters"].items()
        for choice, found in choices.items()
        for values in found
    ]


def shown_variants(runs: Runs, parts: Numbers | None) -> dict[str, dict[str, str]]:
    """Variants with figures on the page, and their choices of stages."""
    names = [*runs.plan.listed, *(runs.plan.parts if parts is not None else ())]
    return {name: dict(runs.plan.variants[name]) for name in dict.fromkeys(names)}


def first_scene(runs: Runs) -> str:
    """The scene to show first: one of the paper's, else the last one, by the order of built-in scenes."""
    known = [pair for pair in runs.plan.pairs if published.paper_scene(*pair) is not None]
    return "/".join(known[0] if known else runs.plan.pairs[-1])


def _known(mean: Mean) -> float | None:
    return mean.value if mean.scenes and isinstance(mean.value, float) else None
