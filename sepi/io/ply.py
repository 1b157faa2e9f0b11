"""Point clouds as PLY files, which every viewer of 3-D data reads."""

from __future__ import annotations

from pathlib import Path
from typing import Protocol

import numpy as np
import numpy.typing as npt

from sepi.io.files import atomic_path
from sepi.validation import require_path, require_type

_POINT = np.dtype([("position", "<f4", 3), ("colour", "u1", 3)])
_PROPERTIES = (*(f"float {axis}" for axis in "xyz"), *(f"uchar {colour}" for colour in ("red", "green", "blue")))


class Cloud(Protocol):
    """Coloured points, such as :class:`sepi.io.point_cloud.PointCloud`."""

    @property
    def positions(self) -> npt.NDArray[np.floating]:
        """Coordinates, shape (N, 3)."""

    @property
    def colours(self) -> npt.NDArray[np.uint8]:
        """RGB, shape (N, 3)."""

    def comments(self) -> tuple[str, ...]:
        """What the numbers are, for the file's header."""


def write_ply(path: str | Path, cloud: Cloud) -> None:
    """Write coloured points as a binary little-endian PLY, whole or not at all; equal points give equal bytes.

    Parameters
    ----------
    path : str or Path
        MeshLab, CloudCompare, Blender and others open it; a comment in its header names the units.
    cloud : Cloud
        Such as a :class:`~sepi.io.point_cloud.PointCloud`.

    Raises
    ------
    SepiError
        If the file cannot be written.

    Examples
    --------
    >>> from pathlib import Path
    >>> from sepi.io.ply import write_ply
    >>> from sepi.io.point_cloud import point_cloud
    >>> from sepi.scenes import render
    >>> light_field = render("pyramids", size=64, views=2)
    >>> picture = light_field.views[light_field.reference_position]
    >>> write_ply(Path("pyramids.ply"), point_cloud(picture, light_field.ground_truth))
    >>> Path("pyramids.ply").read_bytes().splitlines()[4]
    b'element vertex 4096'
    """
    path = require_path("PLY to write", path)
    for name in ("positions", "colours"):
        require_type(f"{path}: {name}", getattr(cloud, name, None), np.ndarray, "an array of the points")
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
