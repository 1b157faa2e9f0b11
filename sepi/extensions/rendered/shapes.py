"""Meshes: sheets, boxes, balls, tubes, rods, bodies of revolution, plates, and their moves and copies.

``uv`` are approximate metres along the surface, so that a pattern has the same size everywhere.
"""

from collections.abc import Callable, Sequence

import numpy as np
import numpy.typing as npt
from scipy.spatial.transform import Rotation

from sepi.extensions.rendered.world import FloatArray, Material, Mesh, Pattern, Thing, Vector

Points = npt.NDArray[np.float64]
Outline = Points | Sequence[Sequence[float]]
Parts = Mesh | Sequence[Mesh]

# angles round a body; the seam of its pattern lies behind
_ROUND = (-np.pi / 2, 3 * np.pi / 2)


def thing(parts: Parts, surface: Material | Pattern | Vector, *, thin: bool = False) -> Thing:
    """A thing of one mesh or several, matte unless its surface is a material."""
    material = surface if isinstance(surface, Material) else Material(surface)
    return Thing(joined(parts), material, thin)


def raster(*coordinates: npt.ArrayLike) -> Points:
    """Points on the last axis from coordinates that are broadcast."""
    return np.stack(np.broadcast_arrays(*coordinates), axis=-1)


def sheet(points: Points, *, smooth: bool = True) -> Mesh:
    """A surface through a raster of points.

    Parameters
    ----------
    points : ndarray, shape (R, C, 3), float64
        In metres; ``uv`` are the mean lengths along columns and rows.
    smooth : bool
        Whether it is curved, rather than faceted.
    """
    rows, columns = points.shape[:2]
    across = np.linalg.norm(np.diff(points, axis=1), axis=2).mean(0)
    down = np.linalg.norm(np.diff(points, axis=0), axis=2).mean(1)
    u, v = (np.concatenate([[0.0], np.cumsum(steps)]) for steps in (across, down))
    uv = raster(u[None, :], v[:, None]).reshape(-1, 2)
    corner = np.arange(rows * columns).reshape(rows, columns)
    a, b, c, d = (part.ravel() for part in (corner[:-1, :-1], corner[:-1, 1:], corner[1:, 1:], corner[1:, :-1]))
    faces = np.concatenate([np.stack([a, b, c], 1), np.stack([a, c, d], 1)])
    return _mesh(points.reshape(-1, 3), faces, uv, smooth)


def rectangle(corner: Vector, across: Vector, down: Vector) -> Mesh:
    """A flat rectangle, or parallelogram, from one corner along two edges."""
    return _rectangles(*(np.array([values], float) for values in (corner, across, down)))


def wall(corner: Vector, width: float, height: float) -> Mesh:
    """An upright rectangle that faces the camera, from its upper left corner."""
    return rectangle(corner, (width, 0, 0), (0, height, 0))


def ground(corner: Vector, width: float, depth: float) -> Mesh:
    """A level rectangle, from its corner at the left that is near."""
    return rectangle(corner, (width, 0, 0), (0, 0, depth))


def _rectangles(corners: Points, across: Points, down: Points) -> Mesh:
    """Flat rectangles as one mesh: a corner and two edges of each, ``(N, 3)``."""
    right, below = corners + across, corners + down
    points = np.stack([corners, right, below, below - corners + right], axis=1)
    uv = np.zeros((len(corners), 4, 2))
    uv[:, 1::2, 0] = np.linalg.norm(across, axis=1)[:, None]
    uv[:, 2:, 1] = np.linalg.norm(down, axis=1)[:, None]
    faces = np.array([[0, 1, 3], [0, 3, 2]]) + 4 * np.arange(len(corners))[:, None, None]
    return _mesh(points.reshape(-1, 3), faces.reshape(-1, 3), uv.reshape(-1, 2), False)


def box(centre: Vector, size: Vector, turn: Vector = (0, 0, 0)) -> Mesh:
    """A box, turned by angles about its own x, y and z axes, in radians."""
    right, down, away = np.diag(np.asarray(size, float))
    corners = np.array([[-1, -1, -1], [1, -1, 1], [-1, -1, 1], [1, -1, -1], [-1, -1, 1], [-1, 1, -1]]) * size / 2
    across, below = [right, -right, -away, away, right, right], [down, down, down, down, -away, away]
    return moved(_rectangles(corners, np.array(across), np.array(below)), turn, centre)


def ball(centre: Vector, radius: float, relief: Callable[[Points], Points] | None = None, fineness: int = 96) -> Mesh:
    """A ball, each point of which is moved outwards by a part of the radius.

    Parameters
    ----------
    centre : (float, float, float)
    radius : float
    relief : callable, optional
        Takes directions ``(R, C, 3)`` of length 1 and gives parts of the radius ``(R, C)``.
    fineness : int
        Rows of points from pole to pole.
    """
    polar = np.linspace(0, np.pi, fineness)[:, None]
    turn = np.linspace(*_ROUND, 2 * fineness)[None, :]
    direction = raster(np.sin(polar) * np.cos(turn), -np.cos(polar), -np.sin(polar) * np.sin(turn))
    height = 1.0 if relief is None else 1 + relief(direction)[..., None]
    mesh = sheet(np.array(centre) + radius * height * direction)
    return _mesh(mesh.vertices, mesh.faces, raster(turn * radius, polar * radius).reshape(-1, 2), True)


def tube(path: Outline, radius: float | npt.NDArray[np.float64], sides: int = 12) -> Mesh:
    """A tube along a line of points ``(N, 3)``, of one radius or one for each point; its ends are open."""
    points = np.asarray(path, float)
    along = np.gradient(points, axis=0)
    along /= np.linalg.norm(along, axis=1, keepdims=True)
    # parallel transport, so that the tube does not twist
    normal = np.cross(along[0], np.eye(3)[np.argmin(np.abs(along[0]))])
    normals = []
    for direction in along:
        normal = normal - direction * (normal @ direction)
        normal = normal / np.linalg.norm(normal)
        normals.append(normal)
    first = np.array(normals)
    second = np.cross(along, first)
    angle = np.linspace(0, 2 * np.pi, sides + 1)[None, :, None]
    ring = np.cos(angle) * first[:, None] + np.sin(angle) * second[:, None]
    return sheet(points[:, None] + np.broadcast_to(radius, len(points))[:, None, None] * ring)


def rod(start: npt.ArrayLike, end: npt.ArrayLike, radius: float, sides: int = 12) -> Mesh:
    """A straight tube from one point to another, with rounded ends."""
    first, last = np.asarray(start, float), np.asarray(end, float)
    length = np.linalg.norm(last - first)
    cap = np.array([0, 0.3, 1.0]) * min(radius, 0.4 * length)
    # rays find short triangles faster than long oblique ones
    between = np.linspace(cap[-1], length - cap[-1], 2 + int(length / (16 * radius)))
    along = np.concatenate([cap[:-1], between, length - cap[-2::-1]])
    widths = radius * np.concatenate([[0, 0.7], np.ones(len(between)), [0.7, 0]])
    return tube(first + along[:, None] / length * (last - first), widths, sides)


def bevelled(outline: Outline, by: float) -> Points:
    """An outline ``(N, 2)`` with its corners cut off, so that smooth bodies have sharp edges."""
    first, *corners, last = np.asarray(outline, float)
    points = [first]
    for before, corner, after in zip([first, *corners[:-1]], corners, [*corners[1:], last], strict=True):
        for other in (before, after):
            part = by / max(float(np.linalg.norm(other - corner)), 3 * by)
            points.append(corner + part * (other - corner))
    return np.array([*points, last])


def painted_from(mesh: Mesh, across: float, down: float) -> Mesh:
    """The mesh with its pattern shifted by these metres."""
    return _mesh(mesh.vertices, mesh.faces, mesh.uv + np.array([across, down]), mesh.smooth)


def turned_body(profile: Outline, centre: Vector, sides: int = 96) -> Mesh:
    """A body of revolution about the vertical through ``centre``: vases, bottles, columns.

    Parameters
    ----------
    profile : ndarray, shape (N, 2), float64
        Distance from the axis, and height above ``centre`` (upwards), of the points of the outline, from the top down.
    centre : (float, float, float)
    sides : int
    """
    radius, height = np.hsplit(np.asarray(profile, float), 2)
    angle = np.linspace(*_ROUND, sides + 1)[None, :]
    points = raster(radius * np.cos(angle), -height, -radius * np.sin(angle))
    return sheet(points + np.array(centre))


def plate(outline: Outline, thickness: float) -> Mesh:
    """A flat body of a star-shaped outline, such as a leaf or a disc.

    Parameters
    ----------
    outline : ndarray, shape (N, 2), float64
        Points ``(x, y)`` in order, in metres; the body lies about ``z = 0``. With no thickness it has one side.
    thickness : float
    """
    corners = np.asarray(outline, float)
    count, rim = len(corners), np.concatenate([corners, corners.mean(0)[None]])
    fan = np.stack([np.full(count, count), np.arange(count), np.roll(np.arange(count), -1)], axis=1)
    faces = [np.c_[rim, np.full(count + 1, z)] for z in (0 - thickness / 2, thickness / 2)]
    front, back = (_mesh(faces[n], fan[:, :: 1 - 2 * n], rim - corners.min(0), False) for n in (0, 1))
    if thickness == 0:
        return front
    return joined([front, back, sheet(np.stack(faces)[:, [*range(count), 0]], smooth=False)])


def leaf(length: float, width: float, bend: float, fold: float = 0.3, rows: int = 6) -> Mesh:
    """A pointed leaf from the origin along ``x``, its upper side to ``-y``.

    Parameters
    ----------
    length, width : float
    bend : float
        Radians by which its tip has turned downwards.
    fold : float
        Slope of its halves up from the midrib.
    rows : int
        Of points, along it.
    """
    part = np.linspace(0, 1, rows)
    angle = bend * part
    step = length / (rows - 1)
    way = np.stack([np.cos(angle), np.sin(angle)])
    along, down = step * np.pad(np.cumsum((way[:, 1:] + way[:, :-1]) / 2, axis=1), ((0, 0), (1, 0)))
    half = width / 2 * np.sin(np.pi * np.clip(part, 0.03, 0.995) ** 0.75) ** 0.8
    side = np.array([-1.0, 0.0, 1.0])
    off = half[:, None] * side
    rise = fold * np.abs(off)
    return sheet(np.stack([along[:, None] + rise * np.sin(angle)[:, None], down[:, None] - rise, off], axis=-1))


def moved(parts: Parts, turn: Vector = (0, 0, 0), by: Vector = (0, 0, 0)) -> Mesh:
    """A mesh of parts, turned about the x, then y, then z axis by angles in radians, and shifted."""
    mesh = joined(parts)
    return _mesh(np.asarray(mesh.vertices, float) @ rotation(turn).T + by, mesh.faces, mesh.uv, mesh.smooth)


def rotation(turn: Vector) -> Points:
    """Rotation matrix about the x, then y, then z axis by angles in radians, shape (3, 3)."""
    return np.asarray(Rotation.from_euler("xyz", turn).as_matrix())


def joined(meshes: Parts) -> Mesh:
    """Several meshes as one; all of them smooth, or none."""
    if isinstance(meshes, Mesh):
        return meshes
    vertices, faces, uv, smooth = zip(*meshes, strict=True)
    starts = np.cumsum([0, *map(len, vertices[:-1])])
    shifted = [part + start for part, start in zip(faces, starts, strict=True)]
    return _mesh(np.concatenate(vertices), np.concatenate(shifted), np.concatenate(uv), all(smooth))


def copies(mesh: Mesh, axes: Points, places: Points, scales: npt.ArrayLike = 1.0) -> Mesh:
    """Copies of a mesh as one mesh, each with its pattern shifted.

    Parameters
    ----------
    mesh : Mesh
    axes : ndarray, shape (N, 3, 3), float64
        Axes of each copy: ``axes[n, 0]`` is the direction of its ``x``.
    places : ndarray, shape (N, 3), float64
        Origin of each copy.
    scales : float or ndarray, shape (N,)
    """
    count, scale = len(places), np.broadcast_to(scales, len(places))[:, None, None]
    vertices = scale * (mesh.vertices.astype(np.float64) @ axes) + places[:, None]
    faces = mesh.faces.astype(np.int64) + len(mesh.vertices) * np.arange(count)[:, None, None]
    uv = scale * mesh.uv + np.arange(count)[:, None, None] * np.array([0.137, 0.091])
    return _mesh(vertices.reshape(-1, 3), faces.reshape(-1, 3), uv.reshape(-1, 2), mesh.smooth)


def about_vertical(turns: npt.ArrayLike) -> Points:
    """Axes ``(N, 3, 3)`` of upright :func:`copies`, turned by angles ``(N,)`` in radians."""
    return np.stack([rotation((0.0, turn, 0.0)) for turn in np.ravel(turns)])


def normals(mesh: Mesh) -> FloatArray:
    """Normals of a smooth mesh's vertices: means over the adjacent triangles, weighted by area."""
    corners = mesh.vertices[mesh.faces].astype(np.float64)
    facing = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    # vertices at one place, such as along a seam, count as one
    _, same = np.unique(np.round(mesh.vertices, 6), axis=0, return_inverse=True)
    same = same.ravel()
    total = np.zeros((same.max() + 1, 3))
    np.add.at(total, same[mesh.faces.T], facing)
    length = np.linalg.norm(total, axis=1, keepdims=True)
    return np.asarray((total / np.where(length > 0, length, 1))[same], np.float32)


def _mesh(vertices: npt.ArrayLike, faces: npt.ArrayLike, uv: npt.ArrayLike, smooth: bool) -> Mesh:
    return Mesh(np.asarray(vertices, np.float32), np.asarray(faces, np.uint32), np.asarray(uv, np.float32), smooth)
