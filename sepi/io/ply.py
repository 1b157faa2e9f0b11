"""Point clouds as PLY files, which all 3-D viewers read."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Literal, Protocol

import numpy as np
import numpy.typing as npt

from sepi.errors import SepiError
from sepi.io.files import atomic_path, reading
from sepi.validation import require_path, require_type

_POINT = np.dtype([("position", "<f4", 3), ("colour", "u1", 3)])
# number types of PLY; NumPy knows the sized ones
_SIZED = {"char": "int8", "uchar": "uint8", "short": "int16", "ushort": "uint16", "int": "int32", "uint": "uint32"}
_SIZED |= {"float": "float32", "double": "float64"}
_NUMBERS = _SIZED | {word: word for word in _SIZED.values()}
_ORDERS: dict[str, Literal["<", ">"]] = {"binary_little_endian": "<", "binary_big_endian": ">"}
_LONGEST_HEADER = 2**16
_PROPERTIES = (*(f"float {axis}" for axis in "xyz"), *(f"uchar {colour}" for colour in ("red", "green", "blue")))

_SIGMA = "sigma"


class Cloud(Protocol):
    """Coloured points, such as :class:`sepi.io.point_cloud.PointCloud`; may have a ``sigma`` for each point."""

    @property
    def positions(self) -> npt.NDArray[np.floating]:
        """Coordinates, shape (N, 3)."""

    @property
    def colours(self) -> npt.NDArray[np.uint8]:
        """RGB, shape (N, 3)."""

    def comments(self) -> tuple[str, ...]:
        """Axes and units, for the file's header."""


def write_ply(path: str | Path, cloud: Cloud, comments: Sequence[str] | None = None) -> None:
    """Write coloured points as a binary little-endian PLY, whole or not at all; equal content gives equal bytes.

    Parameters
    ----------
    path : str or Path
        MeshLab, CloudCompare, Blender and others open it; comments in its header name the units. If the cloud has a
        sigma, each vertex has a property of that name, which CloudCompare shows as a scalar field.
    cloud : Cloud
        Such as a :class:`~sepi.io.point_cloud.PointCloud`.
    comments : sequence of str, optional
        Axes and units; default: those of the cloud.

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
    kind, properties = _POINT, _PROPERTIES
    # a user's own class need not have it
    sigma = getattr(cloud, _SIGMA, None)
    if sigma is not None:
        kind, properties = np.dtype([*kind.descr, (_SIGMA, "<f4")]), (*properties, f"float {_SIGMA}")
    points = np.empty(len(cloud.positions), kind)
    points["position"], points["colour"] = cloud.positions, cloud.colours
    if sigma is not None:
        points[_SIGMA] = sigma
    header = [
        "ply",
        "format binary_little_endian 1.0",
        *(f"comment {comment}" for comment in (cloud.comments() if comments is None else comments)),
        f"element vertex {len(points)}",
        *(f"property {words}" for words in properties),
        "end_header",
    ]
    with atomic_path(path) as temporary, temporary.open("wb") as file:
        file.write(("\n".join(header) + "\n").encode("ascii"))
        file.write(points.tobytes())


def read_positions(path: Path) -> npt.NDArray[np.float64]:
    """Coordinates (N, 3) of the points of a PLY file whose first element is ``vertex``.

    Raises
    ------
    SepiError
        If it is damaged, its first element is another, or a vertex has lists.
    """
    with reading(path, "PLY file"):
        data = path.read_bytes()
        end = data.index(b"end_header", 0, _LONGEST_HEADER)
        begin = data.index(b"\n", end) + 1
        lines = [line.split() for line in data[:end].decode("ascii", "replace").splitlines()]
        kind = next((line[1] for line in lines if line[:1] == ["format"]), "none")
        if kind not in ("ascii", *_ORDERS):
            raise SepiError(f"damaged PLY file: expected the format ascii or {' or '.join(_ORDERS)}, found {kind}")
        first, *others = [n for n, line in enumerate(lines) if line[:1] == ["element"]]
        if lines[first][1] != "vertex":
            raise SepiError("not a PLY file of points: its first element is not 'vertex'")
        count, properties = int(lines[first][2]), lines[first + 1 : others[0] if others else None]
        words = [line[1:] for line in properties if line[:1] == ["property"]]
        if unread := [word for word, *_ in words if word not in _NUMBERS]:
            raise SepiError(f"a PLY file whose vertices have a '{unread[0]}'; expected numbers: {', '.join(_NUMBERS)}")
        names = [(name, _NUMBERS[word]) for word, name in words]
        if kind == "ascii":
            rows = [tuple(map(float, line.split())) for line in data[begin:].splitlines()[:count]]
            values = np.array(rows, [(name, "f8") for name, _ in names])
        else:
            values = np.frombuffer(data, np.dtype(names).newbyteorder(_ORDERS[kind]), count, begin)
        return np.column_stack([values[axis].astype(np.float64) for axis in "xyz"])
