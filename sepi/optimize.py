"""Global optimisation (section IV-D, Eq. 8-12 of [1]_).

``wls`` minimises the weighted least squares energy of Eq. 8: fidelity to the refined depth where it deserves it (Eq.
9-10: the confidences of occluded, textureless and other pixels, little where the depth changes abruptly), and
smoothness on the 4-connected grid where the image is smooth (Eq. 11) and the depth uncertain (Eq. 12).

``second_order`` goes back to the views instead: Gauss-Newton steps on their residuals
(:mod:`sepi.matching.gauss_newton`) bring the depth below the candidate step, and second-order smoothing
(:mod:`sepi.regularization.second_order`), which leaves planes free, weighs each pixel by how much the views know about
it. ``gauss_newton`` leaves out the smoothing, ``second_order_colours`` the detail layer. ``none`` hands the depth on.

References
----------
.. [1] Zhou, Shi, Liu, Jin, Zhang, Hou: Light Field Depth Estimation via Stitched Epipolar Plane Images.
.. [2] Olson, Schroder: PyAMG: algebraic multigrid solvers in Python v4.0. 2018.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Self

import cv2
import numpy as np
import numpy.typing as npt
from pydantic import Field, model_validator

from sepi.command import stage_command
from sepi.lightfield import FloatMap, LightField
from sepi.matching.base_detail import COLOURS_ALONE_SCALE, BaseDetail, BaseDetailParameters, base_detail_decomposition
from sepi.stage import (
    Choice,
    NoParameters,
    Parameters,
    Progress,
    StageMaps,
    relative_confidence,
    require_previous,
    with_defaults,
)

if TYPE_CHECKING:
    import scipy.sparse as sparse

FloatArray = npt.NDArray[np.float64]

LEAST_CONFIDENCE = 0.01
"""Keeps the system solvable where no pixel is trusted."""

STEPS_BEFORE_MULTIGRID = 200
"""As long as setting up the multigrid takes."""


UNIFORM_WEIGHT = 0.05
"""Weight of a plane that was put into a region without texture; planes cost nothing, so little holds it."""

IGNORANCE = 0.01
"""What a view's information of 1 / px^2 adds to the bend, in the confidence; pixels per view step."""

HALF_CONFIDENT_BEND = 0.01
"""Bend at which the confidence is one half, pixels per view step."""

LEAST_RELIABILITY = 1e-6
LEAST_SMOOTHNESS = 1e-8


class WlsParameters(Parameters):
    """Parameters of the weighted least squares."""

    alpha: float = Field(
        3e-6, ge=0, description="weight of smoothness against data; for gradients of values 0..1 per px"
    )
    gradient_floor: float = Field(
        0.002, gt=0, description="image gradient below which all is equally smooth, 0..1 per px"
    )
    tau_0: float = Field(1000.0, ge=0, description="how sharply the data weight falls beyond tau_1")
    tau_1: float = Field(
        0.2, ge=0, description="standard deviation of the depth in 3x3 pixels that marks a step, px per step"
    )
    discontinuity_weight: float = Field(
        0.1, gt=0, le=1, description="share of its weight that the data keeps at a step, where Eq. 9 would leave none"
    )
    tau_2: float = Field(1.5, ge=0, description="how strongly confidence weakens smoothness")
    textureless_confidence: float = Field(0.8, ge=0, le=1, description="c_tl, confidence of textureless regions")
    confidence_power: float = Field(4.0, gt=0, le=10, description="exponent on the confidence as data weight")
    rtol: float = Field(
        1e-12, gt=0, lt=1, description="relative residual at which the solver stops; pixels of low weight need it small"
    )


class SecondOrderParameters(BaseDetailParameters):
    """Parameters of Gauss-Newton refinement and second-order smoothing."""

    refinements: int = Field(0, ge=0, le=20, description="Gauss-Newton steps before the first smoothing")
    refinement_radius: int = Field(3, ge=0, le=20, description="window of these steps, 2 r + 1 pixels")
    solves: int = Field(2, ge=0, le=10, description="rounds of one Gauss-Newton step and one smoothing")
    solve_radius: int = Field(2, ge=0, le=20, description="window of the steps of these rounds, 2 r + 1 pixels")
    max_update: float = Field(0.05, gt=0, description="longest Gauss-Newton step, pixels per view step")
    occlusion_margin: float = Field(0.15, ge=0, description="by how much a cover must be nearer, pixels per view step")
    strength: float = Field(5.0, ge=0, description="weight of the smoothness; the best-known tenth of pixels weighs 1")
    second_difference_threshold: float = Field(
        0.05, gt=0, description="second difference of the depth that marks a step, pixels per view step"
    )
    smooth_colour: float = Field(
        0.1, gt=0, description="RGB distance at which smoothness falls, colours in 0..1; noise adds to it"
    )
    reliable_confidence: float = Field(
        0.5, gt=0, le=1, description="confidence within two pixels from which bends in the data are believed"
    )
    rtol: float = Field(3e-4, gt=0, lt=1, description="relative residual at which the solver stops")
    max_iterations: int = Field(200, ge=1, description="steps after which the solver stops anyway")

    @model_validator(mode="after")
    def _does_something(self) -> Self:
        if self.refinements + self.solves == 0:
            raise ValueError("refinements and solves cannot both be 0; the choice 'none' hands the depth on")
        return self


GaussNewtonParameters = with_defaults(
    SecondOrderParameters, "GaussNewtonParameters", "Refinement without smoothing.", refinements=3, solves=0
)
SecondOrderColoursParameters = with_defaults(
    SecondOrderParameters,
    "SecondOrderColoursParameters",
    "Refinement and smoothing by colours alone.",
    colour_scale=COLOURS_ALONE_SCALE,
    detail_share=0.0,
)


def wls(
    light_field: LightField, previous: StageMaps | None, parameters: WlsParameters, progress: Progress
) -> StageMaps:
    """Globally optimised depth.

    Parameters
    ----------
    light_field : LightField
    previous : StageMaps
        Depth after the textureless stage, with the map ``textureless`` where that stage ran.
    parameters : WlsParameters
    progress : callable

    Returns
    -------
    StageMaps
        ``confidence`` is the rectified confidence c' of Eq. 10.
    """
    before = require_previous(previous)
    confidence = rectified_confidence(before, parameters)
    weight = data_weight(before.disparity, confidence, parameters)
    smoothness = smoothness_coefficient(light_field.reference_view, confidence, parameters)
    progress(0.1)
    matrix, right = energy_system(before.disparity, weight, smoothness, parameters.alpha)
    disparity = solve(matrix, right, before.disparity, parameters.rtol)
    return before.updated(disparity.astype(np.float32), confidence)


def second_order(
    light_field: LightField, previous: StageMaps | None, parameters: SecondOrderParameters, progress: Progress
) -> StageMaps:
    """Depth refined on the views and smoothed, planes being free.

    Arguments as for ``wls``.

    Returns
    -------
    StageMaps
        ``confidence`` is that of :func:`smooth_confidence`.
    """
    from sepi.matching.gauss_newton import gradient_and_hessian, spline_views, view_mean, windowed_step
    from sepi.matching.visibility_kernels import z_buffers

    before = require_previous(previous)
    layers = base_detail_decomposition(light_field, parameters)
    matching = spline_views(light_field, layers, parameters)
    disparity = before.disparity
    uniform = before.mask("textureless")
    reliability = np.where(uniform, 1, reliable(before.confidence, parameters)).astype(np.float32)
    total = parameters.refinements + parameters.solves
    for i in range(total):
        progress((i + 0.5) / (total + 1))
        smooth = i >= parameters.refinements
        nearest = z_buffers(disparity, matching.present, *matching.place)
        if i <= parameters.refinements:
            # later steps are too small to change it
            mean = view_mean(matching, disparity, nearest, parameters.occlusion_margin)
        gradient, curvature = gradient_and_hessian(matching, mean, disparity, nearest, parameters.occlusion_margin)
        radius = parameters.solve_radius if smooth else parameters.refinement_radius
        step, curvature = windowed_step(gradient, curvature, radius, parameters.max_update)
        # where no view knows anything, a step would follow the noise
        target = disparity + np.where(uniform, np.float32(0), step)
        if smooth:
            weight = np.minimum(curvature / max(float(np.percentile(curvature, 90)), 1e-9), 1) * reliability
            weight = np.where(uniform, np.float32(UNIFORM_WEIGHT), weight)
            target = smooth_second_order(target, disparity, weight, reliability, layers, parameters)
        disparity = target
    return before.updated(disparity, smooth_confidence(disparity, curvature))


def smooth_confidence(disparity: FloatMap, curvature: FloatMap) -> FloatMap:
    """Confidence by how much the surface bends round a pixel and how little the views know about it.

    Parameters
    ----------
    disparity : ndarray, shape (H, W), float32
    curvature : ndarray, shape (H, W), float32
        Information on the disparity, 1 / (pixels per view step)^2.

    Returns
    -------
    ndarray, shape (H, W), float32
        ``h / (h + b + i / sqrt(curvature))`` with the mean second difference ``b`` over 5x5 pixels,
        ``h = HALF_CONFIDENT_BEND`` and ``i = IGNORANCE``. Near depth steps, where errors are large, it is close to 0.
    """
    bend = cv2.blur(np.abs(cv2.Laplacian(disparity, cv2.CV_32F)), (5, 5))
    unknown = np.maximum(bend, 0) + IGNORANCE / np.sqrt(curvature + np.float32(1e-3))
    return np.asarray(HALF_CONFIDENT_BEND / (HALF_CONFIDENT_BEND + unknown), np.float32)


def reliable(confidence: FloatMap, parameters: SecondOrderParameters) -> FloatMap:
    """How far the data is believed, 0..1: by the best confidence within two pixels, since edges lower it."""
    best = cv2.dilate(confidence, np.ones((5, 5), np.uint8))
    return np.asarray(np.clip((best / parameters.reliable_confidence) ** 2, LEAST_RELIABILITY, 1), np.float32)


def smooth_second_order(
    target: FloatMap,
    shape: FloatMap,
    weight: FloatMap,
    reliability: FloatMap,
    layers: BaseDetail,
    parameters: SecondOrderParameters,
) -> FloatMap:
    """Second-order smoothing of ``target``, whose bends are looked for in ``shape``; all shapes (H, W)."""
    from sepi.regularization.second_order import second_difference_matrix, smoothness_weights, solve_smooth

    variance = parameters.smooth_colour**2 + 4 * layers.noise
    weights = smoothness_weights(shape, layers.guide, reliability, parameters.second_difference_threshold, variance)
    weights = [parameters.strength * w + LEAST_SMOOTHNESS for w in weights]
    matrix = second_difference_matrix(weights, target.shape)
    return solve_smooth(matrix, weight, target, parameters.rtol, parameters.max_iterations)


def none(
    light_field: LightField, previous: StageMaps | None, parameters: NoParameters, progress: Progress
) -> StageMaps:
    """Depth after the textureless stage as it is."""
    return require_previous(previous)


def rectified_confidence(before: StageMaps, parameters: WlsParameters) -> FloatMap:
    """C' of Eq. 10: of textureless pixels a constant, else the stage's own (half-SEPI confidence where occluded)."""
    own = relative_confidence(before.confidence)
    return np.where(before.mask("textureless"), parameters.textureless_confidence, own).astype(np.float32)


def data_weight(disparity: FloatMap, confidence: FloatMap, parameters: WlsParameters) -> FloatMap:
    """Weight w of Eq. 9: the confidence, or little of it where the depth's deviation in 3x3 pixels marks a step."""
    mean = cv2.blur(disparity, (3, 3))
    deviation = np.sqrt(np.maximum(cv2.blur((disparity - mean) ** 2, (3, 3)), 0))
    cut = np.exp(-np.minimum(parameters.tau_0 * np.maximum(deviation - parameters.tau_1, 0), 80))
    trust = np.maximum(confidence, LEAST_CONFIDENCE) ** parameters.confidence_power
    return (trust * np.maximum(cut, parameters.discontinuity_weight)).astype(np.float32)


def smoothness_coefficient(reference_view: FloatMap, confidence: FloatMap, parameters: WlsParameters) -> FloatMap:
    """S = s_c s_t of Eq. 11-12; shape (H, W), float32."""
    dx, dy = (cv2.Sobel(reference_view, cv2.CV_32F, *order, ksize=3, scale=1 / 8) for order in ((1, 0), (0, 1)))
    squared = (np.atleast_3d(dx) ** 2 + np.atleast_3d(dy) ** 2).sum(axis=2)
    return np.asarray(np.exp(-parameters.tau_2 * confidence) / (squared + parameters.gradient_floor**2), np.float32)


def energy_system(
    disparity: FloatMap, weight: FloatMap, smoothness: FloatMap, alpha: float
) -> tuple[sparse.csr_matrix, FloatArray]:
    """Normal equations of Eq. 8 on the 4-connected grid.

    Each pair of neighbours stands twice in the sum, once with the coefficient of either pixel.

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
    """Solve by conjugate gradients, to a residual relative to the right side; shape of ``start``, float64.

    With little smoothness the diagonal is preconditioner enough, and an algebraic multigrid takes several times as long
    to set up as that takes to arrive. What has not arrived after a few steps is left to multigrid, whose steps do not
    grow in number with smoothness or with regions that have hardly any data.
    """
    import scipy.sparse as sparse
    from scipy.sparse.linalg import cg

    vector = start.astype(np.float64).ravel()
    inverse = sparse.diags_array(1 / matrix.diagonal())
    solution, missed = cg(matrix, right, x0=vector, rtol=rtol, maxiter=STEPS_BEFORE_MULTIGRID, M=inverse)
    if missed:
        import pyamg  # slow to import, seldom needed

        hierarchy = pyamg.ruge_stuben_solver(matrix)
        solution = hierarchy.solve(right, x0=solution, tol=rtol, accel="cg", maxiter=100)
    return np.asarray(solution).reshape(start.shape)


CHOICES = {
    "wls": Choice(WlsParameters, wls),
    "second_order": Choice(SecondOrderParameters, second_order),
    "gauss_newton": Choice(GaussNewtonParameters, second_order),
    "second_order_colours": Choice(SecondOrderColoursParameters, second_order),
    "none": Choice(NoParameters, none),
}

if __name__ == "__main__":
    stage_command("optimize", CHOICES)()
