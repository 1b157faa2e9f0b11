"""Score files of a scene's disparity maps, those of external methods among them.

A score file has a group in ``maps`` for each map, with its ``name`` as an attribute. It holds ``evaluation``, JSON of
the fields of an :class:`Evaluation` that are no arrays, the signed error map ``error (H, W)``, and the masks
``regions/NAME (H, W)``, which all maps share and which are stored once. A map with error bars also has ``reliability
(3, 10)``, and that of an external method ``disparity (H, W)`` if there is no problem. If the scene has no ground truth,
there are no scores and arrays, and the root attribute ``ground_truth`` is False.
"""

from __future__ import annotations

import json
import math
import os
from collections.abc import Collection, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import numpy.typing as npt
from pydantic import BaseModel, ConfigDict, Field

from sepi.errors import SepiError
from sepi.io.disparity_maps import SUFFIXES, map_file
from sepi.io.hdf5 import Attribute, attribute, create_hdf5, members, open_hdf5, put, read_dataset
from sepi.lightfield import BoolMap, FloatMap

_MAPS, _TEXT = "maps", "evaluation"
_MAPS_OF_ONE, _RELIABILITY = ("disparity", "error"), "reliability"
_KIND = "score file (written by python -m sepi.evaluate or sepi.external)"
_AS_TEXT = ("scores", "region_sources", "source", "problem", "sha256")

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
    source : str
        Path of an external method's map, even if it is missing; else empty.
    problem : str
        Why an external method has no map, in a few words for the cell of a table; empty if there is one.
    sha256 : str
        Digest of that file, 64 hexadecimal digits; empty if it could not be read.
    disparity : ndarray, shape (H, W), float32, or None
        An external method's map, pixels per view step, NaN or infinite where unknown; None if there is a problem.

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
    source: str = ""
    problem: str = ""
    sha256: str = ""
    disparity: FloatMap | None = None


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
            # a slash would make nested groups
            group = groups.create_group(name.replace("/", ":"))
            group.attrs["name"] = name
            _put_evaluation(group, evaluation, shared)
            shared = shared or dict(members(group.get("regions", {})))


def read_evaluations(
    path: Path, names: Collection[str] | None = None, *, with_maps: bool = True
) -> dict[str, Evaluation]:
    """Evaluations of these maps, or of all maps in a score file, in the order in which they were written.

    ``with_maps=False`` reads scores and reliability alone, without disparity, errors and regions.

    Raises
    ------
    SepiError
        If the file is missing, not a score file, or lacks one of the maps.
    """
    with open_hdf5(path, _KIND) as file:
        groups = {str(attribute(group, "name")): group for _, group in members(file[_MAPS])}
        for name in names or ():
            if name not in groups:
                raise SepiError(f"{path}: no scores of '{name}'; it holds: {', '.join(groups) or 'none'}")
        wanted = groups if names is None else names
        return {name: _evaluation_in(path, groups[name], with_maps) for name in wanted}


def _put_evaluation(group: h5py.Group, evaluation: Evaluation, shared: Mapping[str, h5py.Dataset]) -> None:
    """Write an evaluation into an empty group; regions that are there already are linked."""
    # as JSON, since thousands of attributes in groups would take seconds to read
    told = json.dumps({name: getattr(evaluation, name) for name in _AS_TEXT}, sort_keys=True)
    put(group, _TEXT, np.frombuffer(told.encode(), np.uint8))
    for name in (*_MAPS_OF_ONE, _RELIABILITY):
        if (values := getattr(evaluation, name)) is not None:
            put(group, name, values)
    for name, mask in sorted(evaluation.regions.items()):
        if name in shared:
            group[f"regions/{name}"] = shared[name]
        else:
            put(group, f"regions/{name}", mask)


def _evaluation_in(path: Path, group: h5py.Group, with_maps: bool) -> Evaluation:
    told = json.loads(read_dataset(path, group[_TEXT]).tobytes())
    names = (*_MAPS_OF_ONE * with_maps, _RELIABILITY)
    arrays: dict[str, Any] = {name: read_dataset(path, group[name]) for name in names if name in group}
    regions = members(group.get("regions", {})) if with_maps else []
    masks = {name: read_dataset(path, mask).astype(bool) for name, mask in regions}
    return Evaluation(**told, regions=masks, **arrays)


def without_nan(value: Any) -> Any:
    """Value for JSON: None instead of NaN and infinity, such as a score over no pixels."""
    if isinstance(value, dict):
        return {key: without_nan(inner) for key, inner in value.items()}
    if isinstance(value, list):
        return [without_nan(inner) for inner in value]
    return None if isinstance(value, float) and not math.isfinite(value) else value


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
        found = [
            other for one in (str, str.casefold) for name in expected for other in names if one(other) == one(name)
        ]
        return next(filter(os.path.isfile, (path / name for name in found)), path / expected[0])
