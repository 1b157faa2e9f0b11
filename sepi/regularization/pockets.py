"""Pockets of a surface without texture: regions whose border gives no evidence of their depth.

A piece of a plain wall shows between a box and a ball before it. Its whole border belongs to these, so it supports no
plane, and matching there is a guess. If the piece has the colour of another, larger plain region close by, it is taken
for a part of that region.
"""

from __future__ import annotations

from collections.abc import Sequence

import cv2
import numpy as np

from sepi.lightfield import FloatMap
from sepi.regularization.plane_choice import Chosen
from sepi.regularization.regions import Region, seen_from, widened


def with_pockets(
    regions: Sequence[Region], chosen: Sequence[Chosen | None], pockets: Sequence[int], mean: FloatMap, reach: int,
    tolerance: float,
) -> list[Chosen | None]:  # fmt: skip
    """The planes of regions, and for pockets those of the regions beside them.

    Parameters
    ----------
    regions : sequence of Region
    chosen : sequence of Chosen or None
        Their planes so far.
    pockets : sequence of int
        Which of them nothing round them knows.
    mean : ndarray, shape (H, W, 3), float32
        Colours, 0..1.
    reach : int
        How far away the other region may begin, pixels along both axes.
    tolerance : float
        RGB distance of the mean colours up to which they are one surface.

    Returns
    -------
    list of Chosen or None
        Of several such regions, that with most pixels within reach is taken; it has to be larger than the pocket.
    """
    found = list(chosen)
    if not any(chosen):
        return found
    numbers = np.zeros(mean.shape[:2], np.int32)
    for number, region in enumerate(regions, start=1):
        numbers[region.place][region.pixels] = number
    around = np.ones((2 * reach + 1,) * 2, np.uint8)
    for n in pockets:
        place = widened(regions[n].place, reach)
        near = cv2.dilate((numbers[place] == n + 1).astype(np.uint8), around) > 0
        beside = np.bincount(numbers[place][near], minlength=len(regions) + 1)[1:]
        colour = _colour(regions[n], mean)
        for other in np.argsort(-beside, kind="stable")[: np.count_nonzero(beside)].tolist():
            plane, is_larger = chosen[other], regions[other].area > regions[n].area
            if plane is None or not is_larger:
                continue
            if np.linalg.norm(_colour(regions[other], mean) - colour) <= tolerance:
                found[n] = plane._replace(plane=seen_from(plane.plane, regions[other], regions[n]))
                break
    return found


def _colour(region: Region, mean: FloatMap) -> FloatMap:
    return np.asarray(mean[region.place][region.pixels].mean(axis=0, dtype=np.float64), np.float32)
