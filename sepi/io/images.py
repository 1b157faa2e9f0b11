"""PNG pictures: views and masks in, views and maps out."""

from __future__ import annotations

import os
import struct
import zlib
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import numpy.typing as npt

from sepi.errors import SepiError
from sepi.io.files import atomic_path
from sepi.lightfield import BoolMap

Pixels = npt.NDArray[np.integer[Any]]

_SIGNATURE = b"\x89PNG\r\n\x1a\n"


def read_png(path: Path) -> Pixels:
    """Read a PNG.

    Returns
    -------
    ndarray, shape (H, W, C), uint8 or uint16
        C is 1 for grey, 3 for RGB; transparency is left out.

    Raises
    ------
    SepiError
        If the file is unreadable, not a PNG, or damaged.
    """
    try:
        data = path.read_bytes()
    except OSError as error:
        raise SepiError(f"{path}: cannot be read ({error.strerror})") from error
    # before OpenCV sees it, which would print its own words for a damaged file
    _require_whole(path, data)
    image = cv2.imdecode(np.frombuffer(data, np.uint8), cv2.IMREAD_UNCHANGED)
    if image is None:
        raise SepiError(f"{path}: damaged PNG: its pixels cannot be decoded")
    channels = image[:, :, None] if image.ndim == 2 else image[:, :, 2::-1]
    return np.ascontiguousarray(channels).astype(np.uint16 if image.dtype == np.uint16 else np.uint8, copy=False)


def read_views(paths: Sequence[Path], places: Sequence[int] | None = None, count: int | None = None) -> Pixels:
    """Read pictures that must be alike, several at a time.

    Parameters
    ----------
    paths : sequence of Path
    places : sequence of int, optional
        Index of each in the result; one after the other unless given.
    count : int, optional
        Length of the result; as many as ``paths`` unless given.

    Returns
    -------
    ndarray, shape (count, H, W, C), uint8 or uint16
        Zero at places that no picture has.

    Raises
    ------
    SepiError
        If a file cannot be read, or is not of the same size, depth and number of channels as the first.
    """
    first = read_png(paths[0])
    places = range(len(paths)) if places is None else places
    views = np.zeros((len(paths) if count is None else count, *first.shape), first.dtype)

    def fill(index: int) -> None:
        image = read_png(paths[index])
        if image.shape != first.shape or image.dtype != first.dtype:
            raise SepiError(
                f"{paths[index]}: {_described(image)}, but {paths[0].name} is {_described(first)}; "
                "all views must be alike"
            )
        views[places[index]] = image

    # decoding runs outside Python's lock, so threads share the work
    with ThreadPoolExecutor(min(8, os.cpu_count() or 1)) as pool:
        for _ in pool.map(fill, range(len(paths))):
            pass
    return views


def png_size(path: Path) -> tuple[int, int]:
    """Height and width in pixels, from the header alone.

    Raises
    ------
    SepiError
        If the file is unreadable or has no PNG header.
    """
    try:
        with path.open("rb") as file:
            head = file.read(24)
    except OSError as error:
        raise SepiError(f"{path}: cannot be read ({error.strerror})") from error
    if len(head) < 24 or not head.startswith(_SIGNATURE):
        raise SepiError(f"{path}: not a PNG")
    width, height = struct.unpack(">II", head[16:24])
    return height, width


def write_png(path: Path, pixels: Pixels | BoolMap) -> None:
    """Write grey (H, W) or RGB (H, W, 3) uint8, uint16 or bool as PNG, whole or not at all; bool becomes 0 and 255."""
    values: npt.NDArray[Any] = np.asarray(255 * pixels, np.uint8) if pixels.dtype == bool else pixels
    done, data = cv2.imencode(".png", values[:, :, ::-1] if values.ndim == 3 else values)
    if not done:
        raise SepiError(f"{path}: a picture of shape {pixels.shape} and type {pixels.dtype} cannot be written as PNG")
    with atomic_path(path) as temporary:
        temporary.write_bytes(data.tobytes())


def _require_whole(path: Path, data: bytes) -> None:
    """Raise unless ``data`` is a chain of undamaged PNG chunks up to the end mark."""
    if not data.startswith(_SIGNATURE):
        raise SepiError(f"{path}: not a PNG")
    at = len(_SIGNATURE)
    while at + 12 <= len(data):
        length, kind = struct.unpack_from(">I4s", data, at)
        end = at + 12 + length
        if end > len(data):
            break
        if zlib.crc32(memoryview(data)[at + 4 : end - 4]) != struct.unpack_from(">I", data, end - 4)[0]:
            raise SepiError(f"{path}: damaged PNG: checksum of chunk {kind.decode('ascii', 'replace')} is wrong")
        if kind == b"IEND":
            return
        at = end
    raise SepiError(f"{path}: damaged PNG: the file is cut off after {len(data)} bytes")


def _described(image: Pixels) -> str:
    height, width, channels = image.shape
    return f"{width}x{height} {'RGB' if channels == 3 else 'grey'} of {8 * image.dtype.itemsize} bit"
