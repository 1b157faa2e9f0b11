"""Image files: reads views and masks, writes views and maps."""

from __future__ import annotations

import io
import logging
import os
import struct
import warnings
import zlib
from collections.abc import Callable, Iterator, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager, suppress
from functools import partial
from importlib import import_module
from pathlib import Path
from typing import IO, Any, NamedTuple

import cv2
import numpy as np
import numpy.typing as npt

from sepi.errors import SepiError
from sepi.io.codecs import (
    EXR_SIGNATURE,
    TIFF_SIGNATURES,
    exr_form,
    exr_pixels,
    open_tiff,
    page_pixels,
    pnm_form,
    pnm_pixels,
    tiff_form,
)
from sepi.io.files import atomic_path, reading
from sepi.lightfield import HIGHEST, LOWEST, BoolMap
from sepi.process.threads import available_cores

Pixels = npt.NDArray[np.integer[Any] | np.floating[Any]]

_ENDS = ("png", "jpg", "jpeg", "tif", "tiff", "exr", "bmp", "webp", "pgm", "ppm", "pnm", "gif", "jp2", "j2k", "avif")
SUFFIXES = frozenset(f".{end}" for end in _ENDS)
"""Suffixes of the images that can be read, in lower case."""

MAX_PIXELS = 2**28
"""Most pixels of an image that is read; no camera has more."""

# more than any compression reaches on images of 8 bit; small images of one colour may shrink further
_PIXELS_PER_BYTE = 1100
_SMALL = 2**24
_MAX_BYTES = 2**32
_SILENT = logging.NullHandler()
_PNG = b"\x89PNG\r\n\x1a\n"
# bytes before the second chunk of a PNG
_PNG_HEADER = 33


class Header(NamedTuple):
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
        PNM, and PNG that has grey of 8 or 16 bit alone: the value of white; else 0.
    """

    kind: str
    height: int
    width: int
    pixel_bytes: int = 3
    grey: bool = False
    white: int = 0


def read_picture(path: Path, *, any_floats: bool = False) -> Pixels:
    """Read an image of any supported kind; the content tells the kind, not the name.

    Parameters
    ----------
    path : Path
    any_floats : bool
        Whether float pixels may be any numbers, even NaN and infinity, instead of brightness in 0..1.

    Returns
    -------
    ndarray, shape (H, W, C), uint8, uint16 or float32
        C is 1 for grey, 3 for RGB; transparency is left out. Pixels are as stored: the orientation tag is not applied
        and brightness is not changed, with two exceptions. Integers with a lower white, as in some PGM files, are
        scaled to their whole range. Where white is zero, as in some TIFF files, values are inverted.

    Raises
    ------
    SepiError
        If the file is unreadable, not an image of these kinds, cut off or damaged, its pixels are neither 8 or 16 bit
        nor float32, or its float pixels are not finite or far outside 0..1.
    """
    # libraries warn of what is raised as an error here, or does not matter
    with warnings.catch_warnings(action="ignore"):
        return _read(path, any_floats)


def _read(path: Path, any_floats: bool) -> Pixels:
    with _opened(path) as file:
        # in one read: each of many small ones would release Python's lock and wait for it again
        data = file.read()
    header = _header(path, io.BytesIO(data))
    with reading(path, header.kind):
        image = _KINDS[header.kind].pixels(path, data)
        if image.shape[:2] != (header.height, header.width):
            raise SepiError(f"damaged {header.kind}: its pixels are not those of its header")
        if image.dtype not in (np.uint8, np.uint16, np.float32):
            raise SepiError(f"pixels of type {image.dtype}; expected 8 or 16 bit without sign, or float32")
    channels = image[:, :, None] if image.ndim == 2 else image
    # grey with transparency may be decoded to colours
    image = np.ascontiguousarray(channels[:, :, : 1 if header.grey else 3])
    if image.dtype == np.float32 and not any_floats and not (image.min() >= LOWEST and image.max() <= HIGHEST):
        what = f"{image.min():g} to {image.max():g}" if np.isfinite(image).all() else "NaN or infinity"
        raise SepiError(f"{path}: float pixels must be finite and within 0..1, got {what}; --white says what white is")
    return image


def read_views(
    paths: Sequence[Path], positions: Sequence[int] | None = None, count: int | None = None, *, any_floats: bool = False
) -> Pixels:
    """Read images of one size and type, several at a time.

    Parameters
    ----------
    paths : sequence of Path
    positions : sequence of int, optional
        Index of each image in the result; default: in order.
    count : int, optional
        Length of the result; default: the number of paths.
    any_floats : bool
        As in :func:`read_picture`.

    Returns
    -------
    ndarray, shape (count, H, W, C), uint8, uint16 or float32
        Zero at positions without an image.

    Raises
    ------
    SepiError
        If a file cannot be read, differs from the first in size, bit depth or number of channels, or all together take
        more memory than the machine has.
    """
    first = read_picture(paths[0], any_floats=any_floats)
    positions = range(len(paths)) if positions is None else positions
    count = len(paths) if count is None else count
    _require_memory(paths[0].parent, first, count)
    views = np.zeros((count, *first.shape), first.dtype)

    def fill(index: int) -> None:
        image = _read(paths[index], any_floats) if index else first
        if image.shape != first.shape or image.dtype != first.dtype:
            unlike = f"{_described(image)}, but {paths[0].name} is {_described(first)}"
            raise SepiError(f"{paths[index]}: {unlike}; all views must be alike; --exclude leaves one out")
        views[positions[index]] = image

    # decoding runs outside Python's lock, so threads share the work; all threads share the warning filters
    with warnings.catch_warnings(action="ignore"), ThreadPoolExecutor(min(8, available_cores())) as pool:
        try:
            for _ in pool.map(fill, range(len(paths))):
                pass
        except BaseException:
            # an interrupted command must not wait for the rest
            pool.shutdown(wait=False, cancel_futures=True)
            raise
    return views


def picture_header(path: Path) -> Header:
    """Header of an image of any supported kind; its pixels are not decoded."""
    with _opened(path) as file:
        return _header(path, file)


def png_texts(path: Path) -> dict[str, str]:
    """Uncompressed text chunks of a PNG by key; empty if the file cannot be read or is not a PNG."""
    data, at, texts = b"", len(_PNG), {}
    with suppress(OSError):
        data = path.read_bytes() if path.is_file() else b""
    while data.startswith(_PNG) and at + 12 <= len(data):
        end = at + 8 + int.from_bytes(data[at : at + 4], "big")
        if data[at + 4 : at + 8] == b"tEXt" and data[end : end + 4] == _checksum(data[at + 4 : end]):
            key, _, text = data[at + 8 : end].decode("latin-1").partition("\0")
            texts[key] = text
        at = end + 4
    return texts


def _checksum(chunk: bytes) -> bytes:
    return zlib.crc32(chunk).to_bytes(4, "big")


def write_png(path: Path, pixels: Pixels | BoolMap, texts: Mapping[str, str] | None = None) -> None:
    """Write a PNG, whole or not at all.

    Parameters
    ----------
    path : Path
    pixels : ndarray, shape (H, W) or (H, W, 3), uint8, uint16 or bool
        Grey or RGB; bool becomes 0 and 255.
    texts : mapping of str to str, optional
        Text chunks.
    """
    values: npt.NDArray[Any] = np.asarray(255 * pixels, np.uint8) if pixels.dtype == bool else pixels
    with atomic_path(path) as temporary:
        done, data = cv2.imencode(".png", values[:, :, ::-1] if values.ndim == 3 else values)
        if not done:
            raise SepiError(f"{path}: pixels {pixels.shape} of type {pixels.dtype} cannot be written as PNG")
        bodies = [b"tEXt" + f"{key}\0{text}".encode("latin-1") for key, text in (texts or {}).items()]
        chunks = b"".join((len(body) - 4).to_bytes(4, "big") + body + _checksum(body) for body in bodies)
        temporary.write_bytes(data[:_PNG_HEADER].tobytes() + chunks + data[_PNG_HEADER:].tobytes())


@contextmanager
def _opened(path: Path) -> Iterator[IO[bytes]]:
    with reading(path, "readable image"):
        # reading a pipe would wait for ever
        if not path.is_file():
            raise SepiError("cannot be read: not a regular file, or a broken link")
        with path.open("rb") as file:
            size = os.fstat(file.fileno()).st_size
            if size > _MAX_BYTES:
                raise SepiError(f"{size} bytes are more than an image has")
            yield file


def _require_memory(folder: Path, view: Pixels, count: int) -> None:
    """Raise if ``count`` views like this take more memory than the machine has."""
    try:
        there = os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES")
    except (AttributeError, ValueError, OSError):  # not all systems tell
        return
    if view.nbytes * count > there:
        sizes = f"{view.nbytes * count / 1e9:.1f} GB, more than the {there / 1e9:.1f} GB of memory"
        raise SepiError(f"{folder}: {count} views of {_described(view)} take {sizes}; use fewer (--central)")


def _described(image: Pixels) -> str:
    height, width, channels = image.shape
    bits = f"{8 * image.dtype.itemsize} bit{' float' if image.dtype.kind == 'f' else ''}"
    return f"{width}x{height} {'RGB' if channels == 3 else 'grey'} of {bits}"


def _header(path: Path, file: IO[bytes]) -> Header:
    """Header of an open image file; its content tells the kind, not its name.

    Only its first bytes are read, or as much as tells whether it is complete. Decoders take memory for any size in a
    header, and some fill the missing part of a truncated file with grey.
    """
    size = file.seek(0, io.SEEK_END)
    file.seek(0)
    start = file.read(12)
    name = next((name for name, kind in _KINDS.items() if start.startswith(kind.signatures)), None)
    if name is None:
        raise SepiError(f"{path}: not a {', '.join(_KINDS)} image (PNM: PGM or PPM)")
    file.seek(0)
    with reading(path, name):
        header = Header(name, *_KINDS[name].form(file, path, size))
        if not 1 <= header.height * header.width <= min(MAX_PIXELS, _PIXELS_PER_BYTE * size + _SMALL):
            raise SepiError(f"{header.width}x{header.height} pixels cannot be in a {name} of {size} bytes, or too many")
    return header


# height, width, and if known: bytes of a pixel, grey, white
_Form = tuple[int, int] | tuple[int, int, int, bool] | tuple[int, int, int, bool, int]


def _png_form(file: IO[bytes], path: Path, size: int) -> _Form:
    head = file.read(_PNG_HEADER)
    if len(head) < _PNG_HEADER or head[12:16] != b"IHDR":
        raise ValueError("its header is missing")
    # decoding turns grey with transparency, or a palette, into colours
    width, height, bits, colours = struct.unpack_from(">IIBB", head, 16)
    grey, plain = colours in (0, 4), colours == 0 and bits in (8, 16)
    if not width * height:
        raise ValueError("no pixels")
    return height, width, (1 if grey else 3) * (2 if bits == 16 else 1), grey, plain * (2**bits - 1)


def _pillow_form(plugin: str, file: IO[bytes], path: Path, size: int) -> _Form:
    with _pillow_class(plugin)(file) as image:
        grey = image.mode in ("1", "L", "LA", "I;16")
        return image.height, image.width, (1 if grey else 3) * (2 if "16" in image.mode else 1), grey


def _pillow_class(plugin: str) -> Any:
    # ``Image.open`` and the class for WebP refuse images that are allowed here, with a limit for all threads
    return getattr(import_module(f"PIL.{plugin}ImagePlugin"), f"{plugin}ImageFile")


def _avif_form(file: IO[bytes], path: Path, size: int) -> _Form:
    # the box 'ispe' holds the size of the image
    _, _, box = file.read(4096).partition(b"ispe\0\0\0\0")
    return int.from_bytes(box[4:8], "big"), int.from_bytes(box[:4], "big")


def _webp_form(file: IO[bytes], path: Path, size: int) -> _Form:
    head = file.read(30)
    if head[12:16] == b"VP8X":
        width, height = (1 + int.from_bytes(head[at : at + 3], "little") for at in (24, 27))
    elif head[12:16] == b"VP8L":
        bits = int.from_bytes(head[21:25], "little")
        width, height = 1 + bits % 2**14, 1 + (bits >> 14) % 2**14
    else:
        width, height = (int.from_bytes(head[at : at + 2], "little") % 2**14 for at in (26, 28))
    return height, width


def _tiff_form(file: IO[bytes], path: Path, size: int) -> _Form:
    """Form of the first page."""
    with open_tiff(file) as pictures:
        return tiff_form(pictures.pages[0].aspage(), size)


def _pnm_form(file: IO[bytes], path: Path, size: int) -> _Form:
    height, width, channels, white, *_ = pnm_form(file.read(4096), size)
    return height, width, channels * (1 if white < 256 else 2), channels == 1, white


def _exr_form(file: IO[bytes], path: Path, size: int) -> _Form:
    height, width, names = exr_form(str(path))
    return height, width, 4 * len(names), len(names) == 1


# pixels (H, W) or (H, W, C) in the order RGB; damage raises an error and prints nothing
def _tiff_pixels(path: Path, data: bytes) -> Pixels:
    with open_tiff(io.BytesIO(data)) as pictures:
        return page_pixels(pictures.pages[0].aspage())


def _pillow_pixels(plugin: str, path: Path, data: bytes) -> Pixels:
    with _pillow_class(plugin)(io.BytesIO(data)) as image:
        tile = image.tile[0]
        # Pillow does not miss bytes that fill up the last row of a BMP
        if tile.codec_name == "raw" and tile.offset + tile.args[1] * image.height > len(data):
            raise ValueError("its end is missing")
        return np.asarray(image.convert("L" if image.mode == "L" else "RGB"))


def _codec_pixels(codec: str, path: Path, data: bytes) -> Pixels:
    import imagecodecs

    # searched from the end
    if codec == "png" and data.rfind(b"IEND" + _checksum(b"IEND")) < 0:
        raise ValueError("its end is missing")
    # its warnings do not concern the pixels
    logging.getLogger("imagecodecs").addHandler(_SILENT)
    try:
        pixels: Pixels = getattr(imagecodecs, f"{codec}_decode")(data)
    except RuntimeError as error:
        raise ValueError(f"its pixels cannot be decoded: {error}") from error
    return pixels


class _Kind(NamedTuple):
    """A kind of image: its first bytes, and what reads its header and its pixels."""

    signatures: bytes | tuple[bytes, ...]
    form: Callable[[IO[bytes], Path, int], _Form]
    pixels: Callable[[Path, bytes], Pixels]


# the length of the first box comes before
_AVIF = tuple(bytes((0, 0, 0, length)) + b"ftypavif" for length in range(16, 256, 4))
_JPEG_2000 = (b"\0\0\0\x0cjP  ", b"\xff\x4f\xff\x51")
_KINDS = {
    "PNG": _Kind(_PNG, _png_form, partial(_codec_pixels, "png")),
    "JPEG": _Kind(b"\xff\xd8\xff", partial(_pillow_form, "Jpeg"), partial(_pillow_pixels, "Jpeg")),
    "TIFF": _Kind(TIFF_SIGNATURES, _tiff_form, _tiff_pixels),
    "OpenEXR": _Kind(EXR_SIGNATURE, _exr_form, lambda path, _: exr_pixels(str(path))),
    "BMP": _Kind(b"BM", partial(_pillow_form, "Bmp"), partial(_pillow_pixels, "Bmp")),
    "GIF": _Kind(b"GIF8", partial(_pillow_form, "Gif"), partial(_codec_pixels, "gif")),
    "JPEG 2000": _Kind(_JPEG_2000, partial(_pillow_form, "Jpeg2K"), partial(_codec_pixels, "jpeg2k")),
    "AVIF": _Kind(_AVIF, _avif_form, partial(_codec_pixels, "avif")),
    "WebP": _Kind(b"RIFF", _webp_form, partial(_codec_pixels, "webp")),
    "PNM": _Kind((b"P2", b"P3", b"P5", b"P6"), _pnm_form, lambda _, data: pnm_pixels(data)),
}
