"""The figures that the paper [1]_ prints, from CSV files in the folder ``published`` beside this module.

References
----------
.. [1] P. Zhou, L. Shi, X. Liu, J. Jin, Y. Zhang, J. Hou, "Light Field Depth Estimation via Stitched Epipolar Plane
   Images", tables 1 to 4, sections V-B and V-C.
"""

from __future__ import annotations

import csv
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from pathlib import Path

from sepi.scoring.scores import REGIONS, WHOLE_MAP

FOLDER = Path(__file__).parent / "published"
"""Folder of the data files."""

AVERAGE = "Average"
"""Name of the average rows in the paper's tables 1 and 2."""

PAPERS_METHOD = "zhou"
"""Key of the paper's own method."""

DATASETS: dict[str, str] = {"hci": "HCI 4D light field benchmark", "hci_2013": "HCI Blender (2013)"}
"""Datasets of the paper by their names in this project."""

# folders of the archive of 2013 with other names than in the paper
_ARCHIVE_NAMES = {("hci_2013", "monasroom"): "Monas"}

# the averages of the learned methods are without this scene
_LEFT_OUT_OF_TABLE2 = frozenset({"Boxes", "Cotton", "Dino", "Sideboard"})

RegionTable = dict[str, dict[str, float]]
"""Method or variant to region of :data:`sepi.scoring.scores.REGIONS` to average 100 x MSE, if the paper has one."""


@dataclass(frozen=True)
class Method:
    """A method in the paper's tables.

    Attributes
    ----------
    key : str
        Name in the data files.
    column : str
        Letter of its column in tables 1 and 2; empty if it is in table 3 only.
    authors, name : str
        As in the paper; ``name`` is empty if the paper gives none.
    learning : str
        ``"none"``, ``"supervised"`` or ``"unsupervised"``.
    variant : str
        The variant that computes it, if any; else empty.
    """

    key: str
    column: str
    authors: str
    name: str
    learning: str
    variant: str

    @property
    def label(self) -> str:
        """Authors and name for a table's header."""
        return f"{self.authors} ({self.name})" if self.name else self.authors


@dataclass(frozen=True)
class SceneTable:
    """Table 1 or 2: a figure per dataset, scene and method.

    Attributes
    ----------
    cells : mapping
        ``(dataset, scene)`` to ``{method key: figure}``, in the paper's order. A method trained on the scene has no
        figure.
    averages : mapping
        Dataset to ``{method key: figure}``, the average rows as printed.
    left_out : set
        Scenes outside the averages of methods that lack figures.
    """

    cells: Mapping[tuple[str, str], Mapping[str, float]]
    averages: Mapping[str, Mapping[str, float]]
    left_out: frozenset[str] = frozenset()

    def scenes(self, dataset: str) -> list[str]:
        """Scenes of a dataset, in the paper's order."""
        return [scene for name, scene in self.cells if name == dataset]

    def averaged(self, dataset: str, method: str) -> int:
        """Number of scenes in a method's printed average for a dataset; 0 without figures."""
        scenes = self.scenes(dataset)
        known = [scene for scene in scenes if method in self.cells[dataset, scene]]
        return len(known) if len(known) == len(scenes) else len({*known} - self.left_out)


def paper_scene(dataset: str, scene: str) -> str | None:
    """The paper's name of a scene; None if the paper does not have it.

    Only datasets in :data:`DATASETS` count, so that the built-in scene ``dots`` is not mistaken for the benchmark's.
    Capitals do not matter.
    """
    named = {name.lower(): name for name in table1().scenes(dataset)}
    return named.get(scene.lower(), _ARCHIVE_NAMES.get((dataset, scene.lower())))


@cache
def methods() -> dict[str, Method]:
    """Methods of tables 1 to 3 by key: columns (a) to (k), then those of table 3 only."""
    return {row["key"]: Method(**row) for row in _rows("methods.csv")}


def counterpart(variant: str) -> Method:
    """The published method with which a variant is compared: a compared method's own, else the paper's."""
    return next((one for one in methods().values() if one.variant == variant), methods()[PAPERS_METHOD])


@cache
def table1() -> SceneTable:
    """Table 1: 100 x MSE over the whole map."""
    return _scene_table("table1_mse.csv")


@cache
def table2() -> SceneTable:
    """Table 2: Q25 x 100 over the whole map."""
    return _scene_table("table2_q25.csv", _LEFT_OUT_OF_TABLE2)


@cache
def table3() -> dict[str, RegionTable]:
    """Table 3 by dataset: methods in occluded and textureless regions."""
    return {
        dataset: {
            row["method"]: {region: float(row[f"{dataset}_{region}"]) for region in REGIONS if region != WHOLE_MAP}
            for row in _rows("table3_regions.csv")
        }
        for dataset in DATASETS
    }


@cache
def table4() -> dict[str, RegionTable]:
    """Table 4 by dataset, with the text's figures for Wang's occlusion stage: variants over map and regions."""
    table: dict[str, RegionTable] = {dataset: {} for dataset in DATASETS}
    for row in _rows("table4_ablation.csv"):
        table[row["dataset"]][row["variant"]] = {region: float(row[region]) for region in REGIONS if row[region]}
    return table


@cache
def runtime() -> dict[str, float]:
    """Seconds per stage and ``"total"``, for 512 x 512 pixels and 9 x 9 views on one core of an Intel Core i7-8700."""
    return {row["stage"]: float(row["seconds"]) for row in _rows("runtime.csv")}


def _scene_table(name: str, left_out: frozenset[str] = frozenset()) -> SceneTable:
    cells: dict[tuple[str, str], dict[str, float]] = {}
    averages: dict[str, dict[str, float]] = {}
    for row in _rows(name):
        dataset, scene = row.pop("dataset"), row.pop("scene")
        figures = {method: float(text) for method, text in row.items() if text}
        if scene == AVERAGE:
            averages[dataset] = figures
        else:
            cells[dataset, scene] = figures
    return SceneTable(cells, averages, left_out)


def _rows(name: str) -> list[dict[str, str]]:
    text = (FOLDER / name).read_text(encoding="utf-8")
    return list(csv.DictReader(line for line in text.splitlines() if not line.startswith("#")))
