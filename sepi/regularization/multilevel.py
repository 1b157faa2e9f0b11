"""Conjugate gradients for second-order smoothing, with a multilevel preconditioner of bilinear hats.

Conjugate gradients take many steps for a surface that bends over many pixels. The preconditioner adds up inverse
diagonals of the matrix on several levels: single pixels, and bilinear hats with 2, 8 and 32 pixels between nodes [1]_.
It needs no factorisation, and a third of the steps of a diagonal combined with a direct solution for planes in blocks.
The matrix remains a stencil. The loop is written out because importing a library for it takes longer than solving.

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
"""Number of levels of hats, each with half the nodes of the finer one along either axis."""

COUNTED = 2
"""Every second level is part of the preconditioner; the others only connect them."""

HALF = np.float32(0.5)
"""Height of a hat at the finer level's nodes beside its own."""


def conjugate_gradients(
    stencil: FloatArray, inverse: Inverse, right: FloatArray, start: FloatArray, rtol: float, max_iterations: int
) -> FloatArray:
    """Solution of a system of the smoothing, by preconditioned conjugate gradients.

    Parameters
    ----------
    stencil : ndarray, shape (7, H + 2 MARGIN, W + 2 MARGIN), float32 or float64
        The matrix, as for :func:`multilevel_inverse`.
    inverse : callable
        Preconditioner from :func:`multilevel_inverse`, of the same type.
    right, start : ndarray, shape (H + 2 MARGIN, W + 2 MARGIN), of the same type
        The right side and the initial solution, with margins of zeros.
    rtol : float
        Residual at which the solver stops, relative to the right side.
    max_iterations : int
        Most steps of the solver.

    Returns
    -------
    ndarray
        Shape and type of ``right``.
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
    """Approximate inverse of a matrix of the smoothing, symmetric and positive.

    Parameters
    ----------
    stencil : ndarray, shape (7, H + 2 MARGIN, W + 2 MARGIN), float64
        :func:`sepi.regularization.second_order.second_difference_stencil` plus the data's weights, with a margin of
        zeros.
    dtype : dtype
        Type in which the inverse is applied, float32 or float64.

    Returns
    -------
    callable
        Takes a picture with its margin and returns another one and the inner product of both. The next call overwrites
        the returned picture.
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
    """Compute the inner products with hats (h, w) from those with finer hats (2 h - 1, 2 w - 1)."""
    rows, halves = fine[::2].copy(), HALF * fine[1::2]
    rows[1:] += halves
    rows[:-1] += halves
    out[:] = 0
    out[:, 1:] += rows[:, 1::2]
    out[:, :-1] += rows[:, 1::2]
    out *= HALF
    out += rows[:, ::2]


def _add_coarser(coarse: FloatArray, fine: FloatArray) -> None:
    """Add hats of heights (h, w) to the heights of the finer level (2 h - 1, 2 w - 1)."""
    rows = np.repeat(coarse, 2, axis=0)[:-1]
    rows[1::2] = HALF * (coarse[:-1] + coarse[1:])
    fine[:, ::2] += rows
    fine[:, 1::2] += HALF * (rows[:, :-1] + rows[:, 1:])


def _shapes(stencil: FloatArray) -> list[tuple[int, int]]:
    """Rows and columns of nodes of each level, finest first; nodes of a coarser level are nodes of the finer one."""
    widest = kernels.SPACING << (LEVELS - 1)
    rows, columns = (-(-(n - 2 * kernels.MARGIN) // widest) for n in stencil.shape[1:])
    return [((rows << i) + 1, (columns << i) + 1) for i in reversed(range(LEVELS))]


def _diagonals(stencil: FloatArray) -> list[FloatArray]:
    """Diagonal of the matrix in the hats of each level of the preconditioner."""
    found: list[FloatArray] = []
    for i, shape in list(enumerate(_shapes(stencil)))[::COUNTED]:
        diagonal = np.empty(shape)
        kernels.diagonal_of_hats(stencil, kernels.SPACING << i, diagonal)
        found.append(diagonal)
    return found


def _inverse(diagonal: FloatArray, dtype: npt.DTypeLike) -> FloatArray:
    """Reciprocals of a diagonal; 0 for hats without pixels."""
    return np.divide(1, diagonal, out=np.zeros_like(diagonal), where=diagonal > 0).astype(dtype)
