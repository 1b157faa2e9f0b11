"""Q25 pooled over scenes: the error that a quarter of all their pixels stay below."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence

import numpy as np

from sepi.io.scores import Evaluation, read_evaluations, read_external
from sepi.report.plan import Plan
from sepi.scoring.scores import WHOLE_MAP
from sepi.workflow.rendered_scenes import DATASET, rendered_scene


def pooled_q25(plan: Plan) -> Iterator[tuple[str, str, str, float]]:
    """Q25 x100 over the pixels of all rendered scenes of a level of noise: :func:`level_of`, method, region, figure."""
    levels: dict[str, list[str]] = {}
    for scene in plan.scenes[DATASET]:
        levels.setdefault(level_of(scene), []).append(scene)
    for level, scenes in levels.items():
        for variant in plan.compared:
            key = plan.stage_key(variant, plan.stages[-1])
            found_of = (read_evaluations(plan.scores_file(DATASET, scene), [key])[key] for scene in scenes)
            yield from ((level, variant, *quarter) for quarter in _quarters(found_of))
        maps = [read_external(plan.files(DATASET, scene).external) for scene in scenes] if plan.external else []
        for method in plan.external:
            yield from ((level, method, *quarter) for quarter in _quarters(found[method].evaluation for found in maps))


def level_of(scene: str) -> str:
    """Name of all rendered scenes of the noise and seed of one."""
    found = rendered_scene(scene)
    return f"all scenes, noise {found.noise}, seed {found.seed}"


def _quarters(evaluations: Iterable[Evaluation]) -> list[tuple[str, float]]:
    """Regions and Q25 x100 over the pixels of several maps."""
    errors: dict[str, list[np.ndarray]] = {}
    counts: dict[str, int] = {}
    for found in evaluations:
        for region, scores in found.scores.get("paper", {}).items():
            assert found.error is not None
            error = np.abs(found.error) if region == WHOLE_MAP else np.abs(found.error[found.regions[region]])
            errors.setdefault(region, []).append(error[np.isfinite(error)])
            counts[region] = counts.get(region, 0) + int(scores["pixels"])
    return [(region, _quarter(parts, counts[region])) for region, parts in errors.items()]


def _quarter(errors: Sequence[np.ndarray], pixels: int) -> float:
    """Q25 as in :func:`sepi.scoring.scores.score`; errors that are not finite are the largest."""
    known = np.concatenate(errors)
    place = pixels // 4
    return 100 * float(np.partition(known, place)[place]) if place < known.size else float("nan")
