"""A checked configuration, as the rules use it, with the parameters of the stages."""

from __future__ import annotations

import json
import re
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from pydantic import Field

from sepi.errors import SepiError
from sepi.io.scores import ExternalSource
from sepi.registry import added
from sepi.stage import Parameters
from sepi.validation import require_known
from sepi.validation.models import CheckedModel, Index, validated
from sepi.variants import STAGES, VARIANTS, Variant
from sepi.workflow.datasets import Dataset, Scene
from sepi.workflow.result_paths import RESULTS

Values = Mapping[str, Mapping[str, Mapping[str, Any] | None] | None]
"""Stage to choice to field to value."""


def stage_settings(values: Values, variants: Mapping[str, Variant]) -> dict[str, dict[str, Parameters]]:
    """Stage to label to parameters, for every choice and for every choice with a variant's overrides.

    Parameters
    ----------
    values : mapping
        The configuration's ``stages``.
    variants : mapping of str to Variant
        By name.

    Raises
    ------
    SepiError
        At the first wrong stage, choice, field or value; the one-line message names it.
    """
    where = "config.stages"
    require_known(where, values, STAGES)
    found: dict[str, dict[str, Parameters]] = {}
    for stage, choices in STAGES.items():
        own = values.get(stage) or {}
        require_known(f"{where}.{stage}", own, choices)
        found[stage] = {
            name: validated(choice.parameters, own.get(name) or {}, f"{where}.{stage}.{name}")
            for name, choice in choices.items()
        }
        for variant_name, variant in variants.items():
            choice = variant.choices[stage]
            found[stage][variant.labels[stage]] = validated(
                choices[choice].parameters,
                {**(own.get(choice) or {}), **variant.overrides.get(stage, {})},
                f"config.variants.{variant_name}.{stage}",
            )
    return found


# image files and page data of a scene
_PICTURES = re.compile(r"reports/(?:comparison/|rendered/)?(?:maps/([^/]+)/([^/]+)|page/([^/]+)/([^/]+)\.json)")


PAGES = tuple(f"reports/{report}index.html" for report in ("", "comparison/", "rendered/"))

MOST_ON_PAGE = 50
"""Most scenes for which the page is made by default: 100 MB, which a browser still opens."""


class Report(CheckedModel):
    """Keys of ``report``."""

    pixels: dict[str, list[tuple[Index, Index]]] = Field(
        {},
        description="pixels (row, column) to examine in addition to those chosen automatically, such as "
        "{hci/cotton: [[200, 310]]}",
    )
    page: bool | None = Field(
        None,
        description=f"whether to make the page; null: for up to {MOST_ON_PAGE} scenes, each of which adds up to 2 MB",
    )
    partial: bool = Field(
        False,
        description="whether the tables contain only computed scenes and list the others; use it after a run with "
        "failures",
    )
    parts_of_best: bool = Field(
        False, description="whether the page also shows the ablation of 'best'; 'all' then runs its variants too"
    )


@dataclass(frozen=True)
class Settings:
    """A checked configuration.

    Attributes
    ----------
    scenes : mapping of (dataset, scene) to Scene
        Every scene of ``all``, ``ablation`` and ``comparison``, in the tables' order, then those of datasets that stand
        apart.
    variants : mapping of str to Variant
        The built-in variants, then the user's own.
    parameters : mapping of stage to label to Parameters
        Parameters of each stage; the label names the choice and its overridden parameters.
    external : mapping of str to ExternalSource
        External methods and the paths of their maps.
    report : Report
        Settings of the report.
    apart : mapping of str to Dataset
        Settings of these datasets, by name.
    bad_thresholds : tuple of float
        Additional error thresholds.
    """

    scenes: Mapping[tuple[str, str], Scene]
    variants: Mapping[str, Variant]
    parameters: Mapping[str, Mapping[str, Parameters]]
    external: Mapping[str, ExternalSource]
    report: Report
    apart: Mapping[str, Dataset]
    bad_thresholds: tuple[float, ...] = ()

    @property
    def datasets(self) -> list[str]:
        """Names of the datasets that have scenes, except those that stand apart."""
        return list(dict.fromkeys(dataset for dataset, _ in self.scenes if dataset not in self.apart))

    @property
    def own_variants(self) -> list[str]:
        """Names of the variants that the user added."""
        return [name for name in self.variants if name not in VARIANTS]

    def scenes_of(self, dataset: str) -> list[str]:
        """Names of a dataset's scenes."""
        return [name for other, name in self.scenes if other == dataset]

    def scene(self, dataset: str, name: str) -> Scene:
        """A scene by name.

        Raises
        ------
        SepiError
            If it does not exist; the message suggests the nearest name.
        """
        # called by thousands of jobs: names are listed only on an error
        if (dataset, name) not in self.scenes:
            require_known("dataset", [dataset], dict.fromkeys(one for one, _ in self.scenes))
            require_known(f"scene of dataset '{dataset}'", [name], self.scenes_of(dataset))
        return self.scenes[dataset, name]

    def require_target(self, path: str) -> None:
        """Check the names in a requested path, if it is a file of the results or an image of a scene.

        Raises
        ------
        SepiError
            If there is no such dataset, scene or variant; the message suggests the nearest name.
        """
        if path in PAGES and not self.has_page:
            why = "is false" if self.report.page is False else f"is null, and there are over {MOST_ON_PAGE} scenes"
            raise SepiError(f"{path}: not made: report.page {why}; true asks for it")
        pictures = _PICTURES.fullmatch(path)
        if pictures:
            self.scene(*filter(None, pictures.groups()))
        folder, *names = Path(path).parts or ("",)
        if folder == str(RESULTS) and len(names) > 2:
            self.scene(names[0], names[1])
            if len(names) == 4 and names[2] != "stages":
                require_known(f"{path}: variant", [names[2]], self.variants)

    @property
    def has_page(self) -> bool:
        """Whether the report's page is made."""
        if not added("scenes"):
            return False
        number = sum(dataset not in self.apart for dataset, _ in self.scenes)
        return number <= MOST_ON_PAGE if self.report.page is None else self.report.page

    def parameters_json(self, stage: str, label: str) -> str:
        """Parameters of a stage's choice as JSON with sorted keys."""
        return json.dumps(self.parameters[stage][label].model_dump(mode="json"), sort_keys=True)

    def external_files(self, dataset: str, name: str) -> dict[str, Path]:
        """Method to the path of its map of a scene, which need not exist.

        Raises
        ------
        SepiError
            If there is no such scene.
        """
        scene = self.scene(dataset, name)
        return {method: source.file(scene.dataset, scene.name) for method, source in self.external.items()}

    def external_json(self, dataset: str, name: str) -> str:
        """Input of ``python -m sepi.external`` for a scene, in the order of the configuration."""
        files = self.external_files(dataset, name)
        found = self.external.items()
        return json.dumps({method: source.model_dump() | {"path": str(files[method])} for method, source in found})
