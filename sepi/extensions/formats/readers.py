"""Readers of formats of single programs and devices: pictures of all views, lenslets, TIFF stacks, and OpenLF's HDF5.

In decoded lenslet images of the Stanford Lytro Light Field Archive [3]_, a block of pixels lies under each lenslet, one
of each sub-aperture image: the pixels ``(t, s)`` of all blocks are the view ``(t, s)``. Views near the corners of the
grid are dark.

A mosaic is one image of all views side by side. The name of a quilt of a Looking Glass display [1]_ gives its layout:
``_qs8x6a0.75`` means 8 columns, 6 rows and the aspect ratio of a view. Its views are a single row of cameras, from the
leftmost at the lower left, row by row, to the rightmost at the upper right.

In a TIFF stack each page is a view. ImageJ, OME and tifffile store the axes of the pages. Two axes, such as time and
depth, are a grid of views, and an axis of three channels holds colours. Without axes the pages are a sequence.

A file of OpenLF [2]_ has a group ``LF`` with a mosaic of all views for each channel. Attributes of the group give the
number of views in a row, ``cams_h``, and in a column, ``cams_v``, the size of the mosaic, ``width`` and ``height``, and
the kind of light field, ``LF_TYPE``. The mosaic of a single column of views may be transposed.

References
----------
.. [1] "Quilts", https://docs.lookingglassfactory.com/keyconcepts/quilts
.. [2] S. Wanner, "OpenLF", https://github.com/svenwanner/openlf
.. [3] A. Raj, M. Lowney, R. Shah, G. Wetzstein, "Stanford Lytro Light Field Archive", 2016.
       http://lightfields.stanford.edu/LF2016.html
"""

import math
import re
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from math import prod
from pathlib import Path
from typing import Any

import h5py
import numpy as np

from sepi.errors import SepiError, printable
from sepi.extensions.formats.hci_2013 import number_of
from sepi.io.codecs import TIFF, TIFF_SIGNATURES, directory_of, open_tiff, page_pixels, tiff_form
from sepi.io.files import DEFLATE_RATIO, naming, reading
from sepi.io.hdf5 import has_dataset, open_hdf5, read_dataset
from sepi.io.images import SUFFIXES, picture_header, read_picture
from sepi.io.readers.arrays import Array, light_field_from_array
from sepi.io.readers.formats import Format
from sepi.io.readers.options import ReadOptions
from sepi.io.readers.view_files import MAX_VIEWS
from sepi.lightfield import MIN_SIZE, LightField

_QUILT = re.compile(r".*_qs([0-9]{1,4})x([0-9]{1,4})a[0-9.]+", re.IGNORECASE)


def matches_quilt(path: Path) -> bool:
    """Whether ``path`` is an image with the name of a quilt."""
    return _QUILT.fullmatch(path.stem) is not None and path.suffix.lower() in SUFFIXES and path.is_file()


def read_mosaic(path: Path, options: ReadOptions) -> LightField:
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


# rows and columns of pixels under a lenslet in images of the archive
_BLOCK = (14, 14)

_CENTRAL = 9
_DARK = 0.2


def matches_lenslets(path: Path) -> bool:
    """Whether ``path`` is an image with ``eslf`` in its name."""
    return "eslf" in path.name.lower() and path.suffix.lower() in SUFFIXES and path.is_file()


def size_of_picture(path: Path) -> tuple[int, int, int, int]:
    """Size as that of a light field whose default views lie under lenslets; all of the picture is decoded."""
    header, views = picture_header(path), _CENTRAL**2
    height, width = max(1, header.height // _BLOCK[0]), max(1, header.width // _BLOCK[1])
    values = header.height * header.width * header.pixel_bytes
    return views, height, width, -(-values // (views * height * width))


def read_lenslets(path: Path, options: ReadOptions) -> LightField:
    """Read the views of a lenslet image; by default the middle 9x9 of them.

    Parameters
    ----------
    path : Path
        Image of any supported kind.
    options : ReadOptions
        ``grid`` is the size of the block under a lenslet.
    """
    T, S = grid = options.grid or _BLOCK
    if not 2 <= T * S <= MAX_VIEWS:
        raise SepiError(f"{path}: --grid {T}x{S}: expected a grid of 2 to {MAX_VIEWS} views")
    # default: 9 views a side or, in a smaller grid, the largest odd number
    usual = (min(_CENTRAL, T, S) + 1) // 2 * 2 - 1
    central = options.central or (usual if usual > 1 else None)
    picture = read_picture(path, any_floats=options.white is not None)
    height, width = picture.shape[0] // T, picture.shape[1] // S
    if min(height, width) < MIN_SIZE:
        raise SepiError(f"{path}: {T}x{S} views under each lenslet make views of {width}x{height} pixels; too small")
    notes = []
    if options.central is None and central is not None and (central, central) != grid:
        notes.append(f"the {central}x{central} views in the middle of {T}x{S}; --central N takes another odd number")
    cropped = picture.shape[0] - height * T, picture.shape[1] - width * S
    if any(cropped):
        notes.append(f"{cropped[0]} pixel rows and {cropped[1]} columns beyond the last whole lenslet were left out")
    blocks = picture[: height * T, : width * S].reshape(height, T, width, S, -1)
    light_field = light_field_from_array(blocks, path, replace(options, grid=None, central=central), axes="HTWSC")
    return replace(light_field, notes=(*notes, *light_field.notes, *_dark_notes(light_field)))


def _dark_notes(light_field: LightField) -> list[str]:
    """Notes on the views that are much darker than the reference view."""
    brightness = light_field.views.mean(axis=(2, 3, 4), dtype=np.float64)
    limit = _DARK * brightness[light_field.reference_position]
    dark = np.argwhere(light_field.present & (brightness < limit)).tolist()
    if not dark:
        return []
    flags = " ".join(f"--exclude {t},{s}" for t, s in dark)
    views = "1 view is" if len(dark) == 1 else f"{len(dark)} views are"
    return [f"{views} darker than a fifth of the reference view; to leave out: {flags}"]


_STACK = "TIFF stack"
_RGB = 3
# bytes that the pages of any file may take, however small the file
_SMALL = 2**24


def matches_stack(path: Path) -> bool:
    """Whether ``path`` is a TIFF whose first pages are alike, or a damaged one.

    Other TIFFs hold one image, perhaps with a thumbnail.
    """
    if path.suffix.lower() not in TIFF or not path.is_file():
        return False
    try:
        with reading(path, _STACK), path.open("rb") as file:
            if not file.read(4).startswith(TIFF_SIGNATURES):
                return False
            file.seek(0)
            with open_tiff(file) as pictures:
                forms = [(page.aspage().shape, page.aspage().dtype) for page in pictures.pages[:2]]
                return not _is_whole(pictures) or forms[0] in forms[1:]
    except SepiError:
        # reading reports the damage
        return True


def size_of_stack(path: Path) -> tuple[int, int, int, int]:
    """Number of pages, height, width and bytes of a pixel; no pixels are read."""
    with reading(path, _STACK), path.open("rb") as file, open_tiff(file) as pictures:
        return _pages(pictures, path.stat().st_size)


def read_stack(path: Path, options: ReadOptions) -> LightField:
    """Light field from a stack; the options or the file give its grid, else the views stay in one row."""
    with reading(path, _STACK), path.open("rb") as file, open_tiff(file) as pictures:
        count = _pages(pictures, path.stat().st_size)[0]
        first = page_pixels(pictures.pages[0].aspage())
        stack: Array = np.empty((count, *first.shape), first.dtype)
        for number, page in enumerate(pictures.pages):
            stack[number] = page_pixels(page.aspage())
        series = pictures.series[0]
        axes = [(axis, n) for axis, n in zip(series.axes, series.shape, strict=True) if axis not in "YXS" and n > 1]
    if prod(n for _, n in axes) != count:
        axes = [("I", count)]
    stack = stack.reshape(*(n for _, n in axes), *first.shape)
    if len(axes) > 1 and ("C", _RGB) in axes and first.shape[2] == 1:
        # each colour has a page
        colour = axes.index(("C", _RGB))
        stack = np.moveaxis(stack[..., 0], colour, -1)
        del axes[colour]
    if len(axes) != 2 or options.grid is not None:
        return light_field_from_array(stack.reshape(-1, *stack.shape[-3:]), path, options, axes="NHWC")
    (_, rows), (_, columns) = axes
    light_field = light_field_from_array(stack, path, options, axes="TSHWC")
    note = f"the file has {rows}x{columns} pages, taken as rows and columns; --order transpose exchanges them"
    return replace(light_field, notes=(note, *light_field.notes))


def _is_whole(pictures: Any) -> bool:
    """Whether no page follows the last readable one: tifffile leaves out pages beyond the end of a file."""
    return directory_of(pictures.pages[len(pictures.pages) - 1])[1]


def _pages(pictures: Any, size: int) -> tuple[int, int, int, int]:
    if not _is_whole(pictures):
        raise SepiError(f"damaged TIFF: pages after page {len(pictures.pages)} are cut off")
    count = len(pictures.pages)
    if count > MAX_VIEWS:
        raise SepiError(f"more than {MAX_VIEWS} pages")
    forms = []
    for number, page in enumerate(pictures.pages, 1):
        with naming(f"page {number}"):
            forms.append((tiff_form(page.aspage(), size), page.aspage().dtype))
            if forms[-1] != forms[0]:
                raise SepiError(f"page {number} is unlike the first; all views must be alike")
    height, width, pixel_bytes, _ = forms[0][0]
    if count * height * width * pixel_bytes > size * DEFLATE_RATIO + _SMALL:
        raise SepiError(f"damaged TIFF: {count} pages of {width}x{height} in {size} bytes")
    return count, height, width, pixel_bytes


GROUP = "LF"

_COLOURS, _GREY = ("r", "g", "b"), ("bw",)
_COUNTS = ("LF_TYPE", "cams_h", "cams_v", "height", "width")


def matches_open_lf(path: Path) -> bool:
    """Whether ``path`` is a readable HDF5 file with a group ``LF`` that has OpenLF's attributes or channels."""
    known = {*_COLOURS, *_GREY, *_COUNTS}
    return has_dataset(path, GROUP, lambda lf: isinstance(lf, h5py.Group) and known.intersection((*lf, *lf.attrs)))


def read_open_lf(path: Path, options: ReadOptions) -> LightField:
    """Light field of an OpenLF file; its baselines, of unknown unit, give the distance of rows in view steps."""
    with _open_lf(path) as (group, (rows, columns, H, W), names):
        mosaic = np.stack([_mosaic(path, group[name], (rows * H, columns * W), columns == 1) for name in names], axis=2)
        down, across = (number_of(group, key) for key in ("baseline_v", "baseline_h"))
    views = mosaic.reshape(rows, H, columns, W, -1).transpose(0, 2, 1, 3, 4)
    light_field = light_field_from_array(views, path, options, axes="TSHWC")
    if min(rows, columns) < 2 or not (0 < down < math.inf and 0 < across < math.inf):
        return light_field
    spacing = down / across
    # a transposed grid has the file's columns as rows
    return replace(light_field, row_spacing=1 / spacing if "transpose" in options.order else spacing)


def size_of_open_lf(path: Path) -> tuple[int, int, int, int]:
    """Number of views, height, width and bytes of a pixel; no values are read."""
    with _open_lf(path) as (group, (rows, columns, height, width), names):
        return rows * columns, height, width, len(names) * group[names[0]].dtype.itemsize


@contextmanager
def _open_lf(path: Path) -> Iterator[tuple[h5py.Group, tuple[int, int, int, int], tuple[str, ...]]]:
    """The group, the shape (T, S, H, W) of its views, and the names of their channels."""
    with open_hdf5(path, "file of OpenLF") as file, naming(path):
        group = file.get(GROUP)
        if not isinstance(group, h5py.Group):
            raise SepiError(f"expected a group '{GROUP}' as OpenLF writes it")
        channels = [name for name in (*_COLOURS, *_GREY) if name in group]
        known = channels in (list(_COLOURS), list(_GREY), [*_COLOURS, *_GREY])
        if not known or any(key not in group.attrs for key in _COUNTS):
            held = printable(", ".join(list(group)[:6])) or "nothing"
            raise SepiError(f"'{GROUP}' holds {held}; expected r, g and b, or bw, and {', '.join(_COUNTS)}")
        counts = [number_of(group, key) for key in _COUNTS]
        for key, count in zip(_COUNTS, counts, strict=True):
            if not 0 <= count < 2**31 or count != int(count):
                raise SepiError(f"expected the attribute '{key}' to be a whole number, got {count:g}")
        kind, columns, rows, height, width = map(int, counts)
        kinds = {1: rows * columns > 1, 2: rows == 1 < columns, 3: columns == 1 < rows}
        if kind not in kinds:
            what = "a cross of views" if kind == 4 else "unknown"
            expected = "1 (grid), 2 (row) or 3 (column), or a folder of the views"
            raise SepiError(f"LF_TYPE {kind}, {what}; expected {expected}")
        if min(rows, columns) < 1 or not kinds[kind]:
            raise SepiError(f"{rows}x{columns} views (cams_v x cams_h) do not fit LF_TYPE {kind}")
        if height % rows or width % columns:
            raise SepiError(f"{width}x{height} pixels hold no {rows}x{columns} views of one size")
        yield group, (rows, columns, height // rows, width // columns), _COLOURS if "r" in group else _GREY


def _mosaic(path: Path, dataset: h5py.Dataset, shape: tuple[int, int], column: bool) -> Array:
    values = read_dataset(path, dataset)
    # of a column of views, it may lie on its side
    if column and values.shape == shape[::-1] != shape:
        values = values.T
    if values.shape != shape:
        raise SepiError(f"{path}: '{dataset.name}' has shape {values.shape}; expected (height, width) = {shape}")
    return values


FORMATS = {
    "eslf": Format(
        "Lytro lenslet image", "NAME_eslf.png", matches_lenslets, read_lenslets, ("grid",), size_of=size_of_picture
    ),
    "mosaic": Format(
        "mosaic of views", "NAME_qs8x6a0.75.png", matches_quilt, read_mosaic, ("grid",), size_of=size_of_picture
    ),
    "tiff-stack": Format(
        "TIFF stack", "a page for each view", matches_stack, read_stack, ("grid",), size_of=size_of_stack
    ),
    "openlf": Format("OpenLF HDF5", "with a group LF", matches_open_lf, read_open_lf, size_of=size_of_open_lf),
}
