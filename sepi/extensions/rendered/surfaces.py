"""All triangles of a world in one list, from which the surface at a ray's end follows exactly."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from sepi.extensions.rendered.patterns import srgb_decoded
from sepi.extensions.rendered.shapes import joined
from sepi.extensions.rendered.world import FloatArray, Material, Mesh, Pattern, Vector, World
from sepi.kernels import triangles as kernels
from sepi.lightfield import BoolMap

# rays per pixel, across and down, for its albedo
_FINE = 8
# number of pixels computed together, so that their data stays in the cache
_AT_ONCE = 4096

Faces = npt.NDArray[np.int32]


class Planes(NamedTuple):
    """Planes of triangles, and their coordinates on patterns."""

    corner: npt.NDArray[np.float64]
    """First corner, shape (M, 3)."""
    normal: npt.NDArray[np.float64]
    """Normal, shape (M, 3)."""
    uv: npt.NDArray[np.float64]
    """uv of the corner, in periods, shape (M, 2)."""
    gradient: npt.NDArray[np.float64]
    """Gradients of uv, shape (M, 2, 3)."""


@dataclass(frozen=True)
class FirstSurface:
    """First surfaces on the rays through the middles of a view's pixels.

    Attributes
    ----------
    face : ndarray, shape (H, W), int32
        Triangle of :class:`Surfaces`; 0 where there is none.
    depth : ndarray, shape (H, W), float64
        Metres along the viewing direction; infinite where there is nothing.
    normal : ndarray, shape (H, W, 3), float32
        Normals of the triangles, towards the camera: right, down, away.
    uv : ndarray, shape (H, W, 2), float32
        Coordinates on the pattern, in periods.
    thing : ndarray, shape (H, W), int64
        Number of the world's thing; -1 where there is none.
    """

    face: Faces
    depth: npt.NDArray[np.float64]
    normal: FloatArray
    uv: FloatArray
    thing: npt.NDArray[np.int64]


class Surfaces:
    """The triangles of a world's things and lamps; triangle 0 means that a ray meets nothing.

    Attributes
    ----------
    mesh : Mesh
        All triangles.
    thing : ndarray, shape (M,), int64
        Thing of each triangle; -1 for lamps and triangle 0.
    """

    def __init__(self, world: World) -> None:
        parts = [(number, thing.mesh, period(thing.material)) for number, thing in enumerate(world.things)]
        for lamp in world.light.lamps:
            corners = np.array([[0, 0, 0], lamp.across, np.add(lamp.across, lamp.down), lamp.down]) + lamp.corner
            sheet = Mesh(corners.astype(np.float32), np.array([[0, 1, 2], [0, 2, 3]], np.uint32), _unpainted(4))
            parts.append((-1, sheet, (1.0, 1.0)))
        nothing = Mesh(np.zeros((3, 3), np.float32), np.array([[0, 1, 2]], np.uint32), _unpainted(3))
        parts.insert(0, (-1, nothing, (1.0, 1.0)))
        self.mesh = joined([replace(mesh, uv=mesh.uv / np.array(period)) for _, mesh, period in parts])
        self.thing = np.concatenate([np.full(len(mesh.faces), number) for number, mesh, _ in parts])
        self._corners = self.mesh.vertices.astype(np.float64)[self.mesh.faces]
        first, second, third = np.moveaxis(self._corners, 1, 0)
        normal = np.cross(second - first, third - first)
        # gradient of uv along the triangle
        at, along, beyond = (self.mesh.uv.astype(np.float64)[self.mesh.faces[:, n]] for n in range(3))
        square = np.maximum(np.sum(normal**2, axis=1), 1e-300)[:, None]
        rise = [np.cross(third - first, normal) / square, np.cross(normal, second - first) / square]
        gradient = (along - at)[:, :, None] * rise[0][:, None] + (beyond - at)[:, :, None] * rise[1][:, None]
        self._planes = Planes(first, normal, at, gradient)
        # all patterns (by identity) in one list of linear texels; of each thing: start, height and width
        patterns = [thing.material.pattern for thing in world.things]
        rasters = {id(pattern): _raster(pattern) for pattern in patterns}
        sizes = [raster[..., 0].size for raster in rasters.values()]
        self._begins = dict(zip(rasters, np.cumsum([0, *sizes[:-1]]).tolist(), strict=True))
        self._texels: FloatArray = np.concatenate([srgb_decoded(raster).reshape(-1, 3) for raster in rasters.values()])
        self._starts = np.array([(self._begins[id(one)], *rasters[id(one)].shape[:2]) for one in patterns])
        self._matte = np.array([thing.material.kind == "matte" for thing in world.things] + [False])

    def matte(self, things: npt.NDArray[np.int64]) -> BoolMap:
        """Whether things are matte; False for lamps and without a thing."""
        found: BoolMap = self._matte[things]
        return found

    def met(
        self,
        origin: npt.NDArray[np.float64],
        rotation: npt.NDArray[np.float64],
        frame: npt.NDArray[np.float64],
        size: int,
        near: float,
    ) -> Faces:
        """Triangles that the rays through the middles of a square picture's pixels meet first, ``(size, size)``.

        Parameters
        ----------
        origin : ndarray, shape (3,), float64
            Position of the camera.
        rotation : ndarray, shape (3, 3), float64
            From directions of the camera to those of the world.
        frame : ndarray, shape (3,), float64
            Focal length in pixels, and row and column of the camera's axis in pixels from the upper left corner.
        size : int
        near : float
            Least distance along the axis, metres.
        """
        found = np.zeros((size, size), np.int32)
        kernels.first_met(self._corners, origin, rotation, frame, near, found)
        return found

    def first(self, faces: Faces, directions: npt.NDArray[np.float64], origin: Vector) -> FirstSurface:
        """The first surfaces on these triangles.

        Parameters
        ----------
        faces : ndarray, shape (H, W), int32
        directions : ndarray, shape (H, W, 3), float64
            Directions of the rays; 1 along the camera's axis.
        origin : (float, float, float)
            Origin of the rays.
        """
        corner, normal, uv, gradient = (part[faces] for part in self._planes)
        with np.errstate(divide="ignore", invalid="ignore"):
            depth = np.sum(normal * (corner - origin), axis=-1) / np.sum(normal * directions, axis=-1)
            normal = normal / np.linalg.norm(normal, axis=-1, keepdims=True)
            point = np.array(origin) + depth[..., None] * directions - corner
        hit = faces > 0
        towards = np.sum(normal * directions, axis=-1, keepdims=True) > 0
        uv = uv + np.einsum("...ij,...j", gradient, point)
        return FirstSurface(
            face=faces,
            depth=np.where(hit, depth, np.inf),
            normal=np.where(hit[..., None], np.where(towards, -normal, normal), 0).astype(np.float32),
            uv=np.where(hit[..., None], uv, 0).astype(np.float32),
            thing=self.thing[faces],
        )

    def albedo(self, faces: Faces, pixels: npt.NDArray[np.int64], frame: npt.NDArray[np.float64]) -> FloatArray:
        """Mean linear albedo of pixels, each of which shows the plane of one triangle; shape (N, 3), float32.

        Parameters
        ----------
        faces : ndarray, shape (N,), int32
            The triangles, none of them 0.
        pixels : ndarray, shape (N, 2), int64
            Rows and columns.
        frame : ndarray, shape (5,), float64
            Position of the camera (right, down), row and column of its axis, focal length in pixels.
        """
        found = np.empty((len(faces), 3), np.float32)
        for begin in range(0, len(faces), _AT_ONCE):
            part = slice(begin, begin + _AT_ONCE)
            found[part] = self._albedo(faces[part], pixels[part], frame)
        return found

    def _albedo(self, faces: Faces, pixels: npt.NDArray[np.int64], frame: npt.NDArray[np.float64]) -> FloatArray:
        corner, normal, uv, gradient = (part[faces] for part in self._planes)
        corner = corner - [*frame[:2], 0]
        volume = np.sum(normal * corner, axis=1)
        starts, texels = self._starts, self._texels
        start, sizes = starts[self.thing[faces], 0], starts[self.thing[faces], 1:]
        total = np.zeros((len(faces), 3))
        for fine in np.ndindex(_FINE, _FINE):
            down, across = ((pixels + (np.array(fine) + 0.5) / _FINE - frame[2:4]) / frame[4]).T
            ray = np.stack([across, down, np.ones(len(faces))], axis=1)
            # for planes seen edge-on
            with np.errstate(divide="ignore", invalid="ignore"):
                point = (volume / np.sum(normal * ray, axis=1))[:, None] * ray - corner
                periods = uv + np.einsum("nij,nj->ni", gradient, point)
                texel = ((periods - np.floor(periods))[:, ::-1] * sizes).astype(int)
            # the remainder of a period may round to a whole one
            row, column = np.clip(texel, 0, sizes - 1).T
            total += texels[start + row * sizes[:, 1] + column]
        return np.asarray(total / _FINE**2, np.float32)

    def linear(self, pattern: Pattern) -> FloatArray:
        """The linear raster of a pattern."""
        at, (height, width) = self._begins[id(pattern)], pattern.raster.shape[:2]
        return self._texels[at : at + height * width].reshape(height, width, 3)


def _raster(pattern: Pattern | Vector) -> FloatArray:
    """Raster of a pattern; one texel for a colour."""
    return pattern.raster if isinstance(pattern, Pattern) else np.array([[pattern]], np.float32)


def period(material: Material) -> tuple[float, float]:
    """Metres after which a material's pattern repeats."""
    return material.pattern.size if isinstance(material.pattern, Pattern) else (1.0, 1.0)


def _unpainted(count: int) -> FloatArray:
    return np.zeros((count, 2), np.float32)
