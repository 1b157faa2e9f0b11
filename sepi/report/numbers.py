"""All numbers of the report in one CSV file, and facts about them in a JSON file.

Tables and page are made from these files alone.
"""

from __future__ import annotations

import hashlib
import itertools
import json
from collections import Counter
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import asdict
from datetime import datetime
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import pandas as pd

from sepi.io.files import write_whole
from sepi.io.hdf5 import read_with_truth
from sepi.io.scores import Evaluation, Scores, read_evaluations, without_nan
from sepi.report.plan import PARTS, Plan
from sepi.report.runs import EXTERNAL, KEYS, TENTHS, Runs, read_json
from sepi.scoring.scores import PROTOCOLS, SCORED_REGIONS, WHOLE_MAP
from sepi.variants import HANDED_ON
from sepi.workflow.rendered_scenes import DATASET, rendered_scene


def pooled_q25(plan: Plan) -> Iterator[tuple[str, str, str, float]]:
    """Q25 x100 over the pixels of all rendered scenes of a level of noise: :func:`level_of`, method, region, figure."""
    levels: dict[str, list[str]] = {}
    for scene in plan.scenes[DATASET]:
        levels.setdefault(level_of(scene), []).append(scene)
    for level, scenes in levels.items():
        for method in (*plan.compared, *plan.external):
            is_own = method in plan.variants
            key = plan.stage_key(method, plan.stages[-1]) if is_own else method
            files = (plan.scores_file(DATASET, one) if is_own else plan.files(DATASET, one).external for one in scenes)
            quarters = _quarters(read_evaluations(file, [key])[key] for file in files)
            yield from ((level, method, *quarter) for quarter in quarters)


def level_of(scene: str) -> str:
    """Name of all rendered scenes of the noise and seed of one."""
    found = rendered_scene(scene)
    return f"all scenes, noise {found.noise}, seed {found.seed}"


def _quarters(evaluations: Iterable[Evaluation]) -> Iterator[tuple[str, float]]:
    """Regions and Q25 x100 over the pixels of several maps; errors that are not finite are the largest."""
    errors: dict[str, list[np.ndarray]] = {}
    counts: Counter[str] = Counter()
    for found in evaluations:
        for region, scores in found.scores.get("paper", {}).items():
            assert found.error is not None
            error = np.abs(found.error if region == WHOLE_MAP else found.error[found.regions[region]])
            errors.setdefault(region, []).append(error[np.isfinite(error)])
            counts[region] += int(scores["pixels"])
    for region, parts in errors.items():
        known, place = np.concatenate(parts), counts[region] // 4
        yield region, 100 * float(np.partition(known, place)[place]) if place < known.size else float("nan")


# of each tenth of a confidence
_SAID = "pixels", "said", "found"

_Number = tuple[str, str, str, str, str, str, str, str, float]
"""A row of :attr:`sepi.report.runs.Runs.numbers`."""


def collect(plan: Plan) -> Runs:
    """The numbers of a report, read from ``plan.number_inputs()``.

    Returns
    -------
    Runs
        Its numbers are the scores of every map, by ``region``, of the parts of ``best`` after the last stage alone;
        ``seconds`` and ``peak_memory_mb`` of every stage that is switched on, under no protocol; the reliability of
        confidences (:data:`sepi.report.runs.TENTHS`); and of rendered scenes Q25 over all that have the same noise.

        Its facts are values of JSON, with None for NaN. ``made``: date of the newest result, and machines of the stages
        with versions; ``protocols``: name to border; ``plan``; ``parameters``: stage to choice to a list of the
        parameters used, since scenes may differ; ``scenes``: a list, each with ``dataset``, ``scene``, and except for
        the parts of ``best``, ``light_field`` and ``external`` (method to ``problem``, ``source``, ``sha256``).

    Raises
    ------
    SepiError
        If a file is missing or has other contents.
    """
    timings = {
        (*pair, variant, stage): _timing(plan, *pair, variant, stage)
        for pair, variant, stage in itertools.product(plan.pairs, plan.variants, plan.stages)
        if plan.variants[variant][stage] != HANDED_ON
    }
    machines: list[Any] = []
    parameters: dict[str, dict[str, list[Any]]] = {stage: {} for stage in plan.stages}
    for (_, _, variant, stage), timing in timings.items():
        ran_with = parameters[stage].setdefault(plan.variants[variant][stage], [])
        for known, value in ((machines, timing["machine"]), (ran_with, timing["parameters"])):
            known += [] if value in known else [value]
    newest = max((file.stat().st_mtime for file in plan.number_inputs() if file.is_file()), default=0.0)
    date = datetime.fromtimestamp(newest).astimezone().isoformat(timespec="seconds")
    facts = {
        "made": {"date": date, "machines": machines},
        "protocols": dict(PROTOCOLS),
        "plan": json.loads(plan.to_json()),
        "parameters": parameters,
        "scenes": [_facts(plan, dataset, scene) for dataset, scene in plan.pairs],
    }
    numbers = [number for dataset, scene in plan.pairs for number in _scores_of_scene(plan, dataset, scene)]
    for (dataset, scene, variant, stage), timing in timings.items():
        about = (dataset, scene, variant, stage, plan.variants[variant][stage], "", "")
        numbers += [(*about, name, float(timing[name])) for name in ("seconds", "peak_memory_mb")]
    if plan.report == DATASET:
        for level, method, region, quarter in pooled_q25(plan):
            stage = EXTERNAL if method in plan.external else plan.stages[-1]
            numbers.append((DATASET, level, method, stage, "", "paper", region, "q25", quarter))
    return Runs(without_nan(facts), pd.DataFrame(numbers, columns=[*KEYS, "score", "value"]))


def write_numbers(runs: Runs, path: Path) -> None:
    """Write the facts to this JSON file, and the numbers to the CSV file beside it."""
    write_whole(path.with_suffix(".csv"), runs.numbers.to_csv(index=False, na_rep="nan", lineterminator="\n"))
    write_whole(path, json.dumps(runs.facts, indent=1, allow_nan=False, ensure_ascii=False) + "\n")


def _timing(plan: Plan, dataset: str, scene: str, variant: str, stage: str) -> dict[str, Any]:
    """Time and memory of a stage, its machine and its parameters."""
    path = plan.stage_file(dataset, scene, variant, stage, "time.json")
    keys = {"seconds", "peak_memory_mb", "machine", "parameters"}
    return read_json(path, keys, f"time of a stage (written by python -m sepi.{stage})")


def _facts(plan: Plan, dataset: str, scene: str) -> dict[str, Any]:
    found: dict[str, Any] = {"dataset": dataset, "scene": scene}
    if plan.report == PARTS:
        return found
    maps = _external(plan, dataset, scene).items()
    about = {method: {key: getattr(one, key) for key in ("problem", "source", "sha256")} for method, one in maps}
    light_field = _light_field(plan.files(dataset, scene).light_field, plan.files(dataset, scene).truth)
    return found | {"light_field": light_field, "external": about}


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


def _digest(values: npt.NDArray[Any]) -> str:
    return hashlib.sha256(np.ascontiguousarray(values).data.cast("B")).hexdigest()


def _scores_of_scene(plan: Plan, dataset: str, scene: str) -> Iterator[_Number]:
    """Scores of a scene's maps."""
    path = plan.scores_file(dataset, scene)
    keys = dict.fromkeys(itertools.starmap(plan.stage_key, itertools.product(plan.variants, plan.scored_stages)))
    known = read_evaluations(path, keys, with_maps=False)
    for variant, stage in itertools.product(plan.variants, plan.stages):
        about = (dataset, scene, variant, stage, plan.variants[variant][stage])
        found = known.get(plan.stage_key(variant, stage), Evaluation())
        yield from ((*about, *score) for score in _scores(found.scores))
        for name, values in () if found.reliability is None else zip(_SAID, found.reliability, strict=True):
            yield from ((*about, TENTHS, str(tenth), name, float(value)) for tenth, value in enumerate(values))
    for method, external in _external(plan, dataset, scene).items():
        about = (dataset, scene, method, EXTERNAL, "")
        yield from ((*about, *score) for score in _scores(external.scores))


def _external(plan: Plan, dataset: str, scene: str) -> dict[str, Evaluation]:
    """The external methods' maps, without their pixels."""
    path = plan.files(dataset, scene).external
    return read_evaluations(path, plan.external, with_maps=False) if plan.external else {}


def _scores(scores: Mapping[str, Mapping[str, Scores]]) -> Iterator[tuple[str, str, str, float]]:
    """Protocol, region, name and value of scores, in the order of protocols and regions."""
    for protocol in PROTOCOLS if scores else ():
        regions = scores[protocol]
        for region in dict.fromkeys([*SCORED_REGIONS, *sorted(regions)]):
            yield from ((protocol, region, name, value) for name, value in regions[region].items())
