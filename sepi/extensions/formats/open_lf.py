"""HDF5 files of OpenLF [1]_: a group ``LF`` with a mosaic of all views for each channel.

Attributes of the group give the number of views in a row, ``cams_h``, and in a column, ``cams_v``, the size of the
mosaic, ``width`` and ``height``, and the kind of light field, ``LF_TYPE``. The mosaic of a single column of views may
be transposed.

References
----------
.. [1] S. Wanner, "OpenLF", https://github.com/svenwanner/openlf
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path

import h5py
import numpy as np

from sepi.errors import SepiError, printable
from sepi.io.hdf5 import has_dataset, number_of, open_hdf5, read_dataset
from sepi.io.readers.arrays import Array, light_field_from_array
from sepi.io.readers.formats import Format
from sepi.io.readers.options import ReadOptions
from sepi.lightfield import LightField

GROUP = "LF"

_GRID, _ROW, _COLUMN, _CROSS = 1, 2, 3, 4
_COLOURS, _GREY = ("r", "g", "b"), ("bw",)
_COUNTS = ("LF_TYPE", "cams_h", "cams_v", "height", "width")


FORMAT = Format("OpenLF HDF5", "with a group LF", __name__)


def matches(path: Path) -> bool:
    """Whether ``path`` is a readable HDF5 file with a group ``LF`` that has OpenLF's attributes or channels."""
    known = {*_COLOURS, *_GREY, *_COUNTS}
    return has_dataset(path, GROUP, lambda lf: isinstance(lf, h5py.Group) and known.intersection((*lf, *lf.attrs)))


def read(path: Path, options: ReadOptions) -> LightField:
    """Light field of an OpenLF file; its baselines, of unknown unit, give the distance of rows in view steps."""
    with _opened(path) as group:
        (rows, columns, H, W), kind, names = _form(path, group)
        mosaic = np.stack([_mosaic(path, group[name], (rows * H, columns * W), kind) for name in names], axis=2)
        down, across = (number_of(group, key) for key in ("baseline_v", "baseline_h"))
    views = mosaic.reshape(rows, H, columns, W, -1).transpose(0, 2, 1, 3, 4)
    light_field = light_field_from_array(views, path, options, axes="TSHWC")
    if min(rows, columns) < 2 or not (0 < down < math.inf and 0 < across < math.inf):
        return light_field
    spacing = down / across
    # a transposed grid has the file's columns as rows
    return replace(light_field, row_spacing=1 / spacing if "transpose" in options.order else spacing)


def size_of(path: Path) -> tuple[int, int, int, int]:
    """Number of views, height, width and bytes of a pixel; no values are read."""
    with _opened(path) as group:
        (rows, columns, height, width), _, names = _form(path, group)
        return rows * columns, height, width, len(names) * group[names[0]].dtype.itemsize


@contextmanager
def _opened(path: Path) -> Iterator[h5py.Group]:
    with open_hdf5(path, "file of OpenLF") as file:
        group = file.get(GROUP)
        if not isinstance(group, h5py.Group):
            raise SepiError(f"{path}: expected a group '{GROUP}' as OpenLF writes it")
        channels = [name for name in (*_COLOURS, *_GREY) if name in group]
        known = channels in (list(_COLOURS), list(_GREY), [*_COLOURS, *_GREY])
        if not known or any(key not in group.attrs for key in _COUNTS):
            held = printable(", ".join(list(group)[:6])) or "nothing"
            raise SepiError(f"{path}: '{GROUP}' holds {held}; expected r, g and b, or bw, and {', '.join(_COUNTS)}")
        yield group


def _form(path: Path, group: h5py.Group) -> tuple[tuple[int, int, int, int], int, tuple[str, ...]]:
    """Shape (T, S, H, W) of the views, the kind of light field, and names of the channels."""
    counts = [number_of(group, key) for key in _COUNTS]
    for key, count in zip(_COUNTS, counts, strict=True):
        if not 0 <= count < 2**31 or count != int(count):
            raise SepiError(f"{path}: expected the attribute '{key}' to be a whole number, got {count:g}")
    kind, columns, rows, height, width = map(int, counts)
    if kind == _CROSS:
        raise SepiError(f"{path}: LF_TYPE {kind}, a cross of views, is not supported; give a folder of the views")
    expected = {_GRID: rows * columns > 1, _ROW: rows == 1 < columns, _COLUMN: columns == 1 < rows}
    if kind not in expected:
        raise SepiError(f"{path}: LF_TYPE {kind} is unknown; expected 1 (grid), 2 (row) or 3 (column)")
    if min(rows, columns) < 1 or not expected[kind]:
        raise SepiError(f"{path}: {rows}x{columns} views (cams_v x cams_h) do not fit LF_TYPE {kind}")
    if height % rows or width % columns:
        raise SepiError(f"{path}: {width}x{height} pixels hold no {rows}x{columns} views of one size")
    return (rows, columns, height // rows, width // columns), kind, _COLOURS if "r" in group else _GREY


def _mosaic(path: Path, dataset: h5py.Dataset, shape: tuple[int, int], kind: int) -> Array:
    values = read_dataset(path, dataset)
    if kind == _COLUMN and values.shape == shape[::-1] != shape:
        values = values.T
    if values.shape != shape:
        raise SepiError(f"{path}: '{dataset.name}' has shape {values.shape}; expected (height, width) = {shape}")
    return values
