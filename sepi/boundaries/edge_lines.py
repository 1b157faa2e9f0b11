"""Edges through the pixels beside depth steps: evidence from a pixel's neighbours.

A pixel's own share of the nearer surface is poorly known where views show little contrast, and the decisive pixels are
those that the edge runs right through. The edge continues through their neighbours: it leaves a certain share of every
pixel of a patch to the nearer surface, and costs what these shares cost. All edges through a patch about each pixel
beside a step are tried, in steps of direction and offset, straight ones and ones bent round something small. The pixel
belongs to the surface that holds its middle according to the cheapest edge.
"""

import numpy as np
import numpy.typing as npt

from sepi.boundaries.rim import Rim
from sepi.kernels import edge_lines as kernels
from sepi.lightfield import BoolMap, FloatMap

_DIRECTIONS = 16
_OFFSETS = np.arange(-1.05, 1.06, 0.3)  # of the patch's middle from the edge, pixels; none is 0
_BLUR = 1.2  # distance over which a share goes from 0 to 1, pixels
_CURVATURE = 0.6  # of an edge that is not straight, per pixel: round what is three pixels across
_CURVED = 0.003  # its cost, beside mean costs of what views show
_WIDTH = 0.8  # standard deviation of the patch's weights, pixels


def line_evidence(disparity: FloatMap, rim: Rim, costs: FloatMap) -> FloatMap:
    """Cost advantage of the best edge that gives a pixel to the farther surface, over the best other edge.

    Parameters
    ----------
    disparity : ndarray, shape (H, W), float32
        Pixels per view step.
    rim : Rim
        Its ``n`` pixels inside are looked at.
    costs : ndarray, shape (n, K), float32
        Of shares of the nearer surface in them, from 0 to 1.

    Returns
    -------
    ndarray, shape (n,), float32
        Positive: the farther surface's.
    """
    pixels, above = np.flatnonzero(rim.inside), costs - costs.min(axis=1, keepdims=True)
    number = np.full(disparity.shape, -1, np.int64)
    number[rim.inside] = np.arange(len(pixels))
    evidence = np.empty(len(pixels), np.float32)
    middle = (rim.near + rim.far) * np.float32(0.5)
    edges = _edges(kernels.STEPS * (costs.shape[1] - 1))
    kernels.evidence_of_lines(disparity, middle, number, above, *edges, pixels, evidence)
    return evidence


def _edges(steps: int) -> tuple[npt.NDArray[np.uint8], BoolMap, FloatMap, FloatMap]:
    """Edges of all directions and offsets, straight and bent round the nearer surface.

    Parameters
    ----------
    steps : int
        In which shares go from 0 to 1.

    Returns
    -------
    shares : ndarray, shape (M, 9), uint8
        Of the nearer surface in the pixels of a patch, row after row, in steps.
    is_near : ndarray, shape (M,), bool
        Whether its middle is the nearer surface's.
    costs : ndarray, shape (M,), float32
        Of each edge itself.
    weights : ndarray, shape (9,), float32
        Of the pixels.
    """
    down, across = (part.ravel() for part in np.mgrid[-1:2, -1:2])
    angle = 2 * np.pi * np.arange(_DIRECTIONS)[:, None] / _DIRECTIONS
    along, beside = np.sin(angle) * down + np.cos(angle) * across, np.cos(angle) * down - np.sin(angle) * across
    bent = along - np.array([0, _CURVATURE])[:, None, None] * beside**2 / 2
    distance = bent[:, :, None] + _OFFSETS[:, None]
    count = _DIRECTIONS * len(_OFFSETS)
    shares = np.clip(0.5 + distance.reshape(-1, len(down)) / _BLUR, 0, 1)
    return (
        # halves of a step are such in all directions, however they are rounded
        np.floor(np.round(shares * steps, 6) + 0.5).astype(np.uint8),
        np.tile(_OFFSETS > 0, 2 * _DIRECTIONS),
        np.repeat(np.array([0, _CURVED], np.float32), count),
        np.exp(-(down**2 + across**2) / (2 * _WIDTH**2)).astype(np.float32),
    )
