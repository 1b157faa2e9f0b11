"""One image of all views side by side: a mosaic of the grid, or a quilt of a Looking Glass display [1]_.

The name of a quilt gives its layout: ``_qs8x6a0.75`` means 8 columns, 6 rows and the aspect ratio of a view. Its views
are a single row of cameras, from the leftmost at the lower left, row by row, to the rightmost at the upper right.

References
----------
.. [1] "Quilts", https://docs.lookingglassfactory.com/keyconcepts/quilts
"""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path

from sepi.errors import SepiError
from sepi.io.images import SUFFIXES, read_picture
from sepi.io.readers.arrays import light_field_from_array
from sepi.io.readers.formats import Format
from sepi.io.readers.options import ReadOptions
from sepi.lightfield import LightField

_QUILT = re.compile(r".*_qs([0-9]{1,4})x([0-9]{1,4})a[0-9.]+", re.IGNORECASE)


FORMAT = Format("mosaic of views", "NAME_qs8x6a0.75.png", __name__, ("grid",))


def matches(path: Path) -> bool:
    """Whether ``path`` is an image with the name of a quilt."""
    return _QUILT.fullmatch(path.stem) is not None and path.suffix.lower() in SUFFIXES and path.is_file()


def read(path: Path, options: ReadOptions) -> LightField:
    """Light field from a mosaic; the options or its name give the grid."""
    quilt = _QUILT.fullmatch(path.stem)
    grid = options.grid or (quilt and (int(quilt[2]), int(quilt[1])))
    if grid is None:
        raise SepiError(f"{path}: --format mosaic needs --grid ROWSxCOLUMNS, the views in the image")
    rows, columns = grid
    picture = read_picture(path, any_floats=options.white is not None)
    height, width = picture.shape[:2]
    if 0 in (rows, columns) or height % rows or width % columns:
        raise SepiError(f"{path}: {width}x{height} pixels hold no {rows}x{columns} views of one size")
    views = picture.reshape(rows, height // rows, columns, width // columns, -1).swapaxes(1, 2)
    if options.grid is None:
        views = views[::-1].reshape(1, rows * columns, *views.shape[2:])
        note = f"a quilt of {columns} columns and {rows} rows, by its name: a row of views from the lower left"
    else:
        note = f"the image is cut into {rows}x{columns} views, row by row from the upper left"
    light_field = light_field_from_array(views, path, replace(options, grid=None), axes="TSHWC")
    return replace(light_field, notes=(note, *light_field.notes))
