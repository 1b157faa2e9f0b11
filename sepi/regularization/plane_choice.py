"""Plane of a region without texture, and the pixels of it that keep their disparity.

There are three sources: its border (:mod:`sepi.regularization.border_planes`), its light gradient
(:mod:`sepi.regularization.lit_planes`), and, where noise hides faint texture, its current disparity.
"""

from __future__ import annotations

from typing import NamedTuple

import cv2
import numpy as np

from sepi.lightfield import BoolMap, FloatArray, FloatMap
from sepi.regularization.border_planes import BorderPlane
from sepi.regularization.lit_planes import LitPlane
from sepi.regularization.regions import Plane, Region, parts_of, widened

LIT_AREA = 600
"""Regions of so many pixels are asked for how their light changes."""

SURE = 6.0
"""Standard deviations by which what a region has must differ from the plane of its light to be given up: light is not
quite what the model says."""

FAR = 8.0
"""Standard deviations, over the three coefficients, from which a plane contradicts that of the light."""

STEP = 0.3
"""Disparity by which a part of a region lies off its plane, pixels per view step."""

MOST_MISFIT = 6.0
"""Times the variance that noise explains, beyond which a region is no plane."""

CLEAR_SHARE = 0.9
"""Of a border, that must agree about its plane where the light of the region has another."""

CONFIRMS = 0.1
"""Standard deviation within which light has to know a plane to confirm one, pixels per view step."""

_OWN_SPREAD = 2.0
"""Standard deviations of the light's plane within which what a region has must lie about a plane of its own."""

_RING, _GOES_ON = 3, 0.9
"""Width of what is round such a part, pixels, and how much of it must be as near as it is."""


class Chosen(NamedTuple):
    """The plane of a region.

    Attributes
    ----------
    plane : Plane
    source : str
        ``border``, ``light`` or ``own``.
    confirmed : bool
        Whether the light of the region, as far as it is known, agrees, or what the region has is no surface.
    """

    plane: Plane
    source: str
    confirmed: bool


def chosen_plane(
    region: Region, disparity: FloatMap, border: BorderPlane | None, lit: LitPlane | None, noisy: bool
) -> Chosen | None:
    """Plane of a region; None if it keeps its disparity.

    That of its border, where enough of that is known and its light does not contradict it. In noise only of a large
    region whose border is one plane, since faint texture, which noise hides, knows more than a few pixels beside it;
    and where what the region has lies about a plane, that one if it is nearer to the light's. Otherwise that of its
    light, where it contradicts what the region has. Where the light is that of no plane, in noise that of a border that
    is clearly one, if what the region has is no surface.

    Parameters
    ----------
    region : Region
    disparity : ndarray, shape (h, w), float32
        Of the region's place, so far.
    border : BorderPlane or None
    lit : LitPlane or None
    noisy : bool

    Returns
    -------
    Chosen or None
    """
    if border is not None:
        tells = border.is_one_plane(region.area) and region.area >= LIT_AREA if noisy else border.is_known(region.area)
        border = border if tells else None
    beside = None if border is None else Chosen(border.plane, "border", False)
    if lit is None:
        return beside
    # of a region of few parts nothing is known (NaN)
    if lit.misfit >= MOST_MISFIT:
        # the region is no plane; or the views of a real camera differ by more than noise, which its border may tell
        return _of_clear_border(region, disparity, border) if noisy else beside
    confirms = lit.deviation(region.basis) < CONFIRMS
    known = [] if border is None else [Chosen(border.plane, "border", confirms)]
    own = own_plane(region, disparity, lit) if noisy else None
    if own is not None:
        known.append(Chosen(own, "own", confirms))
    nearest = min(known, key=lambda chosen: lit.distance(chosen.plane), default=None)
    if nearest is not None and lit.distance(nearest.plane) < FAR:
        return nearest
    change = np.sqrt(np.mean((region.basis @ lit.plane - disparity[region.pixels]) ** 2))
    if change > SURE * lit.deviation(region.basis):
        return Chosen(lit.plane, "light", True)
    return None if noisy else beside


def _of_clear_border(region: Region, disparity: FloatMap, border: BorderPlane | None) -> Chosen | None:
    """The plane of a border that hardly anything contradicts, where what a region has is no surface; else None."""
    if border is None or border.share < CLEAR_SHARE:
        return None
    basis, own = region.basis, disparity[region.pixels].astype(np.float64)
    return Chosen(border.plane, "border", True) if _spread(own, basis @ _plane_of(basis, own)) > STEP else None


def own_plane(region: Region, disparity: FloatMap, lit: LitPlane) -> Plane | None:
    """Plane of what a region has, without what its light contradicts.

    None where that is half of it, or does not lie about a plane as closely as its light is known.

    Parameters
    ----------
    region : Region
    disparity : ndarray, shape (h, w), float32
        Of the region's place.
    lit : LitPlane

    Returns
    -------
    Plane or None
    """
    basis, own, deviation = region.basis, disparity[region.pixels].astype(np.float64), lit.deviation(region.basis)
    agreeing = np.abs(own - basis @ lit.plane) < SURE * deviation
    if agreeing.sum() <= 0.5 * agreeing.size:
        return None
    basis, own = basis[agreeing], own[agreeing]
    plane = _plane_of(basis, own)
    return plane if _spread(own, basis @ plane) < _OWN_SPREAD * deviation else None


def _plane_of(basis: FloatArray, values: FloatArray) -> Plane:
    """Of the least squares."""
    # the rounding of a matrix product would depend on the number of threads
    normal = np.einsum("ni,nj->ij", basis, basis), np.einsum("ni,n->i", basis, values)
    return np.asarray(np.linalg.lstsq(*normal, rcond=None)[0])


def _spread(values: FloatArray, expected: FloatArray) -> float:
    """Standard deviation about what is expected, by the median."""
    return float(np.median(np.abs(values - expected)) / 0.6745)


def kept_pixels(pixels: BoolMap, disparity: FloatMap, before: FloatMap, chosen: Chosen) -> BoolMap:
    """Pixels of a region in noise that keep their disparity.

    Parts that lie off its plane and go on beyond the region: a dark fold may hang together with the dark wall behind
    it, while its depth is known from round about. Large parts, unless the light confirms the plane. And where the
    plane is the region's own, all that lies near it: only noise makes it a plane.

    Parameters
    ----------
    pixels : ndarray, shape (h, w), bool
        The region.
    disparity, before : ndarray, shape (h, w), float32
        With its plane, and without.
    chosen : Chosen

    Returns
    -------
    ndarray, shape (h, w), bool
    """
    off = pixels & (np.abs(before - disparity) > STEP)
    kept = pixels & ~off if chosen.source == "own" else np.zeros_like(pixels)
    anything_known = off.sum() <= 0.5 * pixels.sum()
    parts = parts_of(off)
    for number, inner in enumerate(parts.places, start=1):
        place = widened(inner, _RING)
        part, depth = parts.labels[place] == number, before[place]
        ring = cv2.dilate(part.astype(np.uint8), np.ones((2 * _RING + 1,) * 2, np.uint8)).astype(bool) & ~part
        goes_on = np.mean(np.abs(depth[ring] - np.median(depth[part])) < STEP) >= _GOES_ON
        if (anything_known and goes_on) or (not chosen.confirmed and parts.areas[number - 1] >= LIT_AREA):
            kept[place] |= part
    return kept
