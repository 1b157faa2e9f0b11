"""Point clouds as PLY files, which every viewer of 3-D data reads."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np
import numpy.typing as npt

from sepi.errors import SepiError
from sepi.io.files import atomic_path

_POINT = np.dtype([("position", "<f4", 3), ("colour", "u1", 3)])
_PROPERTIES = (*(f"float {axis}" for axis in "xyz"), *(f"uchar {colour}" for colour in ("red", "green", "blue")))


def write_ply(
    path: Path, positions: npt.NDArray[np.float32], colours: npt.NDArray[np.uint8], comments: Sequence[str] = ()
) -> None:
    """Write coloured points as a binary little-endian PLY, whole or not at all; equal points give equal bytes.

    Parameters
    ----------
    path : Path
    positions : ndarray, shape (N, 3), float32
        x, y, z.
    colours : ndarray, shape (N, 3), uint8
        RGB.
    comments : sequence of str
        One line of ASCII each, for the header: units and axes.

    Raises
    ------
    SepiError
        If the shapes are not as above, a comment is not one line of ASCII, or the file cannot be written.
    """
    if positions.ndim != 2 or positions.shape[1] != 3 or colours.shape != positions.shape:
        raise SepiError(
            f"{path}: expected positions and colours of shape (N, 3), got {positions.shape} and {colours.shape}"
        )
    if not all(comment.isascii() and comment.isprintable() for comment in comments):
        raise SepiError(f"{path}: a comment in a PLY file is one line of ASCII")
    points = np.empty(len(positions), _POINT)
    points["position"], points["colour"] = positions, colours
    header = [
        "ply",
        "format binary_little_endian 1.0",
        *(f"comment {comment}" for comment in comments),
        f"element vertex {len(points)}",
        *(f"property {words}" for words in _PROPERTIES),
        "end_header",
    ]
    with atomic_path(path) as temporary, temporary.open("wb") as file:
        file.write(("\n".join(header) + "\n").encode("ascii"))
        file.write(points.tobytes())
