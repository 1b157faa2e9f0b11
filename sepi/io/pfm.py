"""Portable float maps (PFM), the benchmark's format for disparity: one channel, rows stored bottom-up."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np

from sepi.errors import SepiError
from sepi.io.files import atomic_path, reading
from sepi.lightfield import FloatMap
from sepi.validation import require_map, require_path

# magic, width, height, scale (its sign gives the byte order), each ended by one white space
_HEADER = re.compile(rb"\A(P[fF])\s+(\d{1,9})\s+(\d{1,9})\s+([-+]?[0-9.]+(?:[eE][-+]?\d+)?)\s")


def read_pfm(path: str | Path) -> FloatMap:
    """Read a one-channel PFM of either byte order.

    Parameters
    ----------
    path : str or Path

    Returns
    -------
    ndarray, shape (H, W), float32
        Top row first. Values are as stored: of the header's scale only the sign counts, which gives the byte order.

    Raises
    ------
    SepiError
        If the file is missing, not a PFM, of three channels, or damaged.

    Examples
    --------
    >>> from pathlib import Path
    >>> import numpy as np
    >>> from sepi.io.pfm import read_pfm
    >>> rows = np.array([[3.0, 4.0], [1.0, 2.0]])  # a file begins with the bottom row
    >>> big_endian = b"Pf\\n2 2\\n1.0\\n" + rows.astype(">f4").tobytes()
    >>> size = Path("map.pfm").write_bytes(big_endian)
    >>> read_pfm(Path("map.pfm")).tolist()
    [[1.0, 2.0], [3.0, 4.0]]
    """
    path = require_path("PFM to read", path)
    with reading(path, "one-channel PFM"):
        data = path.read_bytes()
        header = _HEADER.match(data[:256])
        if header is None or header[1] != b"Pf":
            raise SepiError("not a one-channel PFM (expected a header 'Pf WIDTH HEIGHT SCALE')")
        width, height, scale = int(header[2]), int(header[3]), float(header[4])
        body = memoryview(data)[header.end() :]
        if not scale or not 0 < 4 * width * height == len(body):
            raise SepiError(f"damaged PFM: expected {4 * width * height} bytes after the header, got {len(body)}")
        values = np.frombuffer(body, "<f4" if scale < 0 else ">f4").reshape(height, width)
        return values[::-1].astype(np.float32)


def write_pfm(path: str | Path, values: FloatMap) -> None:
    """Write a map as a one-channel little-endian PFM, whole or not at all.

    Parameters
    ----------
    path : str or Path
        Its folder is made if missing.
    values : ndarray, shape (H, W), float32
        Top row first.

    Raises
    ------
    SepiError
        If the file cannot be written.

    Examples
    --------
    >>> from pathlib import Path
    >>> import numpy as np
    >>> from sepi.io.pfm import read_pfm, write_pfm
    >>> write_pfm(Path("maps/cotton.pfm"), np.array([[0.25, np.nan]], np.float32))
    >>> read_pfm(Path("maps/cotton.pfm")).tolist()
    [[0.25, nan]]
    """
    path = require_path("PFM to write", path)
    require_map(str(path), values)
    height, width = values.shape
    with atomic_path(path) as temporary:
        temporary.write_bytes(f"Pf\n{width} {height}\n-1\n".encode() + values[::-1].astype("<f4").tobytes())
