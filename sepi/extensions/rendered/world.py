"""Contents of a path-traced scene: meshes with materials, light, depths, and its cameras.

Lengths are in metres. The reference camera stands at the origin and looks along ``z``; ``x`` points right, ``y`` down.
Colours are sRGB, 0..1. Cameras stand on a grid with spacing ``b``, sheared so that points at the focus distance ``F``
have disparity zero, as in the HCI 4D benchmark. With the focal length ``f`` in pixels, depth ``Z`` has disparity
``d = b f (1 / Z - 1 / F)``.
"""

from collections.abc import Iterator, Sequence
from typing import Annotated, Literal, NamedTuple

import numpy as np
import numpy.typing as npt
from pydantic import Field

Share = Annotated[float, Field(ge=0, allow_inf_nan=False)]
FloatArray = npt.NDArray[np.float32]
Vector = Sequence[float] | npt.NDArray[np.float64]
"""Three numbers: a place, a direction, or a colour."""


class Mesh(NamedTuple):
    """Triangles.

    Attributes
    ----------
    vertices : ndarray, shape (N, 3), float32
        In metres.
    faces : ndarray, shape (M, 3), uint32
        Vertices of each triangle.
    uv : ndarray, shape (N, 2), float32
        Coordinates of each vertex on its pattern, in metres along the surface: across, down.
    smooth : bool
        Whether the mesh reflects light like a curved surface.
    """

    vertices: FloatArray
    faces: npt.NDArray[np.uint32]
    uv: FloatArray
    smooth: bool = False


class Pattern(NamedTuple):
    """Colours painted on a surface; the pattern repeats.

    Attributes
    ----------
    raster : ndarray, shape (H, W, 3), float32
        Colours.
    size : (float, float)
        Width and height, metres.
    """

    raster: FloatArray
    size: tuple[float, float] = (1.0, 1.0)


class Material(NamedTuple):
    """Material of a surface.

    Attributes
    ----------
    pattern : Pattern or (float, float, float)
        Colours, or one colour; glass and metal ignore it.
    kind : {"matte", "glossy", "mirror", "glass"}
        Glossy: a coat, such as lacquer, over a coloured ground. Mirror: bare metal.
    roughness : float
        For glossy surfaces and mirrors: 0 reflects like a pane, 0.3 like satin.
    metal : {"Ag", "Al", "Au", "Cr", "Cu"}
        For mirrors.
    pane : bool
        For glass: whether the mesh is a thin pane, not the surface of a solid body.
    """

    pattern: Pattern | Vector = (0.8, 0.8, 0.8)
    kind: Literal["matte", "glossy", "mirror", "glass"] = "matte"
    roughness: float = 0.0
    metal: Literal["Ag", "Al", "Au", "Cr", "Cu"] = "Al"
    pane: bool = False


class Thing(NamedTuple):
    """A mesh of one material.

    Attributes
    ----------
    mesh : Mesh
    material : Material
    thin : bool
        Whether it counts as thin: wires, sticks, twigs.
    """

    mesh: Mesh
    material: Material
    thin: bool = False


Things = Iterator[Thing]


class Lamp(NamedTuple):
    """A rectangle that shines to the side from which ``across``, then ``down``, turn clockwise.

    Attributes
    ----------
    corner, across, down : (float, float, float)
        One corner, and the two edges that leave it, in metres.
    radiance : (float, float, float)
        Linear; 1 is the radiance of a white sheet under a sky of radiance 1.
    """

    corner: Vector
    across: Vector
    down: Vector
    radiance: Vector


class Sun(NamedTuple):
    """Light from very far away.

    Attributes
    ----------
    direction : (float, float, float)
        Direction in which the light travels.
    irradiance : (float, float, float)
        Linear irradiance of a surface that faces the sun.
    """

    direction: Vector
    irradiance: Vector


class Cameras(NamedTuple):
    """What the cameras see of a scene.

    Attributes
    ----------
    near, far : float
        Depths with the disparities ``at_near`` and ``at_far``, metres.
    at_near, at_far : float
        Pixels per view step, for any size of the pictures.
    field_of_view : float
        Degrees from the left to the right border.
    """

    near: float
    far: float
    at_near: float
    at_far: float
    field_of_view: float = 40.0


class Light(NamedTuple):
    """Light of a scene, and its paths.

    Attributes
    ----------
    sky : (float, float, float) or ndarray, shape (H, W, 3), float32
        Radiance of all around, linear: one for all directions, or a panorama (its middle column in direction ``z``,
        its first row above).
    lamps, suns : sequence
        Further light.
    exposure : float
        Factor from radiance to pictures, in which 1 is white.
    share : float
        Light relative to other scenes; less light has more noise.
    depth : int
        Largest number of reflections and refractions.
    roulette : int
        Number of these after which Russian roulette may end a path.
    gloss : float
        Paths of a glossy pixel as a share of the samples, if these are many. Longer paths reduce noise, so fewer of
        them give no more noise (mean difference of two renderings) than all paths with ``roulette`` 2.
    """

    sky: Vector | FloatArray = (0.0, 0.0, 0.0)
    lamps: Sequence[Lamp] = ()
    suns: Sequence[Sun] = ()
    exposure: float = 1.0
    share: float = 1.0
    depth: int = 6
    roulette: int = 2
    gloss: float = 1.0


class World(NamedTuple):
    """A scene.

    Attributes
    ----------
    things : sequence of Thing
        They must fill the pictures, since a ray that meets nothing has no disparity.
    cameras : Cameras
    light : Light
    """

    things: Sequence[Thing]
    cameras: Cameras
    light: Light


SENSOR_MM = 35.0


class Position(NamedTuple):
    """Pose of a view relative to the reference camera.

    Attributes
    ----------
    right, down : float
        Position, metres.
    turn : (float, float, float)
        Rotation about ``x``, ``y`` and ``z``, radians.
    """

    right: float
    down: float
    turn: Vector = (0.0, 0.0, 0.0)


class Rig:
    """Cameras for which a scene's near and far depths have its disparities, times ``share``.

    Parameters
    ----------
    world : World
    size : int
        Height and width of a view in pixels.
    grid : (int, int)
        Rows and columns of views.
    share : float

    Attributes
    ----------
    size, grid
        As given.
    focal_px : float
        Focal length in pixels.
    baseline : float
        Metres from one view to the next.
    focus : float
        Focus distance, metres.
    settings : dict of str to float
        Values for the benchmark's ``parameters.cfg``.
    """

    def __init__(self, world: World, size: int, grid: tuple[int, int], share: float = 1.0) -> None:
        self.size, self.grid, seen = size, grid, world.cameras
        self.focal_px = float(size / (2 * np.tan(np.radians(seen.field_of_view) / 2)))
        step = (seen.at_near - seen.at_far) / (self.focal_px * (1 / seen.near - 1 / seen.far))
        self.baseline = float(share * step)
        self.focus = float(1 / (1 / seen.near - seen.at_near / (step * self.focal_px)))
        self.settings = {
            "focal_length_mm": self.focal_px / size * SENSOR_MM,
            "baseline_mm": 1000 * self.baseline,
            "focus_distance_m": self.focus,
            "sensor_size_mm": SENSOR_MM,
        }

    def axis(self, position: Position) -> tuple[float, float]:
        """Row and column of a camera's axis in its picture, which is shifted to converge at the focus distance."""
        shear = self.focal_px / (self.focus * self.size)
        return (0.5 + position.down * shear) * self.size, (0.5 + position.right * shear) * self.size

    def disparity(self, depth: npt.NDArray[np.float64]) -> npt.NDArray[np.float64]:
        """Disparity in pixels per view step of depths along the viewing direction in metres."""
        return self.baseline * self.focal_px * (1 / depth - 1 / self.focus)
