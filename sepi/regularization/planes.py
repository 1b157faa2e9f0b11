"""Planes of disparity on superpixels: robust fits, and the coupled energy that propagates them (Eq. 7 of [1]_).

A plane is ``(value, gx, gy)``: the disparity at the superpixel's centroid and its change over ``UNIT`` pixels in x and
y.

References
----------
.. [1] Zhou, Shi, Liu, Jin, Zhang, Hou: Light Field Depth Estimation via Stitched Epipolar Plane Images.
"""

from __future__ import annotations

import numpy as np
import scipy.sparse as sparse
from scipy.sparse.linalg import spsolve

from sepi.image.superpixels import Adjacency, Superpixels
from sepi.kernels import planes as kernels
from sepi.lightfield import BoolMap, FloatArray, FloatMap
from sepi.process.memory import take_blas_buffer

UNIT = 15.0
"""Length over which gradients are measured, pixels: about a superpixel, so that the unknowns have similar scales."""

ITERATIONS = 10
"""Number of re-weightings of the absolute values; the tolerance shrinks with each."""

EQUAL_SLOPES = 10.0
"""Weight of equal slopes, relative to equal values at the common border."""


def basis(segments: Superpixels) -> FloatArray:
    """Coefficients of the three plane parameters at every pixel; shape (H * W, 3)."""
    rows, columns = np.indices(segments.labels.shape)
    labels = segments.labels.ravel()
    offset = np.stack([columns.ravel(), rows.ravel()], axis=1) - segments.centroids[labels]
    return np.column_stack([np.ones(len(labels)), offset / UNIT])


def evaluate_planes(segments: Superpixels, planes: FloatArray, design: FloatArray) -> FloatMap:
    """Disparity of every pixel on its superpixel's plane; shape (H, W), float32."""
    values = np.empty(segments.labels.shape, np.float32)
    kernels.values_of_planes(segments.labels.ravel(), design, planes, values.reshape(-1))
    return values


def fit_planes(
    segments: Superpixels, disparity: FloatMap, weight: FloatMap, design: FloatArray, tolerance: float
) -> FloatArray:
    """Robust plane of each superpixel by re-weighted least squares, starting at the median disparity.

    Parameters
    ----------
    segments : Superpixels
    disparity, weight : ndarray, shape (H, W), float32
    design : ndarray, shape (H * W, 3)
        From :func:`basis`.
    tolerance : float
        Residual of an inlier, pixels per view step.

    Returns
    -------
    ndarray, shape (N, 3), float
    """
    planes: FloatArray = np.zeros((len(segments), 3))
    planes[:, 0] = _medians(segments, disparity)
    # a weak penalty on slopes keeps superpixels with few good pixels solvable
    ridge = np.diag([1e-6, 1e-2, 1e-2])
    for spread in _shrinking(tolerance):
        residual = evaluate_planes(segments, planes, design) - disparity
        left, right = _normal_equations(segments, disparity, weight / (1 + (residual / spread) ** 2) ** 2, design)
        planes = np.asarray(np.linalg.solve(left + ridge, right[..., None])[..., 0], np.float64)
    return planes


def propagate(
    segments: Superpixels,
    adjacent: Adjacency,
    affinity: FloatArray,
    planes: FloatArray,
    free: BoolMap,
    disparity: FloatMap,
    weight: FloatMap,
    design: FloatArray,
    continuity: float,
    tolerance: float,
) -> FloatArray:
    """Planes of least coupled energy (Eq. 7) for the free superpixels; the others keep theirs.

    Re-weighting minimises the absolute values of Eq. 7: of the data, ``|d_hat - d|``, and of the continuity, ``|d_hat -
    d_l|``, where ``d_l`` is the neighbour's plane at the common border. This re-weighting is the equation's
    denominator, which weakens the coupling across a change of depth; ``affinity`` is its factor of likeness. All free
    superpixels are solved for together, so depth spreads inwards from reliable edges.

    Parameters
    ----------
    segments : Superpixels
    adjacent : Adjacency
    affinity : ndarray, shape (E,), float
        Likeness of the two superpixels of each border, 0..1.
    planes : ndarray, shape (N, 3), float
        Planes of the held superpixels, and initial ones of the others.
    free : ndarray, shape (N,), bool
    disparity, weight : ndarray, shape (H, W), float32
        Data.
    design : ndarray, shape (H * W, 3)
    continuity : float
        tau_out: weight of agreement between neighbours, relative to the data of a superpixel.
    tolerance : float
        Disagreement beyond which data or a neighbour is an outlier, pixels per view step.

    Returns
    -------
    ndarray, shape (N, 3), float
    """
    touched = free[adjacent.first] | free[adjacent.second]
    adjacent, affinity = adjacent.subset(touched), affinity[touched]
    at_first, at_second = (
        np.column_stack([np.ones(len(affinity)), (adjacent.midpoints - segments.centroids[side]) / UNIT])
        for side in (adjacent.first, adjacent.second)
    )
    strength = continuity * affinity * adjacent.lengths / UNIT
    weight = np.where(free[segments.labels], weight, 0)
    unknown = np.repeat(free, 3)
    solution = planes.copy()
    trust = np.ones(len(affinity))
    data_weight = weight
    blocks = np.arange(len(segments))
    take_blas_buffer()
    for spread in _shrinking(tolerance):
        left, right = _normal_equations(segments, disparity, data_weight, design)
        agreement = _agreement(adjacent, at_first, at_second, strength * trust, len(segments))
        data = sparse.bsr_array((left / UNIT**2, blocks, np.append(blocks, len(blocks)))).tocsr()
        system = data + agreement + 1e-9 * sparse.eye_array(unknown.size)
        system = system.tocsr()[unknown]
        known = system[:, ~unknown] @ solution.ravel()[~unknown]
        solved = spsolve(system[:, unknown].tocsc(), right.ravel()[unknown] / UNIT**2 - known)
        solution[free] = solved.reshape(-1, 3)
        residual = evaluate_planes(segments, solution, design) - disparity
        data_weight = weight / (1 + (residual / spread) ** 2)
        step = (at_first * solution[adjacent.first]).sum(axis=1) - (at_second * solution[adjacent.second]).sum(axis=1)
        trust = 1 / (1 + (step / spread) ** 2)
    return solution


def _shrinking(tolerance: float) -> list[float]:
    """Tolerances from wide to final, so that the initial planes do not decide what is an outlier."""
    return [max(tolerance, 0.5 * 0.6**k) for k in range(ITERATIONS)]


def _medians(segments: Superpixels, values: FloatMap) -> FloatArray:
    order = np.lexsort((values.ravel(), segments.labels.ravel()))
    starts = np.concatenate([[0], np.cumsum(segments.sizes)[:-1]])
    return np.asarray(values.ravel()[order][starts + segments.sizes // 2], np.float64)


def _normal_equations(
    segments: Superpixels, disparity: FloatMap, weight: FloatMap, design: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Normal equations of each superpixel's data: matrices (N, 3, 3) and right sides (N, 3)."""
    left, right = np.zeros((len(segments), 3, 3)), np.zeros((len(segments), 3))
    weights, values = (np.ascontiguousarray(of_pixels, np.float32).reshape(-1) for of_pixels in (weight, disparity))
    kernels.add_normal_equations(segments.labels.ravel(), design, weights, values, left, right)
    return left, right


def _agreement(
    adjacent: Adjacency, at_first: FloatArray, at_second: FloatArray, strength: FloatArray, count: int
) -> sparse.csr_array:
    """Quadratic form of the disagreement of neighbours in values at the border's middle, and in slopes."""
    number = len(strength)
    rows = np.arange(number)
    triples = []
    for p in range(3):
        triples.append((rows, 3 * adjacent.first + p, at_first[:, p]))
        triples.append((rows, 3 * adjacent.second + p, -at_second[:, p]))
    root = np.full(number, np.sqrt(EQUAL_SLOPES))
    for p in (1, 2):
        triples.append((rows + p * number, 3 * adjacent.first + p, root))
        triples.append((rows + p * number, 3 * adjacent.second + p, -root))
    row, column, value = (np.concatenate(parts) for parts in zip(*triples, strict=True))
    difference = sparse.csr_array((value, (row, column)), shape=(3 * number, 3 * count))
    return difference.T @ sparse.diags_array(np.tile(strength, 3)) @ difference
