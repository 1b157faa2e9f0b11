"""Files of other methods' disparity maps of one scene, with their scores.

Layout: a group ``methods/NAME`` per method, in the order of the configuration, with the attributes ``source``,
``problem`` and ``sha256``. Where there is no problem it holds ``disparity (H, W)``, and what a score file holds
(:mod:`sepi.io.scores`) if the scene has ground truth.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path

import h5py
import numpy as np

from sepi.errors import SepiError
from sepi.io.hdf5 import UNITS, created, opened
from sepi.io.scores import Evaluation, evaluation_in, put_evaluation, scores_in
from sepi.lightfield import FloatMap

_METHODS = "methods"


@dataclass(frozen=True)
class ExternalMap:
    """The map of a scene that another method's program made.

    Attributes
    ----------
    source : str
        Path of its file, also where there is none.
    problem : str
        Why there is no map, in a few words for a cell of a table; empty where there is one.
    sha256 : str
        Digest of the file, 64 hexadecimal digits; empty where it could not be read.
    disparity : ndarray, shape (H, W), float32, or None
        Pixels per view step, NaN or infinite where unknown; None where there is a problem.
    evaluation : Evaluation
        Its scores; empty where there is a problem, or the scene has no ground truth.
    """

    source: str
    problem: str = ""
    sha256: str = ""
    disparity: FloatMap | None = None
    evaluation: Evaluation = field(default_factory=Evaluation)


def write_imported(path: Path, maps: Mapping[str, ExternalMap]) -> None:
    """Write the maps of all methods, by name; equal content gives equal bytes."""
    with created(path) as file:
        methods = file.create_group(_METHODS, track_order=True)
        for name, imported in maps.items():
            group = methods.create_group(name)
            for key in ("source", "problem", "sha256"):
                group.attrs[key] = getattr(imported, key)
            if imported.disparity is not None:
                group.create_dataset("disparity", data=imported.disparity)
                group["disparity"].attrs["units"] = UNITS["disparity"]
            put_evaluation(group, imported.evaluation)


def read_imported(path: Path) -> dict[str, ExternalMap]:
    """Method to what :func:`write_imported` wrote of it, in the same order.

    Raises
    ------
    SepiError
        If the file is missing, not HDF5, or not such a file.
    """
    return _read(path, with_maps=True)


def read_imported_scores(path: Path) -> dict[str, ExternalMap]:
    """Like :func:`read_imported`, but without any map: no disparity, no errors, no regions.

    Raises
    ------
    SepiError
        As :func:`read_imported`.
    """
    return _read(path, with_maps=False)


def _read(path: Path, with_maps: bool) -> dict[str, ExternalMap]:
    with opened(path) as file:
        if _METHODS not in file:
            raise SepiError(f"{path}: not a file of other methods' maps (written by python -m sepi.external)")
        return {name: _imported(group, with_maps) for name, group in file[_METHODS].items()}


def _imported(group: h5py.Group, with_maps: bool) -> ExternalMap:
    return ExternalMap(
        source=str(group.attrs["source"]),
        problem=str(group.attrs["problem"]),
        sha256=str(group.attrs["sha256"]),
        disparity=group["disparity"][...].astype(np.float32) if with_maps and "disparity" in group else None,
        evaluation=evaluation_in(group) if with_maps else Evaluation(scores_in(group)),
    )
