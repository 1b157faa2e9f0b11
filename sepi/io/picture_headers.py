"""Header of an image, read before decoding: its kind, its size, and whether the file is complete.

Decoders take memory for any size in a header, and some fill the missing part of a truncated file with grey. Pillow
reads most headers, by its class for each kind: ``Image.open`` and the class for WebP refuse images that are allowed
here, and that limit cannot be set for one thread alone.
"""

from __future__ import annotations

import io
import re
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from importlib import import_module
from pathlib import Path
from typing import IO, Any, NamedTuple

import numpy as np
import numpy.typing as npt

from sepi.errors import SepiError
from sepi.io.exr import SIGNATURE, exr_form
from sepi.io.files import reading
from sepi.io.tiff import TIFF_SIGNATURES, open_tiff, tiff_form

_GAP = rb"(?:\s|#[^\n]*\n)++"
_HEADER = re.compile(rb"P([2356])" + _GAP + rb"([0-9]{1,9})" + _GAP + rb"([0-9]{1,9})" + _GAP + rb"([0-9]{1,5})\s")


class PnmForm(NamedTuple):
    """Header of a PGM or PPM: size, channels, value of white, whether pixels are text, and their first byte."""

    height: int
    width: int
    channels: int
    white: int
    digits: bool
    start: int


def pnm_form(head: bytes, size: int) -> PnmForm:
    """Parse the first bytes of a file of ``size`` bytes.

    Raises
    ------
    SepiError
        If the header is not valid, or the file cannot hold the pixels.
    """
    match = _HEADER.match(head)
    if match is None:
        raise SepiError("damaged PNM: expected 'P5 WIDTH HEIGHT WHITE' or 'P6 WIDTH HEIGHT WHITE' and the pixels")
    kind, width, height, white = map(int, match.groups())
    if not 1 <= white <= 65535:
        raise SepiError(f"damaged PNM: expected a value of white of 1 to 65535, got {white}")
    form = PnmForm(height, width, 1 if kind in (2, 5) else 3, white, kind in (2, 3), match.end())
    values = height * width * form.channels
    if form.start + (2 * values - 1 if form.digits else values * (1 if white < 256 else 2)) > size:
        raise SepiError(f"damaged PNM: the file is cut off after {size} bytes")
    return form


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


MAX_PIXELS = 2**28
"""Most pixels of an image that is read; no camera has more."""

# more than any compression reaches on images of 8 bit; small images of one colour may shrink further
_PIXELS_PER_BYTE = 1100
_SMALL = 2**24


@dataclass(frozen=True)
class Header:
    """Kind, size and pixel type of an image, from its header.

    Attributes
    ----------
    kind : str
        Such as ``"PNG"`` or ``"OpenEXR"``.
    height, width : int
        In pixels.
    pixel_bytes : int
        Bytes of a decoded pixel.
    grey : bool
        Whether it has no colours; False if the header does not say.
    white : int
        PNM: the value of white; else 0.
    """

    kind: str
    height: int
    width: int
    pixel_bytes: int = 3
    grey: bool = False
    white: int = 0


def read_header(path: Path, file: IO[bytes]) -> Header:
    """Header of an open image file; its content tells the kind, not its name.

    Parameters
    ----------
    path : Path
        For messages.
    file : binary file
        Only its first bytes are read, or as much as tells whether it is complete.

    Raises
    ------
    SepiError
        If it is not an image of a known kind, is cut off or damaged, of a form that is not supported, or claims more
        pixels than its bytes can hold.
    """
    size = file.seek(0, io.SEEK_END)
    file.seek(0)
    start = file.read(12)
    kind = next((kind for kind, (signatures, _) in _KINDS.items() if start.startswith(signatures)), None)
    if kind is None:
        raise SepiError(f"{path}: not a {', '.join(_KINDS)} image (PNM: PGM or PPM)")
    file.seek(0)
    with reading(path, kind):
        header = Header(kind, *_KINDS[kind][1](file, path, size))
        if not 1 <= header.height * header.width <= min(MAX_PIXELS, _PIXELS_PER_BYTE * size + _SMALL):
            raise SepiError(f"{header.width}x{header.height} pixels cannot be in a {kind} of {size} bytes, or too many")
    return header


# height, width, and if known: bytes of a pixel, grey, white
_Form = tuple[int, int] | tuple[int, int, int, bool] | tuple[int, int, int, bool, int]


def pillow_class(plugin: str) -> Any:
    """Pillow's class for images of a kind, such as ``"Png"``."""
    return getattr(import_module(f"PIL.{plugin}ImagePlugin"), f"{plugin}ImageFile")


def _by_pillow(plugin: str, file: IO[bytes], path: Path, size: int) -> _Form:
    with pillow_class(plugin)(file) as image:
        # how a PNG packs its pixels: decoding turns grey with transparency, or a palette, into colours
        packed = str(image.tile[0].args) if plugin == "Png" else image.mode
        grey = packed.startswith(("1", "I", "L")) if plugin == "Png" else packed in ("1", "L", "LA", "I;16")
        return image.height, image.width, (1 if grey else 3) * (2 if "16" in packed else 1), grey


def _avif(file: IO[bytes], path: Path, size: int) -> _Form:
    # the box 'ispe' holds the size of the image
    _, _, box = file.read(4096).partition(b"ispe\0\0\0\0")
    return int.from_bytes(box[4:8], "big"), int.from_bytes(box[:4], "big")


def _webp(file: IO[bytes], path: Path, size: int) -> _Form:
    head = file.read(30)
    if head[12:16] == b"VP8X":
        width, height = (1 + int.from_bytes(head[at : at + 3], "little") for at in (24, 27))
    elif head[12:16] == b"VP8L":
        bits = int.from_bytes(head[21:25], "little")
        width, height = 1 + bits % 2**14, 1 + (bits >> 14) % 2**14
    else:
        width, height = (int.from_bytes(head[at : at + 2], "little") % 2**14 for at in (26, 28))
    return height, width


def _tiff(file: IO[bytes], path: Path, size: int) -> _Form:
    """Form of the first page."""
    with open_tiff(file) as pictures:
        return tiff_form(pictures.pages[0].aspage(), size)


def _pnm(file: IO[bytes], path: Path, size: int) -> _Form:
    height, width, channels, white, *_ = pnm_form(file.read(4096), size)
    return height, width, channels * (1 if white < 256 else 2), channels == 1, white


def _exr(file: IO[bytes], path: Path, size: int) -> _Form:
    height, width, names = exr_form(str(path))
    return height, width, 4 * len(names), len(names) == 1


_KINDS: dict[str, tuple[bytes | tuple[bytes, ...], Callable[[IO[bytes], Path, int], _Form]]] = {
    "PNG": (b"\x89PNG\r\n\x1a\n", partial(_by_pillow, "Png")),
    "JPEG": (b"\xff\xd8\xff", partial(_by_pillow, "Jpeg")),
    "TIFF": (TIFF_SIGNATURES, _tiff),
    "OpenEXR": (SIGNATURE, _exr),
    "BMP": (b"BM", partial(_by_pillow, "Bmp")),
    "GIF": (b"GIF8", partial(_by_pillow, "Gif")),
    "JPEG 2000": ((b"\0\0\0\x0cjP  ", b"\xff\x4f\xff\x51"), partial(_by_pillow, "Jpeg2K")),
    # the length of the first box comes before
    "AVIF": (tuple(bytes((0, 0, 0, length)) + b"ftypavif" for length in range(16, 256, 4)), _avif),
    "WebP": (b"RIFF", _webp),
    "PNM": ((b"P2", b"P3", b"P5", b"P6"), _pnm),
}
