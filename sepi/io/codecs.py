"""TIFF, OpenEXR and PNM: what a file says of its pixels, the pixels as stored, and maps of floats.

Orientation tags are not applied. The OpenEXR library is an optional extra.
"""

from __future__ import annotations

import importlib
import io
import logging
import math
import os
import re
import struct
import threading
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager, redirect_stdout, suppress
from pathlib import Path
from types import ModuleType
from typing import IO, TYPE_CHECKING, Any

import cv2
import numpy as np
import numpy.typing as npt

from sepi.errors import SepiError, printable
from sepi.io.files import atomic_path
from sepi.lightfield import FloatMap

if TYPE_CHECKING:
    from tifffile import TiffFile, TiffPage

TIFF = (".tif", ".tiff")
"""Suffixes of file names, in lower case."""

TIFF_SIGNATURES = (b"II*\0", b"II+\0", b"MM\0*", b"MM\0+")
"""First bytes of a TIFF."""

# none, LZW, deflate and PackBits, which unpack to no more than the tags say; the size of a JPEG is checked
_COMPRESSIONS = (1, 5, 8, 32946, 32773, _JPEG := 7)
_KINDS = ("u1", "u2", "i1", "i2", "f2", "f4")
_WHITE_IS_ZERO, _PALETTE, _YCBCR = 0, 3, 6
_COEFFICIENTS, _RANGE, _FULL_RANGE = 529, 532, (0, 1, 255, 1, 128, 1, 255, 1, 128, 1, 255, 1)
# pixels in a tile
_LARGEST_TILE = 2**24
# tags that change the meaning of the pixels, and whose absence tifffile does not notice
_FORM_TAGS = frozenset((258, 259, 262, 317, 320, 338, 339))
_SILENT = logging.NullHandler()


def open_tiff(file: IO[bytes]) -> TiffFile:
    """File opened by tifffile, which then prints no warnings."""
    import tifffile

    # what it warns of is raised as an error here
    logging.getLogger("tifffile").addHandler(_SILENT)
    return tifffile.TiffFile(file)


def tiff_form(page: Any, size: int) -> tuple[int, int, int, bool]:
    """Height and width of a page, bytes of a pixel, and whether it is grey.

    Parameters
    ----------
    page : TiffPage
    size : int
        Bytes of the file.

    Raises
    ------
    SepiError
        If the page is damaged, or of a form that would not be decoded exactly.
    """
    if _FORM_TAGS & (directory_of(page)[0] - {tag.code for tag in page.tags}):
        raise SepiError("damaged TIFF: tags that describe its pixels are cut off")
    bits, samples, photometric, dtype = page.bitspersample, page.samplesperpixel, page.photometric, page.dtype
    if dtype is None or dtype.str[1:] not in _KINDS or bits != 8 * dtype.itemsize:
        form = {"f": " float", "i": " signed"}.get(dtype.kind if dtype is not None else "", "")
        raise SepiError(f"a TIFF of {bits} bit{form} samples; expected 8 or 16 bit, or 32 bit float")
    if samples not in (1, 3, 4):
        raise SepiError(f"a TIFF of {samples} samples a pixel; expected grey, RGB or RGBA")
    if page.compression not in _COMPRESSIONS or page.predictor not in (1, 2, 3):
        raise SepiError("a TIFF of a rare compression; save it uncompressed")
    known = [1, 2, *[_WHITE_IS_ZERO] * (dtype.kind != "f"), *[_PALETTE] * (bits == 8 and samples == 1)]
    if photometric not in (*known, *[_YCBCR] * (page.compression == _JPEG or _is_full_ycbcr(page))):
        raise SepiError("a TIFF that is neither grey nor RGB; save it as one of these")
    height, width, counts = page.imagelength, page.imagewidth, page.databytecounts
    if not all(isinstance(number, int) for number in (height, width, page.tilelength, page.tilewidth)):
        # with several values, a product with another size would be a list of that length
        raise SepiError("damaged TIFF: its height and width are not one number each")
    if page.imagedepth != 1:
        raise SepiError("a TIFF of a volume; save each of its slices as a TIFF")
    if 0 in counts or len(counts) < math.prod(page.chunked):
        # a decoder would fill missing parts with black
        raise SepiError("damaged TIFF: parts of its pixels are missing")
    if max(start + count for start, count in zip(page.dataoffsets, counts, strict=True)) > size:
        raise SepiError(f"damaged TIFF: the file is cut off after {size} bytes")
    if page.compression == 1 and sum(counts) < width * height * samples * bits // 8:
        raise SepiError(f"damaged TIFF: {sum(counts)} bytes of pixels for {width}x{height} of {samples} x {bits} bit")
    if page.is_tiled and page.tilewidth * page.tilelength > _LARGEST_TILE:
        raise SepiError("damaged TIFF: tiles larger than any program writes")
    return height, width, samples * bits // 8, samples == 1 and photometric in (0, 1)


def page_pixels(page: TiffPage) -> npt.NDArray[Any]:
    """Pixels of a page of an open file whose form was checked.

    Returns
    -------
    ndarray, shape (H, W, C), uint8, uint16 or float32
        Black is zero; transparency is left out.

    Raises
    ------
    SepiError
        If integers are negative.
    """
    if page.compression == _JPEG:
        _require_no_larger(page)
    stored = page.asarray(squeeze=False, maxworkers=1)
    # planes, depth, height, width, samples: colours are the first or the last axis
    values = np.moveaxis(stored[:, 0, :, :, 0], 0, 2) if len(stored) > 1 else stored[0, 0]
    if page.photometric == _PALETTE:
        values = (np.asarray(page.colormap).T[values[:, :, 0]] >> 8).astype(np.uint8)
    values = values[:, :, : 3 if values.shape[2] > 2 else 1]
    kind, size = values.dtype.kind, values.dtype.itemsize
    if kind == "i" and values.min() < 0:
        raise SepiError(f"a TIFF with a sign, and a pixel of {values.min()}; expected none below 0")
    values = values.astype(np.float32 if kind == "f" else f"u{size}")
    if page.photometric == _YCBCR and page.compression != _JPEG:
        values = cv2.cvtColor(values[:, :, [0, 2, 1]], cv2.COLOR_YCrCb2RGB)
    if page.photometric == _WHITE_IS_ZERO:
        # for signed numbers, white is the largest of them
        values = np.iinfo(stored.dtype).max - values
    return np.ascontiguousarray(values)


def directory_of(page: Any) -> tuple[set[int], bool]:
    """Codes of all tags of a page, even unreadable ones, and whether it is the last page."""
    form, file = page.parent.tiff, page.parent.filehandle
    file.seek(page.offset)
    (count,) = struct.unpack(form.tagnoformat, file.read(form.tagnosize))
    entries = file.read(count * form.tagsize)
    codes = {struct.unpack_from(f"{form.byteorder}H", entries, at)[0] for at in range(0, len(entries), form.tagsize)}
    return codes, bool(file.read(form.offsetsize) == bytes(form.offsetsize))


def _is_full_ycbcr(page: Any) -> bool:
    """Whether a page has colours of 8 bit for each pixel, over the range and of the coefficients that are usual."""
    whole = page.tags.valueof(_RANGE, default=_FULL_RANGE) == _FULL_RANGE and _COEFFICIENTS not in page.tags
    return whole and page.subsampling == (1, 1) and page.dtype == np.uint8 and page.samplesperpixel > 2


def _require_no_larger(page: Any) -> None:
    """Raise if a JPEG in a page has more pixels than its tile or strip; the decoder would take memory for them."""
    from PIL.JpegImagePlugin import JpegImageFile

    file = page.parent.filehandle
    for start, count in zip(page.dataoffsets, page.databytecounts, strict=True):
        file.seek(start)
        with JpegImageFile(io.BytesIO(file.read(count))) as picture:
            if picture.width * picture.height > math.prod(page.chunks):
                raise SepiError(f"damaged TIFF: a JPEG of {picture.width}x{picture.height} pixels is too large for it")


def write_tiff(path: Path, values: FloatMap, comment: str) -> None:
    """Write a TIFF of 32-bit floats, losslessly compressed; equal content gives equal bytes.

    Parameters
    ----------
    path : Path
    values : ndarray, shape (H, W) or (H, W, 3), float32
        NaN and infinity stay.
    comment : str
        Meaning and unit of the numbers; becomes the TIFF's description.

    Raises
    ------
    SepiError
        If the file cannot be written.
    """
    import tifffile

    pixels, kind = np.ascontiguousarray(values, np.float32), "minisblack" if values.ndim == 2 else "rgb"
    with atomic_path(path) as temporary:
        tifffile.imwrite(
            temporary, pixels, photometric=kind, compression="zlib", description=comment, software="sepi", metadata=None
        )


EXR_SIGNATURE = b"v/1\x01"
"""First bytes of an OpenEXR."""

_COLOURS = ("R", "G", "B")
_GREY = "Y"
# most channels that a message lists
_LISTED = 12


def open_exr() -> ModuleType:
    """The package that reads and writes OpenEXR.

    Raises
    ------
    SepiError
        If it is not installed.
    """
    try:
        return importlib.import_module("OpenEXR")
    except ImportError as error:
        raise SepiError("OpenEXR needs a package that is not installed; pip install 'sepi[exr]'") from error


def exr_form(path: str) -> tuple[int, int, list[str]]:
    """Height and width of an image, and the names of its grey or colour channels.

    Raises
    ------
    SepiError
        If the image is deep or cropped, or does not have exactly one set of grey or colour channels.
    """
    exr = open_exr()
    # the package's older class InputFile crashes on damaged files
    with _quiet(), exr.File(path, header_only=True) as file:
        header = file.header()
        data, display = ([corner.tolist() for corner in header[f"{of}Window"]] for of in ("data", "display"))
        channels = {channel.name: (channel.xSampling, channel.ySampling) for channel in header["channels"]}
        flat = header.get("type", exr.scanlineimage) in (exr.scanlineimage, exr.tiledimage)
        names = _chosen(list(channels))
    if not flat or data != display:
        raise SepiError("a deep or cropped OpenEXR; expected a flat one whose data and display windows are the same")
    if any(channels[name] != (1, 1) for name in names):
        raise SepiError("an OpenEXR with subsampled channels; save all channels in full size")
    (left, top), (right, bottom) = data
    return bottom - top + 1, right - left + 1, names


def exr_pixels(path: str) -> npt.NDArray[np.float32]:
    """Pixels (H, W, C) of a file whose size was checked; half becomes float, transparency is left out."""
    height, width, names = exr_form(path)
    with _quiet(), open_exr().File(path, separate_channels=True) as file:
        channels = file.channels()
        # a part with damaged pixels has no channels
        stored = [channels[name].pixels for name in names]
    if any(values.dtype not in (np.float16, np.float32) for values in stored):
        raise SepiError("an OpenEXR of integers; expected half or float")
    return np.stack([values.astype(np.float32).reshape(height, width) for values in stored], axis=2)


def _chosen(names: list[str]) -> list[str]:
    """The colour channels of the only layer that has them, or the only grey channel."""
    layers = dict.fromkeys(name.removesuffix("R") for name in names if name.endswith("R"))
    coloured = [layer for layer in layers if {f"{layer}{colour}" for colour in _COLOURS} <= set(names)]
    if "" in coloured or len(coloured) == 1:
        layer = "" if "" in coloured else coloured[0]
        return [f"{layer}{colour}" for colour in _COLOURS]
    if not coloured and (len(names) == 1 or (_GREY in names and not {"RY", "BY"} & set(names))):
        return [_GREY if _GREY in names else names[0]]
    listed = printable(", ".join(names[:_LISTED]))
    raise SepiError(f"an OpenEXR with the channels {listed}; expected R, G and B, or Y, or these in one layer alone")


_terminal = threading.Lock()


@contextmanager
def _quiet() -> Iterator[None]:
    """Keep the library from printing about damage, which is raised as an error; it has no switch for that."""
    with _terminal, redirect_stdout(io.StringIO()), ExitStack() as after:
        # standard error may be closed
        with suppress(OSError):
            kept = os.dup(2)
            after.callback(os.close, kept)
            after.callback(os.dup2, kept, 2)
            with open(os.devnull, "wb") as nothing:
                os.dup2(nothing.fileno(), 2)
        yield


_GAP = rb"(?:\s|#[^\n]*\n)++"
_PNM = re.compile(rb"P([2356])" + _GAP + rb"([0-9]{1,9})" + _GAP + rb"([0-9]{1,9})" + _GAP + rb"([0-9]{1,5})\s")


def pnm_form(head: bytes, size: int) -> tuple[int, int, int, int, bool, int]:
    """Parse the first bytes of a PGM or PPM of ``size`` bytes.

    Returns
    -------
    height, width, channels, white : int
    digits : bool
        Whether pixels are text.
    start : int
        Place of the first byte of the pixels.

    Raises
    ------
    SepiError
        If the header is not valid, or the file cannot hold the pixels.
    """
    match = _PNM.match(head)
    if match is None:
        raise SepiError("damaged PNM: expected 'P5 WIDTH HEIGHT WHITE' or 'P6 WIDTH HEIGHT WHITE' and the pixels")
    kind, width, height, white = map(int, match.groups())
    if not 1 <= white <= 65535:
        raise SepiError(f"damaged PNM: expected a value of white of 1 to 65535, got {white}")
    channels, digits, start = 1 if kind in (2, 5) else 3, kind in (2, 3), match.end()
    values = height * width * channels
    if start + (2 * values - 1 if digits else values * (1 if white < 256 else 2)) > size:
        raise SepiError(f"damaged PNM: the file is cut off after {size} bytes")
    return height, width, channels, white, digits, start


def pnm_pixels(data: bytes) -> npt.NDArray[np.unsignedinteger]:
    """Pixels (H, W, C), uint8 or uint16, scaled to the whole range of their type."""
    height, width, channels, white, digits, start = pnm_form(data, len(data))
    kind = np.dtype("u1" if white < 256 else "u2")
    count, full = height * width * channels, int(np.iinfo(kind).max)
    if digits:
        values = np.fromstring(data[start:], np.int64, sep=" ")[:count]
    else:
        values = np.frombuffer(data, kind.newbyteorder(">"), count, start)
    if len(values) < count:
        raise SepiError("damaged PNM, perhaps cut off: its pixels cannot be decoded")
    if values.max() > white or values.min() < 0:
        raise SepiError(f"damaged PNM: a value of {values.max()}, but white is {white}")
    scaled = values if white == full else np.rint(values * (full / white))
    return scaled.astype(kind).reshape(height, width, channels)
