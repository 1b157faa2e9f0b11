"""How large a light field is, by the headers of its files alone: what the memory of a job is reckoned from."""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

from sepi.errors import SepiError
from sepi.io.files import DEFLATE_RATIO
from sepi.io.images import SUFFIXES, picture_header
from sepi.io.readers import eslf, matlab, numpy_files, open_lf, tiff_stack
from sepi.io.readers.arrays import is_likely
from sepi.io.readers.named_arrays import hdf5_shapes

# what is taken where no header tells: a view of the benchmark
_USUAL_SIDE = 512
_USUAL_VIEWS = 81
_RGB = 3


class Size(NamedTuple):
    """Size of a light field.

    Attributes
    ----------
    views : int
        Number of views.
    height, width : int
        Size of a view in pixels.
    pixel_bytes : int
        Bytes that a pixel of a view takes as its file holds it, unpacked: 3 for RGB of 8 bit.
    """

    views: int
    height: int
    width: int
    pixel_bytes: int = _RGB


def size_of(files: Sequence[Path]) -> Size:
    """Size of the light field that these files hold together; no values are read.

    Several pictures are a view each; a single one is a stack of them, or a lenslet picture, of which the usual views
    are read. Of other files it is the largest array in them, and its two longest axes those of a view. Where nothing
    tells, the largest file is taken for what it would be unpacked; damaged ones are left to the reader, which will say
    so.
    """
    pictures = [path for path in files if path.suffix.lower() in SUFFIXES]
    try:
        if len(pictures) > 1:
            header = picture_header(pictures[0])
            return Size(len(pictures), header.height, header.width, header.pixel_bytes)
        if pictures and tiff_stack.matches(pictures[0]):
            return Size(*tiff_stack.form_of(pictures[0]))
        if pictures:
            return _of_lenslets(pictures[0])
    except SepiError:
        if len(pictures) > 1:
            return Size(len(pictures), _USUAL_SIDE, _USUAL_SIDE)
    arrays = [(shape, itemsize) for path in files if path not in pictures for shape, itemsize in _arrays(path)]
    if arrays:
        return _of_array(*max(arrays, key=lambda array: math.prod(array[0]) * array[1]))
    values = max((path.stat().st_size for path in files), default=0)
    side = max(1, math.isqrt(values // (_RGB * _USUAL_VIEWS)))
    return Size(_USUAL_VIEWS, side, side)


def _of_lenslets(path: Path) -> Size:
    header = picture_header(path)
    height, width = max(1, header.height // eslf.BLOCK[0]), max(1, header.width // eslf.BLOCK[1])
    # all of the picture is decoded
    values = header.height * header.width * header.pixel_bytes
    return Size(_USUAL_VIEWS, height, width, -(-values // (_USUAL_VIEWS * height * width)))


def _of_array(shape: tuple[int, ...], itemsize: int) -> Size:
    """Size of the views in an array of 4 or 5 axes."""
    first, second = sorted(sorted(range(len(shape)), key=lambda axis: shape[axis])[-2:])
    others = [size for axis, size in enumerate(shape) if axis not in (first, second)]
    # colours are an axis of 5, or the last one behind a row of views
    coloured = others if len(others) == 3 else others[1:] if others[0] > 4 else []
    channels = next((size for size in reversed(coloured) if size in (3, 4)), 1)
    return Size(max(1, math.prod(others) // channels), shape[first], shape[second], itemsize * channels)


def _arrays(path: Path) -> list[tuple[tuple[int, ...], int]]:
    """Shape and bytes of a value of each array in a file that may be a light field, and that the file can hold."""
    try:
        if numpy_files.matches(path):
            arrays = list(numpy_files.array_shapes(path).values())
        elif matlab.matches(path):
            arrays = list(matlab.array_shapes(path).values())
        elif open_lf.matches(path):
            arrays = [open_lf.views_shape(path)]
        else:
            # the size alone, of many: whoever reads the views checks the file
            arrays = list(hdf5_shapes(path, check=False).values())
    except SepiError:
        return []
    most = path.stat().st_size * DEFLATE_RATIO
    sized = [(shape, kind.itemsize) for shape, kind in arrays if is_likely(shape)]
    return [(shape, itemsize) for shape, itemsize in sized if 0 < math.prod(shape) * itemsize <= most]
