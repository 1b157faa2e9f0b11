"""Pictures: views and masks in, views and maps out."""

from __future__ import annotations

import io
import logging
import os
import threading
import warnings
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
from sepi.io.picture_headers import Header, read_header
from sepi.io.tiff import plain_pixels, unturned
from sepi.lightfield import HIGHEST, LOWEST, BoolMap
from sepi.threads import available_cores

Pixels = npt.NDArray[np.integer[Any] | np.floating[Any]]

_ENDS = ("png", "jpg", "jpeg", "tif", "tiff", "exr", "bmp", "webp", "pgm", "ppm", "pnm", "gif", "jp2", "j2k", "avif")
SUFFIXES = frozenset(f".{end}" for end in _ENDS)
"""Ends of names, in small letters, of the pictures that can be read."""

_MAX_BYTES = 2**32
_USUAL_BYTES = 2**24
_SILENT = logging.NullHandler()
_CODECS = {"PNG": "png", "GIF": "gif", "JPEG 2000": "jpeg2k", "AVIF": "avif"}


def read_picture(path: Path, *, any_floats: bool = False) -> Pixels:
    """Read a picture of a kind in :data:`SUFFIXES`; its content tells which, not its name.

    Parameters
    ----------
    path : Path
    any_floats : bool
        Whether float pixels may be any numbers, NaN and infinity among them, rather than brightness in 0..1.

    Returns
    -------
    ndarray, shape (H, W, C), uint8, uint16 or float32
        C is 1 for grey, 3 for RGB; transparency is left out. Pixels are as stored: neither turned as a camera's
        orientation says nor changed in brightness, but integers that end at another white, as in some PGM, span their
        whole range, and where white is zero, as in some TIFF, black becomes it.

    Raises
    ------
    SepiError
        If the file is unreadable, no picture of these kinds, cut off or damaged, of other numbers than 8 or 16 bit or
        float32, or has float pixels that are not finite or far outside 0..1.
    """
    with _no_warnings():
        return _read(path, any_floats)


def _read(path: Path, any_floats: bool = False) -> Pixels:
    image = _pixels(path)
    if image.dtype == np.float32 and not any_floats and not (image.min() >= LOWEST and image.max() <= HIGHEST):
        what = f"{image.min():g} to {image.max():g}" if np.isfinite(image).all() else "NaN or infinite ones"
        raise SepiError(f"{path}: float pixels must be finite and within 0..1, got {what}; --white says what white is")
    return image


class _Held(io.BytesIO):
    """What a file holds, and its name, by which OpenEXR opens it."""

    def __init__(self, data: bytes, name: str) -> None:
        super().__init__(data)
        self.name = name


def _pixels(path: Path) -> Pixels:
    with _opened(path) as file:
        # usually all of it, at once: each of many small reads would let go of Python's lock, for which others wait
        usual = os.fstat(file.fileno()).st_size <= _USUAL_BYTES
        data = file.read() if usual else b""
        header = read_header(path, _Held(data, file.name) if usual else file, whole=True)
        if not usual:
            file.seek(0)
            data = file.read()
    image = _decoded(path, data, header)
    return _stretched(path, image, header.white) if header.white else image


def read_views(
    paths: Sequence[Path],
    positions: Sequence[int] | None = None,
    count: int | None = None,
    *,
    any_floats: bool = False,
) -> Pixels:
    """Read pictures that must be alike, several at a time.

    Parameters
    ----------
    paths : sequence of Path
    positions : sequence of int, optional
        Index of each in the result; one after the other unless given.
    count : int, optional
        Length of the result; as many as ``paths`` unless given.
    any_floats : bool
        As in :func:`read_picture`.

    Returns
    -------
    ndarray, shape (count, H, W, C), uint8, uint16 or float32
        Zero at positions that no picture has.

    Raises
    ------
    SepiError
        If a file cannot be read, or is not of the same size, depth and number of channels as the first, or they take
        more memory together than there is.
    """
    first = read_picture(paths[0], any_floats=any_floats)
    positions = range(len(paths)) if positions is None else positions
    count = len(paths) if count is None else count
    _require_memory(paths[0].parent, first, count)
    views = np.zeros((count, *first.shape), first.dtype)

    def fill(index: int) -> None:
        image = _read(paths[index], any_floats) if index else first
        if image.shape != first.shape or image.dtype != first.dtype:
            raise SepiError(
                f"{paths[index]}: {_described(image)}, but {paths[0].name} is {_described(first)}; "
                "all views must be alike; --exclude leaves one out"
            )
        views[positions[index]] = image

    # decoding runs outside Python's lock, so threads share the work
    with _no_warnings(), ThreadPoolExecutor(min(8, available_cores())) as pool:
        try:
            for _ in pool.map(fill, range(len(paths))):
                pass
        except BaseException:
            # an interrupted command does not wait for the rest
            pool.shutdown(wait=False, cancel_futures=True)
            raise
    return views


def picture_header(path: Path) -> Header:
    """Header of a picture of any supported kind, without decoding it."""
    with _opened(path) as file:
        return read_header(path, file)


def png_texts(path: Path) -> dict[str, str]:
    """Key to text of a PNG's text chunks; none of what is no undamaged PNG."""
    from PIL import PngImagePlugin

    if not path.is_file():
        return {}
    try:
        # whose size is looked at first: Pillow decodes all of it for the texts behind its pixels
        picture_header(path)
        with PngImagePlugin.PngImageFile(path) as image:
            return {key: str(text) for key, text in image.text.items()}
    except Exception:
        # Pillow stumbles over damage in many ways
        return {}


def write_png(path: Path, pixels: Pixels | BoolMap, texts: Mapping[str, str] | None = None) -> None:
    """Write a PNG, whole or not at all.

    Parameters
    ----------
    path : Path
    pixels : ndarray, shape (H, W) or (H, W, 3), uint8, uint16 or bool
        Grey or RGB; bool becomes 0 and 255.
    texts : mapping of str to str, optional
        Text chunks; for grey only.
    """
    values: npt.NDArray[Any] = np.asarray(255 * pixels, np.uint8) if pixels.dtype == bool else pixels
    with atomic_path(path) as temporary:
        if texts is not None:
            from PIL import Image, PngImagePlugin

            chunks = PngImagePlugin.PngInfo()
            for key, text in texts.items():
                chunks.add_text(key, text)
            # a quarter of the time for a twentieth more bytes; OpenCV packs so, too
            Image.fromarray(values).save(temporary, "PNG", pnginfo=chunks, compress_level=1)
            return
        done, data = cv2.imencode(".png", values[:, :, ::-1] if values.ndim == 3 else values)
        if not done:
            raise SepiError(f"{path}: pixels {pixels.shape} of type {pixels.dtype} cannot be written as PNG")
        temporary.write_bytes(data.tobytes())


@contextmanager
def _no_warnings() -> Iterator[None]:
    """Keep Pillow from warning of what is told as an error, or does not matter.

    Not to be used by several threads at once: Python has one list of filters for all, and who leaves last would put
    back what another had set, so that no warning was ever shown again.
    """
    with warnings.catch_warnings(action="ignore"):
        yield


@contextmanager
def _opened(path: Path) -> Iterator[IO[bytes]]:
    with reading(path, "picture"):
        # a pipe would be waited for
        if not path.is_file():
            raise SepiError("cannot be read: no plain file, or a link to nothing")
        with path.open("rb") as file:
            size = os.fstat(file.fileno()).st_size
            if size > _MAX_BYTES:
                raise SepiError(f"{size} bytes are more than a picture has")
            yield file


def _decoded(path: Path, data: bytes, header: Header) -> Pixels:
    """Pixels of a picture, in the order RGB."""
    if header.kind in _CODECS:
        return _by_imagecodecs(path, data, header)
    if header.kind == "JPEG":
        usual = _by_pillow(path, data, header)
        if usual is not None:
            return usual
    with reading(path, header.kind):
        if header.kind == "OpenEXR":
            return exr_pixels(str(path))
        if header.plain:
            return plain_pixels(data)
        if header.kind == "TIFF":
            data = unturned(data)
    # OpenCV wants something behind the last digit of a PNM
    data += b"\n" if header.white else b""
    try:
        with _silent_opencv():
            image = cv2.imdecode(np.frombuffer(data, np.uint8), cv2.IMREAD_UNCHANGED)
    except cv2.error:
        image = None
    if image is None or image.shape[:2] != (header.height, header.width):
        raise SepiError(f"{path}: damaged {header.kind}, perhaps cut off: its pixels cannot be decoded")
    if image.dtype not in (np.uint8, np.uint16, np.float32):
        raise SepiError(f"{path}: pixels of type {image.dtype}; expected 8 or 16 bit without sign, or float32")
    if header.mixed_alpha and image.shape[2:] == (4,) and image[:, :, 3].min() < 255:
        raise SepiError(f"{path}: a TIFF with transparent pixels, whose colours cannot be told; save it without alpha")
    channels = image[:, :, None] if image.ndim == 2 else image[:, :, 2::-1]
    # grey with transparency is decoded to colours
    return np.ascontiguousarray(channels[:, :, :1] if header.grey else channels)


def _by_imagecodecs(path: Path, data: bytes, header: Header) -> Pixels:
    """Pixels of a PNG of any sort, in two thirds of Pillow's time, and of rarer kinds; what is damaged is told."""
    import imagecodecs

    # what it warns of leaves the pixels as they are
    logging.getLogger("imagecodecs").addHandler(_SILENT)
    with reading(path, header.kind):
        try:
            image: Pixels = getattr(imagecodecs, f"{_CODECS[header.kind]}_decode")(data)
        except RuntimeError as error:
            raise ValueError(f"its pixels cannot be decoded: {error}") from error
    values = image[:, :, None] if image.ndim == 2 else image
    return np.ascontiguousarray(values[:, :, :1] if header.grey else values[:, :, :3])


def _by_pillow(path: Path, data: bytes, header: Header) -> Pixels | None:
    """Pixels of a JPEG; None for colours for printing.

    They are those that OpenCV gives, in the same time, but damage is told and nothing is printed about it: the library
    below OpenCV has its own way to the terminal.
    """
    from PIL.JpegImagePlugin import JpegImageFile

    with reading(path, header.kind), JpegImageFile(io.BytesIO(data)) as image:
        try:
            if image.mode not in ("L", "RGB"):
                # whether all of it is there: OpenCV fills with grey what is missing
                image.load()
                return None
            values = np.asarray(image)
        except OSError as error:
            raise SepiError("damaged JPEG, perhaps cut off: its pixels cannot be decoded") from error
        return np.ascontiguousarray(values if values.ndim == 3 else values[:, :, None])


def _stretched(path: Path, values: Pixels, white: int) -> Pixels:
    """Values of a PGM or PPM, which OpenCV leaves as they are, over the whole range of their type."""
    full = np.iinfo(values.dtype).max  # type: ignore[type-var]
    if values.max() > white:
        raise SepiError(f"{path}: damaged PNM: a value of {values.max()}, but white is {white}")
    return values if white == full else np.rint(values * (full / white)).astype(values.dtype)


def _require_memory(folder: Path, view: Pixels, count: int) -> None:
    """Raise where so many views like this take more memory than the machine has."""
    try:
        there = os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES")
    except (AttributeError, ValueError, OSError):  # not all systems tell
        return
    if view.nbytes * count > there:
        raise SepiError(
            f"{folder}: {count} views of {_described(view)} take {view.nbytes * count / 1e9:.1f} GB, more than the "
            f"{there / 1e9:.1f} GB of memory; use fewer (--central) or smaller ones"
        )


_silence = threading.Lock()
_silenced = 0
_level = 0


@contextmanager
def _silent_opencv() -> Iterator[None]:
    """Keep OpenCV from printing about pictures that this module reports itself; threads may overlap."""
    global _silenced, _level
    logging = cv2.utils.logging
    with _silence:
        if _silenced == 0:
            _level = logging.getLogLevel()
            logging.setLogLevel(logging.LOG_LEVEL_SILENT)
        _silenced += 1
    try:
        yield
    finally:
        with _silence:
            _silenced -= 1
            if _silenced == 0:
                logging.setLogLevel(_level)


def _described(image: Pixels) -> str:
    height, width, channels = image.shape
    bits = f"{8 * image.dtype.itemsize} bit{' float' if image.dtype.kind == 'f' else ''}"
    return f"{width}x{height} {'RGB' if channels == 3 else 'grey'} of {bits}"
