"""Plain implementations of the initial stage with NumPy, SciPy and OpenCV, to compare speed with.

They work on whole pictures in float32, without loops over pixels, and differ in the interpolation. Their costs are
those of :func:`sepi.matching.plane_sweep.sweep`.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from pathlib import Path

import cv2
import numpy as np
from scipy import ndimage

from bench.measure import Figures, Prepared
from sepi.image.noise import residual_variance
from sepi.image.texture import variance_within_surface
from sepi.io.hdf5 import read_light_field
from sepi.lightfield import FloatMap, LightField, as_unit_float
from sepi.matching.plane_sweep import TEXTURE_SHARE, SweepParameters, sweep

Warp = Callable[[FloatMap, float, float], FloatMap]
"""Function of a view ``(H, W, C)`` and an offset down and across to the moved view; any values outside."""


def by_numpy(view: FloatMap, down: float, across: float) -> FloatMap:
    """Bilinear by four shifted slices; one weight per slice, since the whole picture has the same offset."""
    top, left = math.floor(down), math.floor(across)
    fy, fx = np.float32(down - top), np.float32(across - left)
    H, W, _ = view.shape
    margin = max(abs(top), abs(left)) + 1
    padded = np.pad(view, ((margin, margin), (margin, margin), (0, 0)))
    moved = np.zeros_like(view)
    for dy, wy in ((0, 1 - fy), (1, fy)):
        for dx, wx in ((0, 1 - fx), (1, fx)):
            y, x = margin + top + dy, margin + left + dx
            moved += wy * wx * padded[y : y + H, x : x + W]
    return moved


def by_scipy(view: FloatMap, down: float, across: float) -> FloatMap:
    """Bilinear by ``scipy.ndimage.shift``, a channel at a time."""
    moved = np.empty_like(view)
    for channel in range(view.shape[2]):
        ndimage.shift(view[..., channel], (-down, -across), output=moved[..., channel], order=1, mode="nearest")
    return moved


def by_opencv(view: FloatMap, down: float, across: float) -> FloatMap:
    """Bilinear by ``cv2.warpAffine``."""
    H, W, C = view.shape
    matrix = np.array([[1, 0, across], [0, 1, down]], np.float64)
    flags = cv2.INTER_LINEAR | cv2.WARP_INVERSE_MAP
    moved = cv2.warpAffine(view, matrix, (W, H), flags=flags, borderMode=cv2.BORDER_REPLICATE)
    return np.asarray(moved, np.float32).reshape(H, W, C)


WARPS: dict[str, Warp] = {"NumPy slices": by_numpy, "SciPy ndimage.shift": by_scipy, "OpenCV warpAffine": by_opencv}


def plain_sweep(light_field: LightField, parameters: SweepParameters, warp: Warp) -> tuple[FloatMap, FloatMap]:
    """Candidate of the lowest cost of each pixel, and that cost; both of shape (H, W), float32 (Eq. 3-4).

    Parameters
    ----------
    light_field : LightField
        With a known disparity range.
    parameters : SweepParameters
    warp : callable
    """
    views = as_unit_float(light_field.rgb_views)
    reference_view = light_field.reference_view
    noise = residual_variance(reference_view)
    variance = variance_within_surface(reference_view, parameters.window_sigma**2 + noise, TEXTURE_SHARE)
    weights = _window_weights(reference_view, parameters.window_radius, variance)
    scale2 = np.float32(parameters.scale**2 + noise)
    lowest = np.full(light_field.shape, np.inf, np.float32)
    best = np.zeros(light_field.shape, np.float32)
    for disparity in parameters.candidates(light_field):
        total, number = _candidate_cost(light_field, views, float(disparity), scale2, warp)
        seen = _aggregated(number, weights)
        cost = np.divide(_aggregated(total, weights), seen, out=np.ones_like(total), where=seen > 0)
        better = cost < lowest
        lowest[better] = cost[better]
        best[better] = disparity
    return best, lowest


def _candidate_cost(
    light_field: LightField, views: FloatMap, disparity: float, scale2: np.float32, warp: Warp
) -> tuple[FloatMap, FloatMap]:
    """Sum of the robust residuals over the views at one disparity, and how many views see each pixel."""
    H, W = light_field.shape
    t0, s0 = light_field.reference_position
    y, x = np.arange(H)[:, None], np.arange(W)[None]
    total, number = np.zeros((2, H, W), np.float32)
    for t, s in np.argwhere(light_field.present):
        if (t, s) == (t0, s0):
            continue
        down, across = -disparity * (t - t0), -disparity * (s - s0)
        residual = warp(views[t, s], down, across) - light_field.reference_view
        squared = np.einsum("yxc,yxc->yx", residual, residual)
        inside = (y + down >= 0) & (y + down <= H - 1) & (x + across >= 0) & (x + across <= W - 1)
        total += np.where(inside, squared / (squared + scale2), 0)
        number += inside
    return total, number


def _window_weights(reference_view: FloatMap, radius: int, variance: FloatMap) -> FloatMap:
    """Weights of each pixel's window, (H, W, 2 r + 1, 2 r + 1), zero outside the picture."""
    squared = sum(
        (_windows(channel, radius, np.inf) - channel[..., None, None]) ** 2
        for channel in reference_view.transpose(2, 0, 1)
    )
    weights = np.exp(-0.5 * squared / variance[..., None, None])
    return np.asarray(weights / weights.sum(axis=(2, 3), keepdims=True), np.float32)


def _aggregated(values: FloatMap, weights: FloatMap) -> FloatMap:
    """Weighted sum over each pixel's window."""
    return np.asarray(np.einsum("yxij,yxij->yx", _windows(values, weights.shape[2] // 2, 0), weights))


def _windows(values: FloatMap, radius: int, outside: float) -> FloatMap:
    """Each pixel's window, (H, W, 2 r + 1, 2 r + 1); a view of one copy."""
    size = 2 * radius + 1
    return np.lib.stride_tricks.sliding_window_view(np.pad(values, radius, constant_values=outside), (size, size))


def prepare(path: Path, num_disparities: int, warp: Warp) -> Prepared:
    """The plain sweep of a scene; the figure is the difference of its lowest costs from the compiled sweep's."""
    light_field = read_light_field(path)
    parameters = SweepParameters(num_disparities=num_disparities)

    def figures(result: tuple[FloatMap, FloatMap]) -> Figures:
        difference = np.abs(result[1] - sweep(light_field, parameters).cost[0])
        return {"largest_difference": float(difference.max()), "mean_difference": float(difference.mean())}

    return Prepared(lambda: plain_sweep(light_field, parameters, warp), figures)
