"""Score files: what the evaluation of one disparity map found.

Layout: a group ``scores/PROTOCOL/REGION`` per cell with one attribute per score, the signed error map ``error (H, W)``
and the masks ``regions/NAME (H, W)``. Where the scene has no ground truth there is none of these, and the root
attribute ``ground_truth`` is False.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import h5py
import numpy as np

from sepi.errors import SepiError
from sepi.io.hdf5 import UNITS, Attribute, created, opened
from sepi.lightfield import BoolMap, FloatMap

Scores = dict[str, float]
"""Score to value, for one protocol and region."""


@dataclass(frozen=True)
class Evaluation:
    """Scores of one disparity map.

    Attributes
    ----------
    scores : mapping
        Protocol to region to scores; empty where there is no ground truth.
    error : ndarray, shape (H, W), float32, or None
        Estimate minus truth in pixels per view step; NaN where either is unknown.
    regions : mapping of str to ndarray, shape (H, W), bool
        The masks that the scores of a region were taken over.
    region_sources : mapping of str to str
        ``"scene"`` (the scene brought the mask) or ``"computed"`` (by ``sepi.regions``).
    """

    scores: Mapping[str, Mapping[str, Scores]] = field(default_factory=dict)
    error: FloatMap | None = None
    regions: Mapping[str, BoolMap] = field(default_factory=dict)
    region_sources: Mapping[str, str] = field(default_factory=dict)


def write_scores(path: Path, evaluation: Evaluation, attributes: Mapping[str, Attribute]) -> None:
    """Write an evaluation and the attributes that say what was evaluated; equal content gives equal bytes."""
    with created(path) as file:
        file.attrs["ground_truth"] = evaluation.error is not None
        for key, value in attributes.items():
            file.attrs[key] = value
        put_evaluation(file, evaluation)


def read_scores(path: Path) -> dict[str, dict[str, Scores]]:
    """Protocol to region to scores; empty where the scene has no ground truth.

    Raises
    ------
    SepiError
        If the file is missing, not HDF5, or not a score file.
    """
    with opened(path) as file:
        _require_scores(path, file)
        return scores_in(file)


def read_evaluation(path: Path) -> Evaluation:
    """Everything in a score file.

    Raises
    ------
    SepiError
        If the file is missing, not HDF5, or not a score file.
    """
    with opened(path) as file:
        _require_scores(path, file)
        return evaluation_in(file)


def put_evaluation(group: h5py.Group, evaluation: Evaluation) -> None:
    """Write an evaluation into an empty group, or a file's root."""
    for protocol, regions in evaluation.scores.items():
        for region, scores in regions.items():
            group.create_group(f"scores/{protocol}/{region}").attrs.update(scores)
    if evaluation.error is not None:
        group.create_dataset("error", data=evaluation.error)
        group["error"].attrs["units"] = UNITS["disparity"]
    for name, mask in evaluation.regions.items():
        dataset = group.create_dataset(f"regions/{name}", data=mask, compression="gzip", compression_opts=1)
        dataset.attrs["source"] = evaluation.region_sources[name]


def scores_in(group: h5py.Group) -> dict[str, dict[str, Scores]]:
    """The scores alone of what :func:`put_evaluation` wrote: protocol to region to scores."""
    return {
        protocol: {region: {key: float(value) for key, value in cell.attrs.items()} for region, cell in regions.items()}
        for protocol, regions in group.get("scores", {}).items()
    }


def evaluation_in(group: h5py.Group) -> Evaluation:
    """What :func:`put_evaluation` wrote."""
    regions: Mapping[str, Any] = group.get("regions", {})
    return Evaluation(
        scores=scores_in(group),
        error=group["error"][...].astype(np.float32) if "error" in group else None,
        regions={name: mask[...].astype(bool) for name, mask in regions.items()},
        region_sources={name: str(mask.attrs["source"]) for name, mask in regions.items()},
    )


def _require_scores(path: Path, file: h5py.File) -> None:
    if "ground_truth" not in file.attrs:
        raise SepiError(f"{path}: not a score file (written by python -m sepi.evaluate): no attribute 'ground_truth'")
