"""Portable float maps, the benchmark's format for disparity: one channel, rows stored bottom-up."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np

from sepi.errors import SepiError
from sepi.io.files import atomic_path, reading
from sepi.lightfield import FloatMap

# magic, width, height, scale (its sign gives the byte order), each ended by one white space
_HEADER = re.compile(rb"\A(P[fF])\s+(\d{1,9})\s+(\d{1,9})\s+([-+]?[0-9.]+(?:[eE][-+]?\d+)?)\s")


def read_pfm(path: Path) -> FloatMap:
    """Read a one-channel PFM.

    Returns
    -------
    ndarray, shape (H, W), float32
        Top row first.
    """
    with reading(path, "one-channel PFM"):
        data = path.read_bytes()
        header = _HEADER.match(data[:256])
        if header is None or header[1] != b"Pf":
            raise SepiError("not a one-channel PFM (expected a header 'Pf WIDTH HEIGHT SCALE')")
        width, height, scale = int(header[2]), int(header[3]), float(header[4])
        body = memoryview(data)[header.end() :]
        if not scale or not 0 < 4 * width * height == len(body):
            raise SepiError(
                f"damaged PFM of {width}x{height} pixels and scale {scale:g}: expected {4 * width * height} bytes "
                f"after the header, got {len(body)}"
            )
        values = np.frombuffer(body, "<f4" if scale < 0 else ">f4").reshape(height, width)
        return values[::-1].astype(np.float32)


def write_pfm(path: Path, values: FloatMap) -> None:
    """Write ``values`` of shape (H, W) as a one-channel little-endian PFM, whole or not at all."""
    height, width = values.shape
    with atomic_path(path) as temporary:
        temporary.write_bytes(f"Pf\n{width} {height}\n-1\n".encode() + values[::-1].astype("<f4").tobytes())
