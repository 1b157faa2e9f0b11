"""Pixels of TIFFs as they are stored, whatever a camera's orientation says of them."""

from __future__ import annotations

import io
from typing import TYPE_CHECKING, Any, Literal

import numpy as np
import numpy.typing as npt

from sepi.errors import SepiError

if TYPE_CHECKING:
    from tifffile import TiffPage

# those that tifffile unpacks by itself, and no more than their files say
_COMPRESSIONS = (1, 8, 32946, 32773)
_PREDICTORS = (1, 2)
_ORIENTATION = 274


def is_plain(page: Any) -> bool:
    """Whether tifffile reads the pixels of one of its pages by itself: grey or RGB, not packed in a rarer way."""
    return page.compression in _COMPRESSIONS and page.predictor in _PREDICTORS and page.photometric in (0, 1, 2)


def plain_pixels(data: bytes) -> npt.NDArray[Any]:
    """Pixels of the first picture of a TIFF that is plain and whole, as :func:`page_pixels` has them."""
    import tifffile

    with tifffile.TiffFile(io.BytesIO(data)) as pictures:
        return page_pixels(pictures.pages[0].aspage())


def page_pixels(page: TiffPage) -> npt.NDArray[Any]:
    """Pixels of a page that is plain and whole, of an open file.

    Returns
    -------
    ndarray, shape (H, W, C), uint8, uint16 or float32
        Black is zero; transparency is left out.

    Raises
    ------
    SepiError
        If there are numbers below zero among integers.
    """
    import tifffile

    stored = page.asarray(squeeze=False, maxworkers=1)
    # planes, depth, height, width, samples: colours are either of the ends
    values = np.moveaxis(stored[:, 0, :, :, 0], 0, 2) if len(stored) > 1 else stored[0, 0]
    values = values[:, :, : 3 if values.shape[2] > 2 else 1]
    kind, size = values.dtype.kind, values.dtype.itemsize
    if kind == "i" and values.min() < 0:
        raise SepiError(f"a TIFF with a sign, and a pixel of {values.min()}; expected none below 0")
    values = values.astype(np.float32 if kind == "f" else f"u{size}")
    if page.photometric == tifffile.PHOTOMETRIC.MINISWHITE:
        # of numbers with a sign, white is the largest of them
        values = np.iinfo(stored.dtype).max - values
    return np.ascontiguousarray(values)


def unturned(data: bytes) -> bytes:
    """A TIFF that says that its rows and columns are as stored: OpenCV would turn them."""
    import tifffile

    with tifffile.TiffFile(io.BytesIO(data)) as pictures:
        tag = pictures.pages[0].aspage().tags.get(_ORIENTATION)
        order: Literal["big", "little"] = "big" if pictures.byteorder == ">" else "little"
    if tag is None or tag.value == 1:
        return data
    start, count = tag.valueoffset, tag.valuebytecount
    return data[:start] + (1).to_bytes(count, order) + data[start + count :]
