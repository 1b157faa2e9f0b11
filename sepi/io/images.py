"""Image files: reads views and masks, writes views and maps."""

from __future__ import annotations

import io
import logging
import os
import warnings
import zlib
from collections.abc import Iterator, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from pathlib import Path
from typing import IO, Any

import cv2
import numpy as np
import numpy.typing as npt

from sepi.errors import SepiError
from sepi.io.exr import exr_pixels
from sepi.io.files import atomic_path, reading
from sepi.io.picture_headers import Header, pillow_class, pnm_pixels, read_header
from sepi.io.tiff import open_tiff, page_pixels
from sepi.lightfield import HIGHEST, LOWEST, BoolMap
from sepi.process.threads import available_cores

Pixels = npt.NDArray[np.integer[Any] | np.floating[Any]]

_ENDS = ("png", "jpg", "jpeg", "tif", "tiff", "exr", "bmp", "webp", "pgm", "ppm", "pnm", "gif", "jp2", "j2k", "avif")
SUFFIXES = frozenset(f".{end}" for end in _ENDS)
"""Suffixes of the images that can be read, in lower case."""

_MAX_BYTES = 2**32
_SILENT = logging.NullHandler()
_CODECS = {"PNG": "png", "GIF": "gif", "JPEG 2000": "jpeg2k", "AVIF": "avif", "WebP": "webp"}
_PLUGINS = {"JPEG": "Jpeg", "BMP": "Bmp"}
_LAST_CHUNK = b"IEND" + zlib.crc32(b"IEND").to_bytes(4, "big")


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
    header = read_header(path, io.BytesIO(data))
    with reading(path, header.kind):
        image = _decoded(path, data, header.kind)
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
        return read_header(path, file)


def png_texts(path: Path) -> dict[str, str]:
    """Text chunks of a PNG by key; empty if the file is damaged or not a PNG."""
    from PIL import PngImagePlugin

    if not path.is_file():
        return {}
    try:
        # check the size first: Pillow decodes the whole image to find texts behind the pixels
        picture_header(path)
        with PngImagePlugin.PngImageFile(path) as image:
            return {key: str(text) for key, text in image.text.items()}
    except Exception:
        # Pillow fails on damage in many ways
        return {}


def write_png(path: Path, pixels: Pixels | BoolMap, texts: Mapping[str, str] | None = None) -> None:
    """Write a PNG, whole or not at all.

    Parameters
    ----------
    path : Path
    pixels : ndarray, shape (H, W) or (H, W, 3), uint8, uint16 or bool
        Grey or RGB; bool becomes 0 and 255.
    texts : mapping of str to str, optional
        Text chunks, for grey images only.
    """
    values: npt.NDArray[Any] = np.asarray(255 * pixels, np.uint8) if pixels.dtype == bool else pixels
    with atomic_path(path) as temporary:
        if texts is not None:
            from PIL import Image, PngImagePlugin

            chunks = PngImagePlugin.PngInfo()
            for key, text in texts.items():
                chunks.add_text(key, text)
            # a quarter of the time for 5 % more bytes; OpenCV does the same
            Image.fromarray(values).save(temporary, "PNG", pnginfo=chunks, compress_level=1)
            return
        done, data = cv2.imencode(".png", values[:, :, ::-1] if values.ndim == 3 else values)
        if not done:
            raise SepiError(f"{path}: pixels {pixels.shape} of type {pixels.dtype} cannot be written as PNG")
        temporary.write_bytes(data.tobytes())


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


def _decoded(path: Path, data: bytes, kind: str) -> Pixels:
    """Pixels (H, W) or (H, W, C) in the order RGB; damage raises an error and prints nothing."""
    if kind == "OpenEXR":
        return exr_pixels(str(path))
    if kind == "PNM":
        return pnm_pixels(data)
    if kind == "TIFF":
        with open_tiff(io.BytesIO(data)) as pictures:
            return page_pixels(pictures.pages[0].aspage())
    if kind == "PNG" and _LAST_CHUNK not in data:
        raise ValueError("its end is missing")
    if kind in _PLUGINS:
        with pillow_class(_PLUGINS[kind])(io.BytesIO(data)) as image:
            tile = image.tile[0]
            # Pillow does not miss bytes that fill up the last row of a BMP
            if tile.codec_name == "raw" and tile.offset + tile.args[1] * image.height > len(data):
                raise ValueError("its end is missing")
            return np.asarray(image.convert("L" if image.mode == "L" else "RGB"))
    import imagecodecs

    # its warnings do not concern the pixels
    logging.getLogger("imagecodecs").addHandler(_SILENT)
    try:
        pixels: Pixels = getattr(imagecodecs, f"{_CODECS[kind]}_decode")(data)
    except RuntimeError as error:
        raise ValueError(f"its pixels cannot be decoded: {error}") from error
    return pixels


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
