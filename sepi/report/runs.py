"""Scores and timings for the tables, looked up in the numbers of a report."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np

from sepi.errors import SepiError
from sepi.io.scores import AllScores
from sepi.report.plan import MAIN_VARIANT, Plan
from sepi.scoring.error_bars import Reliability
from sepi.scoring.scores import WHOLE_MAP

Numbers = Mapping[str, Any]
"""Result of :func:`sepi.report.numbers.collect`."""


@dataclass(frozen=True)
class Timing:
    """Wall-clock seconds and peak memory of a stage, MB."""

    seconds: float
    peak_memory_mb: float


@dataclass(frozen=True)
class Runs:
    """Scores and timings of a plan, from the numbers of a report."""

    numbers: Numbers

    @cached_property
    def plan(self) -> Plan:
        """Scenes, variants and external methods; its files are not available."""
        return Plan.from_json(Path(), json.dumps(self.numbers["plan"]))

    def light_field(self, dataset: str, scene: str) -> dict[str, Any]:
        """Facts about a light field: ``grid``, ``shape``, ``range``, ``sha256`` and more."""
        found: dict[str, Any] = self._scenes[dataset, scene]["light_field"]
        return found

    def scores(self, dataset: str, scene: str, variant: str, stage: str | None = None) -> AllScores:
        """Protocol to region to scores after a stage (default: the last); empty without ground truth."""
        found: AllScores = _with_nan(self._stage(dataset, scene, variant, stage or self.plan.stages[-1])["scores"])
        return found

    def scored(self, dataset: str, variant: str = MAIN_VARIANT) -> list[str]:
        """Scenes of a dataset with scores of this variant, that is, with ground truth."""
        scenes = self.plan.scenes.get(dataset, ())
        return [scene for scene in scenes if self.scores(dataset, scene, variant)]

    def scored_pairs(self, variant: str = MAIN_VARIANT) -> list[tuple[str, str]]:
        """Every ``(dataset, scene)`` with scores."""
        return [(dataset, scene) for dataset in self.plan.scenes for scene in self.scored(dataset, variant)]

    def final(
        self, dataset: str, scene: str, score: str, region: str = WHOLE_MAP, variant: str = MAIN_VARIANT
    ) -> float:
        """A score of a final map by the paper's protocol."""
        return self.scores(dataset, scene, variant)["paper"][region][score]

    def timing(self, dataset: str, scene: str, variant: str, stage: str) -> Timing:
        """Time and memory of a stage; 0 for one that is switched off."""
        if not self.plan.runs_stage(variant, stage):
            return Timing(0.0, 0.0)
        values = self._stage(dataset, scene, variant, stage)
        return Timing(values["seconds"], values["peak_memory_mb"])

    def reliability(self, dataset: str, scene: str, variant: str) -> Reliability:
        """Reliability of the confidence of a final map that has error bars and scores."""
        found = _with_nan(self._stage(dataset, scene, variant, self.plan.stages[-1])["reliability"])
        return Reliability(*(np.array(values, np.float64) for values in found))

    def external_scores(self, dataset: str, scene: str, method: str) -> AllScores:
        """Protocol to region to scores of another method's map; empty without a map that can be scored."""
        found: AllScores = _with_nan(self._scenes[dataset, scene]["external"][method]["scores"])
        return found

    def external_problem(self, dataset: str, scene: str, method: str) -> str:
        """Reason why an external map has no scores; empty if it has scores or there is no ground truth."""
        return str(self._scenes[dataset, scene]["external"][method]["problem"])

    def pooled_q25(self, method: str, level: str, region: str) -> float:
        """Q25 x100 over the pixels of several scenes (:func:`sepi.report.pooled.pooled_q25`)."""
        found: float = _with_nan(self.numbers["pooled_q25"][method][level].get(region))
        return found

    def _stage(self, dataset: str, scene: str, variant: str, stage: str) -> dict[str, Any]:
        key = self.plan.stage_key(variant, stage)
        stages: dict[str, dict[str, Any]] = self._scenes[dataset, scene]["stages"]
        if key not in stages:
            raise SepiError(f"{dataset}/{scene}: these numbers have nothing of {variant} ({key})")
        return stages[key]

    @cached_property
    def _scenes(self) -> dict[tuple[str, str], dict[str, Any]]:
        return {(values["dataset"], values["scene"]): values for values in self.numbers["scenes"]}


def read_numbers(path: Path) -> dict[str, Any]:
    """The numbers in a file that ``python -m sepi.report.numbers`` wrote.

    Raises
    ------
    SepiError
        If the file is missing or has other contents.
    """
    return read_json(path, {"plan", "scenes", "tables"}, "the numbers of a report", "sepi.report.numbers")


def read_json(path: Path, keys: set[str], what: str, module: str) -> dict[str, Any]:
    """The JSON object in a file of ``module``; messages call it ``what``.

    Raises
    ------
    SepiError
        If the file is missing or lacks one of the keys.
    """
    try:
        found = json.loads(path.read_text(encoding="utf-8"))
    except OSError as error:
        raise SepiError(f"{path}: cannot be read ({error.strerror})") from error
    except (ValueError, RecursionError) as error:
        raise SepiError(f"{path}: not JSON ({error}); expected what python -m {module} writes") from error
    if not isinstance(found, dict) or not keys <= found.keys():
        raise SepiError(f"{path}: not {what}, which python -m {module} writes")
    return found


def _with_nan(value: Any) -> Any:
    """A value with NaN for None, which is JSON's score over no pixels."""
    if isinstance(value, dict):
        return {key: _with_nan(inner) for key, inner in value.items()}
    if isinstance(value, list):
        return [_with_nan(inner) for inner in value]
    return math.nan if value is None else value
