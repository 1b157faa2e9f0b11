"""Score files of a scene's disparity maps, and files of external methods' maps with their scores.

A score file has a group ``maps/NAME`` for each map. It holds ``scores``, JSON from protocol and region to scores, the
signed error map ``error (H, W)``, and the masks ``regions/NAME (H, W)``, which all maps share and which are stored
once. A map with error bars also has ``reliability (3, 10)``. If the scene has no ground truth, these groups are empty,
and the root attribute ``ground_truth`` is False.

A file of external maps has a group ``methods/NAME`` for each method, in the order of the configuration, with the
attributes ``source``, ``problem`` and ``sha256``. If there is no problem it holds ``disparity (H, W)``, and the
datasets of a score file if the scene has ground truth.
"""

from __future__ import annotations

import json
import math
import os
from collections.abc import Collection, Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import numpy.typing as npt
from pydantic import BaseModel, ConfigDict, Field

from sepi.errors import SepiError
from sepi.io.disparity_maps import SUFFIXES, map_file
from sepi.io.hdf5 import Attribute, attribute, create_hdf5, float_maps, members, open_hdf5, put, read_dataset
from sepi.lightfield import BoolMap, FloatMap

_MAPS, _SCORES = "maps", "scores"
_RELIABILITY = "reliability"
_KIND = "score file (written by python -m sepi.evaluate)"

Scores = dict[str, float]
"""Score to value, for one protocol and region."""

AllScores = dict[str, dict[str, Scores]]
"""Protocol to region to scores."""


@dataclass(frozen=True)
class Evaluation:
    """Scores of one disparity map, its error, and the scored regions (:func:`sepi.evaluate.evaluation_of`).

    Attributes
    ----------
    scores : mapping
        Protocol to region to scores; empty without ground truth.
    error : ndarray, shape (H, W), float32, or None
        Estimate minus ground truth in pixels per view step; NaN where either is unknown.
    regions : mapping of str to ndarray, shape (H, W), bool
        Masks of the scored regions.
    region_sources : mapping of str to str
        ``"scene"`` (the mask comes with the scene) or ``"computed"`` (by :mod:`sepi.scoring.regions`).
    reliability : ndarray, shape (3, 10), or None
        Reliability of the confidence over the whole map (:class:`sepi.scoring.error_bars.Reliability`); None without
        error bars.

    Examples
    --------
    >>> import numpy as np
    >>> from sepi.evaluate import evaluation_of
    >>> from sepi.io.scores import Evaluation
    >>> from sepi.scenes import render
    >>> light_field = render("dots", size=64, views=3)
    >>> found = evaluation_of(light_field, light_field.ground_truth + np.float32(0.5))
    >>> isinstance(found, Evaluation), round(found.scores["paper"]["occluded"]["mse100"], 3)
    (True, 25.0)
    >>> round(float(found.error.mean()), 3), found.region_sources["occluded"]
    (0.5, 'scene')
    """

    scores: Mapping[str, Mapping[str, Scores]] = field(default_factory=dict)
    error: FloatMap | None = None
    regions: Mapping[str, BoolMap] = field(default_factory=dict)
    region_sources: Mapping[str, str] = field(default_factory=dict)
    reliability: npt.NDArray[np.float64] | None = None


def map_name(stages: Path, file: Path) -> str:
    """Name of the map in a stage file: its path below the folder of a scene's stage files.

    Raises
    ------
    SepiError
        If the file is not below that folder.
    """
    if not file.parent.is_relative_to(stages):
        raise SepiError(f"{file}: not below {stages}, the folder of the stage files")
    return file.parent.relative_to(stages).as_posix()


def write_scores(path: Path, maps: Mapping[str, Evaluation], attributes: Mapping[str, Attribute]) -> None:
    """Write the evaluations of a scene's maps and the attributes of the scene; equal content gives equal bytes.

    The name of a map is a path such as ``"sepi/half_sepi"``.
    """
    with create_hdf5(path) as file:
        file.attrs["ground_truth"] = any(found.error is not None for found in maps.values())
        file.attrs.update(attributes)
        groups = file.create_group(_MAPS, track_order=True)
        shared: Mapping[str, h5py.Dataset] = {}
        for name, evaluation in maps.items():
            # a slash would make nested groups; no label of a choice has a colon
            group = groups.create_group(name.replace("/", ":"))
            own = {region: mask for region, mask in evaluation.regions.items() if region not in shared}
            put_evaluation(group, replace(evaluation, regions=own))
            for region in sorted(shared.keys() & evaluation.regions.keys()):
                group[f"regions/{region}"] = shared[region]
            shared = shared or dict(members(group.get("regions", {})))


def read_evaluations(
    path: Path, names: Collection[str] | None = None, *, with_maps: bool = True
) -> dict[str, Evaluation]:
    """Evaluations of these maps, or of all maps in a score file.

    Parameters
    ----------
    path : Path
    names : collection of str, optional
    with_maps : bool
        False: scores and reliability alone, without errors and regions.

    Raises
    ------
    SepiError
        If the file is missing, not a score file, or lacks one of the maps.
    """
    with open_hdf5(path, _KIND) as file:
        return {name: evaluation_in(group, with_maps=with_maps) for name, group in _groups(path, file, names).items()}


def put_evaluation(group: h5py.Group, evaluation: Evaluation) -> None:
    """Write an evaluation into an empty group or a file's root; reading and writing it again gives the same bytes."""
    if evaluation.scores:
        # as JSON, since thousands of attributes in groups would take seconds to read
        put(group, _SCORES, np.frombuffer(json.dumps(evaluation.scores, sort_keys=True).encode(), np.uint8))
    if evaluation.error is not None:
        put(group, "error", evaluation.error)
    if evaluation.reliability is not None:
        put(group, _RELIABILITY, evaluation.reliability, axes="(pixels, said, found) said_tenth")
    for name, mask in sorted(evaluation.regions.items()):
        put(group, f"regions/{name}", mask, source=evaluation.region_sources[name])


def evaluation_in(group: h5py.Group, *, with_maps: bool = True) -> Evaluation:
    """Evaluation that :func:`put_evaluation` wrote, with or without errors and regions."""
    path = Path(group.file.filename)
    regions = members(group.get("regions", {}) if with_maps else {})
    return Evaluation(
        scores=json.loads(read_dataset(path, group[_SCORES]).tobytes()) if _SCORES in group else {},
        error=read_dataset(path, group["error"]).astype(np.float32) if with_maps and "error" in group else None,
        regions={name: read_dataset(path, mask).astype(bool) for name, mask in regions},
        region_sources={name: str(attribute(mask, "source")) for name, mask in regions},
        reliability=read_dataset(path, group[_RELIABILITY]) if _RELIABILITY in group else None,
    )


def without_nan(value: Any) -> Any:
    """Value for JSON: None instead of NaN and infinity, such as a score over no pixels."""
    if isinstance(value, dict):
        return {key: without_nan(inner) for key, inner in value.items()}
    if isinstance(value, list):
        return [without_nan(inner) for inner in value]
    return None if isinstance(value, float) and not math.isfinite(value) else value


def _groups(path: Path, file: h5py.File, names: Collection[str] | None) -> dict[str, h5py.Group]:
    groups = {stored.replace(":", "/"): group for stored, group in members(file[_MAPS])}
    for name in names or ():
        if name not in groups:
            raise SepiError(f"{path}: no scores of '{name}'; it holds: {', '.join(groups) or 'none'}")
    return groups if names is None else {name: groups[name] for name in names}


_METHODS = "methods"
_ATTRIBUTES = ("source", "problem", "sha256")


class ExternalSource(BaseModel):
    """Files of an external method's disparity maps, and the scale of their values.

    Attributes
    ----------
    path : str
        A file, a folder with a file for each scene, or a pattern with ``{scene}`` and ``{dataset}``.
    scale, offset : float
        As :func:`sepi.io.disparity_maps.read_disparity` takes them.
    """

    model_config = ConfigDict(extra="forbid", frozen=True, strict=True)

    path: str = Field(min_length=1)
    scale: float | None = None
    offset: float = 0.0

    def file(self, dataset: str, scene: str) -> Path:
        """File with the map of a scene: the one that exists, else the expected one."""
        path = Path(os.path.expanduser(self.path.replace("{dataset}", dataset).replace("{scene}", scene)))
        if "{scene}" in self.path:
            # os.path: a folder without permission has no maps, and is no error here
            return map_file(path) if os.path.isdir(path) else path
        try:
            names = sorted(os.listdir(path))
        except OSError:
            names = []
        expected = [f"{scene}{suffix}" for suffix in SUFFIXES]
        exact = [name for name in expected if name in names]
        alike = [other for name in expected for other in names if other.casefold() == name.casefold()]
        return next(filter(os.path.isfile, (path / name for name in (*exact, *alike))), path / expected[0])


@dataclass(frozen=True)
class ExternalMap:
    """An external method's map of a scene.

    Attributes
    ----------
    source : str
        Path of its file, even if it is missing.
    problem : str
        Why there is no map, in a few words for the cell of a table; empty if there is one.
    sha256 : str
        Digest of the file, 64 hexadecimal digits; empty if it could not be read.
    disparity : ndarray, shape (H, W), float32, or None
        Pixels per view step, NaN or infinite where unknown; None if there is a problem.
    evaluation : Evaluation
        Scores; empty if there is a problem, or the scene has no ground truth.
    """

    source: str
    problem: str = ""
    sha256: str = ""
    disparity: FloatMap | None = None
    evaluation: Evaluation = field(default_factory=Evaluation)


def write_external(path: Path, maps: Mapping[str, ExternalMap]) -> None:
    """Write the external maps of a scene, by method; equal content gives equal bytes."""
    with create_hdf5(path) as file:
        methods = file.create_group(_METHODS, track_order=True)
        for name, external in maps.items():
            group = methods.create_group(name)
            group.attrs.update({key: getattr(external, key) for key in _ATTRIBUTES})
            if external.disparity is not None:
                put(group, "disparity", external.disparity)
            put_evaluation(group, external.evaluation)


def read_external(path: Path, *, with_maps: bool = True) -> dict[str, ExternalMap]:
    """Method to its external map, in the order in which :func:`write_external` wrote them.

    Parameters
    ----------
    path : Path
    with_maps : bool
        False: read the scores alone, without disparity, errors and regions.
    """
    with open_hdf5(path, "file of external maps (written by python -m sepi.external)") as file:
        return {
            name: ExternalMap(
                **{key: str(attribute(group, key)) for key in _ATTRIBUTES},
                disparity=float_maps(path, group).get("disparity") if with_maps else None,
                evaluation=evaluation_in(group, with_maps=with_maps),
            )
            for name, group in members(file[_METHODS])
        }
