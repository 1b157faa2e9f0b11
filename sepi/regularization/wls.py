"""Weighted least squares on the 4-connected grid: the energy of the global optimisation (Eq. 8-12 of [1]_).

References
----------
.. [1] Zhou, Shi, Liu, Jin, Zhang, Hou: Light Field Depth Estimation via Stitched Epipolar Plane Images.
.. [2] Olson, Schroder: PyAMG: algebraic multigrid solvers in Python v4.0. 2018.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import cv2
import numpy as np
import numpy.typing as npt
from pydantic import Field

from sepi.lightfield import BoolMap, FloatMap
from sepi.stage import Parameters, relative_confidence

if TYPE_CHECKING:
    import scipy.sparse as sparse

FloatArray = npt.NDArray[np.float64]

LEAST_CONFIDENCE = 0.01
"""Least confidence, which keeps the system solvable."""

ITERATIONS_BEFORE_MULTIGRID = 200
"""Number of iterations that take about as long as setting up the multigrid."""


class WlsParameters(Parameters):
    """Parameters of the weighted least squares."""

    alpha: float = Field(
        3e-6, ge=0, description="weight of smoothness against data; for gradients of values 0..1 per px"
    )
    gradient_floor: float = Field(
        0.002, gt=0, description="image gradient below which smoothness no longer grows, 0..1 per px"
    )
    tau_0: float = Field(1000.0, ge=0, description="how sharply the data weight falls beyond tau_1")
    tau_1: float = Field(
        0.2, ge=0, description="standard deviation of the depth in 3x3 pixels that marks a discontinuity"
    )
    discontinuity_weight: float = Field(
        0.1, gt=0, le=1, description="share of its weight that data keeps at a discontinuity; Eq. 9: 0"
    )
    tau_2: float = Field(1.5, ge=0, description="how strongly confidence weakens smoothness")
    textureless_confidence: float = Field(0.8, ge=0, le=1, description="c_tl, confidence of textureless regions")
    confidence_power: float = Field(4.0, gt=0, le=10, description="exponent on the confidence as data weight")
    rtol: float = Field(
        1e-12, gt=0, lt=1, description="relative residual at which the solver stops; small for pixels of low weight"
    )


def rectified_confidence(confidence: FloatMap, textureless: BoolMap, parameters: WlsParameters) -> FloatMap:
    """Confidence c' of Eq. 10: a constant in textureless regions, else the confidence of the stage before."""
    own = relative_confidence(confidence)
    return np.where(textureless, parameters.textureless_confidence, own).astype(np.float32)


def data_weight(disparity: FloatMap, confidence: FloatMap, parameters: WlsParameters) -> FloatMap:
    """Weight w of Eq. 9: a power of the confidence, reduced at depth discontinuities; shape (H, W), float32."""
    mean = cv2.blur(disparity, (3, 3))
    deviation = np.sqrt(np.maximum(cv2.blur((disparity - mean) ** 2, (3, 3)), 0))
    cut = np.exp(-np.minimum(parameters.tau_0 * np.maximum(deviation - parameters.tau_1, 0), 80))
    trust = np.maximum(confidence, LEAST_CONFIDENCE) ** parameters.confidence_power
    return (trust * np.maximum(cut, parameters.discontinuity_weight)).astype(np.float32)


def smoothness_coefficient(reference_view: FloatMap, confidence: FloatMap, parameters: WlsParameters) -> FloatMap:
    """S = s_c s_t of Eq. 11-12; shape (H, W), float32."""
    dx, dy = (cv2.Sobel(reference_view, cv2.CV_32F, *order, ksize=3, scale=1 / 8) for order in ((1, 0), (0, 1)))
    squared = np.sum(cv2.split(np.atleast_3d(dx) ** 2 + np.atleast_3d(dy) ** 2), axis=0)
    return np.asarray(np.exp(-parameters.tau_2 * confidence) / (squared + parameters.gradient_floor**2), np.float32)


def energy_system(
    disparity: FloatMap, weight: FloatMap, smoothness: FloatMap, alpha: float
) -> tuple[sparse.csr_matrix, FloatArray]:
    """Normal equations of Eq. 8 on the 4-connected grid.

    The sum holds each pair of neighbours twice, with the coefficient of either pixel.

    Returns
    -------
    matrix : sparse matrix, shape (H * W, H * W), float64
        Symmetric, positive definite.
    right : ndarray, shape (H * W,), float64
    """
    import scipy.sparse as sparse

    H, W = disparity.shape
    index = np.arange(H * W).reshape(H, W)
    s = alpha * smoothness.astype(np.float64)
    first = np.concatenate([index[:, :-1].ravel(), index[:-1].ravel()])
    second = np.concatenate([index[:, 1:].ravel(), index[1:].ravel()])
    pair = np.concatenate([(s[:, :-1] + s[:, 1:]).ravel(), (s[:-1] + s[1:]).ravel()])
    w = weight.astype(np.float64).ravel()
    off = sparse.coo_matrix((-pair, (first, second)), shape=(H * W, H * W))
    off = (off + off.T).tocsr()
    diagonal = w - np.asarray(off.sum(axis=1)).ravel()
    return (off + sparse.diags(diagonal)).tocsr(), w * disparity.ravel()


def solve(matrix: sparse.csr_matrix, right: FloatArray, start: FloatMap, rtol: float) -> FloatArray:
    """Solution of the normal equations by conjugate gradients; shape of ``start``, float64.

    With little smoothness, the diagonal is a sufficient preconditioner, and setting up an algebraic multigrid [2]_
    would take several times as long as the solution. If a residual of ``rtol`` times the right side is not reached
    soon, the multigrid takes over: its number of iterations does not grow with smoothness or scarce data.
    """
    import scipy.sparse as sparse
    from scipy.sparse.linalg import cg

    vector = start.astype(np.float64).ravel()
    inverse = sparse.diags_array(1 / matrix.diagonal())
    solution, missed = cg(matrix, right, x0=vector, rtol=rtol, maxiter=ITERATIONS_BEFORE_MULTIGRID, M=inverse)
    if missed:
        import pyamg  # slow to import, seldom needed

        hierarchy = pyamg.ruge_stuben_solver(matrix)
        solution = hierarchy.solve(right, x0=solution, tol=rtol, accel="cg", maxiter=100)
    return np.asarray(solution).reshape(start.shape)
