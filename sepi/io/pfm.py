"""Portable float maps, the benchmark's format for disparity: one channel, rows stored bottom-up."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np

from sepi.errors import SepiError
from sepi.io.files import atomic_path
from sepi.lightfield import FloatMap

# magic, width, height, scale (its sign gives the byte order), each ended by one white space
_HEADER = re.compile(rb"\A(P[fF])\s+(\d{1,9})\s+(\d{1,9})\s+([-+]?[0-9.]+(?:[eE][-+]?\d+)?)\s")


def read_pfm(path: Path) -> FloatMap:
    """Read a one-channel PFM.

    Returns
    -------
    ndarray, shape (H, W), float32
        Top row first.

    Raises
    ------
    SepiError
        If the file is unreadable, not a one-channel PFM, or shorter than its header says.
    """
    try:
        data = path.read_bytes()
    except OSError as error:
        raise SepiError(f"{path}: cannot be read ({error.strerror})") from error
    header = _HEADER.match(data[:256])
    if header is None or header[1] != b"Pf":
        raise SepiError(f"{path}: not a one-channel PFM (expected a header 'Pf WIDTH HEIGHT SCALE')")
    width, height, scale = int(header[2]), int(header[3]), _number(path, header[4])
    if width == 0 or height == 0 or scale == 0:
        raise SepiError(f"{path}: PFM header has a zero width, height or scale")
    body = memoryview(data)[header.end() :]
    if len(body) != 4 * width * height:
        raise SepiError(
            f"{path}: expected {4 * width * height} bytes after the header for {width}x{height} pixels, got {len(body)}"
        )
    values = np.frombuffer(body, "<f4" if scale < 0 else ">f4").reshape(height, width)
    return values[::-1].astype(np.float32)


def write_pfm(path: Path, values: FloatMap) -> None:
    """Write ``values`` of shape (H, W) as a one-channel little-endian PFM, whole or not at all."""
    height, width = values.shape
    with atomic_path(path) as temporary:
        temporary.write_bytes(f"Pf\n{width} {height}\n-1\n".encode() + values[::-1].astype("<f4").tobytes())


def _number(path: Path, text: bytes) -> float:
    try:
        return float(text)
    except ValueError as error:
        raise SepiError(f"{path}: PFM scale is not a number: {text.decode(errors='replace')}") from error
