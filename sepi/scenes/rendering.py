"""Exact rendering of planar surfaces into the views of a light field.

A plane of disparity ``d(x, y) = a + b x + c y`` in the centre view is seen in the view ``(v, u)`` steps away at
``(x', y') = (x - u d, y - v d)``. Solved for the disparity, ``d = (a + b x' + c y') / (1 - b u - c v)``: it is a plane
there, too, and a polygon stays a polygon. So each view is drawn by filling polygons along sub-pixel rows, the largest
disparity wins, and the texture is looked up at ``(x' + u d, y' + v d)``; nothing is resampled from another view.
The compiled loops are in :mod:`sepi.scenes.rendering_kernels`.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from sepi.lightfield import BoolMap, FloatMap
from sepi.scenes.surfaces import Surface

# Sub-samples per pixel and direction.
SAMPLES = 4
# A plane closer than this to edge-on counts as seen from its edge.
EDGE_ON = 1e-9

FloatArray = npt.NDArray[np.float64]
IntArray = npt.NDArray[np.int64]


class Drawing(NamedTuple):
    """Surfaces as flat arrays in pixels of the centre view, for the compiled kernels.

    Attributes
    ----------
    edges : ndarray, shape (E, 4), float64
        Polygon edges ``x0, y0, x1, y1`` of all surfaces.
    first_edge : ndarray, shape (P + 1,), int64
        Surface ``p`` owns the edges ``first_edge[p]`` to ``first_edge[p + 1]``.
    planes : ndarray, shape (P, 3), float64
        ``a, b, c`` of each surface.
    texels : ndarray, shape (N, 3), float32
        Spline coefficients of all textures, one after the other.
    first_texel, side : ndarray, shape (P,), int64
        Where the texture of a surface begins, and its period in texels.
    """

    edges: FloatArray
    first_edge: IntArray
    planes: FloatArray
    texels: FloatMap
    first_texel: IntArray
    side: IntArray


def drawing(surfaces: Sequence[Surface], size: int) -> Drawing:
    """Put surfaces into pixels of a picture of ``size`` by ``size``."""
    edges = [np.concatenate([_edges(outline) for outline in surface.outlines]) for surface in surfaces]
    planes = []
    for surface in surfaces:
        b, c = surface.plane.across / size, surface.plane.down / size
        middle = (size - 1) / 2
        planes.append((surface.plane.at_centre - (b + c) * middle, b, c))
    textures = {id(surface.texture): surface.texture for surface in surfaces}
    begin = dict(zip(textures, np.cumsum([0, *(t.shape[0] ** 2 for t in textures.values())]), strict=False))
    return Drawing(
        edges=np.concatenate(edges) * size - 0.5,
        first_edge=np.cumsum([0, *map(len, edges)]).astype(np.int64),
        planes=np.array(planes, np.float64),
        texels=np.concatenate([_coefficients(texture) for texture in textures.values()]),
        first_texel=np.array([begin[id(surface.texture)] for surface in surfaces], np.int64),
        side=np.array([surface.texture.shape[0] for surface in surfaces], np.int64),
    )


def render_view(scene: Drawing, size: int, v: int, u: int) -> FloatMap:
    """The view ``v`` steps below and ``u`` steps to the right of the centre; shape (size, size, 3) in about 0..1."""
    from sepi.scenes.rendering_kernels import shade

    picture = np.zeros((size, size, 3), np.float32)
    edges, planes = _seen_from(scene, v, u)
    shade(scene.first_edge, scene.texels, scene.first_texel, scene.side, edges, planes, v, u, SAMPLES, picture)
    return picture


def visible(scene: Drawing, size: int) -> tuple[FloatArray, IntArray]:
    """Disparity and index of the surface at each pixel centre of the centre view, each of shape (size, size)."""
    from sepi.scenes.rendering_kernels import nearest

    disparity = np.empty((size, size))
    owner = np.empty((size, size), np.int64)
    nearest(scene.first_edge, scene.planes, scene.edges, disparity, owner)
    return disparity, owner


def occluded(scene: Drawing, disparity: FloatArray, grid: tuple[int, int]) -> BoolMap:
    """Pixels of the centre view whose surface point a nearer surface hides in at least one view of the grid.

    Parameters
    ----------
    scene : Drawing
        All surfaces.
    disparity : ndarray, shape (H, W), float64
        What ``visible`` gave.
    grid : tuple of int
        View rows and columns (T, S).

    Returns
    -------
    ndarray, shape (H, W), bool
        A point that leaves the picture in a view does not count as hidden there.
    """
    from sepi.scenes.rendering_kernels import hide

    hidden = np.zeros(disparity.shape, bool)
    for t in range(grid[0]):
        for s in range(grid[1]):
            v, u = t - grid[0] // 2, s - grid[1] // 2
            if (v, u) != (0, 0):
                hide(scene.edges, scene.first_edge, scene.planes, _boxes(scene), disparity, v, u, hidden)
    return hidden


def _edges(outline: FloatArray) -> FloatArray:
    return np.concatenate([outline, np.roll(outline, -1, axis=0)], axis=1)


def _coefficients(texture: FloatMap) -> FloatMap:
    """Cubic B-spline coefficients of a periodic texture, shape (M * M, 3)."""
    from scipy import ndimage

    values = texture.astype(np.float64)
    for axis in (0, 1):
        values = ndimage.spline_filter1d(values, order=3, axis=axis, mode="grid-wrap")
    return values.reshape(-1, 3).astype(np.float32)


def _seen_from(scene: Drawing, v: int, u: int) -> tuple[FloatArray, FloatArray]:
    """Edges and planes as they are in a view."""
    of_edge = np.repeat(scene.planes, np.diff(scene.first_edge), axis=0)
    x, y = scene.edges[:, 0::2], scene.edges[:, 1::2]
    d = of_edge[:, :1] + of_edge[:, 1:2] * x + of_edge[:, 2:] * y
    edges = np.empty_like(scene.edges)
    edges[:, 0::2], edges[:, 1::2] = x - u * d, y - v * d
    stretch = 1 - scene.planes[:, 1] * u - scene.planes[:, 2] * v
    # a plane seen exactly edge-on covers nothing
    stretch[np.abs(stretch) < EDGE_ON] = np.inf
    return edges, scene.planes / stretch[:, None]


def _boxes(scene: Drawing) -> FloatArray:
    """Smallest and largest x and y of each surface, shape (P, 4)."""
    parts = [scene.edges[a:b, :2] for a, b in zip(scene.first_edge[:-1], scene.first_edge[1:], strict=True)]
    return np.array([[*part.min(axis=0), *part.max(axis=0)] for part in parts])
