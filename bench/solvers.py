"""Solvers of the global optimisation's sparse system, each to the same residual (Eq. 8)."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import pyamg
from scipy.sparse import linalg

from bench.measure import Figures, Prepared
from bench.scene import inputs
from sepi.errors import SepiError
from sepi.regularization.wls import (
    WlsParameters,
    data_weight,
    energy_system,
    rectified_confidence,
    smoothness_coefficient,
    solve,
)

Vector = npt.NDArray[np.float64]
Solver = Callable[[Any, Vector, Vector, float], Vector]
"""Function of matrix, right side, start and relative residual to the solution."""

MAX_ITERATIONS = 20_000


def multigrid(kind: str, matrix: Any, right: Vector, start: Vector, rtol: float) -> Vector:
    """Conjugate gradients with algebraic multigrid: ``ruge_stuben`` is classical, or ``smoothed_aggregation``."""
    hierarchy = getattr(pyamg, f"{kind}_solver")(matrix)
    return np.asarray(hierarchy.solve(right, x0=start, tol=rtol, accel="cg", maxiter=500))


def incomplete(matrix: Any, right: Vector, start: Vector, rtol: float) -> Vector:
    """Conjugate gradients with an incomplete factorisation."""
    factors = linalg.spilu(
        matrix.tocsc(), drop_tol=1e-4, fill_factor=10, permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0
    )
    inverse = linalg.LinearOperator(matrix.shape, factors.solve)
    solution, missed = linalg.cg(matrix, right, x0=start, rtol=rtol, maxiter=MAX_ITERATIONS, M=inverse)
    if missed:
        raise SepiError(f"no convergence in {MAX_ITERATIONS} iterations")
    return np.asarray(solution)


def direct(matrix: Any, right: Vector, start: Vector, rtol: float) -> Vector:
    """Sparse factorisation, ordered for a symmetric matrix."""
    factors = linalg.splu(
        matrix.tocsc(), permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0, options={"SymmetricMode": True}
    )
    return np.asarray(factors.solve(right))


SOLVERS: dict[str, Solver] = {
    "direct (SuperLU)": direct,
    "sepi's: Jacobi + CG, multigrid where needed": lambda matrix, right, start, rtol: solve(
        matrix, right, start.astype(np.float32), rtol
    ),
    "multigrid (Ruge-Stuben) + CG": partial(multigrid, "ruge_stuben"),
    "multigrid (smoothed aggregation) + CG": partial(multigrid, "smoothed_aggregation"),
    "incomplete LU + CG": incomplete,
}
"""Name to solver, the exact one first."""


def prepare(path: Path, name: str) -> Prepared:
    """Solve a scene's system; the exact solver stores its solution, with which others are compared."""
    light_field, before = inputs(path, "optimize")
    assert before is not None  # it is not the first stage
    parameters = WlsParameters()
    confidence = rectified_confidence(before.confidence, before.mask("textureless"), parameters)
    weight = data_weight(before.disparity, confidence, parameters)
    smoothness = smoothness_coefficient(light_field.reference_view, confidence, parameters)
    matrix, right = energy_system(before.disparity, weight, smoothness, parameters.alpha)
    start = before.disparity.astype(np.float64).ravel()
    exact = path.with_name("exact.npy")

    def figures(solution: Vector) -> Figures:
        if not exact.exists():
            np.save(exact, solution)
        difference = np.abs(solution - np.load(exact))
        residual = np.linalg.norm(right - matrix @ solution) / np.linalg.norm(right)
        return {
            "residual": float(residual),
            "largest_difference": float(difference.max()),
            "mean_difference": float(difference.mean()),
        }

    return Prepared(lambda: SOLVERS[name](matrix, right, start, parameters.rtol), figures)
