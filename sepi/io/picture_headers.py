"""What a picture is before it is decoded: its kind, its size, and whether all of it is there.

Decoders take memory on a header's word, and some fill with grey what a file that is cut off lacks. Pillow knows most
kinds, but few sorts of TIFF, of which tifffile reads the tags; neither reads a PNM with 16 bit colours.
"""

from __future__ import annotations

import io
import logging
import re
import zlib
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import IO

from sepi.errors import SepiError, printable

MAX_PIXELS = 2**28
"""More pixels than any camera's picture has."""

# more than any of the compressions reaches on pictures of 8 bit; small pictures of one colour may shrink further
_PIXELS_PER_BYTE = 1100
_SMALL = 2**24


@dataclass(frozen=True)
class Header:
    """A picture as its first bytes describe it.

    Attributes
    ----------
    kind : str
        ``"PNG"``, ``"JPEG"``, ``"BMP"``, ``"TIFF"``, ``"WebP"`` or ``"PNM"``.
    height, width : int
        In pixels.
    pixel_bytes : int
        Bytes that a pixel takes when it is decoded.
    grey : bool
        Whether it has no colours; where the file does not say, False.
    start, white, digits : int, int, bool
        PNM: where the pixels begin, the value of white, whether they are written in digits.
    mixed_alpha : bool
        Whether decoding mixes transparency into the colours.
    """

    kind: str
    height: int
    width: int
    pixel_bytes: int = 3
    grey: bool = False
    start: int = 0
    white: int = 0
    digits: bool = False
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
        Whether a PNG or JPEG that is cut off or damaged behind its header is refused, too.

    Raises
    ------
    SepiError
        If it is no picture of a known kind, is cut off or damaged, of a form that is not read, or claims more pixels
        than its bytes can hold.
    """
    size = file.seek(0, io.SEEK_END)
    file.seek(0)
    start = file.read(8)
    kind = next((kind for kind, (signatures, _) in _KINDS.items() if start.startswith(signatures)), None)
    if kind is None:
        raise SepiError(f"{path}: not a PNG, JPEG, TIFF, BMP, WebP, PGM or PPM picture")
    file.seek(0)
    try:
        header = _KINDS[kind][1](file, size, whole)
    except SepiError as error:
        raise SepiError(f"{path}: {error}") from error
    except Exception as error:
        # the libraries stumble over damage in many ways
        raise SepiError(f"{path}: damaged {kind}, perhaps cut off ({printable(str(error))[:200]})") from error
    pixels = header.height * header.width
    if not 1 <= pixels <= min(MAX_PIXELS, _PIXELS_PER_BYTE * size + _SMALL):
        raise SepiError(
            f"{path}: {header.width}x{header.height} pixels cannot be in a {kind} of {size} bytes, or are more than "
            f"the {MAX_PIXELS} that are read"
        )
    return header


def _by_pillow(file: IO[bytes], size: int, whole: bool) -> Header:
    from PIL import Image, UnidentifiedImageError

    try:
        image = Image.open(file, formats=("PNG", "JPEG", "BMP", "WEBP"))
    except UnidentifiedImageError as error:
        raise ValueError("its header gives no size") from error
    except Image.DecompressionBombError as error:
        raise SepiError(f"a picture of more pixels than any camera's ({error})") from error
    with image:
        # how pixels are packed; only of a PNG is it a plain text
        packed = image.tile[0].args if image.tile else ""
        packed = packed if isinstance(packed, str) else ""
        grey = packed.startswith(("1", "I", "L"))
        header = Header(
            {"WEBP": "WebP", "MPO": "JPEG"}.get(image.format or "", image.format or ""),
            image.height,
            image.width,
            pixel_bytes=(1 if grey else 3) * (2 if "16" in packed else 1),
            grey=grey,
        )
        if whole and header.kind == "JPEG":
            image.load()
        elif whole:
            image.verify()
    # Pillow leaves out the last checksum, of which libpng prints lines of its own
    if whole and header.kind == "PNG" and file.read(4) != zlib.crc32(b"IEND").to_bytes(4, "big"):
        raise ValueError("bad checksum in its last chunk")
    return header


def _tiff(file: IO[bytes], size: int, whole: bool) -> Header:
    """The first picture of the file; forms that would be decoded to other values than it holds are refused."""
    import tifffile

    # what it complains of is raised here
    logging.getLogger("tifffile").addHandler(logging.NullHandler())
    with tifffile.TiffFile(file) as pictures:
        page = pictures.pages[0].aspage()
    bits, samples, photometric = page.bitspersample, page.samplesperpixel, page.photometric
    if page.dtype not in ("u1", "u2", "f4") or bits != 8 * page.dtype.itemsize:
        form = {"f": " float", "i": " signed"}.get("" if page.dtype is None else page.dtype.kind, "")
        raise SepiError(f"a TIFF of {bits} bit{form} samples; expected 8 or 16 bit without sign, or 32 bit float")
    if samples not in (1, 3, 4):
        raise SepiError(f"a TIFF of {samples} samples a pixel; expected grey, RGB or RGBA")
    if samples > 1 and page.planarconfig != tifffile.PLANARCONFIG.CONTIG:
        raise SepiError("a TIFF with its colours apart (planar); save it interleaved (contiguous)")
    if photometric not in ((0, 1, 2, 3, 6) if bits == 8 else (1, 2)):
        raise SepiError("a TIFF that is neither grey with black as zero nor RGB; save it as one of these")
    height, width, counts = page.imagelength, page.imagewidth, page.databytecounts
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
        mixed_alpha=bits == 8 and samples == 4 and page.extrasamples[:1] == (tifffile.EXTRASAMPLE.UNASSALPHA,),
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
    return Header("PNM", height, width, (1 if grey else 3) * depth, grey, match.end(), white, digits)


_KINDS: dict[str, tuple[bytes | tuple[bytes, ...], Callable[[IO[bytes], int, bool], Header]]] = {
    "PNG": (b"\x89PNG\r\n\x1a\n", _by_pillow),
    "JPEG": (b"\xff\xd8\xff", _by_pillow),
    "TIFF": ((b"II*\0", b"II+\0", b"MM\0*", b"MM\0+"), _tiff),
    "BMP": (b"BM", _by_pillow),
    "WebP": (b"RIFF", _by_pillow),
    "PNM": ((b"P2", b"P3", b"P5", b"P6"), _pnm),
}
