"""Pictures and first surfaces of a world by Mitsuba 3, one view at a time.

Variant ``scalar_rgb`` needs nothing beside the wheel. It seeds the sampler by view and block, and a box filter keeps
each pixel to its own block: the same bytes from run to run, for any number of threads.
"""

from __future__ import annotations

import importlib.util
from dataclasses import dataclass
from types import ModuleType
from typing import Any

import numpy as np
import numpy.typing as npt

from sepi.errors import SepiError
from sepi.rendered.rig import Rig
from sepi.rendered.shapes import normals
from sepi.rendered.world import FloatArray, Lamp, Material, Mesh, Pattern, Vector, World
from sepi.threads import threads_used

# metres at which rays begin; far less would cost digits of their directions
_NEAR = 0.1
# Vogel's spiral: points that fill a disc evenly
_GOLDEN_ANGLE = np.pi * (3 - np.sqrt(5))


@dataclass(frozen=True)
class Position:
    """Where a view is taken, from the reference camera, and how it is turned.

    Attributes
    ----------
    right, down : float
        Metres.
    shear_right, shear_down : float
        By how much the picture is shifted to converge at the focus distance, as parts of its width.
    turn : (float, float, float)
        Radians about ``x``, ``y`` and ``z``.
    """

    right: float
    down: float
    shear_right: float
    shear_down: float
    turn: Vector = (0.0, 0.0, 0.0)


@dataclass(frozen=True)
class FirstSurface:
    """What the rays through the middles of a view's pixels meet first.

    Attributes
    ----------
    depth : ndarray, shape (H, W), float64
        Metres along the viewing direction; infinite where there is nothing.
    normal : ndarray, shape (H, W, 3), float32
        Of the triangles, towards the camera: right, down, away.
    uv : ndarray, shape (H, W, 2), float32
        Where on its pattern, in periods.
    thing : ndarray, shape (H, W), int64
        Which of the world's things; -1 where there is none.
    """

    depth: npt.NDArray[np.float64]
    normal: FloatArray
    uv: FloatArray
    thing: npt.NDArray[np.int64]


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
    # it says what it makes of odd numbers of samples
    mitsuba.set_log_level(mitsuba.LogLevel.Error)
    return mitsuba


class Tracer:
    """A world, ready to be looked at.

    Parameters
    ----------
    world : World
    rig : Rig
    samples : int
        Of each pixel.
    lens : float
        Radius of the lens in metres; 0 for a pinhole. It is in focus where the disparity is zero.
    lens_points : int
        Into so many pinholes, at most, a lens is divided.
    """

    def __init__(self, world: World, rig: Rig, samples: int, lens: float = 0.0, lens_points: int = 32) -> None:
        self._mi = _mitsuba()
        self._world, self._rig, self._samples = world, rig, samples
        self._exposure = world.exposure
        self._paintings: list[Any] = []
        count = min(samples, lens_points) if lens else 1
        distance = lens * np.sqrt((np.arange(count) + 0.5) / count) if lens else np.zeros(1)
        angle = np.arange(count) * _GOLDEN_ANGLE
        self._lens = np.stack([distance * np.cos(angle), distance * np.sin(angle)], axis=1)
        parts: dict[str, Any] = {}
        # things that share a material share its pictures
        surfaces = {id(thing.material): thing.material for thing in world.things}
        loaded = {key: self._mi.load_dict(self._surface(material)) for key, material in surfaces.items()}
        for number, thing in enumerate(world.things):
            parts[f"thing{number}"] = self._shape(thing.mesh, thing.material, {"bsdf": loaded[id(thing.material)]})
        for number, lamp in enumerate(world.lamps):
            parts[f"lamp{number}"] = self._lamp(lamp)
        for number, sun in enumerate(world.suns):
            light = {"type": "rgb", "value": list(sun.irradiance)}
            parts[f"sun{number}"] = {"type": "directional", "direction": list(sun.direction), "irradiance": light}
        # paths end by chance from the second surface on: most of the time goes into light that hardly counts
        integrator = {"type": "path", "max_depth": world.depth, "rr_depth": 2}
        self._scene = self._mi.load_dict({"type": "scene", **parts, **self._sky(world.sky), "integrator": integrator})
        # Mitsuba counts shapes in its own order, from 1
        names = [shape.id() for shape in self._scene.shapes()]
        self._things = np.array([-1, *(int(name[5:]) if name.startswith("thing") else -1 for name in names)])

    def position(self, down: float, across: float, turn: Vector = (0.0, 0.0, 0.0)) -> Position:
        """The camera of the view ``(down, across)`` view steps from the centre."""
        step = self._rig.baseline
        return self._at(across * step, down * step, turn)

    def _at(self, right: float, down: float, turn: Vector) -> Position:
        shear = self._rig.focal_px / (self._rig.focus * self._rig.size)
        return Position(right, down, right * shear, down * shear, turn)

    def picture(self, position: Position, seed: int) -> FloatArray:
        """Radiance times exposure, ``(H, W, 3)`` float32, linear: 1 is white."""
        return self._exposure * self._seen(self._scene, position, seed)

    def paint(self, position: Position, seed: int) -> FloatArray:
        """What is painted on matte surfaces, ``(H, W, 3)`` float32, linear, by the rays of the picture of that seed."""
        if not self._paintings:
            self._paintings = [self._painted(self._world, side) for side in (1, -1)]
        front, back = (self._seen(scene, position, seed) for scene in self._paintings)
        return front + back

    def _seen(self, scene: Any, position: Position, seed: int) -> FloatArray:
        """Mean radiance of the rays through each pixel."""
        count = len(self._lens)
        total = np.zeros((self._rig.size, self._rig.size, 3), np.float64)
        for number, (right, down) in enumerate(self._lens):
            samples = self._samples * (number + 1) // count - self._samples * number // count
            point = self._at(position.right + right, position.down + down, position.turn)
            sensor = self._sensor(point, samples)
            seen = self._mi.render(scene, sensor=sensor, spp=samples, seed=seed * count + number)
            total += samples * np.asarray(seen, np.float64)
        return (total / self._samples).astype(np.float32)

    def first_surface(self, position: Position) -> FirstSurface:
        """What one ray through the middle of each pixel meets."""
        integrator = self._mi.load_dict({"type": "aov", "aovs": "z:depth,n:geo_normal,uv:uv,i:shape_index"})
        seen = np.array(self._mi.render(self._scene, sensor=self._sensor(position, 1), integrator=integrator, spp=1))
        distance, normal = seen[..., 0].astype(np.float64), seen[..., 1:4]
        directions = self._directions(position)
        hit = distance > 0
        towards = np.sum(normal * directions, axis=-1, keepdims=True) > 0
        return FirstSurface(
            depth=np.where(hit, distance * directions[..., 2] + _NEAR, np.inf),
            normal=np.where(towards, -normal, normal).astype(np.float32),
            uv=seen[..., 4:6].astype(np.float32),
            thing=self._things[np.where(hit, seen[..., 6], 0).astype(np.int64)],
        )

    def _sensor(self, position: Position, samples: int) -> Any:
        """Samples are spread over a pixel; a single one is its middle."""
        transform = self._mi.ScalarTransform4f
        turn = transform()
        for axis, angle in zip(np.eye(3), position.turn, strict=True):
            turn = transform().rotate(axis.tolist(), float(np.degrees(angle))) @ turn
        stand = transform().translate([position.right, position.down, 0.0])
        film = {"width": self._rig.size, "height": self._rig.size, "rfilter": {"type": "box"}}
        return self._mi.load_dict(
            {
                "type": "perspective",
                "fov": float(2 * np.degrees(np.arctan(self._rig.size / (2 * self._rig.focal_px)))),
                "to_world": stand @ turn @ transform().look_at([0, 0, 0], [0, 0, 1], [0, -1, 0]),
                "near_clip": _NEAR,
                "far_clip": 1000.0,
                # Mitsuba moves the window, not the picture
                "principal_point_offset_x": -position.shear_right,
                "principal_point_offset_y": -position.shear_down,
                "film": {"type": "hdrfilm", "pixel_format": "rgb", "component_format": "float32", **film},
                "sampler": (
                    {"type": "multijitter", "sample_count": samples}
                    if samples > 1
                    else {"type": "stratified", "sample_count": 1, "jitter": False}
                ),
            }
        )

    def _directions(self, position: Position) -> npt.NDArray[np.float64]:
        """Of the rays through the middles of the pixels, in the camera's own frame but for its turn; length 1."""
        middles = np.arange(self._rig.size) + 0.5 - self._rig.size / 2
        right = (middles - position.shear_right * self._rig.size) / self._rig.focal_px
        down = (middles - position.shear_down * self._rig.size) / self._rig.focal_px
        x, y = np.broadcast_arrays(right[None, :], down[:, None])
        found = np.stack([x, y, np.ones_like(x)], axis=-1)
        found /= np.linalg.norm(found, axis=-1, keepdims=True)
        return found

    def _shape(self, mesh: Mesh, material: Material, parts: dict[str, Any], side: int = 1) -> Any:
        """A mesh with its surface, and light of its own if it has any; of side -1 it is turned inside out."""
        properties = self._mi.Properties()
        for name, part in parts.items():
            properties[name] = part
        properties["face_normals"] = not mesh.smooth
        shape = self._mi.Mesh(
            "thing",
            len(mesh.vertices),
            len(mesh.faces),
            props=properties,
            has_vertex_normals=mesh.smooth,
            has_vertex_texcoords=True,
        )
        size = material.pattern.size if isinstance(material.pattern, Pattern) else (1.0, 1.0)
        values = self._mi.traverse(shape)
        values["vertex_positions"] = np.ravel(mesh.vertices)
        values["faces"] = np.ravel(mesh.faces[:, ::side])
        values["vertex_texcoords"] = np.ravel(mesh.uv / np.array(size, np.float32))
        if mesh.smooth:
            values["vertex_normals"] = np.ravel(side * normals(mesh))
        values.update()
        return shape

    def _painted(self, world: World, side: int) -> Any:
        """The world with matte surfaces that shine by what is painted on them, to one side, and all else black."""
        black = self._mi.load_dict({"type": "diffuse", "reflectance": {"type": "rgb", "value": 0.0}})
        parts: dict[str, Any] = {}
        for number, thing in enumerate(world.things):
            shining: dict[str, Any] = {"bsdf": black}
            if thing.material.kind == "matte":
                texture = self._texture(thing.material)
                shining["emitter"] = self._mi.load_dict({"type": "area", "radiance": texture})
            parts[f"thing{number}"] = self._shape(thing.mesh, thing.material, shining, side)
        return self._mi.load_dict({"type": "scene", **parts, "integrator": {"type": "path", "max_depth": 1}})

    def _lamp(self, lamp: Lamp) -> dict[str, Any]:
        """Mitsuba's square from -1 to 1 in x and y, which shines towards z, laid on the lamp's corner and edges."""
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
        """Mitsuba's name for a material."""
        if material.kind == "glass":
            return {"type": "thindielectric" if material.pane else "dielectric", "int_ior": 1.5}
        rough = {"alpha": material.roughness} if material.roughness else {}
        if material.kind == "mirror":
            inner: dict[str, Any] = {"type": "roughconductor" if rough else "conductor", "material": material.metal}
        elif material.kind == "glossy":
            inner = {"type": "roughplastic" if rough else "plastic", "diffuse_reflectance": self._texture(material)}
            # a coat darkens and saturates what is under it
            inner["nonlinear"] = False
        else:
            inner = {"type": "diffuse", "reflectance": self._texture(material)}
        return {"type": "twosided", "inner": {**inner, **rough}}

    def _texture(self, material: Material) -> dict[str, Any]:
        if not isinstance(material.pattern, Pattern):
            return {"type": "rgb", "value": _linear(np.array(material.pattern)).tolist()}
        raster = _linear(material.pattern.raster)
        return {"type": "bitmap", "bitmap": self._mi.Bitmap(raster), "raw": True, "wrap_mode": "repeat"}

    def _sky(self, sky: Vector | FloatArray) -> dict[str, Any]:
        if not isinstance(sky, np.ndarray):
            return {"sky": {"type": "constant", "radiance": {"type": "rgb", "value": list(sky)}}} if any(sky) else {}
        transform = self._mi.ScalarTransform4f
        # Mitsuba's panoramas have y above
        upright = transform().rotate([0, 0, 1], 180.0)
        return {"sky": {"type": "envmap", "bitmap": self._mi.Bitmap(sky.astype(np.float32)), "to_world": upright}}


def coded(values: FloatArray) -> FloatArray:
    """Values as on a screen (sRGB) of linear ones, both 0..1."""
    found: FloatArray = np.where(
        values <= 0.0031308, 12.92 * values, 1.055 * np.maximum(values, 1e-9) ** (1 / 2.4) - 0.055
    )
    return found


def _linear(values: npt.NDArray[Any]) -> npt.NDArray[Any]:
    """Linear values of those on a screen, both 0..1."""
    found: npt.NDArray[Any] = np.where(values <= 0.04045, values / 12.92, ((values + 0.055) / 1.055) ** 2.4)
    return found
