"""A light field as it is exported: a folder of images with its properties in ``light_field.json``, or an HDF5 file.

Views are PNG of 8 or 16 bit, or TIFF of floats, so nothing is lost. ``light_field.json`` gives the file of each place
in the grid; the names and other files do not matter. ``sepi export`` writes such folders, and other programs may.
"""

from __future__ import annotations

import json
import re
from contextlib import suppress
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from pydantic import Field

from sepi.errors import SepiError
from sepi.io.codecs import write_tiff
from sepi.io.disparity_maps import read_pfm, write_pfm
from sepi.io.files import atomic_folder, naming, reading, remove_files, write_whole
from sepi.io.hdf5 import Properties, has_dataset, is_own, read_light_field, write_light_field
from sepi.io.images import SUFFIXES, read_picture, write_png
from sepi.io.readers.options import ReadOptions, in_grid, unarranged
from sepi.io.readers.view_files import read_grid
from sepi.io.readers.view_grid import rearrange
from sepi.io.result_files import require_target
from sepi.lightfield import BoolMap, LightField
from sepi.validation import require_known
from sepi.validation.models import validated

MANIFEST = "light_field.json"
# properties that are not told there
_APART = {"source", "reading", "rig"}


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
        require_known(f"{path}: light field", values, Manifest.model_fields.keys() - _APART)
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


HDF5 = (".h5", ".hdf5")
"""Suffixes of a light field in one file, in lower case."""

# suffixes of other formats of light fields, and of maps
_OTHERS = SUFFIXES | {".mat", ".npy", ".npz", ".pfm", ".json"}
_TRUTH = "gt_disp_lowres.pfm"
# names of files that are written beside the manifest
_WRITTEN = re.compile(rf"(missing_)?row_\d+_col_\d+\.(png|tif)|mask_.*\.png|{re.escape(_TRUTH)}")


def require_room(path: Path, *, force: bool = False) -> None:
    """Raise unless a light field may be written to ``path``; a check before it is read.

    Raises
    ------
    SepiError
        If the suffix is that of another kind of file, ``path`` exists and not ``force``, or it cannot be written.
    """
    suffix = path.suffix.lower()
    if suffix in HDF5:
        if path.exists() and not force:
            raise SepiError(f"{path}: exists already; choose another name, or replace it with --force")
        return
    if suffix in _OTHERS and not path.is_dir():
        raise SepiError(f"{path}: expected a file name that ends with .h5, or the name of a folder, for images")
    require_target(path)
    there = sorted(file.name for file in path.iterdir() if file.name[0] != ".") if path.is_dir() else []
    if there and not force:
        what = "a light field that was exported" if MANIFEST in there else f"files already ({there[0]}, ...)"
        raise SepiError(f"{path}: holds {what}; choose another folder, or write into it with --force")


def write_exported(path: Path, light_field: LightField, *, force: bool = False) -> None:
    """Write a light field as one HDF5 file or as a folder of views; reading gives it back unchanged without options.

    Parameters
    ----------
    path : Path
        A name that ends with ``.h5`` or ``.hdf5``, or that of a folder.
    light_field : LightField
    force : bool
        Also write if ``path`` exists. Files of an earlier export and files of the same names are replaced or removed;
        others stay.

    Raises
    ------
    SepiError
        As :func:`require_room`, or if something cannot be written.
    """
    require_room(path, force=force)
    if path.suffix.lower() in HDF5:
        write_light_field(path, light_field)
        return
    before = _earlier_files(path)
    with atomic_folder(path, add=True) as temporary:
        made = _write_folder(temporary, light_field)
    remove_files(path, before - made)


def _write_folder(folder: Path, light_field: LightField) -> set[str]:
    digits = max(2, len(str(max(light_field.grid) - 1)))
    suffix = "tif" if light_field.views.dtype == np.float32 else "png"
    names, hidden = (np.full(light_field.grid, None, object) for _ in range(2))
    for t, s in np.argwhere(light_field.present).tolist():
        stem, view = f"row_{t:0{digits}}_col_{s:0{digits}}", light_field.views[t, s]
        names[t, s] = f"{stem}.{suffix}"
        pixels = view[..., 0] if view.shape[2] == 1 else view
        if suffix == "tif":
            write_tiff(folder / names[t, s], pixels.astype(np.float32), f"view {t},{s}")
        else:
            write_png(folder / names[t, s], pixels.astype(view.dtype.newbyteorder("=")))
        if light_field.missing is not None and light_field.missing[t, s].any():
            hidden[t, s] = f"missing_{stem}.png"
            write_png(folder / hidden[t, s], light_field.missing[t, s])
    if light_field.ground_truth is not None:
        write_pfm(folder / _TRUTH, light_field.ground_truth)
    masks = {name: f"mask_{name}.png" for name in sorted(light_field.masks)}
    for name, file in masks.items():
        write_png(folder / file, light_field.masks[name])
    places = [] if light_field.positions is None else light_field.positions.tolist()
    known = Manifest(
        views=names.tolist(),
        positions=[[at if np.isfinite(at).all() else None for at in row] for row in places] or None,
        missing=None if light_field.missing is None else hidden.tolist(),
        ground_truth=None if light_field.ground_truth is None else _TRUTH,
        masks=masks,
        **Properties.of(light_field),
    )
    # one line for each key
    lines = [
        f"  {json.dumps(key)}: {json.dumps(value)}"
        for key, value in known.model_dump(mode="json", exclude=_APART).items()
    ]
    write_whole(folder / MANIFEST, "{\n" + ",\n".join(lines) + "\n}\n")
    return {path.name for path in folder.iterdir()}


def _earlier_files(folder: Path) -> set[str]:
    """Files that an earlier export wrote; an edited manifest may name a user's own files."""
    with suppress(SepiError):
        return set(filter(_WRITTEN.fullmatch, read_manifest(folder / MANIFEST).files()))
    return set()


def matches_own(path: Path) -> bool:
    """Whether ``path`` is a light field of this package, or an HDF5 file too damaged to tell."""
    return has_dataset(path, "views", is_own, if_damaged=True)


def read_own(path: Path, options: ReadOptions) -> LightField:
    """Light field as it was written, with its views arranged as the options ask."""
    light_field = read_light_field(path)
    return rearrange(light_field if light_field.source else replace(light_field, source=str(path)), options)
