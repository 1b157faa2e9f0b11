"""Header of a picture, read before decoding: its kind, its size, and whether the file is complete.

Decoders take memory on a header's word, and some fill with grey what a file that is cut off lacks. Pillow knows most
kinds, but few sorts of TIFF, of which tifffile reads the tags; neither reads a PNM with 16 bit colours.

Pillow's classes are used one by one: ``Image.open`` warns of pictures larger than half of what is read here, and
refuses larger ones, as its class for WebP does; that limit cannot be set for one thread alone.
"""

from __future__ import annotations

import io
import logging
import math
import re
import zlib
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from importlib import import_module
from pathlib import Path
from typing import IO, TYPE_CHECKING

from sepi.errors import SepiError
from sepi.io.exr import SIGNATURE, exr_form
from sepi.io.files import reading
from sepi.io.tiff import is_plain

if TYPE_CHECKING:
    from tifffile import TiffFile, TiffPage

MAX_PIXELS = 2**28
"""More pixels than any camera's picture has."""

TIFF_SIGNATURES = (b"II*\0", b"II+\0", b"MM\0*", b"MM\0+")
"""First bytes of a TIFF."""

# more than any of the compressions reaches on pictures of 8 bit; small pictures of one colour may shrink further
_PIXELS_PER_BYTE = 1100
_SMALL = 2**24
_SILENT = logging.NullHandler()


@dataclass(frozen=True)
class Header:
    """A picture as its first bytes describe it.

    Attributes
    ----------
    kind : str
        Such as ``"PNG"`` or ``"OpenEXR"``.
    height, width : int
        In pixels.
    pixel_bytes : int
        Bytes that a pixel takes when it is decoded.
    grey : bool
        Whether it has no colours; where the file does not say, False.
    white : int
        PNM: the value of white; else 0.
    plain : bool
        TIFF: whether tifffile reads its pixels.
    mixed_alpha : bool
        Whether decoding mixes transparency into the colours.
    """

    kind: str
    height: int
    width: int
    pixel_bytes: int = 3
    grey: bool = False
    white: int = 0
    plain: bool = False
    mixed_alpha: bool = False


def read_header(path: Path, file: IO[bytes], *, whole: bool = False) -> Header:
    """Find out what picture an open file is; what its name says does not matter.

    Parameters
    ----------
    path : Path
        For messages.
    file : binary file
        Its first bytes are read, or as much as tells whether all of it is there.
    whole : bool
        Whether a PNG that is cut off or damaged behind its header is refused, too.

    Raises
    ------
    SepiError
        If it is no picture of a known kind, is cut off or damaged, of a form that is not read, or claims more pixels
        than its bytes can hold.
    """
    size = file.seek(0, io.SEEK_END)
    file.seek(0)
    start = file.read(12)
    kind = next((kind for kind, (signatures, _) in _KINDS.items() if start.startswith(signatures)), None)
    if kind is None:
        raise SepiError(f"{path}: not a {', '.join(_KINDS)} picture (PNM: PGM or PPM)")
    file.seek(0)
    with reading(path, kind):
        header = _KINDS[kind][1](file, size, whole)
        if not 1 <= header.height * header.width <= min(MAX_PIXELS, _PIXELS_PER_BYTE * size + _SMALL):
            raise SepiError(
                f"{header.width}x{header.height} pixels cannot be in a {kind} of {size} bytes, or are more than "
                f"the {MAX_PIXELS} that are read"
            )
    return header


def _png(file: IO[bytes], size: int, whole: bool) -> Header:
    from PIL.PngImagePlugin import PngImageFile

    with PngImageFile(file) as image:
        # how pixels are packed: a grey PNG with transparency has colours once decoded
        packed = str(image.tile[0].args)
        grey = packed.startswith(("1", "I", "L"))
        pixel_bytes = (1 if grey else 3) * (2 if "16" in packed else 1)
        header = Header("PNG", image.height, image.width, pixel_bytes, grey)
        if whole:
            image.verify()
            # Pillow leaves out the last checksum, of which libpng prints lines of its own
            if file.read(4) != zlib.crc32(b"IEND").to_bytes(4, "big"):
                raise ValueError("bad checksum in its last chunk")
    return header


def _by_pillow(kind: str, plugin: str, file: IO[bytes], size: int, whole: bool) -> Header:
    with getattr(import_module(f"PIL.{plugin}ImagePlugin"), f"{plugin}ImageFile")(file) as image:
        # a palette may have colours
        grey, wide = image.mode in ("L", "LA", "I;16"), image.mode == "I;16"
        return Header(kind, image.height, image.width, (1 if grey else 3) * (2 if wide else 1), grey)


def _avif(file: IO[bytes], size: int, whole: bool) -> Header:
    # the box with the size of the picture
    _, _, box = file.read(4096).partition(b"ispe\0\0\0\0")
    return Header("AVIF", int.from_bytes(box[4:8], "big"), int.from_bytes(box[:4], "big"))


def _webp(file: IO[bytes], size: int, whole: bool) -> Header:
    head = file.read(30)
    if head[12:16] == b"VP8X":
        width, height = (1 + int.from_bytes(head[at : at + 3], "little") for at in (24, 27))
    elif head[12:16] == b"VP8L":
        bits = int.from_bytes(head[21:25], "little")
        width, height = 1 + bits % 2**14, 1 + (bits >> 14) % 2**14
    else:
        width, height = (int.from_bytes(head[at : at + 2], "little") % 2**14 for at in (26, 28))
    return Header("WebP", height, width)


def _tiff(file: IO[bytes], size: int, whole: bool) -> Header:
    """The first picture of the file."""
    with open_tiff(file) as pictures:
        return tiff_page(pictures.pages[0].aspage(), size)


def open_tiff(file: IO[bytes]) -> TiffFile:
    """A file as tifffile reads it, without a word on the terminal."""
    import tifffile

    # what it complains of is raised here
    logging.getLogger("tifffile").addHandler(_SILENT)
    return tifffile.TiffFile(file)


def tiff_page(page: TiffPage, size: int) -> Header:
    """A page of a TIFF of ``size`` bytes; forms that would be decoded to other values than it holds are refused."""
    import tifffile

    bits, samples, photometric = page.bitspersample, page.samplesperpixel, page.photometric
    plain = is_plain(page)
    rarer = "" if plain else ", or save it uncompressed"
    kind, size_of_one = (page.dtype.kind, page.dtype.itemsize) if page.dtype is not None else ("", 0)
    known = ("u1", "u2", "i1", "i2", "f2", "f4") if plain else ("u1", "u2", "f4")
    if f"{kind}{size_of_one}" not in known or bits != 8 * size_of_one:
        form = {"f": " float", "i": " signed"}.get(kind, "")
        raise SepiError(f"a TIFF of {bits} bit{form} samples; expected 8 or 16 bit, or 32 bit float{rarer}")
    if samples not in (1, 3, 4):
        raise SepiError(f"a TIFF of {samples} samples a pixel; expected grey, RGB or RGBA")
    if samples > 1 and page.planarconfig != tifffile.PLANARCONFIG.CONTIG and not plain:
        raise SepiError(f"a TIFF with its colours apart (planar); save it interleaved (contiguous){rarer}")
    if photometric not in ((0, 1, 2, 3, 6) if bits == 8 else (0, 1, 2) if plain and kind != "f" else (1, 2)):
        raise SepiError(f"a TIFF that is neither grey with black as zero nor RGB; save it as one of these{rarer}")
    height, width, counts = page.imagelength, page.imagewidth, page.databytecounts
    if not all(isinstance(number, int) for number in (height, width, page.tilelength, page.tilewidth)):
        # several of them: a product with one would be a list as long as the other says
        raise SepiError("damaged TIFF: its height and width are not one number each")
    if page.imagedepth != 1:
        raise SepiError("a TIFF of a volume; save each of its pictures as one")
    if 0 in counts or len(counts) < math.prod(page.chunked):
        # a decoder would take what is missing for black
        raise SepiError("damaged TIFF: parts of its pixels are missing")
    if max(start + count for start, count in zip(page.dataoffsets, counts, strict=True)) > size:
        raise SepiError(f"damaged TIFF: the file is cut off after {size} bytes")
    if page.compression == tifffile.COMPRESSION.NONE and sum(counts) < width * height * samples * bits // 8:
        raise SepiError(f"damaged TIFF: {sum(counts)} bytes of pixels for {width}x{height} of {samples} x {bits} bit")
    if page.is_tiled and page.tilewidth * page.tilelength > _SMALL:
        raise SepiError("damaged TIFF: tiles larger than any program writes")
    return Header(
        "TIFF",
        height,
        width,
        pixel_bytes=samples * bits // 8,
        grey=samples == 1 and photometric in (0, 1),
        plain=plain,
        mixed_alpha=not plain
        and bits == 8
        and samples == 4
        and page.extrasamples[:1] == (tifffile.EXTRASAMPLE.UNASSALPHA,),
    )


_PNM = re.compile(
    rb"P([2356])(?:\s|#[^\n]*\n)++([0-9]{1,9})(?:\s|#[^\n]*\n)++([0-9]{1,9})(?:\s|#[^\n]*\n)++([0-9]{1,5})\s"
)


def _pnm(file: IO[bytes], size: int, whole: bool) -> Header:
    match = _PNM.match(file.read(4096))
    if match is None:
        raise SepiError("damaged PNM: expected 'P5 WIDTH HEIGHT WHITE' or 'P6 WIDTH HEIGHT WHITE' and the pixels")
    form, width, height, white = map(int, match.groups())
    if not 1 <= white <= 65535:
        raise SepiError(f"damaged PNM: expected a value of white of 1 to 65535, got {white}")
    grey, digits, depth = form in (2, 5), form in (2, 3), 1 if white < 256 else 2
    values = width * height * (1 if grey else 3)
    if match.end() + (2 * values - 1 if digits else values * depth) > size:
        raise SepiError(f"damaged PNM: the file is cut off after {size} bytes")
    return Header("PNM", height, width, (1 if grey else 3) * depth, grey, white)


def _exr(file: IO[bytes], size: int, whole: bool) -> Header:
    height, width, names = exr_form(file.name)
    return Header("OpenEXR", height, width, 4 * len(names), len(names) == 1)


_KINDS: dict[str, tuple[bytes | tuple[bytes, ...], Callable[[IO[bytes], int, bool], Header]]] = {
    "PNG": (b"\x89PNG\r\n\x1a\n", _png),
    "JPEG": (b"\xff\xd8\xff", partial(_by_pillow, "JPEG", "Jpeg")),
    "TIFF": (TIFF_SIGNATURES, _tiff),
    "OpenEXR": (SIGNATURE, _exr),
    "BMP": (b"BM", partial(_by_pillow, "BMP", "Bmp")),
    "GIF": (b"GIF8", partial(_by_pillow, "GIF", "Gif")),
    "JPEG 2000": ((b"\0\0\0\x0cjP  ", b"\xff\x4f\xff\x51"), partial(_by_pillow, "JPEG 2000", "Jpeg2K")),
    # behind the length of its first box
    "AVIF": (tuple(bytes((0, 0, 0, length)) + b"ftypavif" for length in range(16, 256, 4)), _avif),
    "WebP": (b"RIFF", _webp),
    "PNM": ((b"P2", b"P3", b"P5", b"P6"), _pnm),
}
