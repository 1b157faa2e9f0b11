"""The figures that the paper [1]_ prints, from CSV files in the folder ``published`` beside this module.

References
----------
.. [1] P. Zhou, L. Shi, X. Liu, J. Jin, Y. Zhang, J. Hou, "Light Field Depth Estimation via Stitched Epipolar Plane
   Images", tables 1 to 4, sections V-B and V-C.
"""

from __future__ import annotations

from functools import cache
from typing import cast

import pandas as pd

from sepi.report.plan import PUBLISHED

AVERAGE = "Average"
"""Name of the average rows in the paper's tables 1 and 2."""

PAPERS_METHOD = "zhou"
"""Key of the paper's own method."""

DATASETS: dict[str, str] = {"hci": "HCI 4D light field benchmark", "hci_2013": "HCI Blender (2013)"}
"""Datasets of the paper by their names in this project."""

# folders of the archive of 2013 with other names than in the paper
_ARCHIVE_NAMES = {("hci_2013", "monasroom"): "Monas"}

# the averages of the learned methods are without these scenes, in table 2
_LEFT_OUT_OF_TABLE2 = frozenset({"Boxes", "Cotton", "Dino", "Sideboard"})


@cache
def methods() -> pd.DataFrame:
    """Methods of tables 1 to 3 by key, columns (a) to (k) first, then those of table 3 only.

    Returns
    -------
    DataFrame
        ``column``: letter of its column in tables 1 and 2, empty if it is in table 3 only; ``authors`` and ``name``: as
        in the paper; ``learning``: ``"none"``, ``"supervised"`` or ``"unsupervised"``; ``variant``: the one that
        computes it, if any; ``label``: authors and name for a table's header.
    """
    found = _read("methods", "key").fillna("")
    named = found["authors"] + " (" + found["name"] + ")"
    return found.assign(label=named.where(found["name"] != "", found["authors"]))


def counterpart(variant: str) -> str:
    """Key of the published method with which a variant is compared: a compared method's own, else the paper's."""
    return next((str(key) for key, name in methods()["variant"].items() if name == variant), PAPERS_METHOD)


def table1() -> pd.DataFrame:
    """Table 1: 100 x MSE over the whole map; rows ``(dataset, scene)``, then the averages as printed, columns methods.

    A method trained on a scene has no figure for it.
    """
    return _read("table1_mse", "dataset", "scene")


def table2() -> pd.DataFrame:
    """Table 2: Q25 x 100 over the whole map, as :func:`table1`."""
    return _read("table2_q25", "dataset", "scene")


def table3() -> pd.DataFrame:
    """Table 3: 100 x MSE; rows methods, columns ``(dataset, region)``."""
    found = _read("table3_regions", "method")
    return found.set_axis(pd.MultiIndex.from_tuples([tuple(name.rsplit("_", 1)) for name in found.columns]), axis=1)


def table4() -> pd.DataFrame:
    """Table 4: 100 x MSE; rows ``(dataset, variant)``, columns regions. Wang's occlusion stage is from the text."""
    return _read("table4_ablation", "dataset", "variant")


def runtime() -> dict[str, float]:
    """Seconds per stage and ``"total"``, for 512 x 512 pixels and 9 x 9 views on one core of an Intel Core i7-8700."""
    return {str(stage): float(took) for stage, took in _read("runtime", "stage")["seconds"].items()}


def scenes(dataset: str) -> list[str]:
    """The paper's scenes of a dataset, in its order; none of a dataset that it does not have."""
    return [scene for name, scene in table1().index if name == dataset and scene != AVERAGE]


def averaged(table: pd.DataFrame, dataset: str) -> dict[str, int]:
    """Number of scenes in each method's printed average for a dataset of table 1 or 2."""
    known = table.loc[dataset].drop(AVERAGE).notna()
    every, fewer = known.sum(), known[~known.index.isin(_LEFT_OUT_OF_TABLE2 if table is table2() else [])].sum()
    return cast("dict[str, int]", every.where(every == len(known), fewer).to_dict())


def paper_scene(dataset: str, scene: str) -> str | None:
    """The paper's name of a scene; None if the paper does not have it.

    Only datasets in :data:`DATASETS` count, so that the built-in scene ``dots`` is not mistaken for the benchmark's.
    Capitals do not matter.
    """
    named = {name.lower(): name for name in scenes(dataset)}
    return named.get(scene.lower(), _ARCHIVE_NAMES.get((dataset, scene.lower())))


@cache
def _read(name: str, *index: str) -> pd.DataFrame:
    return pd.read_csv(PUBLISHED / f"{name}.csv", comment="#").set_index([*index])
