"""All numbers of the report in one JSON file, and the command that collects them.

Tables and page are made from this file alone.
"""

from __future__ import annotations

import hashlib
import itertools
import json
from collections.abc import Mapping, Sequence
from dataclasses import asdict
from datetime import datetime
from pathlib import Path
from typing import Any

import click
import numpy as np
import numpy.typing as npt

from sepi.io.scores import Scores, read_external, read_reliability, read_scores, without_nan
from sepi.io.truth import read_with_truth
from sepi.process.command import SepiCommand
from sepi.report.plan import Plan
from sepi.report.pooled import pooled_q25
from sepi.report.runs import Runs, read_json
from sepi.report.tables import table
from sepi.report.tabular.layout import as_json, write
from sepi.scoring.error_bars import ERROR_BAR_SCORES
from sepi.scoring.scores import COUNTS, EDGE_SCORES, PROTOCOLS, SCORED_REGIONS, score_heads
from sepi.validation import require_known
from sepi.workflow.rendered_scenes import DATASET
from sepi.workflow.result_paths import stage_of


def collect(plan: Plan, parts: bool = False) -> dict[str, Any]:
    """The numbers of a report, read from ``plan.number_inputs(parts)``.

    Parameters
    ----------
    plan : Plan
        Scenes, variants and external methods.
    parts : bool
        Collect the numbers for the ablation of the best variant, instead of those for all other tables.

    Returns
    -------
    dict
        Values of JSON: text, numbers, None (also for NaN), lists and dictionaries. ``made``: date of the newest
        result, and machines of the stages with versions; ``protocols``: name to border; ``plan``; ``parameters``:
        stage to choice to a list of the parameters used, since scenes may differ; ``scenes``: a list, each
        with ``dataset``, ``scene``, ``light_field``, ``stages`` (path of choices to ``stage``, ``scores``,
        ``seconds``, ``peak_memory_mb``, ``reliability``, None without error bars) and ``external`` (method to
        ``problem``, ``source``, ``sha256``, ``scores``); for rendered scenes ``pooled_q25``
        (:data:`sepi.report.pooled.Pooled`); ``tables``: name to :func:`sepi.report.tabular.layout.as_json`. With
        ``parts``, scenes have ``stages`` only, and ``scores`` is None except after the last stage.

    Raises
    ------
    SepiError
        If a file is missing or has other contents.
    """
    machines, parameters = _made_by(plan, parts)
    numbers: dict[str, Any] = {
        "made": {"date": _newest(plan.number_inputs(parts)), "machines": machines},
        "protocols": dict(PROTOCOLS),
        "plan": json.loads(plan.to_json()),
        "parameters": parameters,
        "scenes": [_scene(plan, dataset, scene, parts) for dataset, scene in plan.pairs],
    }
    if plan.report == DATASET:
        numbers["pooled_q25"] = pooled_q25(plan)
    numbers = without_nan(numbers)
    runs = Runs(numbers)
    tables = {name: as_json(table(name, runs)) for name in plan.tables(parts)}
    return numbers | {"tables": tables}


def _newest(files: Sequence[Path]) -> str:
    """Date of the newest file, without the time of day."""
    newest = max((file.stat().st_mtime for file in files if file.is_file()), default=0.0)
    return datetime.fromtimestamp(newest).astimezone().isoformat(timespec="seconds")


def _made_by(plan: Plan, parts: bool) -> tuple[list[Any], dict[str, dict[str, list[Any]]]]:
    """Machines of the stages, and parameters by stage and choice, from the stage files."""
    machines: list[Any] = []
    parameters: dict[str, dict[str, list[Any]]] = {stage: {} for stage in plan.stages}
    for (dataset, scene), variant, stage in itertools.product(plan.pairs, plan.collected(parts), plan.stages):
        if plan.runs_stage(variant, stage):
            timing = _timing(plan.stage_file(dataset, scene, variant, stage, "time.json"), stage)
            ran_with = parameters[stage].setdefault(plan.variants[variant][stage], [])
            for known, value in ((machines, timing["machine"]), (ran_with, timing["parameters"])):
                if value not in known:
                    known.append(value)
    return machines, parameters


def _timing(path: Path, stage: str) -> dict[str, Any]:
    """Time and memory of a stage, its machine and its parameters."""
    keys = {"seconds", "peak_memory_mb", "machine", "parameters"}
    return read_json(path, keys, "the time of a stage", f"sepi.{stage}")


def as_text(value: Any) -> str:
    """JSON with one number per line, for readable differences."""
    return json.dumps(value, indent=1, allow_nan=False, ensure_ascii=False) + "\n"


def _scene(plan: Plan, dataset: str, scene: str, parts: bool) -> dict[str, Any]:
    found: dict[str, Any] = {"dataset": dataset, "scene": scene}
    if parts:
        return found | {"stages": _stages(plan, dataset, scene, parts)}
    return found | {
        "light_field": _light_field(plan.light_field_file(dataset, scene), plan.truth_file(dataset, scene)),
        "stages": _stages(plan, dataset, scene, parts),
        "external": _external(plan, dataset, scene),
    }


def _light_field(path: Path, truth: Path) -> dict[str, Any]:
    """Facts about a light field, with digests of its pixels and its ground truth."""
    found = read_with_truth(path, truth)
    known = found.disparity_range
    return {
        "grid": list(found.grid),
        "row_spacing": found.row_spacing,
        "positions": "grid" if found.positions is None else "given",
        # from the reference view, if positions are known
        "baselines": None if found.positions is None else found.baselines[found.present].tolist(),
        "shape": list(found.shape),
        "channels": found.views.shape[4],
        "dtype": str(found.views.dtype),
        "source": found.source,
        "range": None if known is None else [known.minimum, known.maximum],
        "range_source": None if known is None else known.source,
        "ground_truth": found.ground_truth is not None,
        "masks": sorted(found.masks),
        "notes": list(found.notes),
        "camera": None if found.camera is None else asdict(found.camera),
        "sha256": _digest(found.views),
        "ground_truth_sha256": None if found.ground_truth is None else _digest(found.ground_truth),
    }


def _stages(plan: Plan, dataset: str, scene: str, parts: bool) -> dict[str, Any]:
    """Scores and times by the path of a stage's choices; a stage that variants share occurs once."""
    files = {
        plan.stage_key(variant, stage): plan.stage_file(dataset, scene, variant, stage, "time.json")
        for variant in plan.collected(parts)
        for stage in plan.stages
    }
    # in the ablation of parts, only the last stage is scored
    last = [plan.stage_key(variant, plan.stages[-1]) for variant in plan.collected(parts)]
    scored, wanted = plan.scores_file(dataset, scene, parts), last if parts else files.keys()
    scores, reliability = read_scores(scored, wanted), read_reliability(scored, wanted)
    found = {}
    for key, path in files.items():
        took = _timing(path, stage_of(key))
        found[key] = {
            "stage": stage_of(key),
            "scores": _ordered(plan, scores[key]) if key in scores else None,
            "seconds": float(took["seconds"]),
            "peak_memory_mb": float(took["peak_memory_mb"]),
            "reliability": reliability[key].tolist() if key in reliability else None,
        }
    return found


def _external(plan: Plan, dataset: str, scene: str) -> dict[str, Any]:
    """Scores of the external methods, or the problems of their maps."""
    if not plan.external:
        return {}
    path = plan.external_file(dataset, scene)
    maps = read_external(path, with_maps=False)
    require_known(str(path), plan.external, maps)
    return {
        method: {key: getattr(maps[method], key) for key in ("problem", "source", "sha256")}
        | {"scores": _ordered(plan, maps[method].evaluation.scores)}
        for method in plan.external
    }


def _ordered(plan: Plan, scores: Mapping[str, Mapping[str, Scores]]) -> dict[str, Any]:
    """Scores in the order of protocols, regions and names."""
    names = (*score_heads(plan.bad_thresholds), *EDGE_SCORES, *COUNTS)
    of_bars = ERROR_BAR_SCORES.keys()
    found: dict[str, Any] = {}
    for protocol in PROTOCOLS if scores else ():
        regions = scores[protocol]
        order = dict.fromkeys([*SCORED_REGIONS, *sorted(regions)])
        found[protocol] = {
            region: {name: regions[region][name] for name in (*names, *(n for n in of_bars if n in regions[region]))}
            for region in order
        }
    return found


def _digest(values: npt.NDArray[Any]) -> str:
    return hashlib.sha256(np.ascontiguousarray(values).data.cast("B")).hexdigest()


@click.command(name="python -m sepi.report.numbers", cls=SepiCommand)
@click.option("--results", type=click.Path(path_type=Path), required=True, help="Folder of the results.")
@click.option(
    "--plan",
    "path",
    type=click.Path(path_type=Path),
    required=True,
    help="JSON file: scenes per dataset, choices per variant and stage.",
)
@click.option("--parts", is_flag=True, help="What the ablation of the best variant needs, and nothing else.")
@click.option("--output", type=click.Path(path_type=Path), required=True, help="JSON file to write.")
def command(results: Path, path: Path, parts: bool, output: Path) -> None:
    """Collect all numbers of the report in one JSON file."""
    plan = Plan.from_json(
        results, json.dumps(read_json(path, {"scenes", "variants"}, "the plan of a report", "snakemake"))
    )
    write(output, as_text(collect(plan, parts)))


if __name__ == "__main__":
    command()
