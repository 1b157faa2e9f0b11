"""Slope of single EPIs by the structure tensor, the initial depth that the paper's ablation compares with.

On the horizontal EPI through a pixel (fixed ``y`` and ``t0``) and on the vertical one (fixed ``x`` and ``s0``), the
structure tensor gives the direction along which the image does not change, hence the disparity, and a coherence. The
more coherent of the two EPIs decides [1]_. Only the views of the centre row and column take part.

Finite differences between neighbouring views are right for disparities below about half a pixel, so the EPIs are first
sheared by every whole disparity of the range, and the most coherent estimate that stays within its shear is kept.

References
----------
.. [1] Wanner, Goldluecke: Globally consistent depth labeling of 4D light fields. CVPR 2012.
   doi:10.1109/CVPR.2012.6247656
"""

from __future__ import annotations

import math

import cv2
import numpy as np
from pydantic import Field

from sepi.errors import SepiError
from sepi.lightfield import FloatMap, LightField, as_unit_float
from sepi.stage import Parameters


class StructureTensorParameters(Parameters):
    """Parameters of the structure tensor."""

    inner_sigma: float = Field(0.7, gt=0, le=10, description="smoothing before the differences, in pixels")
    outer_sigma: float = Field(2.0, gt=0, le=20, description="smoothing of the tensor, in pixels")
    shear_reach: float = Field(
        0.7, gt=0, le=2, description="largest disparity trusted round a shear, in pixels per view step"
    )


def structure_tensor_depth(light_field: LightField, parameters: StructureTensorParameters) -> tuple[FloatMap, FloatMap]:
    """Disparity and coherence of the more coherent of the horizontal and the vertical EPI.

    Parameters
    ----------
    light_field : LightField
        With a known disparity range; missing views are skipped.
    parameters : StructureTensorParameters

    Returns
    -------
    disparity : ndarray, shape (H, W), float32
        Within the disparity range.
    confidence : ndarray, shape (H, W), float32
        Coherence, 0..1.

    Raises
    ------
    SepiError
        If the reference view is alone in its row and in its column.
    """
    t0, s0 = light_field.reference_position
    known = light_field.require_disparity_range()
    best = np.full(light_field.shape, (known.minimum + known.maximum) / 2, np.float32)
    confidence = np.zeros(light_field.shape, np.float32)
    row = [(s - s0, light_field.rgb_views[t0, s]) for s in range(light_field.grid[1]) if light_field.present[t0, s]]
    column = [(t - t0, light_field.rgb_views[t, s0]) for t in range(light_field.grid[0]) if light_field.present[t, s0]]
    if max(len(row), len(column)) < 2:
        raise SepiError(
            f"{light_field.name}: the structure tensor needs a second view in the row or the column of view {t0},{s0}"
        )
    # a vertical EPI is the horizontal one of the transposed views
    for views, transposed in ((row, False), (column, True)):
        if len(views) < 2:
            continue
        baselines = [baseline for baseline, _ in views]
        images = [as_unit_float(view.transpose(1, 0, 2) if transposed else view) for _, view in views]
        for shear in range(math.floor(known.minimum), math.ceil(known.maximum) + 1):
            disparity, coherence = _sheared(baselines, images, shear, parameters)
            if transposed:
                disparity, coherence = disparity.T, coherence.T
            trusted = (np.abs(disparity - shear) <= parameters.shear_reach) & (coherence > confidence)
            trusted &= (disparity >= known.minimum) & (disparity <= known.maximum)
            best[trusted] = disparity[trusted]
            confidence[trusted] = coherence[trusted]
    return best, confidence


def _sheared(
    baselines: list[int], images: list[FloatMap], shear: int, parameters: StructureTensorParameters
) -> tuple[FloatMap, FloatMap]:
    """Disparity and coherence at the reference view from horizontal EPIs sheared by a whole disparity."""
    # after the shear a surface of disparity `shear` stands still from view to view
    moved = np.stack([_shifted(image, shear * baseline) for baseline, image in zip(baselines, images, strict=True)])
    smooth = np.stack([_blurred(view, parameters.inner_sigma) for view in moved])
    along_x = np.stack([cv2.Sobel(view, cv2.CV_32F, 1, 0, ksize=3, scale=1 / 8) for view in smooth])
    along_s = np.gradient(smooth, np.asarray(baselines, np.float32), axis=0)
    weight = np.exp(-0.5 * (np.asarray(baselines) / parameters.outer_sigma) ** 2).astype(np.float32)

    def tensor(a: FloatMap, b: FloatMap) -> FloatMap:
        # einsum, not tensordot: a BLAS product changes its last bits with the number of threads
        product = np.einsum("s,syxc->yx", weight / weight.sum(), (a * b).reshape(*moved.shape[:3], -1))
        return _blurred(product.astype(np.float32), parameters.outer_sigma)

    xx, ss, xs = tensor(along_x, along_x), tensor(along_s, along_s), tensor(along_x, along_s)
    spread = np.sqrt((ss - xx) ** 2 + 4 * xs**2)
    with np.errstate(divide="ignore", invalid="ignore"):
        # x moves by -d per view step along a line: L_s = d L_x for the nearer-is-positive convention
        disparity = shear + np.tan(0.5 * np.arctan2(2 * xs, xx - ss))
        coherence = np.where(xx + ss > 0, (spread / (xx + ss)) ** 2, 0)
    return disparity.astype(np.float32), coherence.astype(np.float32)


def _shifted(image: FloatMap, pixels: int) -> FloatMap:
    """Image whose column ``x`` is the given one's column ``x - pixels``, edge columns repeated."""
    columns = np.clip(np.arange(image.shape[1]) - pixels, 0, image.shape[1] - 1)
    return image[:, columns]


def _blurred(image: FloatMap, sigma: float) -> FloatMap:
    return np.asarray(cv2.GaussianBlur(image, (0, 0), sigma), np.float32)
