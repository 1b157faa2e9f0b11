"""Disparity and coherence from the structure tensor of single EPIs, the initial depth of the paper's ablation.

The structure tensor gives the direction in which an EPI does not change, and so a disparity, and a coherence. It is
computed on the horizontal EPI through a pixel (fixed ``y`` and ``t0``) and on the vertical one (fixed ``x`` and
``s0``); the more coherent EPI decides [1]_. Only the views of the centre row and column take part.

Finite differences between neighbouring views are right for disparities below about half a pixel. So the EPIs are
sheared by every whole disparity of the range, or every whole disparity per row if rows are farther apart than columns.
The most coherent estimate within 0.7 pixels of its shear wins. Views off the grid are sheared by their baselines,
along and across the EPI; views less than a tenth of a step from another are left out.

References
----------
.. [1] Wanner, Goldluecke: Globally consistent depth labeling of 4D light fields. CVPR 2012.
   doi:10.1109/CVPR.2012.6247656
.. [2] Keys: Cubic convolution interpolation for digital image processing. IEEE Transactions on Acoustics, Speech, and
   Signal Processing 29(6), 1981. doi:10.1109/TASSP.1981.1163711
"""

import math

import cv2
import numpy as np

from sepi.errors import SepiError
from sepi.lightfield import FloatArray, FloatMap, LightField, as_unit_float
from sepi.matching.view_subsets import grid_steps

# smoothing before the differences, and of the tensor, pixels
_INNER, _OUTER = 0.7, 2.0
# largest disparity relative to a shear that is trusted, pixels per view step
_TRUSTED = 0.7


def structure_tensor_depth(light_field: LightField) -> tuple[FloatMap, FloatMap]:
    """Disparity and coherence of the more coherent EPI, horizontal or vertical.

    Parameters
    ----------
    light_field : LightField
        With a known disparity range; missing views are skipped.

    Returns
    -------
    disparity : ndarray, shape (H, W), float32
        Within the disparity range.
    confidence : ndarray, shape (H, W), float32
        Coherence, 0..1.

    Raises
    ------
    SepiError
        If the reference view is the only view of its row and of its column.
    """
    t0, s0 = light_field.reference_position
    known = light_field.require_disparity_range()
    best = np.full(light_field.shape, (known.minimum + known.maximum) / 2, np.float32)
    confidence = np.zeros(light_field.shape, np.float32)
    if max(light_field.present[t0].sum(), light_field.present[:, s0].sum()) < 2:
        raise SepiError(
            f"{light_field.name}: the structure tensor needs a second view in the row or the column of view {t0},{s0}"
        )
    # steps below 1 would need no finer shears
    steps = np.maximum(grid_steps(light_field), 1).tolist()
    # rows first: the horizontal EPI decides where both are equally coherent
    for axis in (1, 0):
        baselines, images = _of_one_line(light_field, axis, steps[axis])
        if len(images) < 2:
            continue
        low, high = known.minimum * steps[axis], known.maximum * steps[axis]
        for shear in range(math.floor(low), math.ceil(high) + 1):
            disparity, coherence = _sheared(baselines, images, shear)
            if axis == 0:
                disparity, coherence = disparity.T, coherence.T
            trusted = (np.abs(disparity - shear) <= _TRUSTED) & (coherence > confidence)
            trusted &= (disparity >= low) & (disparity <= high)
            best[trusted] = disparity[trusted] / np.float32(steps[axis])
            confidence[trusted] = coherence[trusted]
    return best, confidence


def _of_one_line(light_field: LightField, axis: int, step: float) -> tuple[FloatArray, list[FloatMap]]:
    """Views of the reference view's row (``axis`` 1) or column (0): baselines (N, 2) in ``step``, and pictures.

    For a column, pictures and baselines are transposed, so that its EPI is a horizontal one.
    """
    t0, s0 = light_field.reference_position
    line = np.s_[t0] if axis else np.s_[:, s0]
    present = light_field.present[line]
    baselines, views = light_field.baselines[line][present] / step, light_field.rgb_views[line][present]
    _, kept = np.unique(np.round(baselines[:, axis], 1), return_index=True)
    images = [as_unit_float(view if axis else view.transpose(1, 0, 2)) for view in views[kept]]
    return (baselines if axis else baselines[:, ::-1])[kept], images


def _sheared(baselines: FloatArray, images: list[FloatMap], shear: int) -> tuple[FloatMap, FloatMap]:
    """Disparity and coherence at the reference view from horizontal EPIs sheared by a whole disparity."""
    # after the shear, a surface of disparity `shear` has the same position in all views
    moved = np.stack([_shifted(image, shear * baseline) for baseline, image in zip(baselines, images, strict=True)])
    smooth = np.stack([_blurred(view, _INNER) for view in moved])
    along_x = np.stack([cv2.Sobel(view, cv2.CV_32F, 1, 0, ksize=3, scale=1 / 8) for view in smooth])
    along_s = np.gradient(smooth, baselines[:, 1].astype(np.float32), axis=0)
    weight = np.exp(-0.5 * (baselines[:, 1] / _OUTER) ** 2).astype(np.float32)

    def tensor(a: FloatMap, b: FloatMap) -> FloatMap:
        # einsum, not tensordot: a BLAS product changes its last bits with the number of threads
        product = np.einsum("s,syxc->yx", weight / weight.sum(), (a * b).reshape(*moved.shape[:3], -1))
        return _blurred(product.astype(np.float32), _OUTER)

    xx, ss, xs = tensor(along_x, along_x), tensor(along_s, along_s), tensor(along_x, along_s)
    spread = np.sqrt((ss - xx) ** 2 + 4 * xs**2)
    with np.errstate(divide="ignore", invalid="ignore"):
        # x moves by -d per view step along a line: L_s = d L_x for the nearer-is-positive convention
        disparity = shear + np.tan(0.5 * np.arctan2(2 * xs, xx - ss))
        coherence = np.where(xx + ss > 0, (spread / (xx + ss)) ** 2, 0)
    return disparity.astype(np.float32), coherence.astype(np.float32)


def _shifted(image: FloatMap, pixels: FloatArray) -> FloatMap:
    """Image moved by ``pixels`` down and to the right, by cubic convolution [2]_; its borders are repeated."""
    for axis, distance in enumerate(pixels.round(6)):
        if not distance:
            continue
        whole = math.floor(distance)
        places = np.clip(np.arange(image.shape[axis]) - whole, 0, image.shape[axis] - 1)
        image = image.take(places, axis)
        if distance != whole:
            taps = _cubic(distance - whole)
            turned = taps if axis else taps.T
            image = np.asarray(cv2.filter2D(image, -1, turned, borderType=cv2.BORDER_REPLICATE), np.float32)
    return image


def _cubic(f: float) -> FloatMap:
    """Weights (1, 5) of the pixels ``x - 2`` to ``x + 2`` in the value at ``x - f``, ``f`` in 0..1."""
    t = np.abs(np.arange(-2, 3) + f)
    near, far = (1.5 * t - 2.5) * t**2 + 1, ((2.5 - 0.5 * t) * t - 4) * t + 2
    return np.where(t <= 1, near, np.where(t < 2, far, 0))[None].astype(np.float32)


def _blurred(image: FloatMap, sigma: float) -> FloatMap:
    return np.asarray(cv2.GaussianBlur(image, (0, 0), sigma), np.float32)
