"""Disparity below the candidate step: Gauss-Newton on the residuals of all views that see a pixel.

For pixel ``p``, view ``v`` and mean ``m`` of the views, the residual ``r_v(d) = L_v(p - d v) - m(p)`` changes with the
disparity by ``-g v``, where ``g`` is the derivative of the mean along y and x. With robust weights ``w`` the cost is
least at a step of ``sum(w r g v) / sum(w (g v)^2)``, both sums over a window. The mean of the views has much less
noise than the reference view, so that its derivatives are sound even where texture is faint; views are interpolated by
cubic splines, since linear interpolation pulls the minimum towards half pixels.
"""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np
import numpy.typing as npt

from sepi.lightfield import BoolMap, FloatMap, LightField
from sepi.matching.base_detail import DETAIL_UNIT, BaseDetail, BaseDetailParameters
from sepi.matching.gauss_newton_kernels import (
    MARGIN,
    mean_of_views,
    normal_equations,
    spline_coefficients,
    view_splines,
)

_SMOOTH = np.array([1, 4, 1], np.float32) / 6
_DIFFERENCE = np.array([-1, 0, 1], np.float32) / 2


@dataclass(frozen=True)
class SplineViews:
    """What a Gauss-Newton step needs of the views.

    Attributes
    ----------
    splines : ndarray, shape (T, S, H + 2 MARGIN, W + 2 MARGIN, C), int16
        Spline coefficients of colours and, where it has a share, detail: C is 3 or 6.
    reference : ndarray, shape (H, W, C), float32
        The reference view's layers.
    present : ndarray, shape (T, S), bool
    place : tuple of int
        Of the reference view in the grid.
    scales, shares : ndarray, shape (C / 3,), float32
        Square of the robust scale and share of each layer.
    """

    splines: npt.NDArray[np.int16]
    reference: FloatMap
    present: BoolMap
    place: tuple[int, int]
    scales: FloatMap
    shares: FloatMap


def spline_views(light_field: LightField, layers: BaseDetail, parameters: BaseDetailParameters) -> SplineViews:
    """Splines of all views and the reference view's layers.

    Parameters
    ----------
    light_field : LightField
    layers : Layers
    parameters : BaseDetailParameters

    Returns
    -------
    SplineViews
    """
    t0, s0 = light_field.reference_position
    planes = [(layers.colours, layers.colour_unit, parameters.colour_scale, 1 - parameters.detail_share)]
    if parameters.detail_share > 0:
        planes.append((layers.detail, DETAIL_UNIT, parameters.detail_scale, parameters.detail_share))
    padded = (n + 2 * MARGIN for n in light_field.shape)
    splines = np.zeros((*light_field.grid, *padded, 3 * len(planes)), np.int16)
    for i, (values, unit, _, _) in enumerate(planes):
        view_splines(values, np.float32(unit), light_field.present, 3 * i, splines)
    own = [values[t0, s0].astype(np.float32) * np.float32(unit) for values, unit, _, _ in planes]
    return SplineViews(
        splines,
        np.ascontiguousarray(np.concatenate(own).transpose(1, 2, 0)),
        light_field.present,
        light_field.reference_position,
        np.array([layers.squared_scale(scale) for _, _, scale, _ in planes], np.float32),
        np.array([share for _, _, _, share in planes], np.float32),
    )


def view_mean(matching: SplineViews, disparity: FloatMap, nearest: FloatMap, occlusion_margin: float) -> FloatMap:
    """Mean of the views that see each pixel.

    Parameters
    ----------
    matching : SplineViews
    disparity : ndarray, shape (H, W), float32
        Pixels per view step.
    nearest : ndarray, shape (T, S, H, W), float32
        z-buffers of the map in the views.
    occlusion_margin : float
        By how much a occlusion_margin must be nearer, pixels per view step.

    Returns
    -------
    ndarray, shape (H, W, C), float32
    """
    mean: FloatMap = mean_of_views(
        matching.splines,
        matching.present,
        *matching.place,
        disparity,
        nearest,
        np.float32(occlusion_margin),
        matching.scales,
        matching.reference,
    )
    return mean


def gradient_and_hessian(
    matching: SplineViews, mean: FloatMap, disparity: FloatMap, nearest: FloatMap, occlusion_margin: float
) -> tuple[FloatMap, FloatMap]:
    """Gradient and curvature of the cost of each pixel, before any window.

    Parameters
    ----------
    matching : SplineViews
    mean : ndarray, shape (H, W, C), float32
        From :func:`view_mean`; of a slightly different map is good enough.
    disparity : ndarray, shape (H, W), float32
        Pixels per view step.
    nearest : ndarray, shape (T, S, H, W), float32
        z-buffers of the map in the views.
    occlusion_margin : float
        By how much a occlusion_margin must be nearer, pixels per view step.

    Returns
    -------
    gradient, curvature : ndarray, shape (H, W), float32
        The curvature is the information on the disparity, 1 / (pixels per view step)^2.
    """
    down, across = spline_derivatives(mean)
    gradient, curvature = normal_equations(
        matching.splines,
        matching.present,
        *matching.place,
        disparity,
        nearest,
        np.float32(occlusion_margin),
        matching.scales,
        matching.shares,
        mean,
        down,
        across,
    )
    return gradient, curvature


def windowed_step(gradient: FloatMap, curvature: FloatMap, radius: int, longest: float) -> tuple[FloatMap, FloatMap]:
    """Step of each pixel, and its curvature, over a window of ``2 radius + 1`` pixels.

    Parameters
    ----------
    gradient, curvature : ndarray, shape (H, W), float32
    radius : int
    longest : float
        Steps are cut to this, pixels per view step: farther away the linearisation does not hold.

    Returns
    -------
    step, curvature : ndarray, shape (H, W), float32
    """
    size = (2 * radius + 1, 2 * radius + 1)
    mean_gradient, mean_curvature = cv2.blur(gradient, size), cv2.blur(curvature, size)
    step = mean_gradient / (mean_curvature + np.float32(1e-9))
    return np.clip(step, -longest, longest).astype(np.float32), np.maximum(mean_curvature, 0)


def spline_derivatives(image: FloatMap) -> tuple[FloatMap, FloatMap]:
    """Derivatives along y and x of the cubic spline through an image; shapes (H, W, C), float32."""
    down, across = np.empty_like(image), np.empty_like(image)
    for c in range(image.shape[2]):
        coefficients = spline_coefficients(np.ascontiguousarray(image[..., c]))
        # mirrored as the splines are
        border = cv2.BORDER_REFLECT_101
        across[..., c] = cv2.sepFilter2D(coefficients, -1, _DIFFERENCE, _SMOOTH, borderType=border)
        down[..., c] = cv2.sepFilter2D(coefficients, -1, _SMOOTH, _DIFFERENCE, borderType=border)
    return down, across
