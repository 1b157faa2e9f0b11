"""Compiled loops of the second-order smoothing: its matrix, as a stencil, and the hats of its preconditioner.

Pictures have a margin of :data:`MARGIN` pixels of zeros on each side, so that no loop has to look where it is; hats
have none. Their nodes lie between pixels: that of number ``i`` of the finest, :data:`SPACING` pixels apart, at
``SPACING i - 0.5``. A coarser level has every other node, and each of its hats is one of the finer level and half of
each of its neighbours.

What is called in every step of the solver takes less than a millisecond: threads do together what goes through most
memory, and sums are those of rows, taken one after the other, to the same bits on any number of them.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from sepi.compiled import njit, prange

EXACT = {"nnan", "ninf", "nsz"}
"""Fast-math flags that keep every rounding as written: see :mod:`sepi.matching.plane_sweep_kernels`."""

MARGIN = 2
"""How far second differences reach, pixels."""

SPACING = 2
"""Pixels from node to node of the finest hats."""

_NEAR, _FAR = 0.75, 0.25
"""The finest hats at the pixels beside a node and at the next ones."""


@njit(parallel=True, cache=True, fastmath=EXACT)
def weights_of_differences(
    disparity: Any,
    reliability: Any,
    colour: Any,
    corners: Any,
    factors: Any,
    threshold: float,
    variance: float,
    out: Any,
) -> None:
    """Weights of second differences: :func:`sepi.regularization.second_order.smoothness_weights` in one direction.

    Parameters
    ----------
    disparity, reliability : ndarray, shape (H, W), float32
    colour : ndarray, shape (h, w), float64
        Squared colour distance along each difference.
    corners : ndarray, shape (n, 2), int64
        Rows and columns from a difference's first pixel to those that it is made of.
    factors : ndarray, shape (n,), float64
        Theirs.
    threshold, variance : float
        Difference that counts as a discontinuity, and squared colour distance at which smoothness falls.
    out : ndarray, shape (h, w), float64
        Filled.
    """
    for y in prange(out.shape[0]):
        for x in range(out.shape[1]):
            difference, trust = 0.0, reliability[y, x]
            for i in range(len(factors)):
                row, column = y + corners[i, 0], x + corners[i, 1]
                difference += factors[i] * disparity[row, column]
                trust = min(trust, reliability[row, column])
            difference /= threshold
            out[y, x] = np.exp(-min(difference * difference * trust + 2 * colour[y, x] / variance, 30.0))


@njit(forceinline=True, borrows=True)
def _add(row: Any, begin: int, weights: Any, factor: float) -> None:
    """Add weights, times a factor, to a row from a column on."""
    for x in range(weights.size):
        row[begin + x] += factor * weights[x]


@njit(cache=True, fastmath=EXACT, borrows=True)
def _stencil_row(y: int, along_x: Any, along_y: Any, across: Any, out: Any) -> None:
    """Row ``y`` of :func:`stencil_of`, of zeros so far."""
    H = along_x.shape[0]
    row, m, end = y + MARGIN, MARGIN, out.shape[2] - MARGIN
    own, right, right2 = out[0, row, m:end], out[1, row, m:end], out[2, row, m:end]
    below, below2 = out[3, row, m:end], out[4, row, m:end]
    for first, factor in ((0, 1.0), (1, 4.0), (2, 1.0)):
        _add(own, first, along_x[y], factor)
    _add(right, 0, along_x[y], -2.0)
    _add(right, 1, along_x[y], -2.0)
    _add(right2, 0, along_x[y], 1.0)
    for before, factor in ((0, 1.0), (1, 4.0), (2, 1.0)):
        if 0 <= y - before < H - 2:
            _add(own, 0, along_y[y - before], factor)
    for before in range(2):
        if 0 <= y - before < H - 2:
            _add(below, 0, along_y[y - before], -2.0)
    if y < H - 2:
        _add(below2, 0, along_y[y], 1.0)
    for before in range(2):
        if 0 <= y - before < H - 1:
            for first in range(2):
                _add(own, first, across[y - before], 1.0)
            _add(right, 0, across[y - before], -1.0)
    if y < H - 1:
        for first in range(2):
            _add(below, first, across[y], -1.0)
            _add(out[5 + first, row, m:end], first, across[y], 1.0)


@njit(parallel=True, cache=True, fastmath=EXACT)
def stencil_of(along_x: Any, along_y: Any, across: Any, out: Any) -> None:
    """Matrix of weighted second differences.

    Parameters
    ----------
    along_x, along_y, across : ndarray, shape (H, W - 2), (H - 2, W) and (H - 1, W - 1), float64
    out : ndarray, shape (7, H + 2 MARGIN, W + 2 MARGIN), float64
        That of :func:`sepi.regularization.second_order.second_difference_stencil`; filled.
    """
    for row in prange(out.shape[1]):
        for k in range(7):
            out[k, row] = 0
        y = row - MARGIN
        if 0 <= y < along_x.shape[0]:
            _stencil_row(y, along_x, along_y, across, out)


@njit(parallel=True, cache=True, fastmath=EXACT)
def add_data(weight: Any, stencil: Any, packed: Any) -> None:
    """Add the data's weights ``(H, W)`` to a matrix with its margin; ``packed``, of any type, becomes the same."""
    m = MARGIN
    for y in prange(stencil.shape[1]):
        if m <= y < m + weight.shape[0]:
            _add(stencil[0, y], m, weight[y - m], 1.0)
        for k in range(7):
            packed[k, y] = stencil[k, y]


@njit(forceinline=True, borrows=True, fastmath=EXACT | {"reassoc"})
def _dot(a: Any, b: Any) -> Any:
    """Inner product of two rows, in an order that vectorises."""
    total = a.dtype.type(0)
    for x in range(a.size):
        total += a[x] * b[x]
    return total


@njit(cache=True)
def _in_order(rows: Any) -> float:
    """Sum over rows of what each adds, in double precision and one after the other, whichever thread made them."""
    total = 0.0
    for value in rows:
        total += value
    return total


@njit(inline="always")
def _add_pair(forth: Any, there: Any, back: Any, before: Any, out: Any) -> None:
    """One entry and its mirror image; few arrays at a time, so that the loop vectorises."""
    for x in range(out.size):
        out[x] += forth[x] * there[x] + back[x] * before[x]


@njit(forceinline=True, borrows=True, fastmath=EXACT)
def _product_row(stencil: Any, vector: Any, y: int, out: Any) -> None:
    """Row ``y``, margin counted, of the matrix times a picture."""
    m = MARGIN
    n = vector.shape[1] - 2 * m
    c, v, target = stencil[0, y, m : m + n], vector[y, m : m + n], out[y, m : m + n]
    for x in range(n):
        target[x] = c[x] * v[x]
    for k, dy, dx in ((1, 0, 1), (2, 0, 2), (3, 1, 0), (4, 2, 0), (5, 1, 1), (6, 1, -1)):
        _add_pair(
            stencil[k, y, m : m + n], vector[y + dy, m + dx : m + dx + n],
            stencil[k, y - dy, m - dx : m - dx + n], vector[y - dy, m - dx : m - dx + n], target,
        )  # fmt: skip


@njit(forceinline=True, borrows=True, fastmath=EXACT)
def _turn(row: Any, ratio: Any, ahead: Any) -> None:
    for x in range(row.size):
        row[x] = ratio * row[x] + ahead[x]


@njit(parallel=True, cache=True, fastmath=EXACT)
def turn_and_bend(stencil: Any, ahead: Any, ratio: Any, direction: Any, out: Any) -> float:
    """Turn a direction, and take the matrix times it.

    Parameters
    ----------
    stencil : ndarray, shape (7, H + 2 MARGIN, W + 2 MARGIN), float32 or float64
        Of :func:`sepi.regularization.second_order.second_difference_stencil`, with a margin.
    ahead : ndarray, shape (H + 2 MARGIN, W + 2 MARGIN), of the same type
        With a margin of zeros.
    ratio : float32 or float64
    direction, out : ndarray, as ``ahead``
        ``direction`` becomes ``ratio * direction + ahead``, and ``out`` the matrix times that, but for its margin.

    Returns
    -------
    float
        Inner product of both.
    """
    m = MARGIN
    H, W = direction.shape[0] - 2 * m, direction.shape[1] - 2 * m
    for y in range(m, m + H):
        _turn(direction[y], ratio, ahead[y])
    along = np.empty(H, direction.dtype)
    for y in prange(m, m + H):
        _product_row(stencil, direction, y, out)
        along[y - m] = _dot(direction[y, m : m + W], out[y, m : m + W])
    return _in_order(along)


@njit(forceinline=True, borrows=True, fastmath=EXACT)
def _step(solution: Any, residual: Any, length: Any, direction: Any, bent: Any) -> None:
    for x in range(solution.size):
        solution[x] += length * direction[x]
        residual[x] -= length * bent[x]


@njit(parallel=True, cache=True, fastmath=EXACT)
def step(length: Any, direction: Any, bent: Any, solution: Any, residual: Any) -> float:
    """Add a direction, so many times, to a solution, and take what the matrix makes of it from the residual.

    Parameters
    ----------
    length : float32 or float64
    direction, bent, solution, residual : ndarray, shape (H + 2 MARGIN, W + 2 MARGIN), of the same type
        With margins of zeros; ``bent`` is the matrix times ``direction``.

    Returns
    -------
    float
        Squared norm of the residual.
    """
    squares = np.empty(len(solution), solution.dtype)
    for y in prange(len(solution)):
        _step(solution[y], residual[y], length, direction[y], bent[y])
        squares[y] = _dot(residual[y], residual[y])
    return _in_order(squares)


@njit(cache=True, fastmath=EXACT)
def onto_finest(vector: Any, out: Any) -> None:
    """Inner products of a picture with the finest hats.

    Parameters
    ----------
    vector : ndarray, shape (H + 2 MARGIN, W + 2 MARGIN), float32 or float64
    out : ndarray, shape (h, w), of the same type
        Filled.
    """
    H, W = vector.shape[0] - 2 * MARGIN, vector.shape[1] - 2 * MARGIN
    near, far = vector.dtype.type(_NEAR), vector.dtype.type(_FAR)
    # with zeros round the picture, as wide as the hats reach
    line = np.zeros(2 * out.shape[1] + 2, vector.dtype)
    for i in range(out.shape[0]):
        line[:] = 0
        within = line[2 : 2 + W]
        for dy, share in ((-2, far), (-1, near), (0, near), (1, far)):
            y = 2 * i + dy
            if 0 <= y < H:
                row = vector[y + MARGIN, MARGIN : MARGIN + W]
                for x in range(W):
                    within[x] += share * row[x]
        for j in range(out.shape[1]):
            x = 2 * j
            out[i, j] = far * (line[x] + line[x + 3]) + near * (line[x + 1] + line[x + 2])


@njit(cache=True, fastmath=EXACT)
def onto_coarser(fine: Any, out: Any) -> None:
    """Inner products with the hats ``(h, w)`` of the next level from those ``(2 h - 1, 2 w - 1)`` with finer ones."""
    half = fine.dtype.type(0.5)
    line = np.zeros(fine.shape[1] + 2, fine.dtype)
    for i in range(out.shape[0]):
        within = line[1 : 1 + fine.shape[1]]
        within[:] = fine[2 * i]
        for y in (2 * i - 1, 2 * i + 1):
            if 0 <= y < fine.shape[0]:
                row = fine[y]
                for x in range(row.size):
                    within[x] += half * row[x]
        for j in range(out.shape[1]):
            x = 2 * j + 1
            out[i, j] = line[x] + half * (line[x - 1] + line[x + 1])


@njit(cache=True, fastmath=EXACT)
def add_coarser(coarse: Any, fine: Any) -> None:
    """Add hats of heights ``coarse (h, w)`` to those of the finer level, ``fine (2 h - 1, 2 w - 1)``."""
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
def diagonal_and_finest(inverse: Any, vector: Any, fine: Any, out: Any) -> float:
    """``inverse * vector``, plus the finest hats.

    Parameters
    ----------
    inverse, vector, out : ndarray, shape (H + 2 MARGIN, W + 2 MARGIN), float32 or float64
        ``out`` is filled but for its margin.
    fine : ndarray, shape (h, w), of the same type
        Heights of the hats.

    Returns
    -------
    float
        Inner product of ``vector`` and ``out``.
    """
    H, W = vector.shape[0] - 2 * MARGIN, vector.shape[1] - 2 * MARGIN
    near, far = out.dtype.type(_NEAR), out.dtype.type(_FAR)
    total = 0.0
    line, hats = np.empty(fine.shape[1], out.dtype), np.empty(2 * fine.shape[1], out.dtype)
    for y in range(H):
        first, second = (near, far) if y % 2 == 0 else (far, near)
        above, below = fine[y // 2], fine[y // 2 + 1]
        for j in range(line.size):
            line[j] = first * above[j] + second * below[j]
        for j in range(line.size - 1):
            hats[2 * j] = near * line[j] + far * line[j + 1]
            hats[2 * j + 1] = far * line[j] + near * line[j + 1]
        row, own, target = vector[y + MARGIN], inverse[y + MARGIN], out[y + MARGIN]
        for x in range(W):
            target[x + MARGIN] = own[x + MARGIN] * row[x + MARGIN] + hats[x]
        total += _dot(row[MARGIN : MARGIN + W], target[MARGIN : MARGIN + W])
    return total


@njit(parallel=True, cache=True, fastmath=EXACT)
def diagonal_of_hats(stencil: Any, spacing: int, out: Any) -> None:
    """What the matrix has on its diagonal as hats see it.

    Parameters
    ----------
    stencil : ndarray, as in :func:`turn_and_bend`
    spacing : int
        Pixels from node to node.
    out : ndarray, shape (h, w), float64
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
