"""Tables of the rendered scenes: scores of each method by property (such as gloss or noise) and by scene."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from statistics import mean, stdev

from sepi.io.scores import Scores
from sepi.report.pooled import level_of
from sepi.report.runs import Runs
from sepi.report.tabular import methods
from sepi.report.tabular.layout import Cell, Column, Kind, Record, Report, line, ranks, section
from sepi.report.tabular.methods import Method
from sepi.scoring.scores import DISCONTINUITIES, SCORES, WHOLE_MAP
from sepi.workflow.rendered_scenes import DATASET, RenderedScene, rendered_scene

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

_Figure = Callable[[Method, str, str, int], Cell]
"""Figure of a method, for a column's key, a level of noise and a seed."""


def property_table(runs: Runs, score: str) -> Report:
    """A section per level of noise, a row per method, a column per property, over the pixels of all scenes."""
    pixels = _pixels(runs)
    shown = {region: title for region, title in PROPERTIES.items() if pixels.get(region)}

    def figure(method: Method, region: str, noise: str, seed: int) -> Cell:
        scenes = [scene.name for scene in _scenes(runs) if (scene.noise, scene.seed) == (noise, seed)]
        scores = [_scores(runs, method, scene) for scene in scenes]
        if not all(scores):
            problems = {runs.external_problem(DATASET, scene, method.name) for scene in scenes}
            known = sum(map(bool, scores))
            return problems.pop() if len(problems) == 1 else f"{known} of {len(scenes)} scenes"
        if score == "q25":
            return runs.pooled_q25(method.name, level_of(noise, seed), region)
        return _pooled([found[region] for found in scores if region in found], score)

    shares = ", ".join(f"{title} {100 * pixels[region] / pixels[WHOLE_MAP]:.1f} %" for region, title in shown.items())
    return _report(
        runs,
        f"{SCORES[score]} by property",
        f"Of the pixels of all scenes together, not an average of scenes. Part of all pixels: {shares}; properties "
        "overlap. Depth steps: beside discontinuities of the ground truth; occluded: some view does not see it; alone: "
        "no other view sees it. ",
        shown,
        figure,
    )


def scene_table(runs: Runs, score: str) -> Report:
    """A section per level of noise, a row per method, a column per scene."""
    worlds = dict.fromkeys(scene.world for scene in _scenes(runs))
    heads = {world: world if world in runs.plan.choosing else f"{world} (held out)" for world in worlds}

    def figure(method: Method, world: str, noise: str, seed: int) -> Cell:
        scene = RenderedScene(world, noise, seed)
        if scene not in _scenes(runs):
            return None
        found = _scores(runs, method, scene.name)
        return found[WHOLE_MAP][score] if found else runs.external_problem(DATASET, scene.name, method.name)

    return _report(runs, f"{SCORES[score]} by scene", "", heads, figure)


def _report(runs: Runs, title: str, caption: str, heads: Mapping[str, str], figure: _Figure) -> Report:
    every = [m for m in methods.compared_methods(runs.plan) if m.is_here]
    rows = [m for m in every if m.kind == Kind.OURS or methods.has_column(runs, DATASET, m.name)]
    levels: dict[str, set[int]] = {}
    for scene in _scenes(runs):
        levels.setdefault(scene.noise, set()).add(scene.seed)
    columns = {"method": Column("method", Kind.TEXT), **{key: Column(head, Kind.OURS) for key, head in heads.items()}}
    records: list[Record] = []
    sections = []
    for noise, seeds in levels.items():
        cells = {
            m.key: {key: _over_seeds([figure(m, key, noise, s) for s in sorted(seeds)]) for key in heads} for m in rows
        }
        marks = {
            key: ranks({m.key: value for m in rows if isinstance(value := cells[m.key][key][0], float) and m.learning})
            for key in heads
        }
        lines = []
        for m in rows:
            record: dict[str, Cell] = {"noise": noise, "seeds": len(seeds), "method": m.name}
            for key, (value, spread) in cells[m.key].items():
                record |= {key: value, f"{key}_sd": spread}
            records.append(record)
            notes = {key: f"± {spread:.2f}" for key, (_, spread) in cells[m.key].items() if spread is not None}
            own_marks = {key: marks[key].get(m.key) for key in heads}
            lines.append(line(columns, {**record, "method": m.head}, m.kind, marks=own_marks, notes=notes))
        over = f", {len(seeds)} seeds: mean (± standard deviation)" if len(seeds) > 1 else ""
        sections.append(section(f"Noise {noise}{over}", columns, lines))
    spreads = [f"{key}_sd" for key in heads] if any(len(seeds) > 1 for seeds in levels.values()) else []
    return Report(
        title,
        f"{methods.PROTOCOL_NOTE} {caption}{split_note(runs)}"
        + (f" {methods.EXTERNAL_NOTE}" if runs.plan.external else ""),
        ["noise", "seeds", "method", *heads, *spreads],
        records,
        sections,
        "Marked: best and second best in a column, of what is computed here",
    )


def split_note(runs: Runs) -> str:
    """Sentence on the scenes on which parameters may be chosen."""
    worlds = dict.fromkeys(scene.world for scene in _scenes(runs))
    parts = (("For choosing parameters", True), ("held out from that", False))
    named = [(title, [world for world in worlds if (world in runs.plan.choosing) == chosen]) for title, chosen in parts]
    return "; ".join(f"{title}: {', '.join(names)}" for title, names in named if names) + "."


def _scenes(runs: Runs) -> list[RenderedScene]:
    return [rendered_scene(name) for name in runs.plan.scenes[DATASET]]


def _scores(runs: Runs, method: Method, scene: str) -> Mapping[str, Scores]:
    """Region to scores of a method's final map; empty without a map."""
    of = runs.scores if method.kind == Kind.OURS else runs.external_scores
    return of(DATASET, scene, method.name).get("paper", {})


def _pixels(runs: Runs) -> dict[str, float]:
    """Number of pixels of each region in all scenes of one level of noise."""
    found: dict[str, float] = {}
    first = _scenes(runs)[0]
    for scene in _scenes(runs):
        if (scene.noise, scene.seed) == (first.noise, first.seed):
            for region, scores in runs.scores(DATASET, scene.name, runs.plan.compared[0])["paper"].items():
                found[region] = found.get(region, 0) + scores["pixels"]
    return found


def _pooled(scores: Sequence[Scores], score: str) -> float:
    """Mean of a score over the pixels of several maps; the squared error counts finite estimates only."""
    weights = [one["pixels"] - (one["non_finite"] if score == "mse100" else 0) for one in scores]
    known = [(one[score], weight) for one, weight in zip(scores, weights, strict=True) if weight]
    return sum(value * weight for value, weight in known) / sum(weights) if known else math.nan


def _over_seeds(figures: Sequence[Cell]) -> tuple[Cell, float | None]:
    """Mean and standard deviation over seeds (None for one seed); a text in place of a missing figure."""
    known = [figure for figure in figures if isinstance(figure, float)]
    if len(known) < len(figures):
        return next((figure for figure in figures if not isinstance(figure, float)), None), None
    return mean(known), stdev(known) if len(known) > 1 else None
