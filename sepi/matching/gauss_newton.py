"""Disparity below the disparity sampling: Gauss-Newton on the residuals of all views that see a pixel.

For pixel ``p``, a view of baseline ``v`` and mean ``m`` of the views, the residual ``r_v(d) = L_v(p - d v) - m(p)``
changes with the disparity by ``-g v``, where ``g`` is the derivative of the mean along y and x. With robust weights
``w`` the cost is least at an update of ``sum(w r g v) / sum(w (g v)^2)``, both sums over a window. The mean of the
views has much less noise than the reference view, so that its derivatives are sound even where texture is faint; views
are interpolated by cubic splines, since linear interpolation pulls the minimum towards half pixels.
"""

from __future__ import annotations

import cv2
import numpy as np

from sepi.lightfield import FloatMap, LightField
from sepi.matching.base_detail import BaseDetail, BaseDetailParameters
from sepi.matching.gauss_newton_kernels import (
    MARGIN,
    SplineViews,
    mean_of_views,
    normal_equations,
    spline_coefficients,
    view_splines,
)

_SMOOTH = np.array([1, 4, 1], np.float32) / 6
_DIFFERENCE = np.array([-1, 0, 1], np.float32) / 2


def spline_views(light_field: LightField, views: BaseDetail, parameters: BaseDetailParameters) -> SplineViews:
    """Splines of all views' colours and, where it has a share, detail."""
    planes = [(views.colours, views.colour_unit, parameters.colour_scale, 1 - parameters.detail_share)]
    if parameters.detail_share > 0:
        planes.append((views.detail, views.detail_unit, parameters.detail_scale, parameters.detail_share))
    padded = (n + 2 * MARGIN for n in light_field.shape)
    splines = np.zeros((*light_field.grid, *padded, 3 * len(planes)), np.int16)
    for i, (values, unit, _, _) in enumerate(planes):
        view_splines(values, unit, light_field.present, 3 * i, splines)
    others = light_field.present.copy()
    others[light_field.reference_position] = False
    down, across = light_field.baselines[others].astype(np.float32).T
    rows, columns = np.nonzero(others)
    runs = np.flatnonzero(np.diff(down, prepend=np.nan).astype(bool) | np.diff(rows, prepend=-1).astype(bool))
    own = [values[light_field.reference_position].astype(np.float32) * unit for values, unit, _, _ in planes]
    return SplineViews(
        splines,
        np.ascontiguousarray(np.concatenate(own).transpose(1, 2, 0)),
        columns,
        np.ascontiguousarray(across),
        np.append(runs, columns.size),
        rows[runs],
        down[runs],
        np.array([views.squared_scale(scale) for _, _, scale, _ in planes], np.float32),
        np.array([share for _, _, _, share in planes], np.float32),
    )


def view_mean(views: SplineViews, disparity: FloatMap, nearest: FloatMap, occlusion_margin: float) -> FloatMap:
    """Mean of the views that see each pixel.

    Parameters
    ----------
    views : SplineViews
    disparity : ndarray, shape (H, W), float32
        Pixels per view step.
    nearest : ndarray, shape (T, S, H, W), float32
        z-buffers of the map in the views.
    occlusion_margin : float
        By how much an occluder must be nearer, pixels per view step.

    Returns
    -------
    ndarray, shape (H, W, C), float32
    """
    mean: FloatMap = mean_of_views(views, disparity, nearest, np.float32(occlusion_margin))
    return mean


def gradient_and_hessian(
    views: SplineViews, mean: FloatMap, disparity: FloatMap, nearest: FloatMap, occlusion_margin: float
) -> tuple[FloatMap, FloatMap]:
    """Gradient and curvature of the cost of each pixel, before any window.

    Parameters
    ----------
    views : SplineViews
    mean : ndarray, shape (H, W, C), float32
        From :func:`view_mean`; of a slightly different map is good enough.
    disparity, nearest, occlusion_margin
        As in :func:`view_mean`.

    Returns
    -------
    gradient, curvature : ndarray, shape (H, W), float32
        The curvature is the inverse variance of the disparity, 1 / (pixels per view step)^2.
    """
    margin = np.float32(occlusion_margin)
    gradient, curvature = normal_equations(views, disparity, nearest, margin, mean, *spline_derivatives(mean))
    return gradient, curvature


def windowed_step(gradient: FloatMap, curvature: FloatMap, radius: int, max_update: float) -> tuple[FloatMap, FloatMap]:
    """Update of each pixel, and its curvature, over a window of ``2 radius + 1`` pixels.

    Parameters
    ----------
    gradient, curvature : ndarray, shape (H, W), float32
    radius : int
    max_update : float
        Updates are cut to this, pixels per view step: beyond it the linearisation does not hold.

    Returns
    -------
    update, curvature : ndarray, shape (H, W), float32
    """
    size = (2 * radius + 1, 2 * radius + 1)
    mean_gradient, mean_curvature = cv2.blur(gradient, size), cv2.blur(curvature, size)
    update = mean_gradient / (mean_curvature + np.float32(1e-9))
    return np.clip(update, -max_update, max_update).astype(np.float32), np.maximum(mean_curvature, 0)


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
