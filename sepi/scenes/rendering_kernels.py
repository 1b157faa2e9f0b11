"""Compiled loops of the exact rendering (:mod:`sepi.scenes.rendering`)."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

from sepi.compiled import fma, njit
from sepi.lightfield import BoolMap, FloatMap
from sepi.vectors import at_most, load, spread, store

# A surface hides a point only if it is nearer by more than rounding (points on the edge between two faces).
TOLERANCE = 1e-9

BEYOND = 3
"""Texels that follow those of each row of a texture, as it goes on periodically: as many as a sample reaches."""

FloatArray = npt.NDArray[np.float64]
IntArray = npt.NDArray[np.int64]


@njit(cache=True)
def _fill_row(
    first_edge: IntArray,
    planes: FloatArray,
    edges: FloatArray,
    y: float,
    samples: int,
    places: FloatArray,
    crossings: FloatArray,
    depth: FloatArray,
    owner: IntArray,
) -> None:
    """Nearest disparity and its surface at the sub-samples ``places`` of one row at height ``y``.

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
                d = at_zero + planes[p, 1] * places[column]
                if d > depth[column]:
                    depth[column] = d
                    owner[column] = p


@njit(cache=True)
def nearest(
    first_edge: IntArray, planes: FloatArray, edges: FloatArray, disparity: FloatArray, owner: IntArray
) -> None:
    """Fill ``disparity`` and ``owner`` at the pixel centres."""
    crossings, places = np.empty(edges.shape[0]), np.arange(disparity.shape[1]).astype(np.float64)
    for row in range(disparity.shape[0]):
        _fill_row(first_edge, planes, edges, float(row), 1, places, crossings, disparity[row], owner[row])


@njit(forceinline=True, borrows=True)
def _added(total: Any, texels: FloatMap, first: int, side: int, x: float, y: float, halves: Any) -> Any:
    """A sample of a texture, which goes on periodically, added to a vector: its colours are the sum of both halves.

    ``halves`` is a vector of four numbers below, and four above zero.
    """
    ix, across = _spline_weights(x)
    iy, down = _spline_weights(y)
    column, row, stride, zero = ix % side, iy % side, side + BEYOND, spread(np.float32(0))
    # two texels at once, each of four numbers
    left = right = zero
    for j in range(4):
        here = first + row * stride + column
        left = fma(spread(down[j]), load(texels, (here, 0)), left)
        right = fma(spread(down[j]), load(texels, (here + 2, 0)), right)
        row = row + 1 if row + 1 < side else 0
    total = fma(at_most(halves, zero, spread(across[0]), spread(across[1])), left, total)
    return fma(at_most(halves, zero, spread(across[2]), spread(across[3])), right, total)


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
    crossings, places = np.empty(edges.shape[0]), (np.arange(size * samples) + 0.5) / samples - 0.5
    depth = np.empty(size * samples)
    owner = np.empty(size * samples, np.int64)
    sums = np.array([-1, -1, -1, -1, 1, 1, 1, 1], np.float32)
    halves = load(sums, 0)
    for row in range(size * samples):
        y = places[row]
        _fill_row(first_edge, planes, edges, y, samples, places, crossings, depth, owner)
        line = row // samples
        for pixel in range(size):
            total = spread(np.float32(0))
            for column in range(pixel * samples, (pixel + 1) * samples):
                p = owner[column]
                if p >= 0:
                    d = depth[column]
                    x = places[column] + u * d
                    total = _added(total, texels, first_texel[p], side[p], x, y + v * d, halves)
            store(sums, 0, total)
            for c in range(3):
                picture[line, pixel, c] += sums[c] + sums[4 + c]
    picture /= samples * samples


@njit(forceinline=True)
def _spline_weights(position: float) -> Any:
    """The index of the first of four texels, and their cubic B-spline weights at ``position``."""
    base = np.floor(position)
    f = np.float32(position - base)
    g = np.float32(1) - f
    sixth, most, half = np.float32(1 / 6), np.float32(2 / 3), np.float32(0.5)
    weights = (
        g * g * g * sixth,
        most - half * f * f * (np.float32(1) + g),
        most - half * g * g * (np.float32(1) + f),
        f * f * f * sixth,
    )
    return int(base) - 1, weights


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
    sums = np.array([-1, -1, -1, -1, 1, 1, 1, 1], np.float32)
    halves = load(sums, 0)
    for i in range(owner.size):
        p = owner[i]
        colours[i] = 0
        if p < 0:
            continue
        found = _added(spread(np.float32(0)), texels, first_texel[p], side[p], hits[i, 1], hits[i, 2], halves)
        store(sums, 0, found)
        for c in range(3):
            colours[i, c] = sums[c] + sums[4 + c]
