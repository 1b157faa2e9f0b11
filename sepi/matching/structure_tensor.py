"""Disparity and coherence from the structure tensor of single EPIs, the initial depth of the paper's ablation.

The structure tensor gives the direction in which an EPI does not change, and so a disparity, and a coherence. It is
computed on the horizontal EPI through a pixel (fixed ``y`` and ``t0``) and on the vertical one (fixed ``x`` and
``s0``); the more coherent EPI decides [1]_. Only the views of the centre row and column take part.

Finite differences between neighbouring views are right for disparities below about half a pixel. So the EPIs are
sheared by every whole disparity of the range, or every whole disparity per row if rows are farther apart than columns.
The most coherent estimate within 0.7 pixels of its shear wins. Views off the grid are sheared by their baselines,
along and across the EPI (:mod:`sepi.matching.sheared_views`); views less than a tenth of a step from another are left
out.

References
----------
.. [1] Wanner, Goldluecke: Globally consistent depth labeling of 4D light fields. CVPR 2012.
   doi:10.1109/CVPR.2012.6247656
"""

import math

import cv2
import numpy as np

from sepi.errors import SepiError
from sepi.lightfield import BoolMap, FloatMap, LightField
from sepi.matching.sheared_views import ShearedViews
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
        views = ShearedViews(light_field, _of_one_line(light_field, axis, steps[axis]))
        if len(views.positions) < 2:
            continue
        baselines = views.baselines[:, axis].astype(np.float32) / np.float32(steps[axis])
        order = np.argsort(baselines)
        low, high = known.minimum * steps[axis], known.maximum * steps[axis]
        for shear in range(math.floor(low), math.ceil(high) + 1):
            # after the shear, a surface of disparity `shear` has the same position in all views
            beyond, coherence = _of_epis(views.at(shear / steps[axis])[order], baselines[order], axis)
            disparity = np.float32(shear) + beyond
            trusted = (np.abs(beyond) <= _TRUSTED) & (coherence > confidence)
            trusted &= (disparity >= low) & (disparity <= high)
            best[trusted] = disparity[trusted] / np.float32(steps[axis])
            confidence[trusted] = coherence[trusted]
    return best, confidence


def _of_one_line(light_field: LightField, axis: int, step: float) -> BoolMap:
    """Views of the reference view's row (``axis`` 1) or column (0), one of those at a place; shape (T, S), bool."""
    t0, s0 = light_field.reference_position
    line = np.s_[t0] if axis else np.s_[:, s0]
    numbers = np.flatnonzero(light_field.present[line])
    _, kept = np.unique(np.round(light_field.baselines[line][numbers, axis] / step, 1), return_index=True)
    chosen = np.zeros(light_field.grid, bool)
    chosen[line][numbers[kept]] = True
    return chosen


def _of_epis(moved: FloatMap, baselines: FloatMap, axis: int) -> tuple[FloatMap, FloatMap]:
    """Disparity and coherence at the reference view from horizontal (``axis`` 1) or vertical EPIs of views in order."""
    smooth, along_x = np.empty_like(moved), np.empty_like(moved)
    for place in np.ndindex(moved.shape[:2]):
        smooth[place] = _blurred(moved[place], _INNER)
        along_x[place] = cv2.Sobel(smooth[place], cv2.CV_32F, axis, 1 - axis, ksize=3, scale=1 / 8)
    along_s = np.gradient(smooth, baselines, axis=0)
    weight = np.exp(-0.5 * (baselines / _OUTER) ** 2)

    def tensor(a: FloatMap, b: FloatMap) -> FloatMap:
        # einsum, not tensordot: a BLAS product changes its last bits with the number of threads
        return _blurred(np.einsum("s,scyx->yx", weight / weight.sum(), a * b), _OUTER)

    xx, ss, xs = tensor(along_x, along_x), tensor(along_s, along_s), tensor(along_x, along_s)
    spread = np.sqrt((ss - xx) ** 2 + 4 * xs**2)
    with np.errstate(divide="ignore", invalid="ignore"):
        # x moves by -d per view step along a line: L_s = d L_x for the nearer-is-positive convention
        disparity = np.tan(0.5 * np.arctan2(2 * xs, xx - ss))
        coherence = np.where(xx + ss > 0, (spread / (xx + ss)) ** 2, 0)
    return disparity.astype(np.float32), coherence.astype(np.float32)


def _blurred(image: FloatMap, sigma: float) -> FloatMap:
    return np.asarray(cv2.GaussianBlur(image, (0, 0), sigma), np.float32)
