"""Q25 pooled over scenes: the error that a quarter of all their pixels stay below."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import numpy as np

from sepi.io.scores import Evaluation, read_evaluations, read_external
from sepi.report.plan import Plan
from sepi.scoring.scores import WHOLE_MAP
from sepi.workflow.rendered_scenes import DATASET, rendered_scene

Pooled = dict[str, dict[str, dict[str, float]]]
"""Method to level of noise and seed, such as ``low 1``, to region to Q25 x100."""


def pooled_q25(plan: Plan) -> Pooled:
    """Q25 x100 of the final maps over the pixels of all rendered scenes of a level of noise, by region."""
    levels: dict[str, list[str]] = {}
    for scene in plan.scenes.get(DATASET, ()):
        found = rendered_scene(scene)
        levels.setdefault(level_of(found.noise, found.seed), []).append(scene)
    last = plan.stages[-1]
    pooled: Pooled = {}
    for level, scenes in levels.items():
        for variant in plan.compared:
            key = plan.stage_key(variant, last)
            found_of = (read_evaluations(plan.scores_file(DATASET, scene), [key])[key] for scene in scenes)
            pooled.setdefault(variant, {})[level] = _quarters(found_of)
        maps = [read_external(plan.external_file(DATASET, scene)) for scene in scenes] if plan.external else []
        for method in plan.external:
            pooled.setdefault(method, {})[level] = _quarters(found[method].evaluation for found in maps)
    return pooled


def level_of(noise: str, seed: int) -> str:
    """Name of a level of noise and a seed."""
    return f"{noise} {seed}"


def _quarters(evaluations: Iterable[Evaluation]) -> dict[str, float]:
    """Q25 x100 over the pixels of several maps, by region."""
    errors: dict[str, list[np.ndarray]] = {}
    counts: dict[str, int] = {}
    for found in evaluations:
        for region, scores in found.scores.get("paper", {}).items():
            assert found.error is not None
            error = np.abs(found.error) if region == WHOLE_MAP else np.abs(found.error[found.regions[region]])
            errors.setdefault(region, []).append(error[np.isfinite(error)])
            counts[region] = counts.get(region, 0) + int(scores["pixels"])
    return {region: _quarter(parts, counts[region]) for region, parts in errors.items()}


def _quarter(errors: Sequence[np.ndarray], pixels: int) -> float:
    """Q25 as in :func:`sepi.scoring.scores.score`; errors that are not finite are the largest."""
    known = np.concatenate(errors)
    place = pixels // 4
    return 100 * float(np.partition(known, place)[place]) if place < known.size else float("nan")
