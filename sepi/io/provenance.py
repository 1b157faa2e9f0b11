"""Provenance of a file: attributes of stage files and results, and the light field that a result belongs to.

The history of a map is the list of entries (:func:`sepi.stage.entry`) of the stages that made it, in order.
"""

from __future__ import annotations

import functools
import hashlib
import json
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass, fields
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from types import NoneType
from typing import Any

import numpy as np
import numpy.typing as npt

from sepi.camera import numbers_of
from sepi.errors import SepiError
from sepi.io.hdf5 import RIG, Attribute, attribute, has_dataset, open_hdf5, read_attributes, read_dataset
from sepi.io.readers.options import ReadOptions
from sepi.lightfield import LightField
from sepi.stage import Entry, StageMaps
from sepi.validation import require_type

RESULT = "result.h5"

_FORMAT = "format"
# a result stores its view apart; only the caller, not a file, may allow links to be followed
_NOT_KEPT = ("view", "follow_links")


@dataclass(frozen=True)
class Origin:
    """Light field that a result was made from, as the result records it.

    Attributes
    ----------
    scene, source : str
        Name and path; empty if not recorded.
    view, grid : (int, int)
        Position of the view that the maps belong to; rows and columns of views.
    row_spacing : float or None
        Distance of rows in view steps; None if the positions of the views were known, or it is not recorded.
    options : ReadOptions
        Options with which the source reads as this light field.
    file_format : str or None
        The format, if it was given.
    digest : str
        :func:`digest_of` the light field.
    picture : ndarray, shape (H, W, C), or None
        The view.
    rectified : bool
        Whether the views were rectified.
    files : tuple of str
        Names of all files of the result.
    """

    scene: str
    source: str
    view: tuple[int, int]
    grid: tuple[int, int]
    row_spacing: float | None
    options: ReadOptions
    file_format: str | None
    digest: str
    picture: npt.NDArray[np.generic] | None
    rectified: bool
    files: tuple[str, ...]

    def is_of(self, light_field: LightField) -> bool:
        """Whether the result is of this light field, even of another view, read otherwise, or changed since."""
        named = light_field.source != "" and (self.source, self.scene) == (light_field.source, light_field.name)
        return named or self._shows(light_field) or self.digest == digest_of(light_field)

    def difference(self, light_field: LightField) -> str | None:
        """How a light field differs from the one that the result was made from; None: not at all."""
        places = (self.view, self.grid), (light_field.reference_position, light_field.grid)
        if places[0] != places[1]:
            own, other = (f"{t},{s} of {rows}x{columns}" for (t, s), (rows, columns) in places)
            return f"depth of view {own} views, not of view {other}"
        if self.digest != digest_of(light_field) if self.digest else not self._shows(light_field):
            return "depth of another light field, or of its views in another order or without some of them"
        if self.row_spacing is not None and not np.isclose(self.row_spacing, light_field.row_spacing):
            return f"made with rows of views {self.row_spacing:g} steps apart, not {light_field.row_spacing:g}"
        return None

    def differs(self, other: Origin) -> bool:
        """Whether another result is of another view, so that the maps cannot be compared."""
        if self.picture is None or other.picture is None:
            return (self.view, self.grid) != (other.view, other.grid)
        return not np.array_equal(self.picture, other.picture)

    def _shows(self, light_field: LightField) -> bool:
        view = light_field.views[light_field.reference_position]
        return self.picture is not None and np.array_equal(self.picture, view)


DIGEST = "light_field"
"""Name of the attribute with the :func:`digest_of` a light field."""

# what is read of a result; other programs may have added attributes of other kinds
_ORIGIN = ("view_position", "grid", "reading", "scene", "source", "positions", "row_spacing", DIGEST, RIG, "files")


def origin_attributes(light_field: LightField, digest: str | None = None) -> dict[str, Attribute]:
    """Attributes of the light field that maps were made from, as :func:`read_origin` reads them.

    Parameters
    ----------
    light_field : LightField
    digest : str, optional
        Its :func:`digest_of`, if known.
    """
    camera, rig = light_field.camera, light_field.reference_rig
    return {
        "view_position": light_field.reference_position,
        "grid": light_field.grid,
        "from_centre": light_field.from_centre,
        DIGEST: digest or digest_of(light_field),
        **({"reading": light_field.reading} if light_field.reading else {}),
        **({} if camera is None else {"camera": numbers_of(camera)}),
        **({} if rig is None else {RIG: rig.to_text()}),
    }


def read_origin(path: Path) -> Origin | None:
    """Light field of a result as the result records it; None if it does not.

    Parameters
    ----------
    path : Path
        Folder of a result, or an HDF5 file.

    Raises
    ------
    SepiError
        If the file is damaged or its record is not valid.
    """
    path = path / RESULT if path.is_dir() else path
    if not has_dataset(path, "/", lambda root: {"view_position", "grid"} <= set(root.attrs), if_damaged=True):
        return None
    with open_hdf5(path, "result of 'sepi depth'") as file:
        known = {name: attribute(file, name) for name in _ORIGIN if name in file.attrs}
        (t, s), (rows, columns) = (map(int, known[name]) for name in ("view_position", "grid"))
        options, file_format = _reading(path, str(known.get("reading", "")))
        return Origin(
            scene=str(known.get("scene", "")),
            source=str(known.get("source", "")),
            view=(t, s),
            grid=(rows, columns),
            row_spacing=float(known["row_spacing"]) if known.get("positions") == "grid" else None,
            options=options,
            file_format=file_format,
            digest=str(known.get(DIGEST, "")),
            picture=read_dataset(path, file["view"]) if "view" in file else None,
            rectified=RIG in known,
            files=tuple(str(known.get("files", "")).split()),
        )


def digest_of(light_field: LightField) -> str:
    """Digest of the views and their positions, and of nothing that flags may change without changing the views."""
    present, positions = light_field.present, light_field.positions
    total = hashlib.sha256(f"{light_field.views.shape} {light_field.views.dtype}".encode())
    total.update(present.tobytes())
    for t, s in np.argwhere(present).tolist():
        total.update(np.ascontiguousarray(light_field.views[t, s]).data.cast("B"))
    if positions is not None:
        total.update(positions[present].tobytes())
    return total.hexdigest()


def reading_record(options: ReadOptions, file_format: str | None) -> str:
    """Options and format that differ from the defaults, as JSON; empty if none."""
    own = {field.name: getattr(options, field.name) for field in fields(options) if field.name not in _NOT_KEPT}
    given: dict[str, Any] = {name: value for name, value in own.items() if value != getattr(ReadOptions(), name)}
    if file_format is not None:
        given[_FORMAT] = file_format
    return json.dumps(given, sort_keys=True) if given else ""


def _reading(path: Path, record: str) -> tuple[ReadOptions, str | None]:
    """Options and format in a :func:`reading_record`."""
    try:
        given = json.loads(record or "{}")
        file_format = given.pop(_FORMAT, None)
        require_type("format", file_format, (str, NoneType), "text")
        options = ReadOptions(**{name: value for name, value in given.items() if name not in _NOT_KEPT})
    except (SepiError, ValueError, AttributeError, TypeError, RecursionError) as error:
        raise SepiError(f"{path}: damaged: options of its light field are not valid ({record[:40]!r})") from error
    return options, file_format


def package_version() -> str:
    """Version of the installed package; ``"unknown"`` in a source tree that is not installed."""
    return version_of("sepi") or "unknown"


@functools.cache
def version_of(name: str) -> str:
    """Version of a distribution; empty if it is not installed."""
    with suppress(PackageNotFoundError):
        return version(name)
    return ""


def stage_attributes(light_field: LightField, history: Sequence[Entry]) -> dict[str, Attribute]:
    """Attributes of a stage file.

    Parameters
    ----------
    light_field : LightField
        With a known disparity range.
    history : sequence of Entry
        Stages that made the maps; the last entry is the file's own, the others become ``made_from``.
    """
    *before, last = history
    parameters, made_from = (json.dumps(told, sort_keys=True) for told in (last["parameters"], before))
    own = {"stage": last["stage"], "choice": last["choice"], "parameters": parameters, "made_from": made_from}
    return {**scene_attributes(light_field), **own}


def result_attributes(light_field: LightField, maps: StageMaps, digest: str | None = None) -> dict[str, Attribute]:
    """Attributes of finished maps: their light field, and what made them if the maps record it.

    Parameters
    ----------
    light_field : LightField
    maps : StageMaps
    digest : str, optional
        As in :func:`origin_attributes`.
    """
    made_by, origin = maps.made_by, origin_attributes(light_field, digest)
    if made_by is None:
        return {**scene_attributes(light_field), **origin}
    made = {"variant": made_by.variant, "made_from": json.dumps(made_by.history, sort_keys=True)}
    return {**scene_attributes(light_field.with_range(made_by.disparity_range)), **made, **origin}


def history_of(path: Path | None) -> list[Entry]:
    """History of a stage file, its own entry last; empty without a file."""
    if path is None:
        return []
    attributes = read_attributes(path)
    try:
        last = {"stage": str(attributes["stage"]), "choice": str(attributes["choice"])}
        return [*json.loads(attributes["made_from"]), {**last, "parameters": json.loads(attributes["parameters"])}]
    except (KeyError, ValueError, RecursionError) as error:
        raise SepiError(f"{path}: not a stage file: expected attributes that say what made it ({error})") from error


def scene_attributes(light_field: LightField) -> dict[str, Attribute]:
    """Attributes that identify a file's light field, and its disparity range if known."""
    known = light_field.disparity_range
    searched: dict[str, Attribute] = {}
    if known is not None:
        searched = {"disparity_range": (known.minimum, known.maximum), "disparity_range_source": known.source}
    return {
        "scene": light_field.name,
        "source": light_field.source,
        **searched,
        "row_spacing": light_field.row_spacing,
        "positions": "grid" if light_field.positions is None else "given",
        "version": package_version(),
    }
