"""Splitting of angular patches along nearby image edges (see :mod:`sepi.extensions.methods.occ`)."""

from __future__ import annotations

from typing import NamedTuple

import cv2
import numpy as np
import numpy.typing as npt

from sepi.image.edges import CannyParameters, canny_edges, edge_angle
from sepi.lightfield import BoolMap, FloatMap

ORIENTATIONS = 16
"""Orientations of edges over half a turn."""

LEAST_SHARE = 0.25
"""Minimum share of the other views in each half."""

ON_THE_LINE = 1 / 8
"""Distance within which a view counts as on the dividing line, as a fraction of the farthest view's distance."""


class Edges(NamedTuple):
    """Pixels whose angular patches are split.

    Attributes
    ----------
    near : ndarray, shape (H, W), bool
    places : ndarray, shape (P, 3), int64
        Row, column and index of the orientation; the edge's normal has the angle ``index pi / ORIENTATIONS`` from
        ``+x`` towards ``+y``.
    """

    near: BoolMap
    places: npt.NDArray[np.int64]


def edges_to_split(reference_view: FloatMap, parameters: CannyParameters, reach: float) -> Edges:
    """Pixels within ``reach`` pixels of a Canny edge, each with the orientation of the nearest one."""
    lines = canny_edges(reference_view, parameters)
    turns = np.round(edge_angle(reference_view, parameters) * (ORIENTATIONS / np.pi)).astype(np.int64) % ORIENTATIONS
    if not lines.any():
        return Edges(lines, np.empty((0, 3), np.int64))
    distance, nearest = cv2.distanceTransformWithLabels(
        (~lines).astype(np.uint8), cv2.DIST_L2, cv2.DIST_MASK_5, labelType=cv2.DIST_LABEL_PIXEL
    )
    turn_of = np.zeros(int(nearest.max()) + 1, np.int64)
    turn_of[nearest[lines]] = turns[lines]
    near = np.asarray(distance <= reach)
    return Edges(near, np.column_stack([np.argwhere(near), turn_of[nearest[near]]]))


def halves_of_views(baselines: npt.NDArray[np.float64]) -> BoolMap:
    """The two halves of views into which an edge of each orientation splits the angular patch.

    Parameters
    ----------
    baselines : ndarray, shape (N, 2), float64
        Row and column offset of each view from the reference view, in view steps.

    Returns
    -------
    ndarray, shape (ORIENTATIONS, 2, N), bool
        The second half is on the side to which the edge's normal points.
    """
    along = _normals() @ baselines.T
    line = ON_THE_LINE * np.abs(baselines).max(initial=0)
    halves = np.stack([along <= line, along >= -line], axis=1)
    others = halves.sum(axis=2) - 1
    halves[others < LEAST_SHARE * (len(baselines) - 1)] = True
    return halves


def colours_beside(reference_view: FloatMap, edges: Edges, radius: int) -> FloatMap:
    """Mean colours of the two sides of the edge in a window around each pixel; shape (P, 2, 3), float32.

    The edge's normal points to the second side.
    """
    y, x = np.mgrid[-radius : radius + 1, -radius : radius + 1]
    colours = np.zeros((len(edges.places), 2, 3), np.float32)
    for number, (down, across) in enumerate(_normals()):
        chosen = edges.places[:, 2] == number
        rows, columns = edges.places[chosen, 0], edges.places[chosen, 1]
        along = y * down + x * across
        for side, window in enumerate((along < -0.5, along > 0.5)):
            weights = window.astype(np.float32) / np.float32(window.sum())
            means = cv2.filter2D(reference_view, cv2.CV_32F, weights, borderType=cv2.BORDER_REPLICATE)
            colours[chosen, side] = means[rows, columns]
    return colours


def _normals() -> npt.NDArray[np.float64]:
    """Normals of the orientations, ``(down, across)``; shape (ORIENTATIONS, 2)."""
    angle = np.arange(ORIENTATIONS) * np.pi / ORIENTATIONS
    return np.stack([np.sin(angle), np.cos(angle)], axis=1)
