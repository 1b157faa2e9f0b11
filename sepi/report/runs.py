"""The numbers of a report: scores and times in one data frame, facts about what they are of, and their methods."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from sepi.external import NO_FILE
from sepi.io.files import reading
from sepi.report import published
from sepi.report.plan import MAIN_VARIANT, Plan
from sepi.report.table import Kind
from sepi.scoring.error_bars import ERROR_BAR_SCORES, Reliability
from sepi.scoring.scores import COUNTS, EDGE_SCORES, PROTOCOLS, WHOLE_MAP, score_heads

PROTOCOL_NOTE = f"Protocol: paper (border {PROTOCOLS['paper']}, the whole map)."
EXTERNAL_NOTE = (
    "External: maps that other methods made, scored here as ours are; they are not ranked, since nothing says whether "
    "their method is learned."
)
REGIONS_NOTE = (
    "Regions are those of `sepi.scoring.regions`, or the exact ones that a built-in scene brings; the paper's are "
    "not known."
)


def own_key(variant: str) -> str:
    """Key of a variant among the methods."""
    return "ours" if variant == MAIN_VARIANT else f"ours_{variant}"


def datasets_of(plan: Plan) -> list[str]:
    """Available datasets, then the paper's others."""
    return list(dict.fromkeys([*plan.scenes, *published.DATASETS]))


def count_note(counts: Sequence[int], scenes: int) -> str:
    """Note on the numbers of scenes in a cell's figures, if one is lower than in its row."""
    if all(count in (0, scenes) for count in counts):
        return ""
    return f"{'/'.join(map(str, counts))} scene{'s' * (list(counts) != [1])}"


KEYS = ["dataset", "scene", "variant", "stage", "choice", "protocol", "region"]
"""Columns that name a number, besides ``score``."""

EXTERNAL = "external"
"""Stage of the maps of external methods, whose names are in the column ``variant``."""

TENTHS = "tenths of confidence"
"""Protocol of the numbers of a :class:`Reliability`; their regions are tenths, 0 to 9."""


@dataclass(frozen=True)
class Runs:
    """Scores and times of a plan.

    Attributes
    ----------
    facts : mapping
        Values of JSON, as :func:`sepi.report.numbers.collect` describes them.
    numbers : DataFrame
        A row for each number: :data:`KEYS`, ``score``, ``value``. A score over no pixels is NaN.
    """

    facts: Mapping[str, Any]
    numbers: pd.DataFrame

    @cached_property
    def plan(self) -> Plan:
        """Scenes, variants and external methods; its files are not available."""
        return Plan.from_json(Path(), json.dumps(self.facts["plan"]))

    @cached_property
    def methods(self) -> pd.DataFrame:
        """All methods in the order of the tables: ours, their ratios to published figures, published, external.

        Returns
        -------
        DataFrame
            By keys, their names in CSV files: ``name`` of the variant or method; ``head`` on the pages; ``kind``; and
            ``learning`` as in :func:`sepi.report.published.methods`, empty if unknown or not applicable.
        """
        compared, signs = self.plan.compared, {"none": "", "supervised": "*", "unsupervised": "**"}
        rows = [(own_key(v), v, f"this code, {v}", Kind.OURS, "none") for v in compared]
        rows += [(f"ratio{own_key(v)[4:]}", v, f"{v} / published", Kind.RATIO, "") for v in compared]
        rows += [
            (str(key), str(key), row["label"] + signs[row["learning"]], Kind.PUBLISHED, row["learning"])
            for key, row in published.methods().iterrows()
        ]
        taken = {"dataset", "scene", "row", "method", "learning", *(key for key, *_ in rows)}
        taken.update(map(own_key, self.plan.variants))
        for name in self.plan.external:
            key = name
            # a name that a column has already gets a suffix
            while key in taken:
                key += " (external)"
            taken.add(key)
            rows.append((key, name, f"{name} (external)", Kind.EXTERNAL, ""))
        return pd.DataFrame(rows, columns=["key", "name", "head", "kind", "learning"]).set_index("key")

    def external_of(self, dataset: str) -> pd.DataFrame:
        """Those of the external :attr:`methods` that tables of a dataset show.

        A method with files for other datasets only is not shown. A method without any file is, to show the problem.
        """
        every = self.methods[self.methods["kind"] == Kind.EXTERNAL]

        def is_shown(method: str) -> bool:
            pairs = [pair for pair in self.plan.pairs if self.problem(pair[0], pair[1:], method) != NO_FILE]
            return dataset in {one for one, _ in pairs or self.plan.pairs}

        return every[every["name"].map(is_shown).astype(bool)]

    @cached_property
    def maps(self) -> pd.DataFrame:
        """A column for each score; rows :data:`KEYS`, in the order of the numbers."""
        order = pd.MultiIndex.from_frame(self.numbers[KEYS].drop_duplicates())
        known = [*score_heads(self.plan.bad_thresholds), *EDGE_SCORES, *COUNTS, *ERROR_BAR_SCORES]
        found = self.numbers.pivot(index=KEYS, columns="score", values="value").reindex(index=order)
        return found.reindex(columns=dict.fromkeys([*known, "seconds", "peak_memory_mb", *found.columns]))

    @cached_property
    def final(self) -> pd.DataFrame:
        """Scores of final maps by the paper's protocol; rows ``(dataset, scene, method, region)``.

        ``method`` is a key of :attr:`methods`, or for variants that are not compared, :func:`own_key`.
        """
        found = self.maps.reset_index()
        found = found[(found["protocol"] == "paper") & found["stage"].isin([self.plan.stages[-1], EXTERNAL])]
        external = dict(zip(self.plan.external, self.methods.index[self.methods["kind"] == EXTERNAL], strict=True))
        of_maps = zip(found["variant"], found["stage"], strict=True)
        keys = [external[name] if stage == EXTERNAL else own_key(name) for name, stage in of_maps]
        return found.assign(method=keys).set_index(["dataset", "scene", "method", "region"])

    def of(self, score: str, dataset: str, region: str = WHOLE_MAP) -> pd.DataFrame:
        """A score of the final maps of a dataset: a row for each scene with ground truth, a column for each method."""
        scenes = self.scored(dataset)
        rows = pd.MultiIndex.from_product([[dataset], scenes, [region]])
        return self.final[score].unstack("method").reindex(index=rows).set_axis(scenes)

    def scored(self, dataset: str) -> list[str]:
        """Scenes of a dataset with scores, that is, with ground truth."""
        return [scene for name, scene in self.scored_pairs if name == dataset]

    @cached_property
    def scored_pairs(self) -> list[tuple[str, str]]:
        """Every ``(dataset, scene)`` with scores."""
        known = set(self.final.index.droplevel(["method", "region"]))
        return [pair for pair in self.plan.pairs if pair in known]

    @cached_property
    def times(self) -> pd.DataFrame:
        """Seconds and peak memory, MB, of stages that are switched on; rows ``(dataset, scene, variant, stage)``."""
        return self.maps[["seconds", "peak_memory_mb"]].dropna().droplevel(["choice", "protocol", "region"])

    @cached_property
    def totals(self) -> pd.DataFrame:
        """Seconds of all stages, and the largest peak memory; rows ``(dataset, scene, variant)``."""
        return self.times.groupby(level=KEYS[:3]).agg({"seconds": "sum", "peak_memory_mb": "max"})

    def reliability(self, variant: str, pairs: Sequence[tuple[str, str]]) -> Reliability:
        """Reliability of a variant's confidence over the pixels of several scenes together."""
        found = self.maps.xs((variant, self.plan.stages[-1], TENTHS), level=("variant", "stage", "protocol"))
        found = found[found.index.droplevel(["choice", "region"]).isin(pairs)]
        found = weighted_means(found[["said", "found"]], found["pixels"], "region")
        return Reliability(*(found[name].to_numpy(np.float64) for name in ("pixels", "said", "found")))

    @cached_property
    def scenes(self) -> dict[tuple[str, str], dict[str, Any]]:
        """Facts about each ``(dataset, scene)``."""
        return {(values["dataset"], values["scene"]): values for values in self.facts["scenes"]}

    def problem(self, dataset: str, scenes: Sequence[str], method: str) -> str:
        """Why an external method has no scores of scenes, or of how many it has some; empty if of all."""
        problems = [self.scenes[dataset, scene]["external"][method]["problem"] for scene in scenes]
        return "".join(problems[:1]) if len(set(problems)) < 2 else f"{problems.count('')} of {len(scenes)} scenes"

    def problems(self, dataset: str, scenes: Sequence[str]) -> pd.Series:
        """The :meth:`problem` of every method in the tables, empty but for external ones."""
        found = self.methods[["name", "kind"]].itertuples(index=False)
        told = [self.problem(dataset, scenes, name) if kind == EXTERNAL else "" for name, kind in found]
        return pd.Series(told, self.methods.index, dtype=object)


_KIND = "file of a report's numbers (written by python -m sepi.report.tables)"


def weighted_means(values: pd.DataFrame, pixels: pd.Series, by: Any) -> pd.DataFrame:
    """Means over the pixels of several maps, with their number in the column ``pixels``; NaN over none."""
    sums = values.mul(pixels, axis=0)[pixels > 0].groupby(by, sort=False).agg(lambda column: column.sum(skipna=False))
    every = pixels.groupby(by, sort=False).sum()
    return sums.reindex(every.index).div(every, axis=0).assign(pixels=every)


def read_numbers(path: Path) -> Runs:
    """The numbers in two files that ``python -m sepi.report.tables`` wrote: this one, and ``.csv`` beside it.

    Raises
    ------
    SepiError
        If a file is missing or has other contents.
    """
    facts, table = read_json(path, {"plan", "scenes"}, _KIND), path.with_suffix(".csv")
    with reading(table, _KIND):
        kinds = dict.fromkeys([*KEYS, "score"], str) | {"value": float}
        numbers = pd.read_csv(table, usecols=[*kinds], dtype=kinds, keep_default_na=False, na_values={"value": ["nan"]})
    return Runs(facts, numbers)


def read_json(path: Path, keys: set[str], kind: str) -> dict[str, Any]:
    """The JSON object in a file of this kind.

    Raises
    ------
    SepiError
        If the file is missing or lacks one of the keys.
    """
    with reading(path, kind):
        found = dict(json.loads(path.read_text(encoding="utf-8")))
        if not keys <= found.keys():
            raise ValueError(f"without {', '.join(sorted(keys - found.keys()))}")
    return found
