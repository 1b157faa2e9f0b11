"""A light field as a folder of pictures with all that is known about it beside them, in ``light_field.json``.

Views are PNG of 8 or 16 bit, or TIFF of floats: nothing is lost. The file names each by its place in the grid, so that
neither what else lies in the folder nor what the pictures are called has a say.
"""

from __future__ import annotations

import json
import re
from contextlib import suppress
from pathlib import Path

import numpy as np

from sepi.errors import SepiError
from sepi.io.files import atomic_path, filled_folder, remove_files
from sepi.io.hdf5 import write_light_field
from sepi.io.images import SUFFIXES, write_png
from sepi.io.pfm import write_pfm
from sepi.io.readers.exported import MANIFEST, Manifest, read_manifest
from sepi.io.result_files import require_target
from sepi.io.tiff import write_tiff
from sepi.lightfield import LightField

HDF5 = (".h5", ".hdf5")
"""Ends of names, in small letters, of what is one file."""

# of other formats of light fields, and of maps
_OTHERS = SUFFIXES | {".mat", ".npy", ".npz", ".pfm", ".json"}
_TRUTH = "gt_disp_lowres.pfm"
_VIEW = re.compile(r"row_\d+_col_\d+\.(png|tif)")


def require_room(path: Path, *, force: bool = False) -> None:
    """Raise unless a light field may be written to ``path``; for telling before it is read.

    Raises
    ------
    SepiError
        If the name is that of another kind of file, something is there already and not ``force``, or it cannot be
        written.
    """
    suffix = path.suffix.lower()
    if suffix in HDF5:
        if path.exists() and not force:
            raise SepiError(f"{path}: exists already; choose another name, or replace it with --force")
        return
    if suffix in _OTHERS and not path.is_dir():
        raise SepiError(f"{path}: expected a name that ends with .h5, for one file, or that of a folder, for pictures")
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
        Write where something is already, too. What an earlier export wrote there is replaced or removed, and all else
        of others left alone, but for files of the very names.

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
    with filled_folder(path) as temporary:
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
        name=light_field.name,
        views=names.tolist(),
        view=light_field.view,
        row_spacing=float(light_field.row_spacing),
        positions=[[at if np.isfinite(at).all() else None for at in row] for row in places] or None,
        missing=None if light_field.missing is None else hidden.tolist(),
        disparity_range=light_field.disparity_range,
        camera=light_field.camera,
        ground_truth=None if light_field.ground_truth is None else _TRUTH,
        masks=masks,
        notes=light_field.notes,
    )
    # a line for each key
    lines = [f"  {json.dumps(key)}: {json.dumps(value)}" for key, value in known.model_dump(mode="json").items()]
    with atomic_path(folder / MANIFEST) as temporary:
        temporary.write_text("{\n" + ",\n".join(lines) + "\n}\n", encoding="ascii")
    return {path.name for path in folder.iterdir()}


def _earlier_files(folder: Path) -> set[str]:
    """Files that an earlier export wrote; one that was edited may name a user's own."""
    with suppress(SepiError):
        known = read_manifest(folder / MANIFEST)
        masks = {file for name, file in known.masks.items() if file == f"mask_{name}.png"}
        views = {name for row in known.views for name in row if name is not None and _VIEW.fullmatch(name)}
        return {*views, *masks, *([_TRUTH] if known.ground_truth == _TRUTH else [])}
    return set()
