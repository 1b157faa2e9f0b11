"""TIFF stacks: each page is a view.

ImageJ, OME and tifffile store the axes of the pages. Two axes, such as time and depth, are a grid of views, and an axis
of three channels holds colours. Without axes the pages are a sequence.
"""

from __future__ import annotations

from dataclasses import replace
from math import prod
from pathlib import Path
from typing import Any

import numpy as np

from sepi.errors import SepiError
from sepi.io.files import DEFLATE_RATIO, naming, reading
from sepi.io.readers.arrays import Array, light_field_from_array
from sepi.io.readers.formats import Format
from sepi.io.readers.options import ReadOptions
from sepi.io.readers.view_files import MAX_VIEWS
from sepi.io.tiff import TIFF_SIGNATURES, directory_of, open_tiff, page_pixels, tiff_form
from sepi.lightfield import LightField

_SUFFIXES = (".tif", ".tiff")
_KIND = "TIFF stack"
_RGB = 3
# bytes that the pages of any file may take, however small the file
_SMALL = 2**24


FORMAT = Format("TIFF stack", "a page for each view", __name__, ("grid",))


def matches(path: Path) -> bool:
    """Whether ``path`` is a TIFF whose first pages are alike, or a damaged one.

    Other TIFFs hold one image, perhaps with a thumbnail.
    """
    if path.suffix.lower() not in _SUFFIXES or not path.is_file():
        return False
    try:
        with reading(path, _KIND), path.open("rb") as file:
            if not file.read(4).startswith(TIFF_SIGNATURES):
                return False
            file.seek(0)
            with open_tiff(file) as pictures:
                first, *others = (page.aspage() for page in pictures.pages[:2])
                return not _is_whole(pictures) or any(
                    (page.shape, page.dtype) == (first.shape, first.dtype) for page in others
                )
    except SepiError:
        # reading reports the damage
        return True


def size_of(path: Path) -> tuple[int, int, int, int]:
    """Number of pages, height, width and bytes of a pixel; no pixels are read."""
    with reading(path, _KIND), path.open("rb") as file, open_tiff(file) as pictures:
        return _form(pictures, path.stat().st_size)


def read(path: Path, options: ReadOptions) -> LightField:
    """Light field from a stack; the options or the file give its grid, else the views stay in one row."""
    with reading(path, _KIND), path.open("rb") as file, open_tiff(file) as pictures:
        count = _form(pictures, path.stat().st_size)[0]
        first = page_pixels(pictures.pages[0].aspage())
        stack: Array = np.empty((count, *first.shape), first.dtype)
        for number, page in enumerate(pictures.pages):
            stack[number] = page_pixels(page.aspage())
        series = pictures.series[0]
        counted = [(axis, n) for axis, n in zip(series.axes, series.shape, strict=True) if axis not in "YXS" and n > 1]
    if prod(n for _, n in counted) != count:
        counted = [("I", count)]
    if len(counted) > 1 and ("C", _RGB) in counted and stack.shape[3] == 1:
        # each colour has a page
        stack = stack.reshape(*(n for _, n in counted), *stack.shape[1:3])
        colour = counted.index(("C", _RGB))
        stack = np.moveaxis(stack, colour, -1)
        del counted[colour]
    if len(counted) != 2 or options.grid is not None:
        return light_field_from_array(stack.reshape(-1, *stack.shape[-3:]), path, options, axes="NHWC")
    rows, columns = (n for _, n in counted)
    light_field = light_field_from_array(stack.reshape(rows, columns, *stack.shape[-3:]), path, options, axes="TSHWC")
    note = f"the file has {rows}x{columns} pages, taken as rows and columns; --order transpose exchanges them"
    return replace(light_field, notes=(note, *light_field.notes))


def _is_whole(pictures: Any) -> bool:
    """Whether no page follows the last readable one: tifffile leaves out pages beyond the end of a file."""
    return directory_of(pictures.pages[len(pictures.pages) - 1])[1]


def _form(pictures: Any, size: int) -> tuple[int, int, int, int]:
    if not _is_whole(pictures):
        raise SepiError(f"damaged TIFF: pages after page {len(pictures.pages)} are cut off")
    count = len(pictures.pages)
    if count > MAX_VIEWS:
        raise SepiError(f"more than {MAX_VIEWS} pages")
    forms = []
    for number, page in enumerate(pictures.pages, 1):
        with naming(f"page {number}"):
            forms.append((tiff_form(page.aspage(), size), page.aspage().dtype))
    if unlike := [number for number, form in enumerate(forms, 1) if form != forms[0]]:
        raise SepiError(f"page {unlike[0]} is unlike the first; all views must be alike")
    height, width, pixel_bytes, _ = forms[0][0]
    if count * height * width * pixel_bytes > size * DEFLATE_RATIO + _SMALL:
        raise SepiError(f"damaged TIFF: {count} pages of {width}x{height} in {size} bytes")
    return count, height, width, pixel_bytes
