"""Pictures of a world by Mitsuba 3, one view at a time, and the first surfaces of their pixels.

Mitsuba's variant ``scalar_rgb`` needs only the wheel. The sampler is seeded by view and block, blocks have one size,
and a box filter keeps pixels separate, so results are the same in each run and for any number of threads.
"""

import importlib.util
import math
from collections.abc import Callable
from types import ModuleType
from typing import Any

import numpy as np
import numpy.typing as npt

from sepi.errors import SepiError
from sepi.extensions.rendered.patterns import srgb_decoded
from sepi.extensions.rendered.shapes import normals, rotation
from sepi.extensions.rendered.surfaces import NEAR, Surfaces, period
from sepi.extensions.rendered.world import FloatArray, Lamp, Material, Pattern, Position, Rig, Thing, Vector, World
from sepi.process.threads import threads_used

# side of Mitsuba's blocks; by default, it depends on the number of threads, and so would the seeds
_BLOCK = 16
# least number of samples of a pixel for which an even spread pays
SPREAD = 9
# samples of the sky for each of a sun; reduces noise in pixels with several surfaces by a sixth
_SKY_BESIDE_SUN = 0.3
# largest number of pinholes into which a lens is divided
_LENS_POINTS = 32
# Vogel's spiral: points that fill a disc evenly
_GOLDEN_ANGLE = np.pi * (3 - np.sqrt(5))


Pixels = npt.NDArray[np.int64]


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

    Attributes
    ----------
    world, rig
        As given.
    surfaces : Surfaces
        All triangles of the world in one list.
    """

    def __init__(self, world: World, rig: Rig, lens: float = 0.0) -> None:
        self._mi = _mitsuba()
        self.world, self.rig, self._lens = world, rig, lens
        self.surfaces = Surfaces(world, rig)
        # things with the same material share its textures
        surfaces = {id(thing.material): thing.material for thing in world.things}
        loaded = {key: self._mi.load_dict(self._surface(material)) for key, material in surfaces.items()}
        things = [self._shape(thing, loaded[id(thing.material)]) for thing in world.things]
        parts = {f"thing{number}": thing for number, thing in enumerate(things)}
        parts |= {f"lamp{number}": self._lamp(lamp) for number, lamp in enumerate(world.light.lamps)}
        for number, sun in enumerate(world.light.suns):
            direction = np.asarray(sun.direction).tolist()
            parts[f"sun{number}"] = {"type": "directional", "direction": direction, "irradiance": _rgb(sun.irradiance)}
        self._scene = self._mi.load_dict({"type": "scene", **parts, **self._sky()})

    def position(self, down: float, across: float, turn: Vector = (0.0, 0.0, 0.0)) -> Position:
        """The camera of the view ``(down, across)`` view steps from the centre."""
        return Position(across * self.rig.baseline, down * self.rig.baseline, turn)

    def picture(self, position: Position, seed: int, samples: int) -> FloatArray:
        """Linear picture of a view from ``samples`` paths per pixel, 1 is white; shape (H, W, 3), float32."""
        count, size = min(samples, _LENS_POINTS if self._lens else 1), self.rig.size
        total = np.zeros((size, size, 3), np.float64)
        # points spread evenly over the lens
        angle, radius = np.arange(count) * _GOLDEN_ANGLE, self._lens * np.sqrt((np.arange(count) + 0.5) / count)
        for number, (right, down) in enumerate(zip(radius * np.cos(angle), radius * np.sin(angle), strict=True)):
            part = samples * (number + 1) // count - samples * number // count
            point = Position(position.right + right, position.down + down, position.turn)
            camera = self._side_by_side(point, np.zeros((1, 2), np.int64), size, part)
            total += part * self._seen(camera, size, part, seed + number)
        return (self.world.light.exposure / samples * total).astype(np.float32)

    def tiles(self, position: Position, pixels: Pixels, paths: int, seed: int) -> Callable[[], FloatArray]:
        """Prepare pictures of square tiles, given their pixels ``(N, T, T, 2)``.

        They are linear, 1 is white, of shape (N, T, T, 3); ``seed`` is the first of several in a row.
        """
        corners, side = pixels[:, 0, 0], pixels.shape[1]
        # groups small enough for single precision to distinguish their rays
        groups = np.split(corners, range(max(4096 // side, 1), len(corners), max(4096 // side, 1)))
        cameras = [self._side_by_side(position, group, side, paths) for group in groups]

        def pictures() -> FloatArray:
            found = [self._seen(camera, side, paths, seed + number) for number, camera in enumerate(cameras)]
            apart = np.concatenate([picture.reshape(side, -1, side, 3) for picture in found], axis=1)
            return np.float32(self.world.light.exposure) * apart.transpose(1, 0, 2, 3)

        return pictures

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
        film = _film(len(corners) * side, side)
        return self._mi.load_dict({"type": "batch", **windows, "film": film, "sampler": _sampler(paths)})

    def _seen(self, camera: Any, side: int, samples: int, seed: int) -> FloatArray:
        paths = {"type": "path", "max_depth": self.world.light.depth, "rr_depth": self.world.light.roulette}
        integrator = self._mi.load_dict({**paths, "block_size": min(side, _BLOCK)})
        seen = self._mi.render(self._scene, sensor=camera, integrator=integrator, spp=samples, seed=seed % 2**32)
        return np.array(seen)

    def _shape(self, thing: Thing, surface: Any) -> Any:
        """Mitsuba's shape of a thing."""
        mesh, properties = thing.mesh, self._mi.Properties()
        properties["bsdf"], properties["face_normals"] = surface, not mesh.smooth
        layers = {"has_vertex_normals": mesh.smooth, "has_vertex_texcoords": True}
        shape = self._mi.Mesh("thing", len(mesh.vertices), len(mesh.faces), props=properties, **layers)
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
        corner, across, down = (np.asarray(values, float) for values in (lamp.corner, lamp.across, lamp.down))
        facing, matrix = np.cross(across, down), np.eye(4)
        columns = [across / 2, down / 2, facing / np.linalg.norm(facing), corner + across / 2 + down / 2]
        matrix[:3] = np.stack(columns, axis=1)
        emitter = {"type": "area", "radiance": _rgb(lamp.radiance)}
        return {"type": "rectangle", "to_world": self._mi.ScalarTransform4f(matrix), "emitter": emitter}

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
            return _rgb(srgb_decoded(np.array(material.pattern)))
        raster = self._mi.Bitmap(srgb_decoded(material.pattern.raster))
        # without interpolation, for a fifth of the time: pixels are at least texels, and paths spread over them
        return {"type": "bitmap", "bitmap": raster, "raw": True, "format": "fp16", "filter_type": "nearest"}

    def _sky(self) -> dict[str, Any]:
        sky = self.world.light.sky
        # each path samples one light at a time, and a sun contributes more than the sky
        asked = {"sampling_weight": _SKY_BESIDE_SUN if self.world.light.suns else 1.0}
        if np.ndim(sky) == 1:
            return {"sky": {"type": "constant", "radiance": _rgb(sky), **asked}} if np.any(sky) else {}
        # Mitsuba's panoramas have y up
        upright = self._mi.ScalarTransform4f().rotate([0, 0, 1], 180.0)
        bitmap = self._mi.Bitmap(np.asarray(sky, np.float32))
        return {"sky": {"type": "envmap", "bitmap": bitmap, "to_world": upright, **asked}}


def _rgb(values: npt.ArrayLike) -> dict[str, Any]:
    return {"type": "rgb", "value": np.asarray(values, float).tolist()}


def _film(width: int, height: int) -> dict[str, Any]:
    values = {"width": width, "height": height, "rfilter": {"type": "box"}}
    return {"type": "hdrfilm", "pixel_format": "rgb", "component_format": "float32", **values}


def _sampler(samples: int) -> dict[str, Any]:
    """Sampler; few samples are independent, since an even spread repeats visibly from pixel to pixel."""
    spread = "stratified" if samples == 4 ** round(math.log(samples, 4)) else "multijitter"
    return {"type": spread if samples >= SPREAD else "independent", "sample_count": samples}
