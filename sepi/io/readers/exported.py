"""Folders that ``sepi export`` wrote, or whose ``light_field.json`` somebody else did (:mod:`sepi.io.exported`)."""

from __future__ import annotations

import json
from contextlib import suppress
from pathlib import Path

import numpy as np
from pydantic import BaseModel

from sepi.camera import Camera
from sepi.errors import SepiError
from sepi.io.files import naming, reading
from sepi.io.images import read_picture
from sepi.io.pfm import read_pfm
from sepi.io.readers.arrays import rearrange
from sepi.io.readers.options import ReadOptions, in_grid, unarranged
from sepi.io.readers.view_files import read_grid
from sepi.lightfield import BoolMap, DisparityRange, LightField
from sepi.models import validated

MANIFEST = "light_field.json"


class Manifest(BaseModel, defer_build=True):
    """Content of ``light_field.json``: the fields of a light field, and names of files in the folder for its arrays.

    ``views`` has a name, or null for a missing view, for each row and column of the grid; ``positions`` likewise a pair
    ``[down, across]`` in view steps, and ``missing`` a mask of the pixels that a view does not show, null for none.
    """

    name: str
    views: list[list[str | None]]
    view: tuple[int, int] | None = None
    row_spacing: float = 1.0
    positions: list[list[tuple[float, float] | None]] | None = None
    missing: list[list[str | None]] | None = None
    disparity_range: DisparityRange | None = None
    camera: Camera | None = None
    ground_truth: str | None = None
    masks: dict[str, str] = {}
    notes: tuple[str, ...] = ()


def read_manifest(path: Path) -> Manifest:
    """Read ``light_field.json``.

    Raises
    ------
    SepiError
        If it is damaged, its rows differ in length, or it names what is no file in its own folder.
    """
    with reading(path, "file of 'sepi export'"):
        values = json.loads(path.read_bytes())
        if not isinstance(values, dict):
            raise ValueError("expected keys with values")
        known = validated(Manifest, values, f"{path}: light field")
        columns = len(known.views[0]) if known.views else 0
        for key, rows in (("views", known.views), ("positions", known.positions), ("missing", known.missing)):
            if rows is not None and (columns == 0 or [len(row) for row in rows] != [columns] * len(known.views)):
                raise SepiError(f"{key}: expected {len(known.views)} rows of {columns} values, as 'views' has")
        named = [name for row in (*known.views, *(known.missing or ())) for name in row]
        for name in filter(None, (*named, known.ground_truth, *known.masks.values())):
            if name != Path(name).name or name == ".." or "\0" in name:
                raise SepiError(f"expected names of files in its own folder, got {name[:80]!r}")
    return known


def matches(path: Path) -> bool:
    """Whether ``path`` is a folder with ``light_field.json``."""
    return (path / MANIFEST).is_file()


def truth_files(folder: Path) -> list[Path]:
    """The files of a folder with ground truth and masks, and the one that names them."""
    names: list[str] = []
    # of a damaged one, reading says what is wrong
    with suppress(SepiError):
        known = read_manifest(folder / MANIFEST)
        names = [name for name in (known.ground_truth, *known.masks.values()) if name is not None]
    return [folder / name for name in (MANIFEST, *names)]


def read(path: Path, options: ReadOptions) -> LightField:
    """Read a folder; what the options ask for is done to the light field that was written."""
    file = path / MANIFEST
    known = read_manifest(file)
    names = np.array(known.views, object)
    files = {number: path / name for number, name in enumerate(names.ravel()) if name is not None}
    views, present, *_ = read_grid(path, files, names.shape, unarranged(options))
    positions, missing = None, None
    if known.positions is not None:
        positions = np.array([[place or (np.nan, np.nan) for place in row] for row in known.positions], np.float64)
    if known.missing is not None:
        missing = np.zeros((*names.shape, *views.shape[2:4]), bool)
        for place, name in np.ndenumerate(np.array(known.missing, object)):
            if name is not None:
                missing[place] = _read_mask(path / name, views.shape[2:4])
    with naming(file):
        light_field = LightField(
            views=views,
            name=known.name,
            source=str(path),
            present=present,
            disparity_range=known.disparity_range,
            ground_truth=None if known.ground_truth is None else read_pfm(path / known.ground_truth),
            masks={name: _read_mask(path / mask) for name, mask in known.masks.items()},
            view=known.view,
            row_spacing=known.row_spacing,
            positions=positions,
            camera=known.camera,
            notes=known.notes,
            settled=True,
            missing=missing,
        )
    return rearrange(light_field, in_grid(options))


def _read_mask(path: Path, shape: tuple[int, ...] | None = None) -> BoolMap:
    values = read_picture(path)
    if shape is not None and values.shape[:2] != shape:
        raise SepiError(f"{path}: {values.shape[1]}x{values.shape[0]} pixels; expected a mask as large as the views")
    if not np.isin(values, (0, 255)).all():
        raise SepiError(f"{path}: expected a mask of black and white")
    return np.asarray(values[:, :, 0] > 0)
