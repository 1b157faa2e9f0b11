"""Share of the nearer of its two surfaces in a pixel beside a depth step, from all views.

A pixel that an edge runs through shows a share ``a`` of the nearer surface, of colour ``F``, and of the background the
rest. It moves with the nearer surface: along that disparity every view ``v`` shows the same share before another piece
of background, ``I_v = a F + (1 - a) B_v``. Views that are not hidden show what is behind, ``B_v``, so that ``a`` and
``F`` follow from all views together, without any window.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import cv2
import numpy as np
import numpy.typing as npt

from sepi.boundaries.parameters import BoundaryParameters
from sepi.boundaries.rim import Rim, RimViews, Sides, Surroundings
from sepi.image.noise import noise_of_reference_view
from sepi.kernels import background as background_kernels
from sepi.kernels import surface_shares as kernels
from sepi.lightfield import BoolMap, FloatMap, LightField, as_unit_float, full_scale
from sepi.matching.nearest_surfaces import SeenViews
from sepi.matching.row_bands import row_bands
from sepi.matching.view_subsets import spread_views

_LEAST_SCALE = 0.005
"""Of the residual at which a view counts half, beside noise; 0..1."""

_MOST_DARKENING = 1.25
"""Ratio of brightness, either way, up to which a view is taken for another exposure of the same."""

_ACROSS = 64
"""Pixels along the shorter side whose colours tell the brightness of a view."""

_MOST_DIFFERENCE = 0.1
"""Of one channel in a view's residual, colours in 0..1."""

_ENOUGH = 25
"""Least number of views for a background that the reference view shows, too."""

BYTES_PER_PIXEL, MOST_BYTES = 4, 2**26
"""Of a pixel of a view: the z-buffer; and of a band, which fits where the sweep's costs were."""


class ShareCosts(NamedTuple):
    """Costs of shares of the nearer surface as explanations of the views' colours at the pixels of a rim.

    Attributes
    ----------
    costs : ndarray, shape (n, K), float32
        Mean robust residuals of shares from 0 to 1, 0..1; 0 where the views do not tell.
    told : ndarray, shape (n,), bool
        Where they do.
    """

    costs: FloatMap
    told: BoolMap


def nothing_told(count: int) -> ShareCosts:
    """Costs of ``count`` pixels without evidence from any view."""
    return ShareCosts(np.zeros((count, kernels.SHARES), np.float32), np.zeros(count, bool))


def share_costs(
    light_field: LightField, disparity: FloatMap, around: Surroundings, rim: Rim, parameters: BoundaryParameters
) -> ShareCosts:
    """Costs of shares of the nearer surface by all views.

    Parameters
    ----------
    light_field : LightField
    disparity : ndarray, shape (H, W), float32
        Pixels per view step.
    around : Surroundings
        Of the disparity.
    rim : Rim
        Its ``n`` pixels inside are looked at.
    parameters : BoundaryParameters

    Returns
    -------
    ShareCosts
    """
    pixels = np.flatnonzero(rim.inside)
    found = nothing_told(len(pixels))
    guide = light_field.reference_view
    # no farther surface within a pixel, so none shows through
    clean = disparity - around.farthest < parameters.boundary_step
    sides = Sides(disparity, guide, clean, parameters.clean_radius)
    present, units = _views_alike(light_field, sides, parameters)
    if not len(units):
        # they say nothing for either surface
        return found
    scales2 = _LEAST_SCALE**2 + 2 * noise_of_reference_view(light_field) ** 2, parameters.share_scale**2
    baselines, margin = np.abs(light_field.baselines[present]), parameters.occlusion_margin
    # how far from a pixel the pieces of background lie that views show with it
    step = np.where(rim.inside, rim.near - rim.far, 0)
    moved = np.ceil(step * baselines.max()) + 2
    rows_moved = math.ceil(float(step.max()) * float(baselines[:, 0].max())) + 1
    farthest = float(np.abs(disparity).max())
    height, width = light_field.shape
    layer, wanted = _more_distant_layer(disparity, rim, margin, moved)
    shown, few = (layer == disparity) & ~rim.inside, spread_views(light_field, _ENOUGH)[present]
    background = np.zeros((height, width, 4), np.float32)
    # kernels take rows whose numbers lie side by side
    colours = np.ascontiguousarray(light_field.views)
    lines = colours.reshape(*colours.shape[:3], -1), colours.shape[4]
    for begin, end, rows in row_bands(light_field, present, farthest, BYTES_PER_PIXEL, rows_moved, MOST_BYTES):
        views = RimViews(*lines, units, SeenViews.of(light_field, around.nearest, present, rows, margin))
        first, last = max(0, begin - rows_moved), min(height, end + rows_moved)
        background_kernels.background_of(views, layer, wanted, shown, few, first, last, background)
        of_band = slice(*np.searchsorted(pixels, (begin * width, end * width)))
        kernels.costs_of_shares(
            views, rim, background, sides, *scales2, pixels[of_band], found.costs[of_band], found.told[of_band]
        )
    return found


def _views_alike(light_field: LightField, sides: Sides, parameters: BoundaryParameters) -> tuple[BoolMap, FloatMap]:
    """The views that are compared (T, S), without those that show it badly or are much darker, and their units.

    Lenses darken and blur views towards the edge of the grid; shares would take that for another surface.
    """
    present = spread_views(light_field, parameters.share_views)
    brightness, residual = view_brightness(light_field, sides, np.argwhere(present))
    alike = (brightness > 1 / _MOST_DARKENING) & (brightness < _MOST_DARKENING)
    showing = np.isfinite(residual)
    usual = float(np.median(residual[showing])) if showing.any() else 0.0
    alike &= showing & (residual <= 2 * usual + _LEAST_SCALE)
    units = (1 / full_scale(light_field.views.dtype) / brightness[alike]).astype(np.float32)
    chosen = np.zeros_like(present)
    chosen[present] = alike
    return chosen, units


def view_brightness(
    light_field: LightField, sides: Sides, places: npt.NDArray[np.int64]
) -> tuple[npt.NDArray[np.float64], npt.NDArray[np.float64]]:
    """Brightness and residual of views relative to the reference view, over some clean pixels.

    Parameters
    ----------
    light_field : LightField
    sides : Sides
    places : ndarray, shape (N, 2), int64
        Row and column of each view in the grid.

    Returns
    -------
    brightness, residual : ndarray, shape (N,), float64
        Ratio of the sums of the colours that both show, and what remains: mean absolute difference of one channel,
        0..1; NaN where they show nothing alike.
    """
    shape = light_field.shape
    stride = max(1, min(shape) // _ACROSS)
    # a flipped view has the same pixels
    lines = [np.flatnonzero(np.minimum(at := np.arange(length), at[::-1]) % stride == 0) for length in shape]
    asked = np.ix_(*lines)
    here, disparity, clean = sides.guide[asked], sides.disparity[asked], sides.clean[asked]
    brightness, residual = np.ones(len(places)), np.full(len(places), np.nan)
    views, baselines = light_field.rgb_views, light_field.baselines
    for n, (t, s) in enumerate(places.tolist()):
        down, across = baselines[t, s]
        y, x = (
            (lines[0][:, None] - disparity * down).astype(np.float32),
            (lines[1] - disparity * across).astype(np.float32),
        )
        shown = clean & (y >= 0) & (y <= shape[0] - 1) & (x >= 0) & (x <= shape[1] - 1)
        if light_field.missing is not None:
            missing = light_field.missing[t, s].astype(np.float32)
            shown &= cv2.remap(missing, x, y, cv2.INTER_LINEAR) == 0
        if shown.any():
            view = np.ascontiguousarray(views[t, s])
            there, own = as_unit_float(cv2.remap(view, x, y, cv2.INTER_LINEAR))[shown], here[shown]
            shown_there, shown_here = (max(float(of.sum(dtype=np.float64)), 1e-9) for of in (there, own))
            brightness[n] = shown_there / shown_here
            apart = np.abs(there / brightness[n] - own)
            residual[n] = np.minimum(apart, _MOST_DIFFERENCE).mean(dtype=np.float64)
    return brightness, residual


def _more_distant_layer(disparity: FloatMap, rim: Rim, margin: float, moved: FloatMap) -> tuple[FloatMap, BoolMap]:
    """The map with the more distant surface of the next step in place of all that is nearer, and how far it is known.

    That is so many pixels from a step. Of steps that are equally near the most distant surface is taken.
    """
    behind = np.where(rim.inside, rim.far, np.float32(np.inf))
    # pixels that are left to where views show what is behind the next step
    left = np.where(rim.inside, moved, -1).astype(np.float32)
    for step in range(int(left.max())):
        unknown = np.isinf(behind)
        # by turns, so that what is reached is nearly round
        around = cv2.getStructuringElement(cv2.MORPH_RECT if step % 2 else cv2.MORPH_CROSS, (3, 3))
        np.copyto(behind, cv2.erode(behind, around), where=unknown)
        left = np.maximum(left, cv2.dilate(left, np.ones((3, 3), np.uint8)) - 1)
    return np.where(disparity > behind + margin, behind, disparity), np.isfinite(behind) & (left >= 0)
