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
import numpy.typing as npt
from pydantic import Field

from sepi.channels import sum_of_channels
from sepi.lightfield import BoolMap, DisparityRange, FloatMap
from sepi.regularization.plane_search import fitted, pixels_in_order, planes_through, residuals_of, support
from sepi.regularization.regions import Plane, parts_of
from sepi.stage import Parameters

# of the brightness before its slopes are taken, pixels
_SMOOTHING = 0.8
# edges that planes are tried on, and planes tried through three of them
_EDGES, _TRIED = 3000, 4000
# weight of an edge behind a plane against one on it: some are reflections
_BEHIND = 0.5
# least part of the range that a floor goes through from the upper border of the picture to the lower
_RISE = 0.5
# of that, how much it may go through sideways
_SIDEWAYS = 0.5
# sides, of four, on which the plane has to be seen again
_SIDES = 3
# share of the pixels round a reflection that lie on the floor; the others lie before it
_BESIDE = 0.2
# share of them from which on they lie behind it, too: what goes on behind a plane on most sides is no picture in it
_AROUND_BEHIND = 0.6
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
    return np.asarray(sum_of_channels(down**2 + across**2) >= contrast**2)


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
    positions, values = pixels_in_order(edges, disparity)
    every = max(1, -(-len(values) // _EDGES))
    positions, values = positions[::every], values[::every]
    planes = planes_through(positions, values, _TRIED)
    planes = planes[_rises(planes, disparity.shape[0], known)]
    if not len(planes):
        return None
    tolerance = parameters.floor_tolerance
    scores = support(positions, values, planes, tolerance, _BEHIND)
    plane: Plane = planes[scores.argmax()]
    for _ in range(_FITS):
        plane = fitted(positions, values, plane, tolerance)
    above = residuals_of(positions, values, plane[None])[0]
    below_horizon = values - above > known.minimum
    holds = (np.abs(above) < tolerance).sum() >= parameters.floor_share * below_horizon.sum()
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
    behind = floor - disparity
    on = np.abs(behind) < parameters.floor_tolerance
    down, up = np.maximum.accumulate(on), np.maximum.accumulate(on[::-1])[::-1]
    right, left = np.maximum.accumulate(on, axis=1), np.maximum.accumulate(on[:, ::-1], axis=1)[:, ::-1]
    sides = down.astype(np.uint8) + up + right + left
    parts = parts_of((behind >= parameters.floor_tolerance) & (sides >= _SIDES))
    if not parts.places:
        return np.zeros_like(on)
    count = len(parts.places)
    deep = _means(parts.labels, behind, count) > parameters.reflection_depth
    faint = _means(parts.labels, edges, count) < _FAINT * edges[on].mean()
    # whichever of two parts that meet in a corner has the pixels between them; exact up to 2^24 parts
    largest = cv2.dilate(parts.labels.astype(np.float32), np.ones((3, 3), np.uint8)).astype(np.int32)
    around = np.where(parts.labels > 0, 0, largest)
    # a part that has nothing beside it fills a picture
    beside = _means(around, on, count) >= _BESIDE
    framed = _means(around, behind >= parameters.floor_tolerance, count) < _AROUND_BEHIND
    return np.asarray(np.append(False, deep & faint & beside & framed)[parts.labels])


def _means(labels: npt.NDArray[np.int32], values: FloatMap | BoolMap, count: int) -> npt.NDArray[np.float64]:
    """Mean of the values with each label of 1 to ``count``; 0 where there are none."""
    labels = labels.ravel()
    sums = np.bincount(labels, values.ravel(), minlength=count + 1)
    return np.asarray((sums / np.maximum(np.bincount(labels, minlength=count + 1), 1))[1:])


def _rises(planes: npt.NDArray[np.float64], height: int, known: DisparityRange) -> npt.NDArray[np.bool_]:
    """Whether planes (..., 3) are nearer the lower they are, as a floor is that goes away from the camera."""
    across, down = planes[..., 1], planes[..., 2]
    rises = down * height > _RISE * (known.maximum - known.minimum)
    return np.asarray(rises & (np.abs(across) < _SIDEWAYS * down))
