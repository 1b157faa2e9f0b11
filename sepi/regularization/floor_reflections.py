"""What a polished floor or table mirrors, put back onto it.

In a mirror lies another room: to the views, a reflection is a surface behind the one that it is seen in, and no cost
tells them apart. What stands against it is that nobody sees through a floor. A plane that rises towards the camera, and
that many edges of its own texture lie on, is one; what lies behind it, with the plane on three of its four sides, is
seen in it and not through it. Where strong edges go behind the plane nearly as often as they lie on it, that is relief
and no reflection, which is faint beside the colours of the surface.

Pictures are taken to be upright. What is seen at a slant through an opening lies behind a wall, whose plane falls
sideways, or not at all.
"""

from __future__ import annotations

import cv2
import numpy as np
from pydantic import Field

from sepi.lightfield import BoolMap, DisparityRange, FloatMap
from sepi.regularization.border_planes import residuals_of
from sepi.regularization.regions import Plane, basis_of
from sepi.stage import Parameters

# of the brightness before its slopes are taken, pixels
_SMOOTHING = 0.8
# edges that planes are tried on, and planes tried through three of them
_EDGES, _TRIED = 3000, 4000
# how many edges behind a plane speak against it as one on it does for it: some are reflections
_BEHIND = 2
# least part of the range that a floor goes through from the upper border of the picture to the lower
_RISE = 0.5
# of that, how much it may go through sideways
_SIDEWAYS = 0.5
# sides, of four, on which the plane has to be seen again
_SIDES = 3
# share of the pixels round a reflection that lie on the floor; the others lie before it
_BESIDE = 0.2
# share of strong edges in a reflection, times that of the floor, from which on it is none
_FAINT = 0.7
# times to fit a plane to the edges that lie on it
_FITS = 3


class FloorReflectionsParameters(Parameters):
    """Parameters of what floors mirror."""

    reflections: bool = Field(True, description="whether what lies behind a floor or table is taken for a reflection")
    edge_contrast: float = Field(
        0.06, gt=0, le=2, description="colour change per pixel that is a strong edge; RGB distance, 0..1"
    )
    floor_share: float = Field(
        0.18, ge=0, le=1, description="share of the strong edges below a plane's horizon that a floor has to hold"
    )
    floor_tolerance: float = Field(
        0.05, gt=0, description="distance from a floor of what lies on it, pixels per view step"
    )
    reflection_depth: float = Field(
        0.1, ge=0, description="how far behind a floor a reflection lies on average at least, pixels per view step"
    )


def without_reflections(
    reference_view: FloatMap, disparity: FloatMap, known: DisparityRange, parameters: FloorReflectionsParameters
) -> tuple[FloatMap, BoolMap]:
    """Disparity with a floor's plane where the floor shows a reflection, and where that is.

    Parameters
    ----------
    reference_view : ndarray, shape (H, W, 3), float32
        0..1.
    disparity : ndarray, shape (H, W), float32
        Pixels per view step.
    known : DisparityRange
    parameters : FloorReflectionsParameters

    Returns
    -------
    disparity : ndarray, shape (H, W), float32
    mirrored : ndarray, shape (H, W), bool
    """
    edges = strong_edges(reference_view, parameters.edge_contrast)
    plane = floor_plane(edges, disparity, known, parameters)
    if plane is None:
        return disparity, np.zeros_like(edges)
    height, width = disparity.shape
    x, y = np.arange(width) - (width - 1) / 2, np.arange(height) - (height - 1) / 2
    floor = (plane[0] + plane[1] * x[None, :] + plane[2] * y[:, None]).astype(np.float32)
    mirrored = seen_in(floor, disparity, edges, parameters)
    return np.where(mirrored, np.clip(floor, known.minimum, known.maximum), disparity), mirrored


def strong_edges(view: FloatMap, contrast: float) -> BoolMap:
    """Where the colours of a view (H, W, 3) change by ``contrast`` per pixel or more."""
    down, across = np.gradient(cv2.GaussianBlur(view, (0, 0), _SMOOTHING), axis=(0, 1))
    return np.asarray((down**2 + across**2).sum(axis=-1) >= contrast**2)


def floor_plane(
    edges: BoolMap, disparity: FloatMap, known: DisparityRange, parameters: FloorReflectionsParameters
) -> Plane | None:
    """The plane that rises towards the camera and holds most strong edges, less half of those behind it.

    Parameters
    ----------
    edges : ndarray, shape (H, W), bool
    disparity : ndarray, shape (H, W), float32
    known : DisparityRange
    parameters : FloorReflectionsParameters

    Returns
    -------
    Plane or None
        None where no plane holds enough of the edges below its horizon, which is where it leaves the range.
    """
    positions, values = basis_of(edges), disparity[edges].astype(np.float64)
    # the same ones in a picture that is mirrored
    order = np.lexsort(((positions[:, 1:] ** 2).sum(axis=1), values))
    order = order[:: -(-len(order) // _EDGES) or 1]
    positions, values = positions[order], values[order]
    if len(values) < _SIDES:
        return None
    triples = np.random.default_rng(0).integers(len(values), size=(_TRIED, 3))
    triples = triples[np.abs(np.linalg.det(positions[triples])) > 1]
    planes = np.linalg.solve(positions[triples], values[triples, None])[..., 0]
    planes = planes[[_rises(plane, disparity.shape[0], known) for plane in planes]]
    if not len(planes):
        return None
    above, near = residuals_of(positions, values, planes), parameters.floor_tolerance
    scores = _BEHIND * (np.abs(above) < near).sum(axis=1) - (above < -near).sum(axis=1)
    plane: Plane = planes[scores.argmax()]
    for _ in range(_FITS):
        on = np.abs(residuals_of(positions, values, plane[None])[0]) < near
        plane = np.linalg.lstsq(positions[on], values[on], rcond=None)[0]
    above = residuals_of(positions, values, plane[None])[0]
    below_horizon = values - above > known.minimum
    holds = (np.abs(above) < near).sum() >= parameters.floor_share * below_horizon.sum()
    return plane if scores.max() > 0 and holds and _rises(plane, disparity.shape[0], known) else None


def seen_in(floor: FloatMap, disparity: FloatMap, edges: BoolMap, parameters: FloorReflectionsParameters) -> BoolMap:
    """Which pixels show what a floor mirrors.

    Parameters
    ----------
    floor : ndarray, shape (H, W), float32
        Its disparity.
    disparity : ndarray, shape (H, W), float32
    edges : ndarray, shape (H, W), bool
        Strong ones.
    parameters : FloorReflectionsParameters

    Returns
    -------
    ndarray, shape (H, W), bool
    """
    from scipy import ndimage

    behind = floor - disparity
    on = np.abs(behind) < parameters.floor_tolerance
    down, up = np.maximum.accumulate(on), np.maximum.accumulate(on[::-1])[::-1]
    right, left = np.maximum.accumulate(on, axis=1), np.maximum.accumulate(on[:, ::-1], axis=1)[:, ::-1]
    sides = down.astype(np.uint8) + up + right + left
    labels, count = ndimage.label((behind >= parameters.floor_tolerance) & (sides >= _SIDES))
    if not count:
        return np.zeros_like(on)
    numbers = np.arange(1, count + 1)
    deep = ndimage.mean(behind, labels, numbers) > parameters.reflection_depth
    faint = ndimage.mean(edges, labels, numbers) < _FAINT * edges[on].mean()
    # whichever of two parts that meet in a corner has the pixels between them
    round_about = np.where(labels > 0, 0, ndimage.grey_dilation(labels, (3, 3)))
    beside = ndimage.mean(on, round_about, numbers) >= _BESIDE
    return np.asarray(np.append(False, deep & faint & beside)[labels])


def _rises(plane: Plane, height: int, known: DisparityRange) -> bool:
    """Whether a plane is nearer the lower it is, as a floor is on which one could walk away from the camera."""
    return bool(plane[2] * height > _RISE * (known.maximum - known.minimum) and abs(plane[1]) < _SIDEWAYS * plane[2])
