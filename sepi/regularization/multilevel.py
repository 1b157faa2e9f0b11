"""Preconditioner of the second-order smoothing: its inverse as pixels, hats of two widths and planes see it, added up.

Conjugate gradients are slow at what bends over many pixels, the slower the farther. Each level takes what is as wide as
its functions: the diagonal takes single pixels, bilinear hats from 2 and from 4 pixels to the next, each with its own
diagonal, what is a few pixels wide [1]_, and a direct solve for one plane for each block the rest [2]_. Steps of the
solver become a third of what the diagonal and the planes alone need.

References
----------
.. [1] Bramble, Pasciak, Xu: Parallel multilevel preconditioners. Mathematics of Computation 1990. doi:10.2307/2008789
.. [2] Toselli, Widlund: Domain Decomposition Methods. Springer 2005. doi:10.1007/b137868
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import numpy.typing as npt

from sepi.memory import BLAS_BUFFER, require_memory

FloatArray = npt.NDArray[np.float64]


def multilevel_inverse(stencil: FloatArray, dtype: npt.DTypeLike) -> Callable[[FloatArray], FloatArray]:
    """What is near the inverse of a matrix of the smoothing, symmetric and positive.

    Parameters
    ----------
    stencil : ndarray, shape (7, H + 2 MARGIN, W + 2 MARGIN), float64
        Of :func:`sepi.regularization.second_order.second_difference_stencil` and the data's weights, with a margin of
        zeros of :data:`sepi.regularization.second_order_kernels.MARGIN` pixels.
    dtype : dtype
        float32 or float64, in which it is applied.

    Returns
    -------
    callable
        Takes and returns pictures with their margins, raveled, of that type.
    """
    from sepi.regularization.multilevel_kernels import SPACING, diagonal_of_hats, from_levels, onto_levels
    from sepi.regularization.second_order_kernels import MARGIN

    factors = _planes_system(stencil)
    shape = stencil.shape[1:]
    # each of the coarser nodes is one of the finer
    coarse = tuple(-(-(n - 2 * MARGIN) // (2 * SPACING)) + 1 for n in shape)
    fine = tuple(2 * n - 1 for n in coarse)
    diagonals = [np.empty(fine), np.empty(coarse)]
    for i, diagonal in enumerate(diagonals):
        diagonal_of_hats(stencil, SPACING << i, diagonal)
    inverse, *of_hats = (_inverse(diagonal, dtype) for diagonal in (stencil[0], *diagonals))
    blocks = _blocks(stencil)

    def apply(residual: FloatArray) -> FloatArray:
        vector, out = residual.reshape(shape), np.zeros(shape, dtype)
        hats, onto = [np.empty(n, dtype) for n in (fine, coarse)], np.empty((*blocks, 3))
        onto_levels(vector, *hats, onto)
        for heights, own in zip(hats, of_hats, strict=True):
            heights *= own
        from_levels(inverse, vector, *hats, factors.solve(onto.ravel()).reshape(onto.shape), out)
        return out.ravel()

    return apply


def _inverse(diagonal: FloatArray, dtype: npt.DTypeLike) -> FloatArray:
    """One by one; 0 of what no pixel is part of."""
    return np.divide(1, diagonal, out=np.zeros_like(diagonal), where=diagonal > 0).astype(dtype)


def _planes_system(stencil: FloatArray) -> Any:
    """Factors of the system as one plane for each block sees it: constant, slope along x, slope along y."""
    import scipy.sparse as sparse
    from scipy.sparse.linalg import splu

    from sepi.regularization.multilevel_kernels import matrix_of_planes

    rows, columns = _blocks(stencil)
    entries = np.zeros((3, rows, columns, 3, 3, 3))
    matrix_of_planes(stencil, entries)
    down, by, bx, across, i, j = np.ogrid[-1:2, :rows, :columns, -1:2, :3, :3]
    other_y, other_x = by + down, bx + across
    there = (other_y >= 0) & (other_y < rows) & (other_x >= 0) & (other_x < columns)
    there = np.broadcast_to(there, entries.shape)
    row = np.broadcast_to(3 * (by * columns + bx) + i, entries.shape)[there]
    column = np.broadcast_to(3 * (other_y * columns + other_x) + j, entries.shape)[there]
    size = 3 * rows * columns
    matrix = sparse.csc_matrix((entries[there], (row, column)), shape=(size, size))
    # blocks of one pixel's width have slopes that do nothing
    matrix = matrix + sparse.diags(np.full(size, 1e-9 * max(float(matrix.diagonal().max()), 1e-9)))
    require_memory(BLAS_BUFFER)
    return splu(matrix.tocsc(), permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0.0, options={"SymmetricMode": True})


def _blocks(stencil: FloatArray) -> tuple[int, int]:
    """Rows and columns of blocks."""
    from sepi.regularization.multilevel_kernels import BLOCK
    from sepi.regularization.second_order_kernels import MARGIN

    return tuple(-(-(n - 2 * MARGIN) // BLOCK) for n in stencil.shape[1:])
