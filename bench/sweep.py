"""Scores of a parameter's values over scenes, and the best value with each scene left out in turn.

Rendered scenes that are held out from choosing (:data:`sepi.extensions.rendered.worlds.RENDERED`) are refused.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from tabulate import tabulate

from bench.streets import street
from sepi.errors import SepiError
from sepi.extensions.rendered.worlds import RENDERED
from sepi.inspection.coded_views import comparable
from sepi.inspection.disparity_range import settle_range
from sepi.io.hdf5 import has_dataset
from sepi.lightfield import LightField
from sepi.reading import read_light_field
from sepi.scenes import SCENES, render
from sepi.scoring.scores import score
from sepi.stage import Parameters, StageMaps, no_progress
from sepi.validation import require_known, value_of
from sepi.variants import STAGES, Variant, stage_parameters
from sepi.workflow.rendered_scenes import rendered_scene

Scores = Mapping[str, Sequence[float]]
"""Scene to a score for each value."""


def scene_for_choosing(given: str, noise: str) -> LightField:
    """A built-in scene by its name, a street as ``street:SEED``, a light field, or a render at a level of noise.

    Raises
    ------
    SepiError
        If there is no such scene, it has no ground truth, or it is held out.
    """
    kind, _, seed = given.partition(":")
    if kind == "street" and seed.isdecimal():
        return street(int(seed))
    if given in SCENES:
        light_field = render(given)
    elif has_dataset(Path(given), "turns"):
        from sepi.extensions.rendered.exposure import read_scene

        light_field = read_scene(Path(given), noise, 1)
    else:
        light_field = read_light_field(Path(given))
    # the name in the files, since folders may have any name
    world = rendered_scene(light_field.name).world
    if world in RENDERED and not RENDERED[world].for_choosing:
        free = ", ".join(name for name, entry in RENDERED.items() if entry.for_choosing)
        raise SepiError(f"{given}: scene '{world}' is held out, no parameter may be chosen on it; on {free} one may")
    if light_field.ground_truth is None:
        raise SepiError(f"{given}: has no ground truth to score against")
    # as in the stages
    return comparable(settle_range(light_field))


def settings_of(variant: Variant, target: str, texts: Sequence[str]) -> tuple[str, list[dict[str, Parameters]]]:
    """The stage of ``STAGE.CHOICE.NAME``, and for each value the parameters of all stages.

    Raises
    ------
    SepiError
        If the variant has no such parameter, or a value is not allowed.
    """
    stage, _, rest = target.partition(".")
    choice, _, name = rest.partition(".")
    require_known(f"{target}: stage", [stage], STAGES)
    require_known(f"{target}: choice of this variant", [choice], [variant.choices[stage]])
    return stage, [stage_parameters(variant, {stage: {name: value_of(text)}}) for text in texts]


def scores_of(
    light_field: LightField, variant: Variant, stage: str, settings: Sequence[Mapping[str, Parameters]], which: str
) -> list[float]:
    """A score of the final map for each of several settings of one stage."""
    place = list(STAGES).index(stage)
    before, after = list(STAGES)[:place], list(STAGES)[place:]
    first = _run(light_field, None, variant, before, settings[0])
    maps = [_run(light_field, first, variant, after, values) for values in settings]
    assert light_field.ground_truth is not None
    return [score(found.disparity, light_field.ground_truth)[which] for found in maps if found is not None]


def tables(texts: Sequence[str], scores: Scores) -> str:
    """Markdown of the scores of each value; then for each scene the best value on the others, and its score."""
    scenes = list(scores)
    rows = [[text, _mean(scores, i, scenes), *(scores[one][i] for one in scenes)] for i, text in enumerate(texts)]
    folds: list[tuple[str, str, float, float]] = []
    for left_out in scenes:
        others = [scene for scene in scenes if scene != left_out]
        means = [_mean(scores, i, others) for i in range(len(texts))]
        chosen = means.index(min(means))
        folds.append((left_out, texts[chosen], scores[left_out][chosen], min(scores[left_out])))
    mean = sum(row[2] for row in folds) / len(folds)
    return "\n\n".join(
        (
            _markdown(rows, ["value", "mean", *scenes]),
            _markdown(folds, ["left out", "best on the others", "that value here", "best here"]),
            f"Mean over scenes, each with the value that was chosen without it: {mean:.3f}",
        )
    )


def _mean(scores: Scores, value: int, scenes: Sequence[str]) -> float:
    return sum(scores[scene][value] for scene in scenes) / len(scenes)


def _markdown(rows: Sequence[Sequence[Any]], heads: Sequence[str]) -> str:
    shown = [[f"{cell:.3f}" if isinstance(cell, float) else cell for cell in row] for row in rows]
    return str(tabulate(shown, heads, tablefmt="pipe", disable_numparse=True))


def _run(
    light_field: LightField,
    maps: StageMaps | None,
    variant: Variant,
    stages: Sequence[str],
    settings: Mapping[str, Parameters],
) -> StageMaps | None:
    for stage in stages:
        maps = STAGES[stage][variant.choices[stage]].run(light_field, maps, settings[stage], no_progress)
    return maps
