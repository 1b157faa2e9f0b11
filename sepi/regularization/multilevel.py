"""Conjugate gradients for the second-order smoothing, preconditioned by hats of several widths.

Conjugate gradients are slow at what bends over many pixels, the slower the farther. The preconditioner is the inverse
as single pixels and as bilinear hats see it, 2, 8 and 32 pixels from node to node, each with its own diagonal, all
added up [1]_: a third of the steps that the diagonal takes with a direct solve for planes in blocks beside it, and
nothing to be factored. The system is a stencil, and stays one; the loop is short, and loading a library that has one
takes longer than solving.

References
----------
.. [1] Bramble, Pasciak, Xu: Parallel multilevel preconditioners. Mathematics of Computation 1990. doi:10.2307/2008789
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import numpy.typing as npt

from sepi.kernels import second_order as kernels

FloatArray = npt.NDArray[np.float64]
Inverse = Callable[[FloatArray], tuple[FloatArray, float]]

LEVELS = 5
"""Of hats, each with half the nodes of the one before, along either axis."""

COUNTED = 2
"""Every so many levels count; the others only lie between."""

HALF = np.float32(0.5)
"""Height of a hat where the next finer level has nodes beside its own."""


def conjugate_gradients(
    stencil: FloatArray, inverse: Inverse, right: FloatArray, start: FloatArray, rtol: float, max_iterations: int
) -> FloatArray:
    """Solve a system of the smoothing.

    Parameters
    ----------
    stencil : ndarray, shape (7, H + 2 MARGIN, W + 2 MARGIN), float32 or float64
        The matrix, as of :func:`multilevel_inverse`.
    inverse : callable
        Of :func:`multilevel_inverse`, in the same type.
    right, start : ndarray, shape (H + 2 MARGIN, W + 2 MARGIN), of the same type
        The right side, and where to start; with margins of zeros.
    rtol : float
        Residual at which to stop, relative to the right side.
    max_iterations : int
        Steps after which to stop anyway.

    Returns
    -------
    ndarray
        As ``right``.
    """
    enough = rtol * float(np.linalg.norm(right))
    if not enough:
        return np.zeros_like(right)
    direction, bent = np.zeros_like(right), np.zeros_like(right)
    kernels.bend(stencil, start, bent)
    solution, residual, before = start.copy(), right - bent, 1.0
    left = float(np.linalg.norm(residual)) ** 2
    for _ in range(max_iterations):
        if left < enough**2:
            break
        ahead, along = inverse(residual)
        direction *= along / before
        direction += ahead
        curved = kernels.bend(stencil, direction, bent)
        left = kernels.step(along / curved, direction, bent, solution, residual)
        before = along
    return solution


def multilevel_inverse(stencil: FloatArray, dtype: npt.DTypeLike) -> Inverse:
    """What is near the inverse of a matrix of the smoothing, symmetric and positive.

    Parameters
    ----------
    stencil : ndarray, shape (7, H + 2 MARGIN, W + 2 MARGIN), float64
        Of :func:`sepi.regularization.second_order.second_difference_stencil` and the data's weights, with a margin of
        zeros.
    dtype : dtype
        float32 or float64, in which it is applied.

    Returns
    -------
    callable
        Takes a picture with its margin, of that type, and returns one, which holds until it is called again, and the
        inner product of both.
    """
    inverse = _inverse(stencil[0], dtype)
    hats = [_inverse(diagonal, dtype) for diagonal in _diagonals(stencil)]
    levels = [np.empty(shape, dtype) for shape in _shapes(stencil)]
    out = np.zeros(stencil.shape[1:], dtype)

    def apply(residual: FloatArray) -> tuple[FloatArray, float]:
        kernels.onto_finest(residual, levels[0])
        for i in range(1, LEVELS):
            _onto_coarser(levels[i - 1], levels[i])
        for i in reversed(range(LEVELS)):
            if i % COUNTED:
                levels[i][:] = 0
            else:
                levels[i] *= hats[i // COUNTED]
            if i + 1 < LEVELS:
                _add_coarser(levels[i + 1], levels[i])
        return out, kernels.diagonal_and_finest(inverse, residual, levels[0], out)

    return apply


def _onto_coarser(fine: FloatArray, out: FloatArray) -> None:
    """Inner products with hats (h, w) from those (2 h - 1, 2 w - 1) with finer ones."""
    rows, halves = fine[::2].copy(), HALF * fine[1::2]
    rows[1:] += halves
    rows[:-1] += halves
    out[:] = 0
    out[:, 1:] += rows[:, 1::2]
    out[:, :-1] += rows[:, 1::2]
    out *= HALF
    out += rows[:, ::2]


def _add_coarser(coarse: FloatArray, fine: FloatArray) -> None:
    """Add hats of heights (h, w) to those of the finer level (2 h - 1, 2 w - 1)."""
    rows = np.repeat(coarse, 2, axis=0)[:-1]
    rows[1::2] = HALF * (coarse[:-1] + coarse[1:])
    fine[:, ::2] += rows
    fine[:, 1::2] += HALF * (rows[:, :-1] + rows[:, 1:])


def _shapes(stencil: FloatArray) -> list[tuple[int, int]]:
    """Rows and columns of nodes of each level: each of a coarser level is one of the finer."""
    widest = kernels.SPACING << (LEVELS - 1)
    rows, columns = (-(-(n - 2 * kernels.MARGIN) // widest) for n in stencil.shape[1:])
    return [((rows << i) + 1, (columns << i) + 1) for i in reversed(range(LEVELS))]


def _diagonals(stencil: FloatArray) -> list[FloatArray]:
    """What the matrix has on its diagonal as the hats of each level that counts see it."""
    found: list[FloatArray] = []
    for i, shape in list(enumerate(_shapes(stencil)))[::COUNTED]:
        diagonal = np.empty(shape)
        kernels.diagonal_of_hats(stencil, kernels.SPACING << i, diagonal)
        found.append(diagonal)
    return found


def _inverse(diagonal: FloatArray, dtype: npt.DTypeLike) -> FloatArray:
    """One by one; 0 of what no pixel is part of."""
    return np.divide(1, diagonal, out=np.zeros_like(diagonal), where=diagonal > 0).astype(dtype)
