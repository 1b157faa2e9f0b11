"""Specks of the map: a few pixels whose depth no surrounding pixel shares.

A surface covers more than a few pixels, apart from rare tips. A speck is a matching error, mostly beside an edge, where
few views see a pixel, or on a plain surface, where a depth farther behind it fits as well as any. Holes, surrounded by
nearer pixels only, may be larger: hardly any view shows the surface behind a hole, so hardly any contradicts it. The
pixels of a speck join the neighbours whose colours are most like their own.

A surface behind a fence also shows in gaps of a few pixels. Such a gap is as deep as something close by in the picture,
and stays unless views favour closing it.
"""

from __future__ import annotations

import numpy as np

from sepi.boundaries.parameters import BoundaryParameters
from sepi.kernels import specks as kernels
from sepi.lightfield import BoolMap, FloatMap, LightField, without_reference
from sepi.matching.gaps import compared_depths

# a gap is as deep as so many pixels of larger parts, no farther away than so many pixels
_AS_DEEP, _ABOUT = 3, 5
# its squared residual is at most so many times that of the closed one, in this share of the views at least
_WORSE, _SEEING = 2.0, 0.5

_NEIGHBOURS = [(dy, dx) for dy in (-1, 0, 1) for dx in (-1, 0, 1) if dy or dx]


def without_specks(
    light_field: LightField, disparity: FloatMap, present: BoolMap, parameters: BoundaryParameters
) -> FloatMap:
    """Disparity map without specks; gaps do not count as specks.

    Parameters
    ----------
    light_field : LightField
    disparity : ndarray, shape (H, W), float32
        Pixels per view step.
    present : ndarray, shape (T, S), bool
        The views that are asked about gaps.
    parameters : BoundaryParameters

    Returns
    -------
    ndarray, shape (H, W), float32
    """
    margin, colours = parameters.occlusion_margin, light_field.reference_view
    joined = join_specks(disparity, colours, margin, parameters.speck_area, parameters.hole_area)
    asked = _deep_as_something_near(disparity, joined, margin)
    if not asked.any():
        return joined
    others = without_reference(light_field, present)
    closed, open_, seeing = compared_depths(light_field, np.where(asked, disparity, joined), joined, others, margin)
    stays = asked & (open_ <= _WORSE * closed) & (seeing >= _SEEING * others.sum())
    return np.where(stays, disparity, joined)


def _deep_as_something_near(disparity: FloatMap, joined: FloatMap, difference: float) -> BoolMap:
    """Pixels of specks that are farther than what they join, and as deep as a few that belong to larger parts."""
    farther = disparity < joined
    y, x = np.nonzero(farther)
    alike = np.zeros(len(y), np.int64)
    # beyond the border, nothing equals anything
    found, parts = (np.pad(values, _ABOUT, constant_values=np.nan) for values in (disparity, joined))
    for dy, dx in np.ndindex(2 * _ABOUT + 1, 2 * _ABOUT + 1):
        there = y + dy, x + dx
        alike += (found[there] == parts[there]) & (np.abs(found[there] - disparity[y, x]) <= difference)
    farther[y, x] = alike >= _AS_DEEP
    return farther


def specks_of(disparity: FloatMap, difference: float, most_pixels: int, most_of_hole: int) -> BoolMap:
    """Pixels (H, W) of parts of a map that are small; see :func:`join_specks`."""
    specks = np.empty(disparity.shape, bool)
    kernels.specks_of(np.ascontiguousarray(disparity), difference, most_pixels, most_of_hole, specks)
    return specks


def join_specks(
    disparity: FloatMap, colours: FloatMap, difference: float, most_pixels: int, most_of_hole: int
) -> FloatMap:
    """Disparity without specks.

    Parameters
    ----------
    disparity : ndarray, shape (H, W), float32
        Pixels per view step.
    colours : ndarray, shape (H, W, 3), float32
        0..1.
    difference : float
        By how much neighbours differ at most to belong together, pixels per view step.
    most_pixels, most_of_hole : int
        Of a speck, and of one with nothing but nearer pixels round it.

    Returns
    -------
    ndarray, shape (H, W), float32
        ``disparity`` itself where all of it is specks, or nothing.
    """
    left = specks_of(disparity, difference, most_pixels, most_of_hole)
    if not left.any() or left.all():
        return disparity
    height, width = disparity.shape
    joined = np.where(left, np.float32(np.nan), disparity)
    y, x = np.nonzero(left)
    while len(y):
        # from the rims inwards: pixels joined in this round count as neighbours in the next
        unlike = np.full(len(y), np.inf)
        values = np.full(len(y), np.nan, np.float32)
        for dy, dx in _NEIGHBOURS:
            there = (y + dy).clip(0, height - 1), (x + dx).clip(0, width - 1)
            beside = joined[there]
            apart = np.where(np.isnan(beside), np.inf, ((colours[there] - colours[y, x]) ** 2).sum(axis=1))
            # of neighbours that are equally like, the farthest
            values = np.where((apart < unlike) | ((apart == unlike) & (beside < values)), beside, values)
            unlike = np.minimum(unlike, apart)
        joined[y, x] = values
        y, x = y[np.isnan(values)], x[np.isnan(values)]
    return joined
