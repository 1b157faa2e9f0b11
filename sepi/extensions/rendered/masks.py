"""Masks of a view's pixels: kinds of surfaces, depth steps, and which other views see them.

A pixel shows the surface that the ray through its middle meets first. Masks of a view are bits of one number, in the
order of :data:`MASKS`.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise

import numpy as np
import numpy.typing as npt

from sepi.extensions.rendered.surfaces import FirstSurface
from sepi.extensions.rendered.world import FloatArray, Pattern, Thing
from sepi.kernels import reprojection as kernels
from sepi.lightfield import BoolMap, FloatMap
from sepi.scoring.regions import edges_of, textureless

MASKS = ("textured", "textureless", "glossy", "mirror", "glass", "thin", "discontinuities", "occluded", "alone")
"""Names of the masks.

Textured and textureless: matte or glossy surfaces with and without a change of the painted colours
(:func:`sepi.scoring.regions.textureless` on colours without light); glossy, mirror, glass: surfaces of these kinds;
thin: wires, sticks, twigs; discontinuities: two pixels beside a depth step; occluded: hidden from another view; alone:
seen by no other view.
"""

Bits = npt.NDArray[np.uint16]

_BIT = {name: 1 << number for number, name in enumerate(MASKS)}

# largest difference of disparities of one surface, pixels per view step
_SAME = 0.05


def albedo_of(things: Sequence[Thing], seen: FirstSurface) -> FloatArray:
    """Colours of a view's surfaces without light, sRGB; shape (H, W, 3)."""
    colours, uv = np.zeros((seen.thing.size, 3), np.float32), seen.uv.reshape(-1, 2)
    # sorted by thing, instead of a pass over the picture for each
    order = np.argsort(seen.thing.astype(np.int16), axis=None, kind="stable")
    ends = np.searchsorted(seen.thing.ravel()[order], np.arange(-1, len(things)), side="right")
    for thing, (first, last) in zip(things, pairwise(ends), strict=True):
        pattern, here = thing.material.pattern, order[first:last]
        if isinstance(pattern, Pattern):
            height, width = pattern.raster.shape[:2]
            across, down = (uv[here] % 1).T
            row, column = (down * height).astype(np.int64) % height, (across * width).astype(np.int64) % width
            colours[here] = pattern.raster[row, column]
        else:
            colours[here] = pattern
    return colours.reshape(*seen.thing.shape, 3)


def surface_bits(things: Sequence[Thing], seen: FirstSurface, disparity: FloatMap) -> Bits:
    """Masks of a view that do not depend on other views: kinds of surfaces, and depth steps."""
    kinds = np.array([thing.material.kind for thing in things] + ["matte"])[seen.thing]
    thin = np.array([thing.thin for thing in things] + [False])[seen.thing]
    plain = textureless(albedo_of(things, seen))
    solid = (kinds == "matte") | (kinds == "glossy")
    masks = {
        "textured": solid & ~plain,
        "textureless": solid & plain,
        **{kind: kinds == kind for kind in ("glossy", "mirror", "glass")},
        "thin": thin,
        "discontinuities": edges_of(disparity).region,
    }
    bits: Bits = np.bitwise_or.reduce([mask.astype(np.uint16) * _BIT[name] for name, mask in masks.items()])
    return bits


def seen_bits(disparities: FloatArray, positions: npt.NDArray[np.float64]) -> Bits:
    """Masks ``occluded`` and ``alone`` of all views, ``(N, H, W)``.

    Parameters
    ----------
    disparities : ndarray, shape (N, H, W), float32
        Disparity of all views, pixels per view step.
    positions : ndarray, shape (N, 2), float64
        Positions of the views, ``(down, across)`` in view steps.
    """
    bits = np.empty(disparities.shape, np.uint16)
    hidden, seen = np.empty((2, *disparities.shape[1:]), bool)
    for view in range(len(disparities)):
        kernels.seen_elsewhere(disparities, positions - positions[view], view, _SAME, hidden, seen)
        bits[view] = hidden * np.uint16(_BIT["occluded"]) + ~seen * np.uint16(_BIT["alone"])
    return bits


def mask(bits: Bits, name: str) -> BoolMap:
    """One of a view's masks."""
    found: BoolMap = (bits & _BIT[name]) != 0
    return found
