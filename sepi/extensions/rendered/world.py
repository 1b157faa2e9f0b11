"""Contents of a path-traced scene: meshes with materials, light, and depths.

Lengths are in metres. The reference camera stands at the origin and looks along ``z``; ``x`` points right, ``y`` down.
Colours are sRGB, 0..1.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
import numpy.typing as npt

FloatArray = npt.NDArray[np.float32]
Vector = tuple[float, float, float]
Kind = Literal["matte", "glossy", "mirror", "glass"]
Metal = Literal["Ag", "Al", "Au", "Cr", "Cu"]


@dataclass(frozen=True)
class Mesh:
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


@dataclass(frozen=True)
class Pattern:
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


@dataclass(frozen=True)
class Material:
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
    kind: Kind = "matte"
    roughness: float = 0.0
    metal: Metal = "Al"
    pane: bool = False


@dataclass(frozen=True)
class Thing:
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


@dataclass(frozen=True)
class Lamp:
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


@dataclass(frozen=True)
class Sun:
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


@dataclass(frozen=True)
class World:
    """A scene.

    Attributes
    ----------
    things : sequence of Thing
        They must fill the pictures, since a ray that meets nothing has no disparity.
    near, far : float
        Depths with the disparities ``at_near`` and ``at_far``, metres.
    at_near, at_far : float
        Pixels per view step, for any size of the pictures.
    sky : (float, float, float) or ndarray, shape (H, W, 3), float32
        Radiance of all around, linear: one for all directions, or a panorama (its middle column in direction ``z``,
        its first row above).
    lamps, suns : sequence
        Further light.
    exposure : float
        Factor from radiance to pictures, in which 1 is white.
    field_of_view : float
        Degrees from the left to the right border.
    light : float
        Light of the scene relative to other scenes; less light has more noise.
    depth : int
        Largest number of reflections and refractions.
    roulette : int
        Number of these after which Russian roulette may end a path.
    paths : float
        Paths of a glossy pixel as a share of the samples, if these are many. Longer paths reduce noise, so fewer of
        them give no more noise (mean difference of two renderings) than all paths with ``roulette`` 2.
    """

    things: Sequence[Thing]
    near: float
    far: float
    at_near: float
    at_far: float
    sky: Vector | FloatArray = (0.0, 0.0, 0.0)
    lamps: Sequence[Lamp] = ()
    suns: Sequence[Sun] = ()
    exposure: float = 1.0
    field_of_view: float = 40.0
    light: float = 1.0
    depth: int = 8
    roulette: int = 2
    paths: float = 1.0
