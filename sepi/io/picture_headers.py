"""What the bytes of a picture say before it is decoded: its kind, its size, and whether all of it is there.

Decoders take memory on a header's word, and some fill with grey what a file that is cut off lacks. Both are found here.
"""

from __future__ import annotations

import re
import struct
import zlib
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

import numpy as np

from sepi.errors import SepiError

MAX_PIXELS = 2**28
"""More pixels than any camera's picture has."""

# more than any of the compressions reaches on pictures of 8 bit; small pictures of one colour may shrink further
_PIXELS_PER_BYTE = 1100
_SMALL = 2**24

PNG_SIGNATURE = b"\x89PNG\r\n\x1a\n"


@dataclass(frozen=True)
class Header:
    """A picture as its first bytes describe it.

    Attributes
    ----------
    kind : str
        ``"PNG"``, ``"JPEG"``, ``"BMP"``, ``"TIFF"``, ``"WebP"`` or ``"PNM"``.
    height, width : int
        In pixels.
    grey : bool
        Whether it has no colours; where the file does not say, False.
    start, largest, digits : int, int, bool
        PNM: where the pixels begin, the value of white, whether they are written in digits.
    mixed_alpha : bool
        Whether decoding mixes transparency into the colours.
    """

    kind: str
    height: int
    width: int
    grey: bool = False
    start: int = 0
    largest: int = 0
    digits: bool = False
    mixed_alpha: bool = False


class _FaultError(Exception):
    """What is wrong with a picture."""


def header_of(path: Path, data: bytes) -> Header:
    """Find out what picture ``data`` is; what its name says does not matter.

    Raises
    ------
    SepiError
        If it is no picture of a known kind, is cut off or damaged, of a form that is not read, or claims more pixels
        than its bytes can hold.
    """
    kind = next((kind for kind, (start, _) in _KINDS.items() if start.match(data)), None)
    if kind is None:
        raise SepiError(f"{path}: not a PNG, JPEG, TIFF, BMP, WebP, PGM or PPM picture")
    try:
        header = _KINDS[kind][1](data)
    except _FaultError as fault:
        raise SepiError(f"{path}: {fault}") from fault
    except (struct.error, IndexError) as error:
        raise SepiError(f"{path}: {_cut(kind, data)}") from error
    pixels = header.height * header.width
    if pixels < 1:
        raise SepiError(f"{path}: damaged {kind}: a size of {header.width}x{header.height} pixels")
    if pixels > min(MAX_PIXELS, _PIXELS_PER_BYTE * len(data) + _SMALL):
        raise SepiError(
            f"{path}: {header.width}x{header.height} pixels cannot be in a {kind} of {len(data)} bytes, or are more "
            f"than the {MAX_PIXELS} that are read"
        )
    return header


def _cut(kind: str, data: bytes) -> str:
    return f"damaged {kind}: the file is cut off after {len(data)} bytes"


def _png(data: bytes) -> Header:
    """A chain of undamaged chunks up to the end mark."""
    if data[12:16] != b"IHDR":
        raise _FaultError("damaged PNG: no header" if len(data) > 16 else _cut("PNG", data))
    at = len(PNG_SIGNATURE)
    while at + 12 <= len(data):
        length, kind = struct.unpack_from(">I4s", data, at)
        end = at + 12 + length
        if end > len(data):
            break
        if zlib.crc32(memoryview(data)[at + 4 : end - 4]) != struct.unpack_from(">I", data, end - 4)[0]:
            chunk = kind.decode("ascii") if kind.isalpha() else "without a name"
            raise _FaultError(f"damaged PNG: checksum of chunk {chunk} is wrong")
        if kind == b"IEND":
            width, height, _, colour = struct.unpack_from(">IIBB", data, 16)
            return Header("PNG", height, width, grey=colour in (0, 4))
        at = end
    raise _FaultError(_cut("PNG", data))


_AFTER_SCAN = re.compile(rb"\xff[^\x00\xd0-\xd7\xff]")
_FRAMES = frozenset(range(0xC0, 0xD0)) - {0xC4, 0xC8, 0xCC}


def _jpeg(data: bytes) -> Header:
    """A chain of segments up to the end mark; the size is in the frame's."""
    header = None
    at = 2
    while at + 1 < len(data):
        if data[at] != 0xFF:
            raise _FaultError(f"damaged JPEG: no segment begins at byte {at}")
        marker = data[at + 1]
        if marker == 0xFF:
            at += 1
            continue
        if marker == 0xD9:
            break
        length = struct.unpack_from(">H", data, at + 2)[0]
        if marker in _FRAMES:
            height, width, components = struct.unpack_from(">HHB", data, at + 5)
            header = Header("JPEG", height, width, grey=components == 1)
        at += 2 + length
        if marker == 0xDA:
            scan_end = _AFTER_SCAN.search(data, at)
            at = len(data) if scan_end is None else scan_end.start()
    else:
        raise _FaultError(_cut("JPEG", data))
    if header is None:
        raise _FaultError("damaged JPEG: no frame")
    return header


def _bmp(data: bytes) -> Header:
    start, size = struct.unpack_from("<II", data, 10)
    if size == 12:
        width, height, _, bits = struct.unpack_from("<HHHH", data, 18)
        compression = 0
    else:
        width, height, _, bits, compression = struct.unpack_from("<iiHHI", data, 18)
    height = abs(height)
    if bits not in (1, 4, 8, 16, 24, 32) or width < 0:
        raise _FaultError(f"damaged BMP: {bits} bits a pixel, {width} pixels wide")
    stored_whole = compression in (0, 3, 6)
    if stored_whole and start + (width * bits + 31) // 32 * 4 * height > len(data):
        raise _FaultError(_cut("BMP", data))
    return Header("BMP", height, width)


def _webp(data: bytes) -> Header:
    if 8 + struct.unpack_from("<I", data, 4)[0] > len(data):
        raise _FaultError(_cut("WebP", data))
    form = data[12:16]
    if form == b"VP8 ":
        width, height = (value & 0x3FFF for value in struct.unpack_from("<HH", data, 26))
    elif form == b"VP8L":
        bits = struct.unpack_from("<I", data, 21)[0]
        width, height = (bits & 0x3FFF) + 1, (bits >> 14 & 0x3FFF) + 1
    elif form == b"VP8X" and len(data) >= 30:
        width, height = (int.from_bytes(data[at : at + 3], "little") + 1 for at in (24, 27))
    else:
        raise _FaultError("damaged WebP: no picture in it")
    return Header("WebP", height, width)


_PNM = re.compile(
    rb"P([2356])(?:\s|#[^\n]*\n)++([0-9]{1,9})(?:\s|#[^\n]*\n)++([0-9]{1,9})(?:\s|#[^\n]*\n)++([0-9]{1,5})\s"
)


def _pnm(data: bytes) -> Header:
    match = _PNM.match(data)
    if match is None:
        raise _FaultError("damaged PNM: expected 'P5 WIDTH HEIGHT WHITE' or 'P6 WIDTH HEIGHT WHITE' and the pixels")
    form, width, height, largest = map(int, match.groups())
    if not 1 <= largest <= 65535:
        raise _FaultError(f"damaged PNM: expected a value of white of 1 to 65535, got {largest}")
    values = width * height * (3 if form in (3, 6) else 1)
    digits = form in (2, 3)
    if match.end() + (2 * values - 1 if digits else values * (1 if largest < 256 else 2)) > len(data):
        raise _FaultError(_cut("PNM", data))
    return Header("PNM", height, width, form in (2, 5), match.end(), largest, digits)


_TIFF_TYPES = {1: "B", 3: "H", 4: "I", 16: "Q"}
_WIDTH, _HEIGHT, _BITS, _COMPRESSION, _PHOTOMETRIC, _SAMPLES = 256, 257, 258, 259, 262, 277
_STRIPS, _STRIP_BYTES, _PLANES, _TILES, _TILE_BYTES, _EXTRA, _SAMPLE_FORMAT = 273, 279, 284, 324, 325, 338, 339
_TILE_WIDTH, _TILE_HEIGHT = 322, 323
_LISTS = (_STRIPS, _STRIP_BYTES, _TILES, _TILE_BYTES)
_NUMBERS = (
    *(_WIDTH, _HEIGHT, _BITS, _COMPRESSION, _PHOTOMETRIC, _SAMPLES, _PLANES, _EXTRA, _SAMPLE_FORMAT),
    *(_TILE_WIDTH, _TILE_HEIGHT),
)
_ALPHA_APART = 2


def _tiff(data: bytes) -> Header:
    """The first picture of the file."""
    tags = _tiff_tags(data)
    width, height = _one(tags, _WIDTH, 0), _one(tags, _HEIGHT, 0)
    bits, samples = _one(tags, _BITS, 1), _one(tags, _SAMPLES, 1)
    _require_known_tiff(tags, bits, samples)
    starts = tags.get(_STRIPS, tags.get(_TILES, ()))
    sizes = tags.get(_STRIP_BYTES, tags.get(_TILE_BYTES, ()))
    if not starts or len(starts) != len(sizes):
        raise _FaultError("damaged TIFF: no list of where its pixels are")
    if max(start + size for start, size in zip(starts, sizes, strict=True)) > len(data):
        raise _FaultError(_cut("TIFF", data))
    if _one(tags, _COMPRESSION, 1) == 1 and sum(sizes) < width * height * samples * bits // 8:
        raise _FaultError(f"damaged TIFF: {sum(sizes)} bytes of pixels for {width}x{height} of {samples} x {bits} bit")
    if _one(tags, _TILE_WIDTH, 1) * _one(tags, _TILE_HEIGHT, 1) > _SMALL:
        raise _FaultError("damaged TIFF: tiles larger than any program writes")
    mixed = bits == 8 and samples == 4 and _one(tags, _EXTRA, 0) == _ALPHA_APART
    return Header("TIFF", height, width, grey=samples == 1 and _one(tags, _PHOTOMETRIC, 1) in (0, 1), mixed_alpha=mixed)


def _tiff_tags(data: bytes) -> dict[int, tuple[int, ...]]:
    """The tags of the first directory that are used here: first number, or all of them for lists of places."""
    order: Literal["<", ">"] = "<" if data[:2] == b"II" else ">"
    big = 43 in data[2:4]
    entry, count_form, inline = (20, "Q", 8) if big else (12, "H", 4)
    at = struct.unpack_from(f"{order}{'Q' if big else 'I'}", data, 8 if big else 4)[0]
    if at >= len(data):
        raise _FaultError(_cut("TIFF", data))
    entries = struct.unpack_from(order + count_form, data, at)[0]
    at += struct.calcsize(order + count_form)
    if at + entries * entry + inline > len(data):
        raise _FaultError(_cut("TIFF", data))
    tags: dict[int, tuple[int, ...]] = {}
    for place in range(at, at + entries * entry, entry):
        tag, form, count = struct.unpack_from(f"{order}HH{'Q' if big else 'I'}", data, place)
        if form not in _TIFF_TYPES or tag in tags or tag not in _LISTS + _NUMBERS:
            continue
        kind = np.dtype(order + _TIFF_TYPES[form])
        value = place + entry - inline
        if count * kind.itemsize > inline:
            value = struct.unpack_from(f"{order}{'Q' if big else 'I'}", data, value)[0]
        if value + count * kind.itemsize > len(data):
            raise _FaultError(_cut("TIFF", data))
        tags[tag] = tuple(np.frombuffer(data, kind, count if tag in _LISTS else min(count, 1), value).tolist())
    return tags


def _one(tags: dict[int, tuple[int, ...]], tag: int, otherwise: int) -> int:
    """The first number of a tag."""
    return tags.get(tag, ())[0] if tags.get(tag) else otherwise


def _require_known_tiff(tags: dict[int, tuple[int, ...]], bits: int, samples: int) -> None:
    """Raise for forms that would be decoded to other values than the file holds, or not at all."""
    form = "float" if _one(tags, _SAMPLE_FORMAT, 1) == 3 else "signed" if _one(tags, _SAMPLE_FORMAT, 1) == 2 else ""
    if (bits, form) not in ((8, ""), (16, ""), (32, "float")):
        raise _FaultError(
            f"a TIFF of {bits} bit {form}".rstrip() + " samples; expected 8 or 16 bit without sign, or 32 bit float"
        )
    if samples not in (1, 3, 4):
        raise _FaultError(f"a TIFF of {samples} samples a pixel; expected grey, RGB or RGBA")
    if samples > 1 and _one(tags, _PLANES, 1) != 1:
        raise _FaultError("a TIFF with its colours apart (planar); save it interleaved (contiguous)")
    photometric = _one(tags, _PHOTOMETRIC, 1)
    if photometric not in ((0, 1, 2, 3, 6) if bits == 8 else (1, 2)):
        raise _FaultError("a TIFF that is neither grey with black as zero nor RGB; save it as one of these")


_KINDS: dict[str, tuple[re.Pattern[bytes], Callable[[bytes], Header]]] = {
    "PNG": (re.compile(re.escape(PNG_SIGNATURE)), _png),
    "JPEG": (re.compile(rb"\xff\xd8\xff"), _jpeg),
    "TIFF": (re.compile(rb"II[*+]\0|MM\0[*+]"), _tiff),
    "BMP": (re.compile(rb"BM.{24}", re.DOTALL), _bmp),
    "WebP": (re.compile(rb"RIFF.{4}WEBP", re.DOTALL), _webp),
    "PNM": (re.compile(rb"P[2356][\s#]"), _pnm),
}
