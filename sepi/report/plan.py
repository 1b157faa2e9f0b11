"""Which scenes and variants a report is about, and where their files lie.

The workflow declares the inputs of each table from here, and the tables read nothing else.
"""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

from sepi.errors import SepiError
from sepi.evaluate import WHOLE_MAP
from sepi.io.scores import Scores, read_scores
from sepi.pipeline import PARTS_OF_BEST

MAIN_VARIANT = "paper"
"""The variant that does what the paper describes; its figures stand beside the published ones."""

BEST_VARIANT = "best"
"""The most accurate variant, whose figures stand there too."""

TABLES: dict[str, str] = {
    "table1_mse": "final maps of the variants that stand beside the published figures",
    "table2_q25": "final maps of the variants that stand beside the published figures",
    "table3_regions": "final maps of the variants that stand beside the published figures",
    "table4_ablation": "final maps of every variant but the parts of the best one",
    "ablation_best": "final maps and timings of the best variant and of those with one part of it switched off",
    "confidence": "final maps of the variants that stand beside the published figures",
    "stages": "maps after every stage of the same variants",
    "runtime": "timings of every stage of the same variants",
}
"""Name of each table and what it is made from."""


@dataclass(frozen=True)
class Plan:
    """Scenes and variants of a report.

    Attributes
    ----------
    results : Path
        Folder of the results.
    scenes : mapping of str to sequence of str
        Data set to its scenes, in the order of the tables.
    variants : mapping of str to mapping
        Variant to stage to choice, in order; the stages are the same for all.
    """

    results: Path
    scenes: Mapping[str, Sequence[str]]
    variants: Mapping[str, Mapping[str, str]]

    @classmethod
    def from_json(cls, results: Path, text: str) -> Plan:
        """Plan from JSON ``{"scenes": {DATASET: [SCENE...]}, "variants": {VARIANT: {STAGE: CHOICE}}}``.

        Raises
        ------
        SepiError
            If the text is not such JSON, or has no variant ``paper``.
        """
        try:
            values = json.loads(text)
            plan = cls(
                results,
                {dataset: tuple(map(str, names)) for dataset, names in values["scenes"].items()},
                {name: {stage: str(word) for stage, word in c.items()} for name, c in values["variants"].items()},
            )
        except (ValueError, KeyError, TypeError, AttributeError) as error:
            raise SepiError(
                "plan: expected JSON such as "
                f'{{"scenes": {{DATASET: [SCENE]}}, "variants": {{VARIANT: {{STAGE: CHOICE}}}}}} ({error})'
            ) from error
        if MAIN_VARIANT not in plan.variants:
            raise SepiError(f"plan: no variant '{MAIN_VARIANT}', which stands beside the published figures")
        return plan

    def to_json(self) -> str:
        """The text that :meth:`from_json` reads; the results' folder is not part of it."""
        return json.dumps({"scenes": self.scenes, "variants": self.variants})

    @property
    def stages(self) -> list[str]:
        """Stages, in order."""
        return list(self.variants[MAIN_VARIANT])

    @property
    def pairs(self) -> list[tuple[str, str]]:
        """Every ``(dataset, scene)``."""
        return [(dataset, scene) for dataset, scenes in self.scenes.items() for scene in scenes]

    def light_field_file(self, dataset: str, scene: str) -> Path:
        """The light field of a scene."""
        return self.results / dataset / scene / "lightfield.h5"

    def stage_file(self, dataset: str, scene: str, variant: str, stage: str, ending: str = "h5") -> Path:
        """The file of a stage of a variant, or one beside it: ``ending`` is ``"scores.h5"`` or ``"time.json"``."""
        words = list(self.variants[variant].values())[: self.stages.index(stage) + 1]
        return self.results.joinpath(dataset, scene, "stages", *words, f"{stage}.{ending}")

    def table_inputs(self, table: str) -> list[Path]:
        """The files that a table is made from, each once.

        Raises
        ------
        SepiError
            If there is no such table.
        """
        if table not in TABLES:
            raise SepiError(f"unknown table '{table}'; there are: {', '.join(TABLES)}")
        last = self.stages[-1:]
        of_table: dict[str, tuple[Sequence[str], Sequence[tuple[str, str]]]] = {
            "table4_ablation": (self.listed, [(stage, "scores.h5") for stage in last]),
            "stages": (self.listed, [(stage, "scores.h5") for stage in self.stages]),
            "runtime": (self.listed, [(stage, "time.json") for stage in self.stages]),
            "ablation_best": (
                self.parts,
                [*((stage, "scores.h5") for stage in last), *((stage, "time.json") for stage in self.stages)],
            ),
            "confidence": (self.compared, [(stage, ending) for stage in last for ending in ("h5", "scores.h5")]),
        }
        variants, endings = of_table.get(table, (self.compared, [(stage, "scores.h5") for stage in last]))
        files = [
            self.stage_file(dataset, scene, variant, stage, ending)
            for dataset, scene in self.pairs
            for variant in variants
            for stage, ending in endings
        ]
        return list(dict.fromkeys(files))

    @property
    def compared(self) -> list[str]:
        """Variants that stand beside the published figures, where the plan has them."""
        return [variant for variant in (BEST_VARIANT, MAIN_VARIANT) if variant in self.variants]

    @property
    def parts(self) -> list[str]:
        """The best variant and those with one part of it switched off, where the plan has them."""
        return [v for v in PARTS_OF_BEST if v in self.variants] if BEST_VARIANT in self.variants else []

    @property
    def listed(self) -> list[str]:
        """All variants but those with one part of the best one switched off, which have a table of their own."""
        return [variant for variant in self.variants if variant not in PARTS_OF_BEST or variant == BEST_VARIANT]

    def map_inputs(self, dataset: str, scene: str) -> list[Path]:
        """The files that the pictures of a scene are made from, each once."""
        files = [self.light_field_file(dataset, scene)]
        for variant in self.listed:
            files += [self.stage_file(dataset, scene, variant, stage) for stage in self.stages]
            files.append(self.stage_file(dataset, scene, variant, self.stages[-1], "scores.h5"))
        return list(dict.fromkeys(files))


@dataclass(frozen=True)
class Timing:
    """What a stage took: wall-clock seconds and peak memory in MB."""

    seconds: float
    peak_memory_mb: float


@dataclass(frozen=True)
class Runs:
    """The scores and timings of a plan, each file read once and only when asked for."""

    plan: Plan

    def scores(self, dataset: str, scene: str, variant: str, stage: str | None = None) -> dict[str, dict[str, Scores]]:
        """Protocol to region to scores after a stage, the last unless given; empty without ground truth."""
        path = self.plan.stage_file(dataset, scene, variant, stage or self.plan.stages[-1], "scores.h5")
        if path not in self._scores:
            self._scores[path] = read_scores(path)
        return self._scores[path]

    def scored(self, dataset: str, variant: str = MAIN_VARIANT) -> list[str]:
        """Scenes of a data set that have ground truth, and so scores; looked for with one of the variants."""
        scenes = self.plan.scenes.get(dataset, ())
        return [scene for scene in scenes if self.scores(dataset, scene, variant)]

    def final(
        self, dataset: str, scene: str, score: str, region: str = WHOLE_MAP, variant: str = MAIN_VARIANT
    ) -> float:
        """A score of a final map by the paper's protocol."""
        return self.scores(dataset, scene, variant)["paper"][region][score]

    def timing(self, dataset: str, scene: str, variant: str, stage: str) -> Timing:
        """What a stage took.

        Raises
        ------
        SepiError
            If its timing file is missing or not one.
        """
        path = self.plan.stage_file(dataset, scene, variant, stage, "time.json")
        try:
            values: dict[str, Any] = json.loads(path.read_text(encoding="utf-8"))
            return Timing(float(values["seconds"]), float(values["peak_memory_mb"]))
        except OSError as error:
            raise SepiError(f"{path}: cannot be read ({error.strerror})") from error
        except (ValueError, KeyError, TypeError) as error:
            raise SepiError(f'{path}: expected {{"seconds": ..., "peak_memory_mb": ...}} ({error})') from error

    @cached_property
    def _scores(self) -> dict[Path, dict[str, dict[str, Scores]]]:
        return {}
