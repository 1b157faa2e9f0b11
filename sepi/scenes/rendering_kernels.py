"""Compiled loops of the exact rendering (:mod:`sepi.scenes.rendering`)."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from sepi.compiled import njit
from sepi.lightfield import BoolMap, FloatMap

# A surface hides a point only if it is nearer by more than rounding (points on the edge between two faces).
TOLERANCE = 1e-9

FloatArray = npt.NDArray[np.float64]
IntArray = npt.NDArray[np.int64]


@njit(cache=True)
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
        # few crossings, mostly two: a sort by insertion
        for i in range(1, count):
            crossing, position = crossings[i], i
            while position > 0 and crossings[position - 1] > crossing:
                crossings[position] = crossings[position - 1]
                position -= 1
            crossings[position] = crossing
        at_zero = planes[p, 0] + planes[p, 2] * y
        for i in range(0, count - 1, 2):
            first = max(0, int(np.ceil((max(crossings[i], -1.0) + 0.5) * samples - 0.5)))
            last = int(np.ceil((min(crossings[i + 1], float(width)) + 0.5) * samples - 0.5))
            for column in range(first, min(width, last)):
                d = at_zero + planes[p, 1] * ((column + 0.5) / samples - 0.5)
                if d > depth[column]:
                    depth[column] = d
                    owner[column] = p


@njit(cache=True)
def nearest(
    first_edge: IntArray, planes: FloatArray, edges: FloatArray, disparity: FloatArray, owner: IntArray
) -> None:
    """Fill ``disparity`` and ``owner`` at the pixel centres."""
    crossings = np.empty(edges.shape[0])
    for row in range(disparity.shape[0]):
        _fill_row(first_edge, planes, edges, float(row), 1, crossings, disparity[row], owner[row])


@njit(cache=True)
def shade(
    first_edge: IntArray,
    texels: FloatMap,
    first_texel: IntArray,
    side: IntArray,
    edges: FloatArray,
    planes: FloatArray,
    v: float,
    u: float,
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
            # the texture goes on periodically; a division for every texel would take longer than all the rest
            at = ix % m
            for i in range(4):
                column_of[i] = first_texel[p] + at
                at = at + 1 if at + 1 < m else 0
            at = iy % m
            red = green = blue = 0.0
            for j in range(4):
                line = at * m
                at = at + 1 if at + 1 < m else 0
                # along the row first: the four rows do not wait for each other
                a, b = texels[line + column_of[0]], texels[line + column_of[1]]
                c, d = texels[line + column_of[2]], texels[line + column_of[3]]
                w0, w1, w2, w3 = weight_x[0], weight_x[1], weight_x[2], weight_x[3]
                red += weight_y[j] * ((w0 * a[0] + w1 * b[0]) + (w2 * c[0] + w3 * d[0]))
                green += weight_y[j] * ((w0 * a[1] + w1 * b[1]) + (w2 * c[1] + w3 * d[1]))
                blue += weight_y[j] * ((w0 * a[2] + w1 * b[2]) + (w2 * c[2] + w3 * d[2]))
            pixel = picture[row // samples, column // samples]
            pixel[0] += red
            pixel[1] += green
            pixel[2] += blue
    picture /= samples * samples


@njit(cache=True)
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


@njit(cache=True)
def hide(
    first_edge: IntArray,
    planes: FloatArray,
    edges: FloatArray,
    boxes: FloatArray,
    disparity: FloatArray,
    v: float,
    u: float,
    hidden: BoolMap,
) -> None:
    """Mark the pixels whose point is hidden in one view: planes, edges and boxes round them are as seen there."""
    height, width = disparity.shape
    for row in range(height):
        for column in range(width):
            d = disparity[row, column]
            x, y = column - u * d, row - v * d
            if hidden[row, column] or not (-0.5 <= x < width - 0.5 and -0.5 <= y < height - 0.5):
                continue
            for p in range(planes.shape[0]):
                if (
                    planes[p, 0] + planes[p, 1] * x + planes[p, 2] * y > d + TOLERANCE
                    and boxes[p, 0] <= x <= boxes[p, 2]
                    and boxes[p, 1] <= y <= boxes[p, 3]
                    and _inside(edges, first_edge[p], first_edge[p + 1], x, y)
                ):
                    hidden[row, column] = True
                    break


@njit(cache=True)
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


@njit(cache=True)
def cast(
    first_edge: IntArray,
    edges: FloatArray,
    boxes: FloatArray,
    normals: FloatArray,
    origin: FloatArray,
    rays: FloatArray,
    pinhole: FloatArray,
    owner: IntArray,
    hits: FloatArray,
) -> None:
    """Nearest surface along each ray ``(N, 3)`` from ``origin``: its index, -1 for none, and ``(t, x, y)`` of the hit.

    Surface ``p`` lies where ``normals[p] @ point`` is 1; edges and boxes are in pixels of the view from the world's
    origin, whose ``(focal length, x, y)`` are ``pinhole``, and so is the hit's place; ``t`` is in lengths of the ray.
    """
    focal, cx, cy = pinhole
    ahead = np.empty(normals.shape[0])
    for p in range(normals.shape[0]):
        ahead[p] = 1 - (normals[p, 0] * origin[0] + normals[p, 1] * origin[1] + normals[p, 2] * origin[2])
    for i in range(rays.shape[0]):
        owner[i] = -1
        nearest_t = np.inf
        for p in range(normals.shape[0]):
            along = normals[p, 0] * rays[i, 0] + normals[p, 1] * rays[i, 1] + normals[p, 2] * rays[i, 2]
            if along * ahead[p] <= 0:
                continue
            t = ahead[p] / along
            z = origin[2] + t * rays[i, 2]
            if t >= nearest_t - TOLERANCE * t or z <= 0:
                continue
            x = cx + focal * (origin[0] + t * rays[i, 0]) / z
            y = cy + focal * (origin[1] + t * rays[i, 1]) / z
            if (
                boxes[p, 0] <= x <= boxes[p, 2]
                and boxes[p, 1] <= y <= boxes[p, 3]
                and _inside(edges, first_edge[p], first_edge[p + 1], x, y)
            ):
                nearest_t = t
                owner[i] = p
                hits[i, 0], hits[i, 1], hits[i, 2] = t, x, y


@njit(cache=True)
def colours_at(
    texels: FloatMap, first_texel: IntArray, side: IntArray, owner: IntArray, hits: FloatArray, colours: FloatArray
) -> None:
    """Texture of the surface that each ray of :func:`cast` hits; black where there is none."""
    weight_x, weight_y = np.empty(4), np.empty(4)
    for i in range(owner.size):
        p = owner[i]
        colours[i] = 0
        if p < 0:
            continue
        m = side[p]
        ix = _spline_weights(hits[i, 1], weight_x)
        iy = _spline_weights(hits[i, 2], weight_y)
        for j in range(4):
            line = first_texel[p] + (iy + j) % m * m
            for k in range(4):
                for c in range(3):
                    colours[i, c] += weight_y[j] * weight_x[k] * texels[line + (ix + k) % m, c]
