"""What a path-traced scene consists of: meshes with materials, light, and how far things are away.

Lengths are in metres. The reference camera stands in the origin and looks along ``z``; ``x`` points right, ``y`` down.
Colours are as on a screen (sRGB, 0..1).
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
        Where each vertex lies on its pattern, in metres along the surface: across, down.
    smooth : bool
        Whether light is reflected as by the curved surface that the triangles stand for.
    """

    vertices: FloatArray
    faces: npt.NDArray[np.uint32]
    uv: FloatArray
    smooth: bool = False


@dataclass(frozen=True)
class Pattern:
    """What is painted on a surface; it repeats.

    Attributes
    ----------
    raster : ndarray, shape (H, W, 3), float32
        Colours.
    size : (float, float)
        Metres that it is wide and high.
    """

    raster: FloatArray
    size: tuple[float, float] = (1.0, 1.0)


@dataclass(frozen=True)
class Material:
    """How a surface reflects light.

    Attributes
    ----------
    pattern : Pattern or (float, float, float)
        Its colours, or its colour; of glass and metal none is asked for.
    kind : {"matte", "glossy", "mirror", "glass"}
        Glossy: a coat, such as lacquer, over a coloured ground. Mirror: bare metal.
    roughness : float
        Of a glossy surface or a mirror: 0 reflects like a pane, 0.3 like satin.
    metal : {"Ag", "Al", "Au", "Cr", "Cu"}
        Of a mirror.
    pane : bool
        Of glass: whether the mesh is a thin pane, or the surface of a solid body.
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
    """A rectangle that shines to one side: that from which ``across``, then ``down``, turn clockwise.

    Attributes
    ----------
    corner, across, down : (float, float, float)
        One corner, and the two edges that leave it, in metres.
    radiance : (float, float, float)
        Linear; 1 is what a white sheet sends out that a sky of radiance 1 lights.
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
        In which it travels.
    irradiance : (float, float, float)
        Linear, on a surface that faces it.
    """

    direction: Vector
    irradiance: Vector


@dataclass(frozen=True)
class World:
    """A scene.

    Attributes
    ----------
    things : sequence of Thing
        They must fill the pictures: where a ray meets nothing there is no disparity.
    near, far : float
        Depths, in metres, that have the disparities ``at_near`` and ``at_far``.
    at_near, at_far : float
        Pixels per view step, whatever the pictures' size.
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
        Light that the cameras get, as part of what they get in the other scenes: as much weaker it stands out of noise.
    depth : int
        How often light is reflected or refracted, at most.
    roulette : int
        From which of these on paths of light end by Russian roulette.
    paths : float
        Those of a pixel of gloss, as part of the samples asked for, where these are many: where paths that end later
        bring more, as many as have no more noise, by two renderings' mean distance, than all of those that may end at
        the second.
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
