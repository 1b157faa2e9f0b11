"""Exact rendering of planar surfaces into the views of a light field.

A plane of disparity ``d(x, y) = a + b x + c y`` in the centre view is seen in the view of baseline ``(v, u)`` at
``(x', y') = (x - u d, y - v d)``. Solved for the disparity, ``d = (a + b x' + c y') / (1 - b u - c v)``: also a plane
there, and polygons remain polygons. Each view is therefore drawn by filling polygons along sub-pixel rows, where the
largest disparity wins and the texture is sampled at ``(x' + u d, y' + v d)``; nothing is resampled from another view.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from sepi.kernels import rendering as kernels
from sepi.lightfield import BoolMap, FloatMap
from sepi.scenes.definitions import Surface

# Sub-samples per pixel and direction.
SAMPLES = 4
# Planes closer to edge-on than this count as edge-on.
EDGE_ON = 1e-9

FloatArray = npt.NDArray[np.float64]
IntArray = npt.NDArray[np.int64]


class Drawing(NamedTuple):
    """Surfaces as flat arrays in pixels of a view, for the compiled kernels."""

    edges: FloatArray
    """Polygon edges ``x0, y0, x1, y1`` of all surfaces, shape (E, 4)."""
    first_edge: IntArray
    """Surface ``p`` has the edges ``first_edge[p]`` to ``first_edge[p + 1]``."""
    planes: FloatArray
    """``a, b, c`` of each surface, shape (P, 3)."""
    texels: FloatMap
    """Spline coefficients of all textures, one after the other, shape (N, 4): three colours, and 0.

    Each row continues periodically for ``sepi.kernels.rendering.BEYOND`` texels."""
    first_texel: IntArray
    """Start index of each surface's texture."""
    side: IntArray
    """Period of each surface's texture in texels."""


def drawing(surfaces: Sequence[Surface], size: int, *, textured: bool = True) -> Drawing:
    """Surfaces in pixels of an image of ``size`` by ``size``; without textures if only positions are needed."""
    edges = [np.concatenate([np.hstack([o, np.roll(o, -1, axis=0)]) for o in one.outlines]) for one in surfaces]
    planes = []
    for at_centre, across, down in (surface.plane for surface in surfaces):
        b, c = across / size, down / size
        planes.append((at_centre - (b + c) * (size - 1) / 2, b, c))
    asked = {id(surface.texture): surface.texture for surface in surfaces} if textured else {}
    textures = {key: texture() if callable(texture) else texture for key, texture in asked.items()}
    sizes = [len(texture) * (len(texture) + kernels.BEYOND) for texture in textures.values()]
    begin = dict(zip(textures, np.cumsum([0, *sizes]), strict=False))
    own = [id(surface.texture) for surface in surfaces] if textured else []
    return Drawing(
        edges=np.concatenate(edges) * size - 0.5,
        first_edge=np.cumsum([0, *map(len, edges)]).astype(np.int64),
        planes=np.array(planes, np.float64),
        texels=np.concatenate([np.empty((0, 4), np.float32), *map(_coefficients, textures.values())]),
        first_texel=np.array([begin[key] for key in own], np.int64),
        side=np.array([len(textures[key]) for key in own], np.int64),
    )


def render_view(scene: Drawing, size: int, v: float, u: float) -> FloatMap:
    """The view ``v`` steps below and ``u`` steps right of the centre; shape (size, size, 3), about 0..1."""
    picture = np.empty((size, size, 3), np.float32)
    kernels.shade(_seen_from(scene, v, u), v, u, SAMPLES, picture)
    return picture


def visible(scene: Drawing, size: int, v: float = 0.0, u: float = 0.0) -> tuple[FloatArray, IntArray]:
    """Disparity and index of the surface at each pixel centre of a view, each of shape (size, size).

    The view is ``v`` steps below and ``u`` steps right of the centre.
    """
    disparity = np.empty((size, size))
    owner = np.empty((size, size), np.int64)
    kernels.nearest(_seen_from(scene, v, u), disparity, owner)
    return disparity, owner


def occluded(scene: Drawing, disparity: FloatArray, baselines: FloatArray) -> BoolMap:
    """Pixels of the centre view whose surface point is hidden by a nearer surface in at least one view.

    ``baselines (T, S, 2)`` are relative to the centre view. Points outside a view's image do not count as hidden there.
    """
    hidden = np.zeros(disparity.shape, bool)
    for v, u in baselines.reshape(-1, 2):
        seen = _seen_from(scene, v, u)
        kernels.hide(seen, boxes_round(seen), disparity, v, u, hidden)
    return hidden


def boxes_round(scene: Drawing) -> FloatArray:
    """Bounding box of each surface, ``x0, y0, x1, y1``."""
    corners, first = scene.edges[:, :2], scene.first_edge[:-1]
    return np.hstack([np.minimum.reduceat(corners, first), np.maximum.reduceat(corners, first)])


def _coefficients(texture: FloatMap) -> FloatMap:
    """Cubic B-spline coefficients of a periodic texture, shape (M * (M + BEYOND), 4), as in a drawing."""
    from scipy import ndimage

    values = texture.astype(np.float64)
    for axis in (0, 1):
        values = ndimage.spline_filter1d(values, order=3, axis=axis, mode="grid-wrap")
    further = np.pad(values.astype(np.float32), ((0, 0), (0, kernels.BEYOND), (0, 0)), "wrap")
    return np.pad(further, ((0, 0), (0, 0), (0, 1))).reshape(-1, 4)


def _seen_from(scene: Drawing, v: float, u: float) -> Drawing:
    """Surfaces in the pixels of a view."""
    of_edge = np.repeat(scene.planes, np.diff(scene.first_edge), axis=0)
    x, y = scene.edges[:, 0::2], scene.edges[:, 1::2]
    d = of_edge[:, :1] + of_edge[:, 1:2] * x + of_edge[:, 2:] * y
    edges = np.empty_like(scene.edges)
    edges[:, 0::2], edges[:, 1::2] = x - u * d, y - v * d
    stretch = 1 - scene.planes[:, 1] * u - scene.planes[:, 2] * v
    # a plane seen exactly edge-on covers nothing
    stretch[np.abs(stretch) < EDGE_ON] = np.inf
    return scene._replace(edges=edges, planes=scene.planes / stretch[:, None])
