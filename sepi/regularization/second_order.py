"""Second-order smoothing of a disparity map: planes are free, second differences cost, and the data counts by what it
knows.

Minimises ``sum_p w_p (d_p - z_p)^2 + sum_q c_q (D_q d)^2`` over disparities ``d``, where ``z`` is the data, ``w`` its
weight, and ``D_q`` the second differences along x, along y and across; ``c_q`` is small where that of the data is
large, unless the data there is worth little, and where the colours change. The system has 13 entries a row and is
solved by conjugate gradients; what those are slow at, curvature over long distances, is taken by a direct solve for one
plane for each block of pixels, added to the diagonal as preconditioner (two-level Schwarz, [1]_).

References
----------
.. [1] Toselli, Widlund: Domain Decomposition Methods. Springer 2005. doi:10.1007/b137868
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
import scipy.sparse as sparse
from scipy.sparse.linalg import LinearOperator, cg, splu

from sepi.lightfield import FloatMap
from sepi.regularization.direct_solver import require_blas_memory

FloatArray = npt.NDArray[np.float64]
Corner = tuple[slice, slice]

BLOCK = 8
"""Width of the preconditioner's blocks, pixels."""

_ALL = slice(None)
# first, middle, last pixel of second differences along x and y; corners of the mixed difference
_ALONG_X = ((_ALL, slice(None, -2)), (_ALL, slice(1, -1)), (_ALL, slice(2, None)))
_ALONG_Y = ((slice(None, -2), _ALL), (slice(1, -1), _ALL), (slice(2, None), _ALL))
_BACK, _ON = slice(None, -1), slice(1, None)
_ACROSS = ((_BACK, _BACK), (_BACK, _ON), (_ON, _BACK), (_ON, _ON))
_SECOND, _MIXED = (1.0, -2.0, 1.0), (1.0, -1.0, -1.0, 1.0)


def smoothness_weights(
    disparity: FloatMap, guide: FloatMap, reliability: FloatMap, threshold: float, colour_variance: float
) -> list[FloatArray]:
    """Weights of the second differences along x, along y and across, 0..1.

    Parameters
    ----------
    disparity : ndarray, shape (H, W), float32
        The data.
    guide : ndarray, shape (H, W, 3), float32
        Colours, 0..1.
    reliability : ndarray, shape (H, W), float32
        0..1: how far a second difference of the data is believed.
    threshold : float
        Second difference that counts as a discontinuity, pixels per view step.
    colour_variance : float
        Squared RGB distance at which smoothness falls.

    Returns
    -------
    list of ndarray
        Of shapes (H, W - 2), (H - 2, W) and (H - 1, W - 1).
    """

    def weight(
        corners: tuple[Corner, ...], factors: tuple[float, ...], pairs: tuple[tuple[int, int], ...]
    ) -> FloatArray:
        difference = np.asarray(sum(f * disparity[p].astype(np.float64) for f, p in zip(factors, corners, strict=True)))
        trust = np.minimum.reduce([reliability[p] for p in corners])
        colour = sum(((guide[corners[a]] - guide[corners[b]]) ** 2).sum(axis=2) for a, b in pairs)
        exponent = (difference / threshold) ** 2 * trust + 2 * np.asarray(colour, np.float64) / colour_variance
        return np.asarray(np.exp(-np.minimum(exponent, 30)))

    return [
        weight(_ALONG_X, _SECOND, ((0, 1), (2, 1))),
        weight(_ALONG_Y, _SECOND, ((0, 1), (2, 1))),
        weight(_ACROSS, _MIXED, ((0, 3), (1, 2))),
    ]


def second_difference_matrix(weights: list[FloatArray], shape: tuple[int, int]) -> sparse.csr_matrix:
    """Matrix of the smoothness term: ``d^T A d`` is the weighted sum of squared second differences."""
    numbers = np.arange(shape[0] * shape[1], dtype=np.int32).reshape(shape)
    total = sparse.csr_matrix((numbers.size, numbers.size))
    for corners, factors, weight in zip(
        (_ALONG_X, _ALONG_Y, _ACROSS), (_SECOND, _SECOND, _MIXED), weights, strict=True
    ):
        root = np.sqrt(weight).ravel()
        rows = np.tile(np.arange(root.size, dtype=np.int32), len(corners))
        columns = np.concatenate([numbers[p].ravel() for p in corners])
        values = np.concatenate([f * root for f in factors])
        difference = sparse.csr_matrix((values, (rows, columns)), shape=(root.size, numbers.size))
        total = total + difference.T @ difference
    return total.tocsr()


def solve_smooth(
    smoothness: sparse.csr_matrix, weight: FloatMap, data: FloatMap, rtol: float, max_iterations: int
) -> FloatMap:
    """Disparities of least energy.

    Parameters
    ----------
    smoothness : sparse matrix, shape (H W, H W)
        From :func:`second_difference_matrix`, times the strength.
    weight, data : ndarray, shape (H, W), float32
        ``w`` and ``z``; the data is also where the solver starts.
    rtol : float
        Residual, relative to the data's deviations from their mean, at which the solver stops.
    max_iterations : int
        Steps after which it stops anyway.

    Returns
    -------
    ndarray, shape (H, W), float32
    """
    w = weight.ravel().astype(np.float64) + 1e-9
    matrix = (smoothness + sparse.diags(w)).tocsr()
    start = data.ravel().astype(np.float64)
    # smoothness does not know constants: without the mean, the rtol does not depend on where zero lies
    mean = np.average(start, weights=w)
    start = start - mean
    solution, _ = cg(
        matrix, w * start, x0=start, rtol=rtol, atol=0, maxiter=max_iterations, M=_two_levels(matrix, data.shape)
    )
    return np.asarray(solution + mean, np.float32).reshape(data.shape)


def _two_levels(matrix: sparse.csr_matrix, shape: tuple[int, ...]) -> LinearOperator:
    """Preconditioner: the diagonal, plus a direct solve for one plane for each block."""
    planes = _block_planes(shape)
    onto = planes.T.tocsr()
    coarse = (onto @ matrix @ planes).tocsc()
    # blocks of one pixel's width have slopes that do nothing
    coarse = coarse + sparse.diags(np.full(coarse.shape[0], 1e-9 * max(float(coarse.diagonal().max()), 1e-9)))
    require_blas_memory()
    factors = splu(coarse.tocsc(), permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0.0, options={"SymmetricMode": True})
    inverse = 1 / matrix.diagonal()

    def apply(residual: FloatArray) -> FloatArray:
        residual = residual.ravel()
        return np.asarray(inverse * residual + planes @ factors.solve(onto @ residual))

    return LinearOperator(matrix.shape, matvec=apply)


def _block_planes(shape: tuple[int, ...]) -> sparse.csr_matrix:
    """Constant and two slopes on each block, as columns; shape (H W, 3 blocks)."""
    y, x = np.mgrid[: shape[0], : shape[1]]
    blocks_across = -(-shape[1] // BLOCK)
    number = 3 * ((y // BLOCK) * blocks_across + x // BLOCK).ravel()
    middle = (BLOCK - 1) / 2
    values = [np.ones(number.size), ((x % BLOCK - middle) / BLOCK).ravel(), ((y % BLOCK - middle) / BLOCK).ravel()]
    pixels = np.tile(np.arange(number.size), 3)
    columns = np.concatenate([number, number + 1, number + 2])
    return sparse.csr_matrix(
        (np.concatenate(values), (pixels, columns)), shape=(number.size, 3 * blocks_across * -(-shape[0] // BLOCK))
    )
