"""Pictures of a world by Mitsuba 3, one view at a time, and the first surfaces of their pixels.

Mitsuba's variant ``scalar_rgb`` needs only the wheel. The sampler is seeded by view and block, blocks have one size,
and a box filter keeps pixels separate, so results are the same in each run and for any number of threads.
"""

from __future__ import annotations

import importlib.util
import math
from types import ModuleType
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from sepi.errors import SepiError
from sepi.extensions.rendered.patterns import srgb_decoded
from sepi.extensions.rendered.shapes import normals, rotation
from sepi.extensions.rendered.surfaces import NEAR, Surfaces, period
from sepi.extensions.rendered.world import (
    FloatArray,
    Lamp,
    Light,
    Material,
    Pattern,
    Position,
    Rig,
    Thing,
    Vector,
    World,
)
from sepi.process.threads import threads_used

# side of Mitsuba's blocks; by default, it depends on the number of threads, and so would the seeds
_BLOCK = 16
# least number of samples of a pixel for which an even spread pays
SPREAD = 9
# samples of the sky for each of a sun; reduces noise in pixels with several surfaces by a sixth
_SKY_BESIDE_SUN = 0.3
# Vogel's spiral: points that fill a disc evenly
_GOLDEN_ANGLE = np.pi * (3 - np.sqrt(5))


Pixels = npt.NDArray[np.int64]


class Tiles(NamedTuple):
    """Square tiles of a picture.

    Attributes
    ----------
    pixels : ndarray, shape (N, T, T, 2), int64
        Rows and columns of their pixels.
    paths : int
        Number of paths of each pixel.
    seed : int
        First seed of the paths; some that follow are used, too.
    cameras : list
        Cameras of the tiles.
    """

    pixels: Pixels
    paths: int
    seed: int
    cameras: list[Any]


def require_mitsuba() -> None:
    """Raise if the renderer is not installed."""
    if importlib.util.find_spec("mitsuba") is None:
        raise SepiError("path-traced scenes need Mitsuba 3: python -m pip install 'sepi[render]'")


def _mitsuba() -> ModuleType:
    require_mitsuba()
    import drjit
    import mitsuba

    mitsuba.set_variant("scalar_rgb")
    drjit.set_thread_count(threads_used())
    # it reports how it rounds numbers of samples
    mitsuba.set_log_level(mitsuba.LogLevel.Error)
    return mitsuba


class Tracer:
    """Renderer of a world.

    Parameters
    ----------
    world : World
    rig : Rig
    lens : float
        Radius of the lens in metres; 0 for a pinhole. Disparity zero is in focus.
    lens_points : int
        Largest number of pinholes into which a lens is divided.

    Attributes
    ----------
    world, rig
        As given.
    surfaces : Surfaces
        All triangles of the world in one list.
    """

    def __init__(self, world: World, rig: Rig, lens: float = 0.0, lens_points: int = 32) -> None:
        self._mi = _mitsuba()
        self.world, self.rig, self._lens, self._lens_points = world, rig, lens, lens_points if lens else 1
        self.surfaces, light = Surfaces(world, rig), world.light
        parts: dict[str, Any] = {}
        # things with the same material share its textures
        surfaces = {id(thing.material): thing.material for thing in world.things}
        loaded = {key: self._mi.load_dict(self._surface(material)) for key, material in surfaces.items()}
        for number, thing in enumerate(world.things):
            parts[f"thing{number}"] = self._shape(thing, loaded[id(thing.material)])
        for number, lamp in enumerate(light.lamps):
            parts[f"lamp{number}"] = self._lamp(lamp)
        for number, sun in enumerate(light.suns):
            irradiance = {"type": "rgb", "value": list(sun.irradiance)}
            parts[f"sun{number}"] = {
                "type": "directional",
                "direction": np.asarray(sun.direction).tolist(),
                "irradiance": irradiance,
            }
        self._scene = self._mi.load_dict({"type": "scene", **parts, **self._sky(light)})

    def position(self, down: float, across: float, turn: Vector = (0.0, 0.0, 0.0)) -> Position:
        """The camera of the view ``(down, across)`` view steps from the centre."""
        return Position(across * self.rig.baseline, down * self.rig.baseline, turn)

    def picture(self, position: Position, seed: int, samples: int) -> FloatArray:
        """Linear picture of a view from ``samples`` paths per pixel, 1 is white; shape (H, W, 3), float32."""
        count, size = min(samples, self._lens_points), self.rig.size
        total = np.zeros((size, size, 3), np.float64)
        for number, (right, down) in enumerate(_in_disc(self._lens, count)):
            part = samples * (number + 1) // count - samples * number // count
            point = Position(position.right + right, position.down + down, position.turn)
            camera = self._side_by_side(point, np.zeros((1, 2), np.int64), size, part)
            total += part * self._seen(camera, size, part, seed + number)
        return (self.world.light.exposure / samples * total).astype(np.float32)

    def tiles(self, position: Position, pixels: Pixels, paths: int, seed: int) -> Tiles:
        """Cameras for square tiles of :meth:`picture`, given their pixels ``(N, T, T, 2)``."""
        corners, side = pixels[:, 0, 0], pixels.shape[1]
        # groups small enough for single precision to distinguish their rays
        groups = np.split(corners, range(max(4096 // side, 1), len(corners), max(4096 // side, 1)))
        return Tiles(pixels, paths, seed, [self._side_by_side(position, group, side, paths) for group in groups])

    def seen(self, tiles: Tiles) -> FloatArray:
        """Linear pictures of tiles, 1 is white; shape (N, T, T, 3)."""
        side = tiles.pixels.shape[1]
        found = [
            self._seen(cameras, side, tiles.paths, tiles.seed + number).reshape(side, -1, side, 3)
            for number, cameras in enumerate(tiles.cameras)
        ]
        return np.float32(self.world.light.exposure) * np.concatenate(found, axis=1).transpose(1, 0, 2, 3)

    def _side_by_side(self, position: Position, corners: npt.NDArray[np.int64], side: int, paths: int) -> Any:
        """Cameras of square tiles, side by side in one picture, given their first pixels ``(N, 2)``."""
        transform = self._mi.ScalarTransform4f
        turn = transform(np.vstack([np.c_[rotation(position.turn), np.zeros(3)], [0, 0, 0, 1]]))
        stand = transform().translate([position.right, position.down, 0.0])
        # one set of properties, changed for each camera: a dictionary for each would take three times as long
        camera, create = self._mi.Properties("perspective"), self._mi.PluginManager.instance().create_object
        camera["fov"] = float(2 * np.degrees(np.arctan(side / (2 * self.rig.focal_px))))
        camera["to_world"] = stand @ turn @ transform().look_at([0, 0, 0], [0, 0, 1], [0, -1, 0])
        camera["near_clip"], camera["far_clip"] = NEAR, 1000.0
        camera["film"] = self._mi.load_dict(_film(side, side))
        windows = {}
        # Mitsuba moves the window, not the picture
        offsets = (corners + side / 2 - self.rig.axis(position)) / side
        for number, (down, right) in enumerate(offsets.tolist()):
            camera["principal_point_offset_x"], camera["principal_point_offset_y"] = right, down
            windows[f"tile{number:04d}"] = create(camera)
        return self._mi.load_dict(
            {"type": "batch", **windows, "film": _film(len(corners) * side, side), "sampler": _sampler(paths)}
        )

    def _seen(self, camera: Any, side: int, samples: int, seed: int) -> FloatArray:
        paths = {"type": "path", "max_depth": self.world.paths.depth, "rr_depth": self.world.paths.roulette}
        integrator = self._mi.load_dict({**paths, "block_size": min(side, _BLOCK)})
        return np.array(
            self._mi.render(self._scene, sensor=camera, integrator=integrator, spp=samples, seed=seed % 2**32)
        )

    def _shape(self, thing: Thing, surface: Any) -> Any:
        """Mitsuba's shape of a thing."""
        mesh = thing.mesh
        properties = self._mi.Properties()
        properties["bsdf"] = surface
        properties["face_normals"] = not mesh.smooth
        shape = self._mi.Mesh(
            "thing",
            len(mesh.vertices),
            len(mesh.faces),
            props=properties,
            has_vertex_normals=mesh.smooth,
            has_vertex_texcoords=True,
        )
        values = self._mi.traverse(shape)
        values["vertex_positions"] = np.ravel(mesh.vertices)
        values["faces"] = np.ravel(mesh.faces)
        values["vertex_texcoords"] = np.ravel(mesh.uv / np.array(period(thing.material), np.float32))
        if mesh.smooth:
            values["vertex_normals"] = np.ravel(normals(mesh))
        values.update()
        return shape

    def _lamp(self, lamp: Lamp) -> dict[str, Any]:
        """Mitsuba's rectangle (-1 to 1 in x and y, shining towards z), moved to the lamp's corner and edges."""
        corner, across, down = (np.array(values, float) for values in (lamp.corner, lamp.across, lamp.down))
        facing = np.cross(across, down)
        columns = [across / 2, down / 2, facing / np.linalg.norm(facing), corner + across / 2 + down / 2]
        matrix = np.vstack([np.stack(columns, axis=1), [0, 0, 0, 1]])
        radiance = {"type": "rgb", "value": list(lamp.radiance)}
        return {
            "type": "rectangle",
            "to_world": self._mi.ScalarTransform4f(matrix),
            "emitter": {"type": "area", "radiance": radiance},
        }

    def _surface(self, material: Material) -> dict[str, Any]:
        """Mitsuba's description of a material."""
        if material.kind == "glass":
            return {"type": "thindielectric" if material.pane else "dielectric", "int_ior": 1.5}
        rough = {"alpha": material.roughness} if material.roughness else {}
        if material.kind == "mirror":
            inner: dict[str, Any] = {"type": "roughconductor" if rough else "conductor", "material": material.metal}
        elif material.kind == "glossy":
            inner = {"type": "roughplastic" if rough else "plastic", "diffuse_reflectance": self._texture(material)}
            # a coat darkens and saturates the colour below
            inner["nonlinear"] = False
        else:
            inner = {"type": "diffuse", "reflectance": self._texture(material)}
        return {"type": "twosided", "inner": {**inner, **rough}}

    def _texture(self, material: Material) -> dict[str, Any]:
        if not isinstance(material.pattern, Pattern):
            return {"type": "rgb", "value": srgb_decoded(np.array(material.pattern)).tolist()}
        raster = self._mi.Bitmap(self.surfaces.linear(material.pattern))
        # without interpolation, for a fifth of the time: pixels are at least texels, and paths spread over them
        return {"type": "bitmap", "bitmap": raster, "raw": True, "format": "fp16", "filter_type": "nearest"}

    def _sky(self, light: Light) -> dict[str, Any]:
        # each path samples one light at a time, and a sun contributes more than the sky
        asked = {"sampling_weight": _SKY_BESIDE_SUN if light.suns else 1.0}
        if not isinstance(light.sky, np.ndarray):
            radiance = {"type": "rgb", "value": list(light.sky)}
            return {"sky": {"type": "constant", "radiance": radiance, **asked}} if any(light.sky) else {}
        # Mitsuba's panoramas have y up
        upright = self._mi.ScalarTransform4f().rotate([0, 0, 1], 180.0)
        bitmap = self._mi.Bitmap(light.sky.astype(np.float32))
        return {"sky": {"type": "envmap", "bitmap": bitmap, "to_world": upright, **asked}}


def _film(width: int, height: int) -> dict[str, Any]:
    values = {"width": width, "height": height, "rfilter": {"type": "box"}}
    return {"type": "hdrfilm", "pixel_format": "rgb", "component_format": "float32", **values}


def _sampler(samples: int) -> dict[str, Any]:
    """Sampler; few samples are independent, since an even spread repeats visibly from pixel to pixel."""
    spread = "stratified" if samples == 4 ** round(math.log(samples, 4)) else "multijitter"
    return {"type": spread if samples >= SPREAD else "independent", "sample_count": samples}


def _in_disc(radius: float, count: int) -> npt.NDArray[np.float64]:
    """Points spread evenly over a disc; only its middle without a radius; shape (N, 2)."""
    angle = np.arange(count) * _GOLDEN_ANGLE
    distance = radius * np.sqrt((np.arange(count) + 0.5) / count)
    return np.stack([distance * np.cos(angle), distance * np.sin(angle)], axis=1)
