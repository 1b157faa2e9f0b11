"""Exact rendering of planar surfaces into the views of a light field.

A plane of disparity ``d(x, y) = a + b x + c y`` in the centre view is seen in the view ``(v, u)`` steps away at
``(x', y') = (x - u d, y - v d)``. Solved for the disparity, ``d = (a + b x' + c y') / (1 - b u - c v)``: it is a plane
there, too, and a polygon stays a polygon. So each view is drawn by filling polygons along sub-pixel rows, the largest
disparity wins, and the texture is looked up at ``(x' + u d, y' + v d)``; nothing is resampled from another view.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numba
import numpy as np
import numpy.typing as npt
from scipy import ndimage

from sepi.lightfield import BoolMap, FloatMap
from sepi.scenes.surfaces import Surface

# Sub-samples per pixel and direction.
SAMPLES = 4
# A surface hides a point only if it is nearer by more than rounding (points on the edge between two faces).
TOLERANCE = 1e-9

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
    picture = np.zeros((size, size, 3), np.float32)
    edges, planes = _seen_from(scene, v, u)
    _shade(scene.first_edge, scene.texels, scene.first_texel, scene.side, edges, planes, v, u, SAMPLES, picture)
    return picture


def visible(scene: Drawing, size: int) -> tuple[FloatArray, IntArray]:
    """Disparity and index of the surface at each pixel centre of the centre view, each of shape (size, size)."""
    disparity = np.empty((size, size))
    owner = np.empty((size, size), np.int64)
    _nearest(scene.first_edge, scene.planes, scene.edges, disparity, owner)
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
    hidden = np.zeros(disparity.shape, bool)
    for t in range(grid[0]):
        for s in range(grid[1]):
            v, u = t - grid[0] // 2, s - grid[1] // 2
            if (v, u) != (0, 0):
                _hide(scene.edges, scene.first_edge, scene.planes, _boxes(scene), disparity, v, u, hidden)
    return hidden


def _edges(outline: FloatArray) -> FloatArray:
    return np.concatenate([outline, np.roll(outline, -1, axis=0)], axis=1)


def _coefficients(texture: FloatMap) -> FloatMap:
    """Cubic B-spline coefficients of a periodic texture, shape (M * M, 3)."""
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
    stretch[np.abs(stretch) < TOLERANCE] = np.inf
    return edges, scene.planes / stretch[:, None]


def _boxes(scene: Drawing) -> FloatArray:
    """Smallest and largest x and y of each surface, shape (P, 4)."""
    parts = [scene.edges[a:b, :2] for a, b in zip(scene.first_edge[:-1], scene.first_edge[1:], strict=True)]
    return np.array([[*part.min(axis=0), *part.max(axis=0)] for part in parts])


@numba.njit(cache=True)
def _fill_row(
    first_edge: IntArray,
    planes: FloatArray,
    edges: FloatArray,
    y: float,
    samples: int,
    crossings: FloatArray,
    depth: FloatArray,
    owner: IntArray,
) -> None:
    """Nearest disparity and its surface at the sub-samples of one row at height ``y``.

    Even-odd rule; intervals are closed on the left and open on the right, so that neighbours leave no gap.
    """
    width = depth.shape[0]
    depth[:] = -np.inf
    owner[:] = -1
    for p in range(planes.shape[0]):
        count = 0
        for e in range(first_edge[p], first_edge[p + 1]):
            y0, y1 = edges[e, 1], edges[e, 3]
            if (y0 <= y) != (y1 <= y):
                crossings[count] = edges[e, 0] + (y - y0) * (edges[e, 2] - edges[e, 0]) / (y1 - y0)
                count += 1
        crossings[:count].sort()
        at_zero = planes[p, 0] + planes[p, 2] * y
        for i in range(0, count - 1, 2):
            first = max(0, int(np.ceil((max(crossings[i], -1.0) + 0.5) * samples - 0.5)))
            last = int(np.ceil((min(crossings[i + 1], float(width)) + 0.5) * samples - 0.5))
            for column in range(first, min(width, last)):
                d = at_zero + planes[p, 1] * ((column + 0.5) / samples - 0.5)
                if d > depth[column]:
                    depth[column] = d
                    owner[column] = p


@numba.njit(cache=True)
def _nearest(
    first_edge: IntArray, planes: FloatArray, edges: FloatArray, disparity: FloatArray, owner: IntArray
) -> None:
    """Fill ``disparity`` and ``owner`` at the pixel centres."""
    crossings = np.empty(edges.shape[0])
    for row in range(disparity.shape[0]):
        _fill_row(first_edge, planes, edges, float(row), 1, crossings, disparity[row], owner[row])


@numba.njit(cache=True)
def _shade(
    first_edge: IntArray,
    texels: FloatMap,
    first_texel: IntArray,
    side: IntArray,
    edges: FloatArray,
    planes: FloatArray,
    v: int,
    u: int,
    samples: int,
    picture: FloatMap,
) -> None:
    """Add up the textures under all sub-samples of each pixel, and average."""
    size = picture.shape[0]
    crossings = np.empty(edges.shape[0])
    depth = np.empty(size * samples)
    owner = np.empty(size * samples, np.int64)
    weight_x, weight_y = np.empty(4), np.empty(4)
    column_of = np.empty(4, np.int64)
    for row in range(size * samples):
        y = (row + 0.5) / samples - 0.5
        _fill_row(first_edge, planes, edges, y, samples, crossings, depth, owner)
        for column in range(size * samples):
            p = owner[column]
            if p < 0:
                continue
            x = (column + 0.5) / samples - 0.5
            m = side[p]
            ix = _spline_weights(x + u * depth[column], weight_x)
            iy = _spline_weights(y + v * depth[column], weight_y)
            for i in range(4):
                column_of[i] = first_texel[p] + (ix + i) % m
            red = green = blue = 0.0
            for j in range(4):
                line = ((iy + j) % m) * m
                for i in range(4):
                    w = weight_y[j] * weight_x[i]
                    texel = texels[line + column_of[i]]
                    red += w * texel[0]
                    green += w * texel[1]
                    blue += w * texel[2]
            pixel = picture[row // samples, column // samples]
            pixel[0] += red
            pixel[1] += green
            pixel[2] += blue
    picture /= samples * samples


@numba.njit(cache=True)
def _spline_weights(position: float, weights: FloatArray) -> int:
    """Cubic B-spline weights at ``position``; gives the index of the first of the four texels."""
    base = np.floor(position)
    f = position - base
    g = 1 - f
    weights[0] = g * g * g / 6
    weights[1] = 2 / 3 - 0.5 * f * f * (1 + g)
    weights[2] = 2 / 3 - 0.5 * g * g * (1 + f)
    weights[3] = f * f * f / 6
    return int(base) - 1


@numba.njit(cache=True)
def _hide(
    edges: FloatArray,
    first_edge: IntArray,
    planes: FloatArray,
    boxes: FloatArray,
    disparity: FloatArray,
    v: int,
    u: int,
    hidden: BoolMap,
) -> None:
    """Mark the pixels whose point is hidden in one view."""
    height, width = disparity.shape
    for row in range(height):
        for column in range(width):
            d = disparity[row, column]
            x, y = column - u * d, row - v * d
            if hidden[row, column] or not (-0.5 <= x < width - 0.5 and -0.5 <= y < height - 0.5):
                continue
            for p in range(planes.shape[0]):
                stretch = 1 - planes[p, 1] * u - planes[p, 2] * v
                if abs(stretch) < TOLERANCE:
                    continue
                other = (planes[p, 0] + planes[p, 1] * x + planes[p, 2] * y) / stretch
                cx, cy = x + u * other, y + v * other
                if (
                    other > d + TOLERANCE
                    and boxes[p, 0] <= cx <= boxes[p, 2]
                    and boxes[p, 1] <= cy <= boxes[p, 3]
                    and _inside(edges, first_edge[p], first_edge[p + 1], cx, cy)
                ):
                    hidden[row, column] = True
                    break


@numba.njit(cache=True)
def _inside(edges: FloatArray, begin: int, end: int, x: float, y: float) -> bool:
    """Even-odd rule: does a ray to the right cross the outline an odd number of times?"""
    odd = False
    for e in range(begin, end):
        y0, y1 = edges[e, 1], edges[e, 3]
        if (y0 <= y) != (y1 <= y):
            at = edges[e, 0] + (y - y0) * (edges[e, 2] - edges[e, 0]) / (y1 - y0)
            if at > x:
                odd = not odd
    return odd
