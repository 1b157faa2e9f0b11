"""Compiled loops of the solver's preconditioner: what hats and planes know of a picture, and a picture of them.

Pictures have a margin as in :mod:`sepi.regularization.second_order_kernels`; those of hats have none. The nodes of
hats lie between pixels: that of number ``i`` of the finer ones, :data:`SPACING` pixels wide, at ``SPACING i - 0.5``;
coarser ones have every other node, and each is half its neighbours of the finer level and all of the one at its place.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from sepi.compiled import njit, prange
from sepi.regularization.second_order_kernels import EXACT, MARGIN

SPACING = 2
"""Pixels from node to node of the finer hats."""

BLOCK = 24
"""Width of the blocks of planes, pixels."""

_MIDDLE = (BLOCK - 1) / 2
_NEAR, _FAR = 0.75, 0.25
"""The finer hats at the pixels beside a node and at the next ones."""


@njit(inline="always")
def _onto_finer(vector: Any, fine: Any) -> None:
    """Inner products of a picture with the finer hats."""
    H, W = vector.shape[0] - 2 * MARGIN, vector.shape[1] - 2 * MARGIN
    near, far = vector.dtype.type(_NEAR), vector.dtype.type(_FAR)
    # with zeros round the picture, as wide as the hats reach
    line = np.zeros(2 * fine.shape[1] + 2, vector.dtype)
    for i in range(fine.shape[0]):
        line[:] = 0
        within = line[2 : 2 + W]
        for dy, share in ((-2, far), (-1, near), (0, near), (1, far)):
            y = 2 * i + dy
            if 0 <= y < H:
                row = vector[y + MARGIN, MARGIN : MARGIN + W]
                for x in range(W):
                    within[x] += share * row[x]
        for j in range(fine.shape[1]):
            x = 2 * j
            fine[i, j] = far * (line[x] + line[x + 3]) + near * (line[x + 1] + line[x + 2])


@njit(inline="always")
def _onto_coarser(fine: Any, coarse: Any) -> None:
    """Inner products with the coarser hats from those with the finer ones."""
    half = fine.dtype.type(0.5)
    line = np.zeros(fine.shape[1] + 2, fine.dtype)
    for i in range(coarse.shape[0]):
        row = fine[2 * i]
        for x in range(row.size):
            line[x + 1] = row[x]
        for y in (2 * i - 1, 2 * i + 1):
            if 0 <= y < fine.shape[0]:
                row = fine[y]
                for x in range(row.size):
                    line[x + 1] += half * row[x]
        for j in range(coarse.shape[1]):
            x = 2 * j + 1
            coarse[i, j] = line[x] + half * (line[x - 1] + line[x + 1])


@njit(inline="always")
def _onto_planes(vector: Any, out: Any) -> None:
    """Inner products of a picture with constant and slopes of each block."""
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
def onto_levels(vector: Any, fine: Any, coarse: Any, planes: Any) -> None:
    """Inner products of a picture with what the preconditioner is made of.

    Parameters
    ----------
    vector : ndarray, shape (H + 2 MARGIN, W + 2 MARGIN), float32 or float64
        With a margin of zeros.
    fine, coarse : ndarray, shape (2 h - 1, 2 w - 1) and (h, w), of the same type
        Filled with those with hats.
    planes : ndarray, shape (rows of blocks, columns of blocks, 3), float64
        Filled with those with constant and slopes of each block.
    """
    _onto_finer(vector, fine)
    _onto_coarser(fine, coarse)
    _onto_planes(vector, planes)


@njit(inline="always")
def _add_coarser(coarse: Any, fine: Any) -> None:
    """Add the coarser hats to the finer ones."""
    half = fine.dtype.type(0.5)
    line = np.empty(coarse.shape[1], fine.dtype)
    for i in range(fine.shape[0]):
        above, below = coarse[i // 2], coarse[(i + 1) // 2]
        for j in range(line.size):
            line[j] = half * (above[j] + below[j])
        target = fine[i]
        for j in range(line.size - 1):
            target[2 * j] += line[j]
            target[2 * j + 1] += half * (line[j] + line[j + 1])
        target[2 * line.size - 2] += line[line.size - 1]


@njit(cache=True, fastmath=EXACT)
def from_levels(inverse: Any, vector: Any, fine: Any, coarse: Any, planes: Any, out: Any) -> None:
    """``inverse * vector`` plus hats and planes.

    Parameters
    ----------
    inverse, vector : ndarray, shape (H + 2 MARGIN, W + 2 MARGIN), float32 or float64
    fine, coarse : ndarray, as in :func:`onto_levels`
        Heights of the hats; the coarser ones are added to ``fine``.
    planes : ndarray, as in :func:`onto_levels`
        Constant and slopes of each block.
    out : ndarray, as ``vector``
        Filled but for its margin.
    """
    _add_coarser(coarse, fine)
    H, W = vector.shape[0] - 2 * MARGIN, vector.shape[1] - 2 * MARGIN
    # of the pictures' own type, which is computed with
    level, rise, steps = np.empty(W, out.dtype), np.empty(W, out.dtype), np.empty(BLOCK, out.dtype)
    near, far = out.dtype.type(_NEAR), out.dtype.type(_FAR)
    line, hats = np.empty(fine.shape[1], out.dtype), np.empty(2 * fine.shape[1], out.dtype)
    for y in range(BLOCK):
        steps[y] = y
    for by in range(planes.shape[0]):
        for x in range(W):
            p = planes[by, x // BLOCK]
            # where the block begins
            level[x] = p[0] + p[1] * ((x % BLOCK - _MIDDLE) / BLOCK) - p[2] * _MIDDLE / BLOCK
            rise[x] = p[2] / BLOCK
        for y in range(by * BLOCK, min(H, (by + 1) * BLOCK)):
            first, second = (near, far) if y % 2 == 0 else (far, near)
            above, below = fine[y // 2], fine[y // 2 + 1]
            for j in range(line.size):
                line[j] = first * above[j] + second * below[j]
            for j in range(line.size - 1):
                hats[2 * j] = near * line[j] + far * line[j + 1]
                hats[2 * j + 1] = far * line[j] + near * line[j + 1]
            dy = steps[y - by * BLOCK]
            row, own, target = vector[y + MARGIN], inverse[y + MARGIN], out[y + MARGIN]
            for x in range(W):
                i = x + MARGIN
                target[i] = own[i] * row[i] + (level[x] + rise[x] * dy) + hats[x]


@njit(parallel=True, cache=True, fastmath=EXACT)
def diagonal_of_hats(stencil: Any, spacing: int, out: Any) -> None:
    """What the matrix has on its diagonal as hats see it.

    Parameters
    ----------
    stencil : ndarray, as in :func:`sepi.regularization.second_order_kernels.product`
    spacing : int
        Pixels from node to node.
    out : ndarray, shape (rows of nodes, columns of nodes), of the stencil's type
        Filled.
    """
    H, W = stencil.shape[1] - 2 * MARGIN, stencil.shape[2] - 2 * MARGIN
    m, reach = MARGIN, 2 * spacing
    # a hat at its own pixels, and zeros, to where entries lead that leave it
    hat = np.zeros(reach + 2 * MARGIN)
    for p in range(reach):
        hat[p + MARGIN] = 1 - abs(p + 0.5 - spacing) / spacing
    for i in prange(out.shape[0]):
        line = np.zeros(spacing * (out.shape[1] + 1))
        out[i] = 0
        for k, dy, dx in ((0, 0, 0), (1, 0, 1), (2, 0, 2), (3, 1, 0), (4, 2, 0), (5, 1, 1), (6, 1, -1)):
            line[:] = 0
            within = line[spacing : spacing + W]
            for p in range(reach):
                y, share = spacing * (i - 1) + p, hat[p + m] * hat[p + dy + m]
                if 0 <= y < H and share > 0:
                    row = stencil[k, y + m, m : m + W]
                    for x in range(W):
                        within[x] += share * row[x]
            # each entry as seen from either of its pixels
            times = 1.0 if k == 0 else 2.0
            for p in range(reach):
                share = times * hat[p + m] * hat[p + dx + m]
                if share > 0:
                    for j in range(out.shape[1]):
                        out[i, j] += share * line[spacing * j + p]


@njit(inline="always")
def _add_row(values: Any, here: float, there: float, sums: Any) -> None:
    """Add entries of a row of pixels, alone and times the heights in their blocks that they lead from and to."""
    level, begin, end, both = sums
    for x in range(values.size):
        v = values[x]
        level[x] += v
        begin[x] += v * here
        end[x] += v * there
        both[x] += v * (here * there)


@njit(inline="always")
def _add_columns(sums: Any, dx: int, row: Any) -> None:
    """Add what a block's rows sum up to, column by column, to the entries with neighbours in one row of blocks."""
    for x in range(sums.shape[1]):
        bx, other = x // BLOCK, (x + dx) // BLOCK
        px, qx = (x - bx * BLOCK - _MIDDLE) / BLOCK, (x + dx - other * BLOCK - _MIDDLE) / BLOCK
        level, begin, end, both = sums[0, x], sums[1, x], sums[2, x], sums[3, x]
        block = row[bx, other - bx + 1]
        block[0, 0] += level
        block[0, 1] += level * qx
        block[0, 2] += end
        block[1, 0] += px * level
        block[1, 1] += px * level * qx
        block[1, 2] += px * end
        block[2, 0] += begin
        block[2, 1] += begin * qx
        block[2, 2] += both


@njit(parallel=True, cache=True, fastmath=EXACT)
def matrix_of_planes(stencil: Any, out: Any) -> None:
    """The matrix as the planes see it.

    Parameters
    ----------
    stencil : ndarray, as in :func:`sepi.regularization.second_order_kernels.product`
    out : ndarray, shape (3, rows of blocks, columns of blocks, 3, 3, 3), float64
        Zeros, to which are added: entries of a block's planes with those of the row of blocks before it, its own and
        the next, and there of the block before, beside and after it.
    """
    H, W = stencil.shape[1] - 2 * MARGIN, stencil.shape[2] - 2 * MARGIN
    m = MARGIN
    for by in prange(out.shape[1]):
        sums = np.empty((4, W))
        # each entry as seen from either of its pixels: the second time it is where it leads to
        for k, dy, dx, back in (
            (0, 0, 0, 0), (1, 0, 1, 0), (2, 0, 2, 0), (3, 1, 0, 0), (4, 2, 0, 0), (5, 1, 1, 0), (6, 1, -1, 0),
            (1, 0, -1, 1), (2, 0, -2, 1), (3, -1, 0, 1), (4, -2, 0, 1), (5, -1, -1, 1), (6, -1, 1, 1),
        ):  # fmt: skip
            for neighbour in range(-1, 2):
                # rows of the block that lead there
                begin = max(by * BLOCK, (by + neighbour) * BLOCK - dy)
                end = min(H, (by + 1) * BLOCK, (by + neighbour + 1) * BLOCK - dy)
                if begin >= end:
                    continue
                sums[:] = 0
                for y in range(begin, end):
                    first = m + back * dx
                    values = stencil[k, y + m + back * dy, first : first + W]
                    here = (y - by * BLOCK - _MIDDLE) / BLOCK
                    there = (y + dy - (by + neighbour) * BLOCK - _MIDDLE) / BLOCK
                    _add_row(values, here, there, sums)
                _add_columns(sums, dx, out[neighbour + 1, by])
