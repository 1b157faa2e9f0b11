"""External methods' disparity maps: their locations, and the file of one scene's maps with their scores.

Layout of that file: a group ``methods/NAME`` per method, in the order of the configuration, with the attributes
``source``, ``problem`` and ``sha256``. Where there is no problem it holds ``disparity (H, W)``, and what a score file
holds (:mod:`sepi.io.scores`) if the scene has ground truth.
"""

from __future__ import annotations

import os
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path

from pydantic import BaseModel, ConfigDict, Field

from sepi.io.disparity_maps import SUFFIXES, map_file
from sepi.io.hdf5 import attribute, create_hdf5, float_maps, members, open_hdf5, put
from sepi.io.scores import Evaluation, evaluation_in, put_evaluation, scores_in
from sepi.lightfield import FloatMap

_METHODS = "methods"
_ATTRIBUTES = ("source", "problem", "sha256")


class ExternalSource(BaseModel):
    """Where the disparity maps of an external method lie, and what their values mean.

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
        """The map of a scene: the file that is there, or else the one that was expected."""
        path = Path(os.path.expanduser(self.path.replace("{dataset}", dataset).replace("{scene}", scene)))
        if "{scene}" in self.path:
            # os.path: a folder that may not be entered has no maps, and is no error here
            return map_file(path) if os.path.isdir(path) else path
        try:
            names = sorted(os.listdir(path))
        except OSError:
            names = []
        expected = [f"{scene}{suffix}" for suffix in SUFFIXES]
        exact = [name for name in expected if name in names]
        alike = [other for name in expected for other in names if other.casefold() == name.casefold()]
        files = (path / name for name in (*exact, *alike))
        return next(filter(os.path.isfile, files), path / expected[0])


@dataclass(frozen=True)
class ExternalMap:
    """An external method's map of a scene.

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


def write_external(path: Path, maps: Mapping[str, ExternalMap]) -> None:
    """Write the maps of all methods, by name; equal content gives equal bytes."""
    with create_hdf5(path) as file:
        methods = file.create_group(_METHODS, track_order=True)
        for name, external in maps.items():
            group = methods.create_group(name)
            group.attrs.update({key: getattr(external, key) for key in _ATTRIBUTES})
            if external.disparity is not None:
                put(group, "disparity", external.disparity)
            put_evaluation(group, external.evaluation)


def read_external(path: Path, *, with_maps: bool = True) -> dict[str, ExternalMap]:
    """Method to what :func:`write_external` wrote of it, in the same order.

    Parameters
    ----------
    path : Path
    with_maps : bool
        Whether to read disparity, errors and regions, too, rather than the scores alone.
    """
    with open_hdf5(path, "file of external maps (written by python -m sepi.external)") as file:
        return {
            name: ExternalMap(
                **{key: str(attribute(group, key)) for key in _ATTRIBUTES},
                disparity=float_maps(path, group).get("disparity") if with_maps else None,
                evaluation=evaluation_in(group) if with_maps else Evaluation(scores_in(group)),
            )
            for name, group in members(file[_METHODS])
        }
