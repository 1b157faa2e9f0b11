"""Point clouds as PLY files, which every viewer of 3-D data reads."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from sepi.io.files import atomic_path
from sepi.io.point_cloud import PointCloud

_POINT = np.dtype([("position", "<f4", 3), ("colour", "u1", 3)])
_PROPERTIES = (*(f"float {axis}" for axis in "xyz"), *(f"uchar {colour}" for colour in ("red", "green", "blue")))


def write_ply(path: Path, cloud: PointCloud) -> None:
    """Write coloured points as a binary little-endian PLY, whole or not at all; equal points give equal bytes."""
    points = np.empty(len(cloud.positions), _POINT)
    points["position"], points["colour"] = cloud.positions, cloud.colours
    header = [
        "ply",
        "format binary_little_endian 1.0",
        *(f"comment {comment}" for comment in cloud.comments()),
        f"element vertex {len(points)}",
        *(f"property {words}" for words in _PROPERTIES),
        "end_header",
    ]
    with atomic_path(path) as temporary, temporary.open("wb") as file:
        file.write(("\n".join(header) + "\n").encode("ascii"))
        file.write(points.tobytes())
