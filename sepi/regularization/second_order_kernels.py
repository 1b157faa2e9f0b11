"""Compiled loops of the second-order smoothing: its matrix and the planes of its preconditioner, as stencils.

Pictures have a margin of :data:`MARGIN` pixels of zeros on each side, so that no loop has to look where it is. What
is called in every step of the solver takes a millisecond, and threads that wait for each other take longer than that
where another program has one of the cores: it runs on one.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from sepi.compiled import njit, prange

EXACT = {"nnan", "ninf", "nsz"}
"""Fast-math flags that keep every rounding as written: see :mod:`sepi.matching.plane_sweep_kernels`."""

MARGIN = 2
"""How far second differences reach, pixels."""

BLOCK = 16
"""Width of the preconditioner's blocks, pixels."""

_MIDDLE = (BLOCK - 1) / 2


@njit(inline="always")
def _add_pair(forth: Any, there: Any, back: Any, before: Any, out: Any) -> None:
    """One entry and its mirror image; few arrays at a time, so that the loop vectorises."""
    for x in range(out.size):
        out[x] += forth[x] * there[x] + back[x] * before[x]


@njit(cache=True, fastmath=EXACT)
def product(stencil: Any, vector: Any, out: Any) -> None:
    """The matrix times a picture.

    Parameters
    ----------
    stencil : ndarray, shape (7, H + 2 MARGIN, W + 2 MARGIN), float32 or float64
        Of :func:`sepi.regularization.second_order.second_difference_stencil`, with a margin.
    vector, out : ndarray, shape (H + 2 MARGIN, W + 2 MARGIN), of the same type
        With a margin of zeros; that of ``out`` is not touched.
    """
    m = MARGIN
    n = vector.shape[1] - 2 * m
    for y in range(m, vector.shape[0] - m):
        c, v, target = stencil[0, y, m : m + n], vector[y, m : m + n], out[y, m : m + n]
        for x in range(n):
            target[x] = c[x] * v[x]
        for k, dy, dx in ((1, 0, 1), (2, 0, 2), (3, 1, 0), (4, 2, 0), (5, 1, 1), (6, 1, -1)):
            _add_pair(
                stencil[k, y, m : m + n], vector[y + dy, m + dx : m + dx + n],
                stencil[k, y - dy, m - dx : m - dx + n], vector[y - dy, m - dx : m - dx + n], target,
            )  # fmt: skip


@njit(cache=True, fastmath=EXACT)
def onto_planes(vector: Any, out: Any) -> None:
    """Inner products of a picture with constant and slopes of each block; ``out (rows, columns of blocks, 3)``."""
    H, W = vector.shape[0] - 2 * MARGIN, vector.shape[1] - 2 * MARGIN
    # sums over the rows of a block come first: so they vectorise
    total, rising = np.empty(W), np.empty(W)
    for by in range(out.shape[0]):
        total[:] = 0
        rising[:] = 0
        for y in range(by * BLOCK, min(H, (by + 1) * BLOCK)):
            row, dy = vector[y + MARGIN, MARGIN : MARGIN + W], (y - by * BLOCK - _MIDDLE) / BLOCK
            for x in range(W):
                total[x] += row[x]
                rising[x] += row[x] * dy
        for bx in range(out.shape[1]):
            constant, slope_x, slope_y = 0.0, 0.0, 0.0
            for x in range(bx * BLOCK, min(W, (bx + 1) * BLOCK)):
                constant += total[x]
                slope_x += total[x] * ((x - bx * BLOCK - _MIDDLE) / BLOCK)
                slope_y += rising[x]
            out[by, bx, 0], out[by, bx, 1], out[by, bx, 2] = constant, slope_x, slope_y


@njit(cache=True, fastmath=EXACT)
def diagonal_and_planes(inverse: Any, vector: Any, planes: Any, out: Any) -> None:
    """``inverse * vector``, plus the planes ``(rows, columns of blocks, 3)``; pictures with margins."""
    H, W = vector.shape[0] - 2 * MARGIN, vector.shape[1] - 2 * MARGIN
    # of the pictures' own type, which is computed with
    level, rise, steps = np.empty(W, out.dtype), np.empty(W, out.dtype), np.empty(BLOCK, out.dtype)
    for y in range(BLOCK):
        steps[y] = y
    for by in range(planes.shape[0]):
        for x in range(W):
            p = planes[by, x // BLOCK]
            # where the block begins
            level[x] = p[0] + p[1] * ((x % BLOCK - _MIDDLE) / BLOCK) - p[2] * _MIDDLE / BLOCK
            rise[x] = p[2] / BLOCK
        for y in range(by * BLOCK, min(H, (by + 1) * BLOCK)):
            dy = steps[y - by * BLOCK]
            row, own, target = vector[y + MARGIN], inverse[y + MARGIN], out[y + MARGIN]
            for x in range(W):
                i = x + MARGIN
                target[i] = own[i] * row[i] + (level[x] + rise[x] * dy)


@njit(inline="always")
def _add_entry(out: Any, by: int, bx: int, y: int, x: int, dy: int, dx: int, value: Any) -> None:
    """Add the matrix's entry of pixel ``(y, x)`` and the one ``(dy, dx)`` further, as seen by their blocks' planes."""
    if value == 0:
        return
    other_y, other_x = (y + dy) // BLOCK, (x + dx) // BLOCK
    block = out[by, bx, 3 * (other_y - by + 1) + other_x - bx + 1]
    px, py = (x - bx * BLOCK - _MIDDLE) / BLOCK, (y - by * BLOCK - _MIDDLE) / BLOCK
    qx, qy = (x + dx - other_x * BLOCK - _MIDDLE) / BLOCK, (y + dy - other_y * BLOCK - _MIDDLE) / BLOCK
    block[0, 0] += value
    block[0, 1] += value * qx
    block[0, 2] += value * qy
    block[1, 0] += px * value
    block[1, 1] += px * value * qx
    block[1, 2] += px * value * qy
    block[2, 0] += py * value
    block[2, 1] += py * value * qx
    block[2, 2] += py * value * qy


@njit(parallel=True, cache=True, fastmath=EXACT)
def matrix_of_planes(stencil: Any, out: Any) -> None:
    """The matrix as the planes see it.

    Parameters
    ----------
    stencil : ndarray, as in :func:`product`
    out : ndarray, shape (rows of blocks, columns of blocks, 9, 3, 3), float64
        Zeros, to which are added: entries of a block's planes with those of itself and of its neighbours, in the order
        of reading.
    """
    H, W = stencil.shape[1] - 2 * MARGIN, stencil.shape[2] - 2 * MARGIN
    m = MARGIN
    for by in prange(out.shape[0]):
        for y in range(by * BLOCK, min(H, (by + 1) * BLOCK)):
            for x in range(W):
                bx = x // BLOCK
                s, r = y + m, x + m
                _add_entry(out, by, bx, y, x, 0, 0, stencil[0, s, r])
                # each entry as seen from either of its pixels
                for k, dy, dx in ((1, 0, 1), (2, 0, 2), (3, 1, 0), (4, 2, 0), (5, 1, 1), (6, 1, -1)):
                    _add_entry(out, by, bx, y, x, dy, dx, stencil[k, s, r])
                    _add_entry(out, by, bx, y, x, -dy, -dx, stencil[k, s - dy, r - dx])
