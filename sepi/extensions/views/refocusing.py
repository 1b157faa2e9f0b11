"""Refocused pictures: focused at one disparity, or everywhere.

The views of a light field are samples of one large lens, the *synthetic aperture*. Sheared by a disparity, they show
points of this disparity at the same place. Their mean is the photograph by that lens, focused there [1]_
(:func:`refocus`). It needs no map; with one, the gaps between the views are filled. With a map, :func:`all_in_focus`
focuses each pixel at its own disparity: the mean of all views that see a point has less noise than the reference view.

References
----------
.. [1] Ng, Levoy, Bredif, Duval, Horowitz, Hanrahan: Light field photography with a hand-held plenoptic camera.
   Stanford Tech Report CTSR 2005-02.
"""

import math
from numbers import Real
from typing import Any

import cv2
import numpy as np
import numpy.typing as npt

from sepi.errors import SepiError
from sepi.image.noise import noise_level
from sepi.kernels import refocusing as kernels
from sepi.lightfield import BoolMap, FloatMap, LightField, as_unit_float, require_light_field, without_reference
from sepi.matching.nearest_surfaces import EMPTY, nearest_surfaces, z_buffers
from sepi.matching.row_bands import Rows
from sepi.matching.sheared_views import ShearedViews
from sepi.stage import Progress, StageMaps, no_progress
from sepi.validation import described, is_finite, require_map, require_type

OCCLUSION_MARGIN = 0.15
"""By how much an occluder must be nearer, pixels per view step; as in the stages."""

COLOUR_SCALE = 0.0316
"""RGB distance from the expected colour at which a view counts a quarter, colours in 0..1; noise adds to it."""

ROUNDS = 2
"""Number of means of the views: the first expects the reference view's colour, the next one the first mean."""

# sides in pixels of the windows that fill holes, one after the other; together they reach 16 pixels
_FILL = (3, 3, 5, 9, 17)

BEYOND = 0.005
"""Share of a map's pixels beyond each end of a focal stack, so that a few wrong ones do not widen it."""


def refocus(
    light_field: LightField,
    disparity: float,
    maps: StageMaps | FloatMap | None = None,
    *,
    aperture: float | None = None,
    progress: Progress = no_progress,
) -> FloatMap:
    """Picture of the synthetic aperture, focused at one disparity.

    Nearer and farther points are out of focus, more so with a larger aperture. Points that move by more than about a
    pixel between neighbouring views would give sharp copies instead of a blur. With a map, which tells this movement,
    each view represents all views around it, half way to its neighbours.

    Parameters
    ----------
    light_field : LightField
    disparity : float
        Pixels per view step. Points of this disparity are sharp.
    maps : StageMaps, or ndarray of shape (H, W), float32, optional
        Maps of the reference view, or its disparity in pixels per view step, to interpolate between the views; default:
        the mean of the views alone.
    aperture : float, optional
        Radius of the aperture round the reference view, in view steps; default: all views.
    progress : callable
        Called with the fraction done.

    Returns
    -------
    ndarray, shape (H, W, C), float32
        Colours in 0..1, seen from the reference view, with the channels of the views. A pixel outside some views is the
        mean of the others.

    Raises
    ------
    SepiError
        If the disparity is not finite, the map does not have the views' shape, or the aperture is not positive or too
        small for a second view.

    Examples
    --------
    >>> import numpy as np
    >>> import sepi
    >>> from sepi.scenes import render
    >>> light_field = render("fronto_parallel", size=64, views=3)
    >>> picture = sepi.refocus(light_field, 1.0)
    >>> bool(np.abs(picture - light_field.reference_view)[8:-8, 8:-8].max() < 0.01)
    True
    """
    require_light_field(light_field)
    if not is_finite(disparity):
        told = described(disparity)
        raise SepiError(f"{light_field.name}: disparity to focus at must be a finite number, got {told}")
    surfaces = None if maps is None else _surfaces(_disparity_of(light_field, maps))
    height, width = light_field.shape
    moved = disparity * light_field.baselines
    # at larger disparities, no pixel is left
    held = (np.abs(moved) <= (height - 1, width - 1)).all(axis=2)
    chosen = views_within(light_field, aperture) & held
    sums, counts = np.zeros((3, height, width), np.float32), np.zeros((height, width), np.float32)
    rows = _rows(chosen)
    for number, row in enumerate(rows, 1):
        views = ShearedViews(light_field, row).at(disparity)
        if surfaces is not None:
            views = _filled(light_field, row, views, surfaces, disparity)
        for place, sheared in zip(np.argwhere(row).tolist(), views, strict=True):
            shown = _shown(light_field, tuple(place), moved[tuple(place)])
            sums += sheared * shown
            counts += shown
        progress(number / len(rows))
    picture = np.clip(sums / counts, 0, 1).transpose(1, 2, 0)
    return np.ascontiguousarray(picture[..., : light_field.views.shape[4]])


def all_in_focus(
    light_field: LightField,
    maps: StageMaps | FloatMap,
    *,
    aperture: float | None = None,
    occlusion_margin: float = OCCLUSION_MARGIN,
    progress: Progress = no_progress,
) -> FloatMap:
    """The reference view with each pixel averaged over the views that see its point.

    Views in which a nearer pixel of the map occludes the point are left out. A view weighs less if its colour differs
    from the others', so that the reference view's own colour stays where the map is wrong. N views that see a point
    reduce its noise to about 1 / sqrt(N).

    Parameters
    ----------
    light_field : LightField
    maps : StageMaps, or ndarray of shape (H, W), float32
        Maps of the reference view, or its disparity in pixels per view step. Pixels that are not finite keep the
        reference view's colour.
    aperture : float, optional
        Radius of the views that are used, in view steps; default: all views.
    occlusion_margin : float
        By how much an occluder must be nearer, pixels per view step.
    progress : callable
        Called with the fraction done.

    Returns
    -------
    ndarray, shape (H, W, C), float32
        Colours in 0..1, with the channels of the views.

    Raises
    ------
    SepiError
        If the map does not have the views' shape, or the aperture is not positive or too small for a second view.

    Examples
    --------
    >>> import numpy as np
    >>> import sepi
    >>> from sepi.scenes import render
    >>> light_field = render("fronto_parallel", size=64, views=3)
    >>> noise = np.random.default_rng(0).normal(0, 10, light_field.views.shape)
    >>> noisy = sepi.LightField((light_field.views + noise).clip(0, 255).astype(np.uint8), "noisy")
    >>> picture = sepi.all_in_focus(noisy, light_field.ground_truth)
    >>> def error(picture):
    ...     return float(abs(picture - light_field.reference_view).mean())
    >>> error(picture) < error(noisy.reference_view) / 2
    True
    """
    require_light_field(light_field)
    disparity = _disparity_of(light_field, maps)
    others = views_within(light_field, aperture)
    others[light_field.reference_position] = False
    reference = as_unit_float(light_field.views[light_field.reference_position])
    surfaces = _surfaces(disparity)
    if surfaces is None:
        return np.clip(reference, 0, 1)
    disparity = np.where(np.isfinite(disparity), disparity, np.float32(np.nan))
    channels = reference.shape[2]
    noise = 2 * channels * noise_level(light_field.reference_view) ** 2
    scale2 = np.float32(COLOUR_SCALE**2 * channels / 3 + noise)
    centre, rows = reference, _rows(others)
    for number in range(ROUNDS):
        sums = reference - centre
        weights = np.square(scale2 / (scale2 + np.square(sums).sum(axis=2)))
        sums *= weights[..., None]
        for done, row in enumerate(rows, 1):
            found = nearest_surfaces(light_field, surfaces, row, Rows(0, light_field.shape[0]))
            for (t, s), nearest in zip(np.argwhere(row).tolist(), found, strict=True):
                view, margin = as_unit_float(light_field.views[t, s]), occlusion_margin
                v, u = light_field.baselines[t, s]
                kernels.add_view(view, v, u, disparity, nearest, margin, centre, float(scale2), sums, weights)
            progress((number + done / len(rows)) / ROUNDS)
        centre = centre + sums / weights[..., None]
    return np.clip(centre, 0, 1)


def _rows(views: BoolMap) -> list[BoolMap]:
    """Masks (T, S) of the views of each row of the grid with any, since all views at a time take much memory."""
    return [row for row in views & np.eye(len(views), dtype=bool)[:, :, None] if row.any()]


def views_within(light_field: LightField, aperture: float | None) -> BoolMap:
    """Views within this radius of the reference view, in view steps; None: all; shape (T, S), bool.

    Raises
    ------
    SepiError
        If the radius is not positive, or too small for a second view.
    """
    if aperture is None:
        return light_field.present.copy()
    require_type(f"{light_field.name}: aperture", aperture, Real, "a radius above 0 in view steps")
    if not aperture > 0:
        raise SepiError(f"{light_field.name}: aperture must be a radius above 0 in view steps, got {aperture:g}")
    distance = np.hypot(*np.moveaxis(light_field.baselines, 2, 0))
    chosen = light_field.present & (distance <= aperture)
    if chosen.sum() < 2:
        others = without_reference(light_field, light_field.present)
        alone = f"an aperture of {aperture:g} view steps has no view but the reference view"
        raise SepiError(f"{light_field.name}: {alone}; the nearest other is {distance[others].min():g} away")
    return np.asarray(chosen, bool)


def focal_stack(disparity: FloatMap, count: int) -> list[float]:
    """Disparities to focus at, from the nearest to the farthest surface of a map.

    Parameters
    ----------
    disparity : ndarray, shape (H, W), float32
        Pixels per view step; NaN where unknown.
    count : int
        Number of disparities; 1: the middle.

    Returns
    -------
    list of float
        Falling in even steps, from end to end of the map without a few pixels; one if the map is constant.

    Raises
    ------
    SepiError
        If no pixel is finite.
    """
    counted = disparity[np.isfinite(disparity)].astype(np.float64)
    if not counted.size:
        raise SepiError("the map has no pixel with a known disparity to focus at")
    low, high = np.quantile(counted, (BEYOND, 1 - BEYOND)).tolist()
    return evenly_spaced(low, high, count)


def evenly_spaced(low: float, high: float, count: int) -> list[float]:
    """``count`` disparities from ``high`` down to ``low``; a single one is the middle; one if both are the same."""
    if count == 1 or high <= low:
        return [(low + high) / 2]
    return [float(value) for value in np.linspace(high, low, count)]


def _disparity_of(light_field: LightField, maps: StageMaps | FloatMap) -> FloatMap:
    """The disparity of maps, checked to have the views' shape."""
    disparity = maps.disparity if isinstance(maps, StageMaps) else maps
    require_map(f"{light_field.name}: map", disparity, light_field.shape)
    return np.ascontiguousarray(disparity, np.float32)


def _surfaces(disparity: FloatMap) -> FloatMap | None:
    """A map with the farthest disparity at pixels that are not finite, so that these occlude nothing."""
    known = np.isfinite(disparity)
    return np.where(known, disparity, disparity[known].min()).astype(np.float32) if known.any() else None


def _cell(light_field: LightField) -> FloatMap:
    """Height and width in view steps of a view's cell: the usual distance of neighbours; 0 without neighbours."""
    baselines, present = light_field.baselines, light_field.present
    found = []
    for axis in (0, 1):
        steps = np.diff(baselines[..., axis], axis=axis)
        both = np.logical_and(*(np.take(present, range(k, present.shape[axis] - 1 + k), axis) for k in (0, 1)))
        found.append(float(np.median(np.abs(steps[both]))) if both.any() else 0.0)
    return np.array(found, np.float32)


def _filled(light_field: LightField, chosen: BoolMap, views: FloatMap, surfaces: FloatMap, focus: float) -> FloatMap:
    """Sheared views ``(N, 3, H, W)`` of one row of the grid, each with the views round it."""
    baselines, cell = light_field.baselines[chosen], _cell(light_field)
    nearest = z_buffers(surfaces, baselines, 0, len(surfaces))
    filled = np.empty_like(views)
    for n, baseline in enumerate(baselines):
        here = _sheared(_without_holes(nearest[n], focus), focus * baseline)
        kernels.fill_between(views[n], here, focus, cell, OCCLUSION_MARGIN, filled[n])
    return filled


def _without_holes(nearest: FloatMap, otherwise: float) -> FloatMap:
    """A z-buffer with holes, which the reference view does not see, filled with the farthest surface beside them.

    Pixels farther inside than the reach of the windows get the disparity ``otherwise``.
    """
    empty = nearest == EMPTY
    found = np.where(empty, np.float32(np.inf), nearest)
    if empty.any():
        for side in _FILL:
            window = np.ones((side, side), np.uint8)
            # no surfaces beyond the border
            beside = cv2.erode(found, window, borderType=cv2.BORDER_CONSTANT, borderValue=(np.inf,))
            found = np.where(empty, beside, found)
    return np.where(np.isinf(found), np.float32(otherwise), found).astype(np.float32)


def _shown(light_field: LightField, place: tuple[int, ...], moved: npt.NDArray[np.float64]) -> FloatMap:
    """Mask of the reference pixels whose samples a view shows, as 1 and 0; shape (H, W)."""
    shown = np.zeros(light_field.shape, np.float32)
    # pixels ``p`` for which the view has the pixel ``p - moved``
    ends = ((max(0, math.ceil(by)), math.floor(n - 1 + by) + 1) for n, by in zip(shown.shape, moved, strict=True))
    shown[tuple(slice(*end) for end in ends)] = 1
    # the reference view counts even at its missing pixels, for lack of others
    if light_field.missing is not None and place != light_field.reference_position:
        # reach of a cubic sample
        beside = cv2.dilate(light_field.missing[place].astype(np.uint8), np.ones((5, 5), np.uint8))
        shown[_sheared(beside, moved) > 0] = 0
    return shown


def _sheared(values: npt.NDArray[Any], moved: npt.NDArray[np.float64]) -> npt.NDArray[Any]:
    """Values (H, W) of a view at the nearest pixels to those of the reference view, which it shows ``moved``."""
    at = (np.clip(np.rint(np.arange(n) - by), 0, n - 1).astype(int) for n, by in zip(values.shape, moved, strict=True))
    return np.ascontiguousarray(values[np.ix_(*at)])
