"""Solver of the global optimisation: conjugate gradients with a multilevel preconditioner of bilinear hats.

The weighted least squares of the paper and the second-order smoothing both minimise ``sum_p w_p (d_p - z_p)^2 + d^T A
d`` over disparities ``d``, where ``z`` is the data and ``w`` its weight; ``A`` is kept as a stencil instead of a sparse
matrix. Conjugate gradients take many steps for a surface that changes over many pixels. The preconditioner adds up
inverse diagonals of the matrix on several levels: single pixels, and bilinear hats with 2, 8 and 32 pixels between
nodes [1]_. It needs no factorisation, and a third of the steps of a diagonal combined with a direct solution for planes
in blocks. The loop is written out because importing a library for it takes longer than solving.

References
----------
.. [1] Bramble, Pasciak, Xu: Parallel multilevel preconditioners. Mathematics of Computation 1990. doi:10.2307/2008789
"""

from __future__ import annotations

import math
from collections.abc import Callable
from itertools import pairwise
from typing import Any

import numpy as np
import numpy.typing as npt

from sepi.kernels import second_order as kernels
from sepi.lightfield import FloatMap

FloatArray = npt.NDArray[Any]
Inverse = Callable[[FloatArray], tuple[FloatArray, float]]

LEVELS = 5
"""Number of levels of hats, each with half the nodes of the finer one along either axis."""

COUNTED = 2
"""Every second level is part of the preconditioner; the others only connect them."""

MARGIN: int = kernels.MARGIN
"""Reach of the stencil, pixels, and so the width of the zeros round the solver's pictures."""

LEAST_WEIGHT = 1e-9
"""Least weight of the data, which keeps the system solvable."""


def solve_smooth(
    smoothness: FloatArray, weight: FloatMap, data: FloatMap, start: FloatMap, rtol: float, max_iterations: int
) -> FloatMap:
    """Disparities that minimise the energy.

    Parameters
    ----------
    smoothness : ndarray, shape (N, H + 2 MARGIN, W + 2 MARGIN), float32 or float64
        ``A``, in the precision of the solver: the first N <= 7 entries of each pixel with itself and with the pixels
        to the right by 1 and 2, below by 1 and 2, below to the right, and below to the left, in a margin of zeros.
        This function adds the data's weights.
    weight, data : ndarray, shape (H, W), float32
        ``w`` and ``z``.
    start : ndarray, shape (H, W), float32
        Initial disparities.
    rtol : float
        Residual at which the solver stops, relative to the data's deviations from their mean; in single precision at
        least 1e-5.
    max_iterations : int
        Most steps of the solver.

    Returns
    -------
    ndarray, shape (H, W), float32
    """
    if not weight.any():
        # without weights any plane is a solution
        return data
    w = np.maximum(weight.astype(smoothness.dtype), LEAST_WEIGHT)
    # smoothness ignores constants: without the mean, rtol does not depend on the zero of disparity
    mean = np.average(data, weights=weight).astype(smoothness.dtype)
    inside = np.s_[MARGIN:-MARGIN, MARGIN:-MARGIN]
    smoothness[0][inside] += w
    right, first = np.zeros((2, *smoothness.shape[1:]), smoothness.dtype)
    right[inside], first[inside] = w * (data - mean), start - mean
    inverse = multilevel_inverse(smoothness)
    solution = conjugate_gradients(smoothness, inverse, right, first, rtol, max_iterations)
    return np.asarray(solution[inside] + mean, np.float32)


def conjugate_gradients(
    stencil: FloatArray, inverse: Inverse, right: FloatArray, start: FloatArray, rtol: float, max_iterations: int
) -> FloatArray:
    """Solution of a system, by preconditioned conjugate gradients.

    Parameters
    ----------
    stencil : ndarray, shape (N, H + 2 MARGIN, W + 2 MARGIN), float32 or float64
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
    kernels.bend(stencil, start, 0.0, direction, bent)
    solution, residual, before = start.copy(), right - bent, math.inf
    left = float(np.linalg.norm(residual)) ** 2
    for _ in range(max_iterations):
        if left < enough**2:
            break
        ahead, along = inverse(residual)
        curved = kernels.bend(stencil, ahead, along / before, direction, bent)
        left = kernels.step(along / curved, direction, bent, solution, residual)
        before = along
    return solution


def multilevel_inverse(stencil: FloatArray) -> Inverse:
    """Approximate inverse of a matrix, symmetric and positive.

    Parameters
    ----------
    stencil : ndarray, shape (N, H + 2 MARGIN, W + 2 MARGIN), float32 or float64
        The smoothness, as for :func:`solve_smooth`, plus the data's weights.

    Returns
    -------
    callable
        Takes a picture with its margin and returns another one and the inner product of both. The next call overwrites
        the returned picture.
    """
    inverse, dtype = _inverse(stencil[0]), stencil.dtype
    hats, levels = [], []
    for i, shape in enumerate(_shapes(stencil)):
        diagonal = np.zeros(shape, dtype)
        if i % COUNTED == 0:
            kernels.diagonal_of_hats(stencil, kernels.SPACING << i, diagonal)
        hats.append(_inverse(diagonal))
        levels.append(np.empty(shape, dtype))
    nothing, out = np.zeros([n // 2 + 1 for n in levels[-1].shape], dtype), np.zeros(stencil.shape[1:], dtype)

    def apply(residual: FloatArray) -> tuple[FloatArray, float]:
        kernels.onto_finest(residual, levels[0])
        for fine, coarse in pairwise(levels):
            kernels.onto_coarser(fine, coarse)
        for coarse, diagonal, fine in reversed(list(zip([*levels[1:], nothing], hats, levels, strict=True))):
            kernels.onto_finer(coarse, diagonal, fine)
        return out, kernels.diagonal_and_finest(inverse, residual, levels[0], out)

    return apply


def _shapes(stencil: FloatArray) -> list[tuple[int, int]]:
    """Rows and columns of nodes of each level, finest first; nodes of a coarser level are nodes of the finer one."""
    widest = kernels.SPACING << (LEVELS - 1)
    rows, columns = (-(-(n - 2 * kernels.MARGIN) // widest) for n in stencil.shape[1:])
    return [((rows << i) + 1, (columns << i) + 1) for i in reversed(range(LEVELS))]


def _inverse(diagonal: FloatArray) -> FloatArray:
    """Reciprocals of a diagonal; 0 for hats without pixels."""
    return np.divide(1, diagonal, out=np.zeros_like(diagonal), where=diagonal > 0)
