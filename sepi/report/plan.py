"""Plan of a report: its scenes, variants and external methods, and the paths of their files.

The workflow's rule and the report's numbers take their inputs from here.
"""

from __future__ import annotations

import itertools
import json
from collections.abc import Collection, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Annotated

from pydantic import AfterValidator
from pydantic.dataclasses import dataclass

from sepi.errors import SepiError
from sepi.registry import added
from sepi.variants import HANDED_ON, VARIANTS, compared_methods
from sepi.variants.built_in import PARTS_OF_BEST, UNCORRECTED
from sepi.workflow.rendered_scenes import DATASET, rendered_scene
from sepi.workflow.result_paths import PARTS_ENDING, SceneFiles, key_of, scene_files

MAIN_VARIANT = "paper"
"""The method as published; tables compare its figures with the published ones."""

BEST_VARIANT = "best"
"""The most accurate variant, which tables compare, too."""

FAST_VARIANT = "fast"
"""The fast variant, which the comparison shows, too."""

COMPARISON = "comparison"
"""Name of the report of the compared methods; that of rendered scenes is ``rendered``, the main one's is empty."""

TABLES = (
    "table1_mse",
    "table2_q25",
    "table3_regions",
    "table4_ablation",
    "ablation_best",
    "edges",
    "error_bars",
    "stages",
    "runtime",
)
"""Names of the tables, in the order of the page."""

COMPARISON_TABLES = ("methods", "table1_mse", "table2_q25", "table3_regions", "edges", "runtime")
"""Tables of the comparison with the compared methods, in the order of its page."""

RENDERED_TABLES = ("properties_mse", "properties_q25", "properties_badpix", "scenes_mse", "scenes_badpix", "error_bars")
"""Tables of the rendered scenes, in the order of their page."""

PARTS_TABLES = ("ablation_best",)
"""Tables of the ablation of the best variant, made from a file of numbers of their own."""


Names = Annotated[Sequence[str], AfterValidator(tuple)]
"""A list of names; a single text is refused."""


@dataclass(frozen=True)
class Plan:
    """Scenes, variants and external methods of a report.

    Attributes
    ----------
    results : Path
        Folder of the results.
    scenes : mapping of str to sequence of str
        Dataset to its scenes, in the order of the tables.
    variants : mapping of str to mapping
        Variant to stage to the label of its choice (:func:`sepi.variants.choice_label`), in order.
    external : sequence of str
        External methods, in the order of the tables.
    report : str
        :data:`COMPARISON`, ``rendered``, or empty for the main one.
    choosing : sequence of str
        Rendered scenes, without their noise, on which parameters may be chosen.
    missing : sequence of str
        ``DATASET/SCENE`` of scenes that are left out because a job failed.
    bad_thresholds : sequence of float
        The user's thresholds (:func:`sepi.scoring.scores.score`).
    """

    results: Path
    scenes: Mapping[str, Names]
    variants: Mapping[str, Mapping[str, str]]
    external: Names = ()
    report: str = ""
    choosing: Names = ()
    missing: Names = ()
    bad_thresholds: Annotated[Sequence[float], AfterValidator(tuple)] = ()

    @classmethod
    def from_json(cls, results: Path, text: str) -> Plan:
        """Plan from JSON ``{"scenes": {DATASET: [SCENE]}, "variants": {VARIANT: {STAGE: CHOICE}}}``.

        The other attributes may be added.

        Raises
        ------
        SepiError
            If the text is not such JSON, or has no variant ``paper``.
        """
        try:
            plan = cls(results, **json.loads(text))
        except (ValueError, TypeError, RecursionError) as error:
            raise SepiError(
                'plan: expected JSON such as {"scenes": {DATASET: [SCENE]}, "variants": {VARIANT: {STAGE: CHOICE}}, '
                '"external": [NAME]}'
            ) from error
        if MAIN_VARIANT not in plan.variants:
            raise SepiError(f"plan: no variant '{MAIN_VARIANT}', which stands beside the published figures")
        return plan

    def to_json(self) -> str:
        """The text that :meth:`from_json` reads; the results' folder is not part of it."""
        keys = ("scenes", "variants", "external", "report", "choosing", "missing", "bad_thresholds")
        return json.dumps({key: getattr(self, key) for key in keys})

    def comparison(self) -> Plan:
        """The plan of the comparison: this project's variants and the compared methods, computed on the same scenes."""
        ours = [BEST_VARIANT, FAST_VARIANT, MAIN_VARIANT]
        own = [name for name in self.variants if name not in VARIANTS]
        names = [name for name in (*ours, *own, *compared_methods()) if name in self.variants]
        return replace(self, variants={name: self.variants[name] for name in names}, report=COMPARISON)

    def rendered(self, scenes: Sequence[str], choosing: Sequence[str], variants: Sequence[str] | None = None) -> Plan:
        """The plan of the rendered scenes, with these variants and the paper's; default: those of the comparison."""
        names = self.comparison().variants if variants is None else dict.fromkeys([*variants, MAIN_VARIANT])
        return replace(
            self,
            scenes={DATASET: tuple(scenes)},
            variants={name: self.variants[name] for name in names},
            report=DATASET,
            choosing=tuple(choosing),
        )

    def without(self, scenes: Collection[tuple[str, str]]) -> Plan:
        """The plan without these scenes, with their names in ``missing``."""
        left = [pair for pair in self.pairs if pair not in scenes]
        there = {dataset: [name for other, name in left if other == dataset] for dataset, _ in left}
        return replace(self, scenes=there, missing=tuple("/".join(pair) for pair in self.pairs if pair in scenes))

    def tables(self, parts: bool = False) -> tuple[str, ...]:
        """Names of the tables from one of the two files of numbers, in the order of the page."""
        if self.report:
            return COMPARISON_TABLES if self.report == COMPARISON else RENDERED_TABLES
        return tuple(name for name in TABLES if (name in PARTS_TABLES) == parts)

    @property
    def stages(self) -> list[str]:
        """Stages, in order."""
        return list(self.variants[MAIN_VARIANT])

    @property
    def pairs(self) -> list[tuple[str, str]]:
        """Every ``(dataset, scene)``."""
        return [(dataset, scene) for dataset, scenes in self.scenes.items() for scene in scenes]

    @property
    def pictured(self) -> list[tuple[str, str]]:
        """Every ``(dataset, scene)``, with one level of noise per rendered scene."""
        return [pair for pair in self.pairs if pair[0] != DATASET or rendered_scene(pair[1]).seed == 1]

    def files(self, dataset: str, scene: str) -> SceneFiles:
        """Paths of a scene's files."""
        return scene_files(dataset, scene, self.results)

    def light_field_file(self, dataset: str, scene: str) -> Path:
        """Path of a scene's light field."""
        return self.files(dataset, scene).light_field

    def truth_file(self, dataset: str, scene: str) -> Path:
        """Path of a scene's ground truth."""
        return self.files(dataset, scene).truth

    def stage_file(self, dataset: str, scene: str, variant: str, stage: str, ending: str = "h5") -> Path:
        """Path of a variant's maps after a stage; with the ending ``"time.json"``, of the stage's time."""
        return self.files(dataset, scene).stage(self.variants[variant], stage, ending)

    def scores_file(self, dataset: str, scene: str, parts: bool = False) -> Path:
        """Path of the scores of a scene's maps; with ``parts``, for the ablation of the best variant."""
        return self.files(dataset, scene).scores(self.ending(parts))

    def ending(self, parts: bool = False) -> str:
        """Ending of the names of files of scores and numbers."""
        return PARTS_ENDING if parts else f"_{self.report}" if self.report else ""

    def external_file(self, dataset: str, scene: str) -> Path:
        """Path of the external methods' maps and scores for a scene."""
        return self.files(dataset, scene).external

    def stage_key(self, variant: str, stage: str) -> str:
        """Key of a variant's maps after a stage, in numbers and scores."""
        return key_of(self.variants[variant], stage)

    def runs_stage(self, variant: str, stage: str) -> bool:
        """Whether a stage of a variant is switched on."""
        return self.variants[variant][stage] != HANDED_ON

    def number_inputs(self, parts: bool = False) -> list[Path]:
        """Input files of the numbers, each once.

        Parameters
        ----------
        parts : bool
            For :data:`PARTS_TABLES`, instead of all other tables.
        """
        files: list[Path] = []
        for dataset, scene in self.pairs:
            files.append(self.scores_file(dataset, scene, parts))
            for variant in self.collected(parts):
                files += [self.stage_file(dataset, scene, variant, stage, "time.json") for stage in self.stages]
            if not parts:
                files += [self.light_field_file(dataset, scene), self.truth_file(dataset, scene)]
                files += [self.external_file(dataset, scene)] if self.external else []
        return list(dict.fromkeys(files))

    def scored_files(self, dataset: str, scene: str, parts: bool = False) -> list[Path]:
        """Stage files whose maps are scored, each once: of every stage, with ``parts`` of the last one."""
        stages = self.stages[-1:] if parts else self.stages
        every = itertools.product(self.collected(parts), stages)
        return list(dict.fromkeys(self.stage_file(dataset, scene, *variant_stage) for variant_stage in every))

    @property
    def compared(self) -> list[str]:
        """Variants of the plan that tables compare with the published figures."""
        return list(self.variants) if self.report else self.detailed

    @property
    def detailed(self) -> list[str]:
        """Variants of the plan whose stages are all on the page."""
        return [variant for variant in (BEST_VARIANT, MAIN_VARIANT) if variant in self.variants]

    @property
    def parts(self) -> list[str]:
        """Variants of the plan in the ablation of the best variant."""
        return [v for v in PARTS_OF_BEST if v in self.variants] if BEST_VARIANT in self.variants else []

    @property
    def listed(self) -> list[str]:
        """Variants of the main tables: all but the ablation of ``best``, the compared methods, and one for noise."""
        elsewhere = {*PARTS_OF_BEST, *added("variants"), UNCORRECTED} - {BEST_VARIANT, *self.compared}
        return [variant for variant in self.variants if variant not in elsewhere]

    def collected(self, parts: bool) -> list[str]:
        """Variants of one of the two files of numbers."""
        return self.parts if parts else self.listed

    def map_inputs(self, dataset: str, scene: str) -> list[Path]:
        """Input files of the pictures of a scene, each once."""
        known = self.files(dataset, scene)
        files = [known.light_field, known.truth, known.scores(self.ending())]
        files += self.scored_files(dataset, scene)
        files += [self.external_file(dataset, scene)] if self.external else []
        return list(dict.fromkeys(files))
