"""A light field as it is exported: a folder of images with its properties in ``light_field.json``, or an HDF5 file.

Views are PNG of 8 or 16 bit, or TIFF of floats, so nothing is lost. ``light_field.json`` gives the file of each place
in the grid; the names and other files do not matter. ``sepi export`` writes such folders, and other programs may.
"""

from __future__ import annotations

import json
from contextlib import suppress
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from pydantic import Field

from sepi.errors import SepiError
from sepi.io.disparity_maps import read_pfm
from sepi.io.files import naming, reading
from sepi.io.hdf5 import Properties, has_dataset, is_own, read_light_field
from sepi.io.images import read_picture
from sepi.io.readers.options import ReadOptions, in_grid, unarranged
from sepi.io.readers.view_files import read_grid
from sepi.io.readers.view_grid import rearrange
from sepi.lightfield import BoolMap, LightField
from sepi.validation import require_known
from sepi.validation.models import validated

MANIFEST = "light_field.json"

APART = {"source", "reading", "rig"}
"""Properties that are not told there."""


class Manifest(Properties, defer_build=True):
    """Content of ``light_field.json``: the fields of a light field, with file names instead of arrays.

    For each row and column of the grid, ``views`` has a file name, or null for a missing view; ``positions`` a pair
    ``[down, across]`` in view steps; and ``missing`` a mask of the pixels that the view does not show, or null.
    """

    views: list[list[str | None]]
    positions: list[list[tuple[float, float] | None]] | None = None
    missing: list[list[str | None]] | None = None
    ground_truth: str | None = None
    masks: dict[str, str] = Field(default={})

    def files(self) -> list[str]:
        """Names of all files."""
        rows = (*self.views, *(self.missing or ()), (self.ground_truth, *self.masks.values()))
        return [name for row in rows for name in row if name is not None]


def read_manifest(path: Path) -> Manifest:
    """Read ``light_field.json``.

    Raises
    ------
    SepiError
        If it is damaged, its rows differ in length, or it names a file that is not in its own folder.
    """
    with reading(path, "file of 'sepi export'"):
        values = json.loads(path.read_bytes())
        if not isinstance(values, dict):
            raise ValueError("expected keys with values")
        require_known(f"{path}: light field", values, Manifest.model_fields.keys() - APART)
        known = validated(Manifest, values, f"{path}: light field")
        columns = len(known.views[0]) if known.views else 0
        for key, rows in (("views", known.views), ("positions", known.positions), ("missing", known.missing)):
            if rows is not None and (columns == 0 or [len(row) for row in rows] != [columns] * len(known.views)):
                raise SepiError(f"{key}: expected {len(known.views)} rows of {columns} values, as 'views' has")
        for name in known.files():
            if name != Path(name).name or name == ".." or "\0" in name:
                raise SepiError(f"expected names of files in its own folder, got {name[:80]!r}")
    return known


def matches(path: Path) -> bool:
    """Whether ``path`` is a folder with ``light_field.json``."""
    return (path / MANIFEST).is_file()


def truth_files(folder: Path) -> list[Path]:
    """Files of a folder with ground truth and masks, and the manifest that names them."""
    names: list[str] = []
    # reading reports a damaged manifest
    with suppress(SepiError):
        known = read_manifest(folder / MANIFEST)
        names = [name for name in (known.ground_truth, *known.masks.values()) if name is not None]
    return [folder / name for name in (MANIFEST, *names)]


def read(path: Path, options: ReadOptions) -> LightField:
    """Read an exported folder; the options are applied to the light field that was written."""
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
    ground_truth = None if known.ground_truth is None else read_pfm(path / known.ground_truth)
    masks = {name: _read_mask(path / mask) for name, mask in known.masks.items()}
    truth: dict[str, Any] = {"ground_truth": ground_truth, "masks": masks, "positions": positions, "missing": missing}
    with naming(file):
        light_field = LightField(views, present=present, **truth, **known.fields() | {"source": str(path)})
    return rearrange(light_field, in_grid(options))


def _read_mask(path: Path, shape: tuple[int, ...] | None = None) -> BoolMap:
    values = read_picture(path)
    if shape is not None and values.shape[:2] != shape:
        raise SepiError(f"{path}: {values.shape[1]}x{values.shape[0]} pixels; expected a mask as large as the views")
    if not np.isin(values, (0, 255)).all():
        raise SepiError(f"{path}: expected a mask of black and white")
    return np.asarray(values[:, :, 0] > 0)


def matches_own(path: Path) -> bool:
    """Whether ``path`` is a light field of this package, or an HDF5 file too damaged to tell."""
    return has_dataset(path, "views", is_own, if_damaged=True)


def read_own(path: Path, options: ReadOptions) -> LightField:
    """Light field as it was written, with its views arranged as the options ask."""
    light_field = read_light_field(path)
    return rearrange(light_field if light_field.source else replace(light_field, source=str(path)), options)
