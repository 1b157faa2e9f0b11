"""Views made as bright as the reference view, for cameras that expose each picture differently.

All methods compare colours of the views. A difference of a few per cent exceeds noise and faint texture, and shifts the
minimum of a cost over all views. It is the same all over a view, so small pictures are enough to measure it.
"""

from __future__ import annotations

from dataclasses import replace

import cv2
import numpy as np

from sepi.lightfield import HIGHEST, LOWEST, BoolMap, FloatArray, FloatMap, LightField, full_scale

# values that count, full range = 1: neither black nor overexposed
_DARKEST, _BRIGHTEST = 0.03, 0.97
# blur before the comparison, pixels; least share of comparable pixels
_BLUR = 2.0
_COMPARABLE = 0.02
# if the factors of all views lie this close to 1, nothing changes
_ALIKE = 0.02
# the same for means over whole views
_MEANS_ALIKE = 0.01
# least distance of a factor from 1 in standard errors (things that move by more than the shift cause at most four);
# number of neighbouring pixels that count as one measurement
_CLEAR = 5.0
_ALONE = 64
# least side of the small pictures, in pixels: to find whether there is a difference, and to measure it
_SIDE, _FINE_SIDE = 96, 192
# means over whole views use every fourth row
_STRIDE = 4


def equally_bright(light_field: LightField) -> LightField:
    """The light field with all views as bright as the reference view; itself if they are.

    Parameters
    ----------
    light_field : LightField

    Returns
    -------
    LightField
        Views of the same dtype. Each channel of a view is multiplied by one factor, within the range of its values; a
        note states the largest factor.
    """
    if _means_are_alike(light_field):
        return light_field
    factors, errors = brightness_factors(light_field, _SIDE)
    change = np.abs(np.log(factors))
    if not ((change > _ALIKE) & (change > _CLEAR * errors)).any():
        return light_field
    factors, errors = brightness_factors(light_field)
    factors = np.where(np.abs(np.log(factors)) > errors, factors, 1)
    views = np.array(light_field.views)
    for t, s in np.argwhere(light_field.present).tolist():
        bright = views[t, s] * factors[t, s].astype(np.float32)
        if views.dtype == np.float32:
            views[t, s] = np.clip(bright, LOWEST, HIGHEST)
        else:
            views[t, s] = np.rint(np.minimum(bright, full_scale(views.dtype)))
    percent = 100 * np.expm1(np.abs(np.log(factors)).max())
    note = f"brightness and colour differed by up to {percent:.2g} % between views, and were made equal"
    return replace(light_field, views=views, notes=(*light_field.notes, note))


def brightness_factors(light_field: LightField, side: int = _FINE_SIDE) -> tuple[FloatArray, FloatArray]:
    """Factors that make each view's channels as bright as the reference view's, and their errors.

    Both have shape (T, S, C) and are the :func:`gains` of views reduced to about this side; missing views have 1 and 0.
    """
    step = max(1, min(light_field.shape) // side)
    factors = np.ones((*light_field.grid, light_field.views.shape[4]))
    errors = np.zeros_like(factors)
    reference, shown = _small(light_field, light_field.reference_position, step)
    for t, s in np.argwhere(light_field.present).tolist():
        if (t, s) != light_field.reference_position:
            view, shows = _small(light_field, (t, s), step)
            factors[t, s], errors[t, s] = gains(reference, view, shown & shows)
    return factors, errors


def gains(reference: FloatMap, view: FloatMap, shown: BoolMap) -> tuple[FloatArray, FloatArray]:
    """Factors that make each channel of a view as bright as the reference view's.

    The best single shift aligns the pictures. The factor is the median ratio over all pixels, so that hidden pixels, or
    those that move by more, do not matter.

    Parameters
    ----------
    reference, view : ndarray, shape (H, W, C), float32
        Colours in 0..1.
    shown : ndarray, shape (H, W), bool
        Pixels that the view has.

    Returns
    -------
    factors, errors : ndarray, shape (C,), float64
        Factors, and the standard errors of their logarithms; 1 and 0 if too few pixels are comparable.
    """
    height, width = view.shape[:2]
    size = width, height
    shift, _ = cv2.phaseCorrelate(_grey(reference), _grey(view), cv2.createHanningWindow(size, cv2.CV_32F))
    # for odd sizes, phaseCorrelate is off by half a pixel
    across, down = np.rint(shift - np.array([cv2.getOptimalDFTSize(side) % 2 / 2 for side in size])).astype(int)
    if abs(across) > width // 2 or abs(down) > height // 2:
        across = down = 0
    there = view[max(0, down) : height + min(0, down), max(0, across) : width + min(0, across)]
    has = shown[max(0, down) : height + min(0, down), max(0, across) : width + min(0, across)]
    here = reference[max(0, -down) : height + min(0, -down), max(0, -across) : width + min(0, -across)]
    found, errors = np.ones(view.shape[2]), np.zeros(view.shape[2])
    for c in range(view.shape[2]):
        one, other = (cv2.GaussianBlur(np.ascontiguousarray(part[..., c]), (0, 0), _BLUR) for part in (here, there))
        both = has & (np.minimum(one, other) > _DARKEST)
        both &= np.maximum(one, other) < _BRIGHTEST
        if both.mean() >= _COMPARABLE:
            ratios = np.log(one[both]) - np.log(other[both])
            middle = np.median(ratios)
            found[c] = np.exp(middle)
            # standard error of a median of normal errors
            errors[c] = 1.25 * 1.48 * np.median(np.abs(ratios - middle)) / np.sqrt(len(ratios) / _ALONE)
    return found, errors


def _means_are_alike(light_field: LightField) -> bool:
    """Whether the views have the same mean brightness; False for views with missing pixels."""
    if light_field.missing is not None:
        return False
    own = _mean(light_field, light_field.reference_position)
    places = map(tuple, np.argwhere(light_field.present).tolist())
    return all((np.abs(_mean(light_field, place) - own) <= _MEANS_ALIKE * own).all() for place in places)


def _mean(light_field: LightField, place: tuple[int, ...]) -> FloatArray:
    """Mean colour over some rows of a view; the rows are symmetric, so that a flipped view has the same mean."""
    rows = np.arange(light_field.shape[0])
    view = light_field.views[place][np.minimum(rows, rows[::-1]) % _STRIDE == 0]
    return np.array(cv2.mean(view)[: view.shape[2]])


def _small(light_field: LightField, place: tuple[int, int], step: int) -> tuple[FloatMap, BoolMap]:
    """A view in 0..1 reduced by a factor of ``step``, and the mask of the pixels that it has."""
    view, (height, width) = light_field.views[place], (size // step for size in light_field.shape)
    small = cv2.resize(view, (width, height), interpolation=cv2.INTER_AREA)
    small = small.reshape(height, width, -1) / np.float32(full_scale(view.dtype))
    if light_field.missing is None:
        return small, np.ones((height, width), bool)
    missing = light_field.missing[place].astype(np.float32)
    return small, cv2.resize(missing, (width, height), interpolation=cv2.INTER_AREA) == 0


def _grey(view: FloatMap) -> FloatMap:
    return np.ascontiguousarray(np.mean(cv2.split(view), axis=0), np.float32)
