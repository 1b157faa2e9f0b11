"""Which pixels of a view show what: its surfaces' kinds, and which other views see them.

A pixel shows what the ray through its middle meets first. Masks of a view are bits of one number, in the order of
:data:`MASKS`.
"""

from __future__ import annotations

from collections.abc import Sequence

import numba
import numpy as np
import numpy.typing as npt

from sepi.lightfield import BoolMap, FloatMap
from sepi.rendered.tracing import FirstSurface
from sepi.rendered.world import FloatArray, Pattern, Thing
from sepi.scoring.edges import edges_of
from sepi.scoring.regions import textureless

MASKS = ("textured", "textureless", "glossy", "mirror", "glass", "thin", "discontinuities", "occluded", "alone")
"""Textured and textureless: matte or glossy surfaces on which the painted colours change, or hardly do
(:func:`sepi.scoring.regions.textureless` on colours without light); glossy, mirror, glass: surfaces of these kinds;
thin: wires, sticks, twigs; discontinuities: two pixels beside a depth step; occluded: hidden from some other view;
alone: seen by no other view.
"""

Bits = npt.NDArray[np.uint16]

_BIT = {name: 1 << number for number, name in enumerate(MASKS)}

# pixels per view step: what lies as near as this to a view's own surface is that surface
_SAME = 0.05


def painted(things: Sequence[Thing], seen: FirstSurface) -> FloatArray:
    """The colours that are painted on what a view shows, without light, ``(H, W, 3)``."""
    colours = np.zeros((*seen.thing.shape, 3), np.float32)
    for number in np.unique(seen.thing[seen.thing >= 0]):
        pattern, here = things[number].material.pattern, seen.thing == number
        if isinstance(pattern, Pattern):
            height, width = pattern.raster.shape[:2]
            across, down = (seen.uv[here] % 1).T
            row, column = (down * height).astype(np.int64) % height, (across * width).astype(np.int64) % width
            colours[here] = pattern.raster[row, column]
        else:
            colours[here] = pattern
    return colours


def surface_bits(things: Sequence[Thing], seen: FirstSurface, disparity: FloatMap) -> Bits:
    """Masks of a view that do not depend on others: kinds of surfaces, and depth steps."""
    kinds = np.array([thing.material.kind for thing in things] + ["matte"])[seen.thing]
    thin = np.array([thing.thin for thing in things] + [False])[seen.thing]
    plain = textureless(painted(things, seen))
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


def seen_bits(disparities: FloatArray, positions: npt.NDArray[np.float64], view: int) -> Bits:
    """Masks ``occluded`` and ``alone`` of one view.

    Parameters
    ----------
    disparities : ndarray, shape (N, H, W), float32
        Of all views, in pixels per view step.
    positions : ndarray, shape (N, 2), float64
        Where they stand, in view steps: down, across.
    view : int
        Whose masks are wanted.
    """
    hidden, seen = _seen(disparities, positions - positions[view], view)
    bits: Bits = hidden * np.uint16(_BIT["occluded"]) + ~seen * np.uint16(_BIT["alone"])
    return bits


def mask(bits: Bits, name: str) -> BoolMap:
    """One of a view's masks."""
    found: BoolMap = (bits & _BIT[name]) != 0
    return found


@numba.njit(cache=True, parallel=True)
def _seen(
    disparities: FloatArray, baselines: npt.NDArray[np.float64], view: int
) -> tuple[npt.NDArray[np.bool_], npt.NDArray[np.bool_]]:
    """Whether some view that has the point in its picture does not see it, and whether some other view sees it.

    A point lands between four pixels of another view; where all of them are nearer, it is hidden.
    """
    count, height, width = disparities.shape
    hidden = np.zeros((height, width), np.bool_)
    seen = np.zeros((height, width), np.bool_)
    for y in numba.prange(height):
        for x in range(width):
            own = disparities[view, y, x]
            for other in range(count):
                if other == view:
                    continue
                row, column = y - own * baselines[other, 0], x - own * baselines[other, 1]
                if not (0 <= row <= height - 1 and 0 <= column <= width - 1):
                    continue
                top, left = min(int(row), height - 2), min(int(column), width - 2)
                there = min(
                    min(disparities[other, top, left], disparities[other, top, left + 1]),
                    min(disparities[other, top + 1, left], disparities[other, top + 1, left + 1]),
                )
                if there > own + _SAME:
                    hidden[y, x] = True
                else:
                    seen[y, x] = True
    return hidden, seen
