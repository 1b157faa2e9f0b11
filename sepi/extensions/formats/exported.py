"""Writes a light field as one HDF5 file, or as a folder that :mod:`sepi.io.readers.exported` reads."""

import json
import re
from contextlib import suppress
from pathlib import Path

import numpy as np

from sepi.errors import SepiError
from sepi.io.codecs import write_tiff
from sepi.io.disparity_maps import write_pfm
from sepi.io.files import atomic_folder, remove_files, write_whole
from sepi.io.hdf5 import Properties, write_light_field
from sepi.io.images import SUFFIXES, write_png
from sepi.io.readers.exported import APART, MANIFEST, Manifest, read_manifest
from sepi.io.result_files import require_target
from sepi.lightfield import LightField

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
        for key, value in known.model_dump(mode="json", exclude=APART).items()
    ]
    write_whole(folder / MANIFEST, "{\n" + ",\n".join(lines) + "\n}\n")
    return {path.name for path in folder.iterdir()}


def _earlier_files(folder: Path) -> set[str]:
    """Files that an earlier export wrote; an edited manifest may name a user's own files."""
    with suppress(SepiError):
        return set(filter(_WRITTEN.fullmatch, read_manifest(folder / MANIFEST).files()))
    return set()
