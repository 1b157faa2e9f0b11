"""The initial stage written plainly, with NumPy and SciPy or OpenCV: what a reader of the paper would write first.

Whole pictures at a time, float32, no loop over pixels; the three differ in who interpolates. They give the costs that
:func:`sepi.matching.plane_sweep.sweep` gives, and are the yardstick of its speed.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from pathlib import Path

import cv2
import numpy as np
from scipy import ndimage

from bench.measure import Case, Figures, Prepared
from sepi.image.noise import residual_variance
from sepi.io.hdf5 import read_light_field
from sepi.lightfield import FloatMap, LightField, as_unit_float
from sepi.matching.plane_sweep import SweepParameters, sweep

Warp = Callable[[FloatMap, float, float], FloatMap]
"""Takes a view ``(H, W, C)`` and how far down and across to look; gives that picture, anything outside the view."""


def by_numpy(view: FloatMap, down: float, across: float) -> FloatMap:
    """Bilinear by four shifted slices; one weight per slice, since the whole picture has the same offset."""
    top, left = math.floor(down), math.floor(across)
    fy, fx = np.float32(down - top), np.float32(across - left)
    H, W, _ = view.shape
    moved = np.zeros_like(view)
    # a sample on the last row needs none below
    rows = range(max(0, -top), min(H, H - top - (fy > 0)))
    columns = range(max(0, -left), min(W, W - left - (fx > 0)))
    if not rows or not columns:
        return moved
    target = moved[rows.start : rows.stop, columns.start : columns.stop]
    for dy, wy in ((0, 1 - fy), (1, fy)):
        for dx, wx in ((0, 1 - fx), (1, fx)):
            if wy * wx != 0:
                y, x = rows.start + top + dy, columns.start + left + dx
                target += wy * wx * view[y : y + len(rows), x : x + len(columns)]
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
    weights = _window_weights(reference_view, parameters.window_radius, parameters.window_sigma**2 + noise)
    lowest = np.full(light_field.shape, np.inf, np.float32)
    best = np.zeros(light_field.shape, np.float32)
    for disparity in light_field.require_disparity_range().candidates(parameters.num_disparities):
        total, number = _candidate_cost(
            light_field, views, reference_view, float(disparity), parameters.scale**2 + noise, warp
        )
        seen = _aggregated(number, weights)
        cost = np.divide(_aggregated(total, weights), seen, out=np.ones_like(total), where=seen > 0)
        better = cost < lowest
        lowest[better] = cost[better]
        best[better] = disparity
    return best, lowest


def _candidate_cost(
    light_field: LightField, views: FloatMap, reference_view: FloatMap, disparity: float, scale2: float, warp: Warp
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
        residual = warp(views[t, s], down, across)
        residual -= reference_view
        squared = np.einsum("yxc,yxc->yx", residual, residual)
        inside = (y + down >= 0) & (y + down <= H - 1) & (x + across >= 0) & (np.floor(x + across) < W - 1)
        total += np.where(inside, squared / (squared + np.float32(scale2)), 0)
        number += inside
    return total, number


def _window_weights(reference_view: FloatMap, radius: int, variance: float) -> FloatMap:
    """Weights of each pixel's window, (2 r + 1, 2 r + 1, H, W), zero outside the picture."""
    size = 2 * radius + 1
    weights = np.zeros((size, size, *reference_view.shape[:2]), np.float32)
    for i, j, here, there in _window(reference_view.shape[:2], radius):
        squared = ((reference_view[here] - reference_view[there]) ** 2).sum(axis=2)
        weights[(i, j, *here)] = np.exp(-0.5 * squared / np.float32(variance))
    return np.asarray(weights / weights.sum(axis=(0, 1)), np.float32)


def _aggregated(values: FloatMap, weights: FloatMap) -> FloatMap:
    """Weighted sum over each pixel's window."""
    total = np.zeros_like(values)
    for i, j, here, there in _window(values.shape, len(weights) // 2):
        total[here] += weights[(i, j, *here)] * values[there]
    return total


def _window(shape: tuple[int, ...], radius: int) -> Iterator[tuple[int, int, tuple[slice, slice], tuple[slice, slice]]]:
    """Place in the window, the pixels that have a neighbour there, and those neighbours."""
    H, W = shape
    for i in range(-radius, radius + 1):
        for j in range(-radius, radius + 1):
            here = (slice(max(0, -i), min(H, H - i)), slice(max(0, -j), min(W, W - j)))
            there = (slice(max(0, i), min(H, H + i)), slice(max(0, j), min(W, W + j)))
            yield i + radius, j + radius, here, there


def prepare(scene: Path, num_disparities: int, warp: Warp) -> Prepared:
    """The plain sweep of a scene; says how far its lowest costs are from those of the compiled one."""
    light_field = read_light_field(scene)
    parameters = SweepParameters(num_disparities=num_disparities)

    def figures(result: tuple[FloatMap, FloatMap]) -> Figures:
        difference = np.abs(result[1] - sweep(light_field, parameters).cost[0])
        return {"largest_difference": float(difference.max()), "mean_difference": float(difference.mean())}

    return Prepared(lambda: plain_sweep(light_field, parameters, warp), figures)


def cases(scene: Path, num_disparities: int, threads: int) -> list[Case]:
    """The plain sweeps, each once: long enough to measure, and nothing in them is compiled at the first call."""
    known = {"num_disparities": float(num_disparities)}
    rivals = {"NumPy slices": by_numpy, "SciPy ndimage.shift": by_scipy, "OpenCV warpAffine": by_opencv}
    return [
        Case("beside", name, prepare, (scene, num_disparities, warp), known, threads=threads, once=True)
        for name, warp in rivals.items()
    ]
