"""Methods of the tables: this project's variants, the published methods, and external methods' maps."""

from __future__ import annotations

from collections.abc import Sequence

import pandas as pd

from sepi.report import published
from sepi.report.plan import MAIN_VARIANT, Plan
from sepi.report.tabular.table import Kind
from sepi.scoring.scores import PROTOCOLS

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


def own_key(variant: str) -> str:
    """Key of a variant among the methods."""
    return "ours" if variant == MAIN_VARIANT else f"ours_{variant}"


def compared_methods(plan: Plan) -> pd.DataFrame:
    """All methods in the order of the tables: ours, their ratios to published figures, published, external.

    Returns
    -------
    DataFrame
        By keys, their names in CSV files: ``name`` of the variant or method; ``head`` on the pages; ``kind``; and
        ``learning`` as in :func:`sepi.report.published.methods`, empty if unknown or not applicable.
    """
    signs = {"none": "", "supervised": "*", "unsupervised": "**"}
    rows = [(own_key(v), v, f"this code, {v}", Kind.OURS, "none") for v in plan.compared]
    rows += [(f"ratio{own_key(v)[4:]}", v, f"{v} / published", Kind.RATIO, "") for v in plan.compared]
    rows += [
        (str(key), str(key), row["label"] + signs[row["learning"]], Kind.PUBLISHED, row["learning"])
        for key, row in published.methods().iterrows()
    ]
    taken = {"dataset", "scene", "row", "method", "learning", *(key for key, *_ in rows), *map(own_key, plan.variants)}
    for name in plan.external:
        key = name
        # a name that a column has already gets a suffix
        while key in taken:
            key += " (external)"
        taken.add(key)
        rows.append((key, name, f"{name} (external)", Kind.EXTERNAL, ""))
    return pd.DataFrame(rows, columns=["key", "name", "head", "kind", "learning"]).set_index("key")


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
    return f"Average as printed ({len(published.scenes(dataset))} scenes)"


def count_note(counts: Sequence[int], scenes: int) -> str:
    """Note on the numbers of scenes in a cell's figures, if one is lower than in its row."""
    if all(count in (0, scenes) for count in counts):
        return ""
    return f"{'/'.join(map(str, counts))} scene{'s' * (list(counts) != [1])}"
