"""Views as bright as the reference view: cameras of an array, and one that moves, expose each picture otherwise.

All methods compare colours of the views. A difference of some per cent is more than noise and faint texture are, and
moves the minimum of a cost over all views. It is measured on small pictures, since it is the same all over a view.
"""

from __future__ import annotations

from dataclasses import replace

import cv2
import numpy as np
import numpy.typing as npt

from sepi.lightfield import HIGHEST, LOWEST, BoolMap, FloatMap, LightField, full_scale

# values that tell of brightness, full range = 1: neither black nor burnt out
_DARKEST, _BRIGHTEST = 0.03, 0.97
# blur before brightness is compared, pixels; part of the picture's pixels that must be comparable
_BLUR = 2.0
_COMPARABLE = 0.02
# factors of all views within this of one are none
_ALIKE = 0.02
# the same of means over whole views, at a glance
_MEANS_ALIKE = 0.01
# a factor is clear that is so many standard errors from one, of which things that move by more have at most four;
# pixels of a square of which each tells as much as one
_CLEAR = 5.0
_ALONE = 64
# least side of the small pictures that tell whether there is a difference, and of those that tell it, pixels
_SIDE, _FINE_SIDE = 96, 192
# every so many rows count in means over whole views
_STRIDE = 4


def equally_bright(light_field: LightField) -> LightField:
    """The light field with views as bright as the reference view, or itself where all are.

    Parameters
    ----------
    light_field : LightField

    Returns
    -------
    LightField
        Views of the same dtype; each channel of a view is multiplied by one number, as far as its values go, and a note
        says by how much at most.
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
    note = f"brightness and colour differed from view to view, by up to {percent:.2g} %: made equal"
    return replace(light_field, views=views, notes=(*light_field.notes, note))


def brightness_factors(
    light_field: LightField, side: int = _FINE_SIDE
) -> tuple[npt.NDArray[np.float64], npt.NDArray[np.float64]]:
    """What to multiply each view's channels by to be as bright as the reference view, and the error of that.

    Both of shape (T, S, C): :func:`gains` of each view, made smaller while its sides are this long; 1 and 0 for missing
    views.
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


def gains(
    reference: FloatMap, view: FloatMap, shown: BoolMap
) -> tuple[npt.NDArray[np.float64], npt.NDArray[np.float64]]:
    """What to multiply each channel of a view by to be as bright as the reference view where both see the same.

    Pictures are laid over each other by the one shift that fits best, and the ratio is the median over all pixels: what
    is hidden, or moves by more, is outvoted.

    Parameters
    ----------
    reference, view : ndarray, shape (H, W, C), float32
        Colours in 0..1.
    shown : ndarray, shape (H, W), bool
        Which of its pixels the view has.

    Returns
    -------
    factors, errors : ndarray, shape (C,), float64
        And the standard errors of their logarithms; 1 and 0 where too little of both pictures tells.
    """
    height, width = view.shape[:2]
    size = width, height
    shift, _ = cv2.phaseCorrelate(_grey(reference), _grey(view), cv2.createHanningWindow(size, cv2.CV_32F))
    # it takes half a pixel for the middle of an odd number of them
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
            # of a median of normal errors, by their median deviation
            errors[c] = 1.25 * 1.48 * np.median(np.abs(ratios - middle)) / np.sqrt(len(ratios) / _ALONE)
    return found, errors


def _means_are_alike(light_field: LightField) -> bool:
    """Whether the views are as bright on average, at a glance; not told where they do not show all of their pixels."""
    if light_field.missing is not None:
        return False
    own = _mean(light_field, light_field.reference_position)
    places = map(tuple, np.argwhere(light_field.present).tolist())
    return all((np.abs(_mean(light_field, place) - own) <= _MEANS_ALIKE * own).all() for place in places)


def _mean(light_field: LightField, place: tuple[int, ...]) -> npt.NDArray[np.float64]:
    """Mean colour of a view, of some of its rows, which are counted from the nearer end."""
    rows = np.arange(light_field.shape[0])
    view = light_field.views[place][np.minimum(rows, rows[::-1]) % _STRIDE == 0]
    return np.array(cv2.mean(view)[: view.shape[2]])


def _small(light_field: LightField, place: tuple[int, int], step: int) -> tuple[FloatMap, BoolMap]:
    """A view in 0..1, made so many times smaller, and which of its pixels it shows."""
    view, (height, width) = light_field.views[place], (size // step for size in light_field.shape)
    small = cv2.resize(view, (width, height), interpolation=cv2.INTER_AREA)
    small = small.reshape(height, width, -1) / np.float32(full_scale(view.dtype))
    if light_field.missing is None:
        return small, np.ones((height, width), bool)
    missing = light_field.missing[place].astype(np.float32)
    return small, cv2.resize(missing, (width, height), interpolation=cv2.INTER_AREA) == 0


def _grey(view: FloatMap) -> FloatMap:
    return np.ascontiguousarray(np.mean(cv2.split(view), axis=0), np.float32)
