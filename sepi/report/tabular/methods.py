"""Methods of tables 1 to 4: this project's variants, the published methods, and external methods' maps."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import NamedTuple

from sepi.external import NO_FILE
from sepi.report import published
from sepi.report.plan import MAIN_VARIANT, Plan
from sepi.report.runs import Runs
from sepi.report.tabular.layout import Cell, Kind, printed
from sepi.scoring.scores import PROTOCOLS, WHOLE_MAP

SCENE, AVERAGE, PRINTED_AVERAGE = "scene", "average", "average printed"
"""Kinds of rows in the CSV files."""

PROTOCOL_NOTE = f"Protocol: paper (border {PROTOCOLS['paper']}, the whole map)."
LEARNED_NOTE = "* learned, supervised; ** learned, unsupervised."
EXTERNAL_NOTE = (
    "External: maps that other methods made, scored here as ours are; they are not ranked, since nothing says whether "
    "their method is learned."
)
REGIONS_NOTE = (
    "Regions are those of `sepi.scoring.regions`, or the exact ones that a built-in scene brings; the paper's are "
    "not known."
)


@dataclass(frozen=True)
class Method:
    """A method in a table, or a ratio to the paper's figures.

    Attributes
    ----------
    name : str
        Name of the variant or method.
    key, head : str
        Its names in the CSV files and on the pages.
    kind : Kind
        ``OURS``, ``RATIO`` (of ours to the paper's), ``PUBLISHED`` or ``EXTERNAL``.
    learning : str
        As in :class:`sepi.report.published.Method`; empty if unknown or not applicable.
    """

    name: str
    key: str
    head: str
    kind: Kind
    learning: str = ""

    @property
    def is_here(self) -> bool:
        """Whether its maps were scored here."""
        return self.kind in (Kind.OURS, Kind.EXTERNAL)

    def shown(self, figure: Cell) -> Cell:
        """A figure of this method as in the tables."""
        return printed(figure) if self.kind == Kind.PUBLISHED and isinstance(figure, float) else figure


def compared_methods(plan: Plan) -> list[Method]:
    """All methods in the order of the tables: ours, their ratios to published figures, published, external."""
    suffixes = {variant: "" if variant == MAIN_VARIANT else f"_{variant}" for variant in plan.compared}
    signs = {"none": "", "supervised": "*", "unsupervised": "**"}
    methods = [
        *(Method(v, f"ours{suffix}", f"this code, {v}", Kind.OURS, "none") for v, suffix in suffixes.items()),
        *(Method(v, f"ratio{suffix}", f"{v} / published", Kind.RATIO) for v, suffix in suffixes.items()),
        *(
            Method(m.key, m.key, m.label + signs[m.learning], Kind.PUBLISHED, m.learning)
            for m in published.methods().values()
        ),
    ]
    taken = {"dataset", "scene", "row", "method", "learning", *(method.key for method in methods)}
    for name in plan.external:
        key = name
        # a name that a column has already gets a suffix
        while key in taken:
            key += " (external)"
        taken.add(key)
        methods.append(Method(name, key, f"{name} (external)", Kind.EXTERNAL))
    return methods


def unknown_note(runs: Runs, dataset: str, scene: str, method: str) -> str:
    """Note on the share of an external map that is not finite, which its MSE leaves out; empty if all is finite."""
    scores = runs.external_scores(dataset, scene, method)
    whole = scores["paper"][WHOLE_MAP] if scores else {"pixels": 0}
    return f"{100 * whole['non_finite'] / whole['pixels']:.0f} % unknown" if whole.get("non_finite") else ""


def has_column(runs: Runs, dataset: str, method: str) -> bool:
    """Whether an external method has a column on a dataset's page.

    A method with files for other datasets only has none. A method without any file has one, to show the problem.
    """
    with_file = {name for name, scene in runs.plan.pairs if runs.external_problem(name, scene, method) != NO_FILE}
    return dataset in with_file or (not with_file and dataset in runs.plan.scenes)


def own_names(plan: Plan) -> str:
    """Names of the compared variants, for a caption."""
    *names, last = (f"`{variant}`" for variant in plan.compared)
    return f"{', '.join(names)} and {last}" if names else last


def datasets_of(plan: Plan) -> list[str]:
    """Available datasets, then the paper's others."""
    return list(dict.fromkeys([*plan.scenes, *published.DATASETS]))


def dataset_title(dataset: str) -> str:
    """Title of a dataset, with the paper's name if it has one."""
    return f"{dataset}: {published.DATASETS[dataset]}" if dataset in published.DATASETS else dataset


def average_label(count: int) -> str:
    """Name of the row with averages of our figures."""
    return f"Average of {count} scene{'s' * (count != 1)} available"


def printed_label(dataset: str) -> str:
    """Name of the row with the paper's averages."""
    return f"Average as printed ({len(published.table1().scenes(dataset))} scenes)"


class Mean(NamedTuple):
    """A mean, and the number of its figures."""

    value: Cell
    scenes: int


def mean(figures: Iterable[Cell]) -> Mean:
    """Mean of the scores that exist; NaN without any, since scenes may lack a region."""
    known = [figure for figure in figures if isinstance(figure, float) and not math.isnan(figure)]
    return Mean(sum(known) / len(known) if known else math.nan, len(known))


def average(runs: Runs, dataset: str, scenes: Iterable[str], score: str, region: str, variant: str) -> Mean:
    """Mean of a score over those of the scenes that have the region."""
    return mean(runs.final(dataset, scene, score, region, variant) for scene in scenes)


def count_note(counts: Sequence[int], scenes: int) -> str:
    """Note on the numbers of scenes in a cell's figures, if one is lower than in its row."""
    if all(count in (0, scenes) for count in counts):
        return ""
    return f"{'/'.join(map(str, counts))} scene{'s' * (list(counts) != [1])}"
