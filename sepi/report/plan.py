"""Plan of a report: its scenes, variants and external methods, and the paths of their files.

The workflow's rule and the report's numbers take their inputs from here.
"""

from __future__ import annotations

import itertools
import json
from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import fields, replace
from pathlib import Path
from typing import Annotated, ClassVar

from pydantic import AfterValidator
from pydantic.dataclasses import dataclass

from sepi.errors import SepiError
from sepi.registry import added
from sepi.variants import STAGES, VARIANTS, compared_methods
from sepi.variants.built_in import PARTS_OF_BEST, UNCORRECTED
from sepi.workflow.rendered_scenes import DATASET, rendered_scene
from sepi.workflow.result_paths import SceneFiles, key_of, scene_files

MAIN_VARIANT = "paper"
"""The method as published; tables compare its figures with the published ones."""

BEST_VARIANT = "best"
"""The most accurate variant, which tables compare, too."""

FAST_VARIANT = "fast"
"""The fast variant, which the comparison shows, too."""

PARTS = "parts"
"""Name of the report of the parts of the best variant, which has numbers and tables alone."""

COMPARISON = "comparison"
"""Name of the report of the compared methods; that of rendered scenes is ``rendered``, the main one's is empty."""

_FIGURES = ("table1_mse", "table2_q25", "table3_regions")
TABLES: dict[str, tuple[str, ...]] = {
    "": (*_FIGURES, "table4_ablation", "edges", "error_bars", "stages", "runtime"),
    PARTS: ("ablation_best",),
    COMPARISON: ("methods", *_FIGURES, "edges", "runtime"),
    DATASET: ("properties_mse", "properties_q25", "properties_badpix", "scenes_mse", "scenes_badpix", "error_bars"),
}
"""Report to the names of its tables, in the order of its page."""

CHARTS: dict[str, tuple[str, ...]] = {"": ("ablation", "time_and_memory", "error_bars"), PARTS: ("ablation_best",)}
"""Report to the names of its charts."""

PUBLISHED = Path(__file__).with_name("published")
"""Folder of the figures that the paper prints."""

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
        A key of :data:`TABLES`.
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
    stages: ClassVar[list[str]] = list(STAGES)

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
        if MAIN_VARIANT not in plan.variants and plan.report != PARTS:
            raise SepiError(f"plan: no variant '{MAIN_VARIANT}', which stands beside the published figures")
        return plan

    def to_json(self) -> str:
        """The text that :meth:`from_json` reads; the results' folder is not part of it."""
        return json.dumps({one.name: getattr(self, one.name) for one in fields(self) if one.name != "results"})

    def main(self) -> Plan:
        """The plan of the main report: all variants but the parts of ``best``, compared methods, and one for noise."""
        elsewhere = {*PARTS_OF_BEST, *added("variants"), UNCORRECTED} - {BEST_VARIANT}
        return self._of("", [name for name in self.variants if name not in elsewhere])

    def parts_of_best(self) -> Plan:
        """The plan of the ablation of the best variant."""
        return replace(self._of(PARTS, PARTS_OF_BEST if BEST_VARIANT in self.variants else ()), external=())

    def comparison(self) -> Plan:
        """The plan of the comparison: this project's variants and the compared methods, computed on the same scenes."""
        own = [name for name in self.variants if name not in VARIANTS]
        return self._of(COMPARISON, (BEST_VARIANT, FAST_VARIANT, MAIN_VARIANT, *own, *compared_methods()))

    def rendered(self, scenes: Sequence[str], choosing: Sequence[str], variants: Sequence[str] | None = None) -> Plan:
        """The plan of the rendered scenes, with these variants and the paper's; default: those of the comparison."""
        names = list(self.comparison().variants) if variants is None else [*variants, MAIN_VARIANT]
        return replace(self._of(DATASET, names), scenes={DATASET: tuple(scenes)}, choosing=tuple(choosing))

    def _of(self, report: str, names: Iterable[str]) -> Plan:
        """The plan of a report, with those of the variants that there are."""
        return replace(self, report=report, variants={v: self.variants[v] for v in names if v in self.variants})

    def without(self, scenes: Collection[tuple[str, str]]) -> Plan:
        """The plan without these scenes, with their names in ``missing``."""
        left = [pair for pair in self.pairs if pair not in scenes]
        there = {dataset: [name for other, name in left if other == dataset] for dataset, _ in left}
        return replace(self, scenes=there, missing=tuple("/".join(pair) for pair in self.pairs if pair in scenes))

    @property
    def tables(self) -> tuple[str, ...]:
        """Names of the tables, in the order of the page."""
        return TABLES[self.report]

    @property
    def charts(self) -> tuple[str, ...]:
        """Names of the charts."""
        return CHARTS.get(self.report, ())

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

    def stage_file(self, dataset: str, scene: str, variant: str, stage: str, ending: str = "h5") -> Path:
        """Path of a variant's maps after a stage; with the ending ``"time.json"``, of the stage's time."""
        return self.files(dataset, scene).stage(self.variants[variant], stage, ending)

    def scores_file(self, dataset: str, scene: str) -> Path:
        """Path of the scores of a scene's maps."""
        return self.files(dataset, scene).scores(self.ending)

    @property
    def ending(self) -> str:
        """Ending of the names of files of scores and numbers."""
        return f"_{self.report}" if self.report else ""

    def stage_key(self, variant: str, stage: str) -> str:
        """Key of a variant's maps after a stage, in numbers and scores."""
        return key_of(self.variants[variant], stage)

    def number_inputs(self) -> list[Path]:
        """Input files of the numbers, each once."""
        files: list[Path] = []
        for dataset, scene in self.pairs:
            known, of_stages = self.files(dataset, scene), itertools.product(self.variants, self.stages)
            files.append(self.scores_file(dataset, scene))
            files += [self.stage_file(dataset, scene, *one, "time.json") for one in of_stages]
            if self.report != PARTS:
                files += [known.light_field, known.truth, *([known.external] if self.external else [])]
        return list(dict.fromkeys(files))

    @property
    def scored_stages(self) -> list[str]:
        """Stages whose maps are scored: all, of the parts of ``best`` the last one."""
        return self.stages[-1:] if self.report == PARTS else self.stages

    def scored_files(self, dataset: str, scene: str) -> list[Path]:
        """Stage files whose maps are scored, each once."""
        every = itertools.product(self.variants, self.scored_stages)
        return list(dict.fromkeys(self.stage_file(dataset, scene, *variant_stage) for variant_stage in every))

    @property
    def compared(self) -> list[str]:
        """Variants that tables compare with the published figures."""
        return list(self.variants) if self.report else self.detailed

    @property
    def detailed(self) -> list[str]:
        """Variants whose stages are all on the page."""
        return [variant for variant in (BEST_VARIANT, MAIN_VARIANT) if variant in self.variants]

    def map_inputs(self, dataset: str, scene: str) -> list[Path]:
        """Input files of the pictures of a scene, each once."""
        known = self.files(dataset, scene)
        files = [known.light_field, known.truth, self.scores_file(dataset, scene)]
        return [*files, *self.scored_files(dataset, scene), *([known.external] if self.external else [])]
