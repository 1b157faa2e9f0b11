"""All triangles of a world in one list, from which the surface at a ray's end follows exactly."""

from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from sepi.extensions.rendered.patterns import srgb_decoded
from sepi.extensions.rendered.shapes import joined, rectangle, rotation
from sepi.extensions.rendered.world import FloatArray, Material, Mesh, Pattern, Position, Rig, Vector, World
from sepi.kernels import triangles as kernels
from sepi.lightfield import BoolMap

NEAR = 0.1
"""Metres at which rays begin; much less would lose digits of their directions."""

# rays per pixel, across and down, for its albedo
_FINE = 8
# number of pixels computed together, so that their data stays in the cache
_AT_ONCE = 4096


class FirstSurface(NamedTuple):
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

    face: npt.NDArray[np.int32]
    depth: npt.NDArray[np.float64]
    normal: FloatArray
    uv: FloatArray
    thing: npt.NDArray[np.int64]


class Surfaces:
    """The triangles of a world's things and lamps; triangle 0 means that a ray meets nothing.

    Attributes
    ----------
    matte : ndarray, shape (N + 1,), bool
        Whether each thing is matte; False for -1, lamps and no thing.
    """

    def __init__(self, world: World, rig: Rig) -> None:
        self._rig = rig
        nothing = Mesh(np.zeros((3, 3), np.float32), np.array([[0, 1, 2]], np.uint32), np.zeros((3, 2), np.float32))
        parts = [(-1, nothing)]
        for number, (mesh, material, _) in enumerate(world.things):
            parts.append((number, mesh._replace(uv=mesh.uv / np.array(period(material)))))
        parts += [(-1, rectangle(lamp.corner, lamp.across, lamp.down)) for lamp in world.light.lamps]
        self._thing = np.concatenate([np.full(len(mesh.faces), number) for number, mesh in parts])
        mesh = joined([mesh for _, mesh in parts])
        self._corners = mesh.vertices.astype(np.float64)[mesh.faces]
        first, second, third = np.moveaxis(self._corners, 1, 0)
        normal = np.cross(second - first, third - first)
        # gradient of uv along the triangle
        at, along, beyond = (mesh.uv.astype(np.float64)[mesh.faces[:, n]] for n in range(3))
        square = np.maximum(np.sum(normal**2, axis=1), 1e-300)[:, None]
        rise = [np.cross(third - first, normal) / square, np.cross(normal, second - first) / square]
        gradient = (along - at)[:, :, None] * rise[0][:, None] + (beyond - at)[:, :, None] * rise[1][:, None]
        # of each triangle: first corner, normal, the corner's uv in periods, and gradients of uv (2, 3)
        self._planes = (first, normal, at, gradient)
        # all patterns (by identity) in one list of linear texels; of each thing: start, height and width
        patterns = [thing.material.pattern for thing in world.things]
        rasters = {id(pattern): raster_of(pattern) for pattern in patterns}
        begins = dict(zip(rasters, np.cumsum([0, *(raster[..., 0].size for raster in rasters.values())]), strict=False))
        self._texels: FloatArray = np.concatenate([srgb_decoded(raster).reshape(-1, 3) for raster in rasters.values()])
        self._starts = np.array([(begins[id(one)], *rasters[id(one)].shape[:2]) for one in patterns])
        self.matte = np.array([thing.material.kind == "matte" for thing in world.things] + [False])

    def first(self, position: Position) -> FirstSurface:
        """The first surfaces on the rays through the middles of a view's pixels."""
        faces = self._met(position, 1)
        (row, column), middles = self._rig.axis(position), np.arange(self._rig.size) + 0.5
        x, y = np.meshgrid((middles - column) / self._rig.focal_px, (middles - row) / self._rig.focal_px)
        directions = np.stack([x, y, np.ones_like(x)], axis=-1) @ rotation(position.turn).T
        corner, normal, uv, gradient = (part[faces] for part in self._planes)
        origin = np.array([position.right, position.down, 0.0])
        with np.errstate(divide="ignore", invalid="ignore"):
            depth = np.sum(normal * (corner - origin), axis=-1) / np.sum(normal * directions, axis=-1)
            normal = normal / np.linalg.norm(normal, axis=-1, keepdims=True)
            point = origin + depth[..., None] * directions - corner
        hit = faces > 0
        towards = np.sum(normal * directions, axis=-1, keepdims=True) > 0
        uv = uv + np.einsum("...ij,...j", gradient, point)
        depth, thing = np.where(hit, depth, np.inf), self._thing[faces]
        facing = np.where(towards, -normal, normal)
        facing, uv = (np.where(hit[..., None], values, 0).astype(np.float32) for values in (facing, uv))
        return FirstSurface(faces, depth, facing, uv, thing)

    def things(self, position: Position, fine: int) -> npt.NDArray[np.int64]:
        """First things on F by F rays of each pixel, -1 for none; shape (H, F, W, F)."""
        return self._thing[self._met(position, fine)].reshape((self._rig.size, fine) * 2)

    def _met(self, position: Position, fine: int) -> npt.NDArray[np.int32]:
        """Triangles that F by F rays of each pixel meet first; shape (H F, W F)."""
        found = np.zeros((fine * self._rig.size, fine * self._rig.size), np.int32)
        origin, frame = np.array([position.right, position.down, 0.0]), [self._rig.focal_px, *self._rig.axis(position)]
        kernels.first_met(self._corners, origin, rotation(position.turn), fine * np.array(frame), NEAR, found)
        return found

    def albedo(self, position: Position, faces: npt.NDArray[np.int32], where: BoolMap) -> FloatArray:
        """Mean linear albedo of pixels, for a view without a turn; shape (H, W, 3), float32.

        Parameters
        ----------
        position : Position
        faces : ndarray, shape (H, W), int32
            Triangle at the middle of each pixel.
        where : ndarray, shape (H, W), bool
            Pixels that show the plane of this triangle only; others get 0.
        """
        found, pixels = np.zeros((*where.shape, 3), np.float32), np.argwhere(where)
        for some in np.split(pixels, range(_AT_ONCE, len(pixels), _AT_ONCE)):
            face = faces[tuple(some.T)]
            corner, normal, uv, gradient = (part[face] for part in self._planes)
            corner = corner - [position.right, position.down, 0]
            volume = np.sum(normal * corner, axis=1)
            start, sizes = self._starts[self._thing[face], 0], self._starts[self._thing[face], 1:]
            total = np.zeros((len(some), 3))
            for fine in np.ndindex(_FINE, _FINE):
                middles = some + (np.array(fine) + 0.5) / _FINE - self._rig.axis(position)
                ray = np.concatenate([middles[:, ::-1] / self._rig.focal_px, np.ones((len(some), 1))], axis=1)
                # for planes seen edge-on
                with np.errstate(divide="ignore", invalid="ignore"):
                    point = (volume / np.sum(normal * ray, axis=1))[:, None] * ray - corner
                    periods = uv + np.einsum("nij,nj->ni", gradient, point)
                    texel = ((periods - np.floor(periods))[:, ::-1] * sizes).astype(int)
                # the remainder of a period may round to a whole one
                row, column = np.clip(texel, 0, sizes - 1).T
                total += self._texels[start + row * sizes[:, 1] + column]
            found[tuple(some.T)] = total / _FINE**2
        return found


def raster_of(pattern: Pattern | Vector) -> FloatArray:
    """Raster of a pattern; one texel for a colour."""
    return pattern.raster if isinstance(pattern, Pattern) else np.array([[pattern]], np.float32)


def period(material: Material) -> tuple[float, float]:
    """Metres after which a material's pattern repeats."""
    return material.pattern.size if isinstance(material.pattern, Pattern) else (1.0, 1.0)
