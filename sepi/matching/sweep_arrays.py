"""Arrays that plane sweeps work on, in named groups: what their kernels take.

In C++ each is a struct of the same fields in the same order.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from sepi.lightfield import BoolMap, FloatMap


class ViewStack(NamedTuple):
    """The views that are compared.

    Attributes
    ----------
    colours : ndarray, shape (T, S, 3, H, W + margin), uint8, uint16 or float32
        The margin is :data:`sepi.kernels.LANES`.
    t0, s0 : int
        Position of the reference view.
    groups : ndarray, shape (T, S), int64
        Group of each view, 0..G-1; -1 leaves a view out.
    subsets : ndarray, shape (N, G), bool
        Which groups make up each subset.
    scale2 : float32
        Square of the robust scale, in the units of the colours.
    shown : ndarray, shape (T, S, H, 2) or (T, S, 0, 2), int64
        First column that each row of a view shows, and the one after the last; empty: all views show all.
    """

    colours: npt.NDArray[Any]
    t0: int
    s0: int
    groups: npt.NDArray[np.int64]
    subsets: BoolMap
    scale2: np.float32
    shown: npt.NDArray[np.int64]


class Candidates(NamedTuple):
    """Candidate disparities, and where the samples of a reference pixel lie in each view.

    Views equally far down, as those of a row of the grid are, share an entry; likewise across.

    Attributes
    ----------
    disparities : ndarray, shape (K,), float32
        Uniform, rising, pixels per view step.
    row, column : ndarray, shape (T, S), int64
        Number of each view's entry down, 0..V-1, and across, 0..U-1.
    down, across : ndarray, shape (V, K) and (U, K), int64
        Whole pixels from a reference pixel to its sample; an entry never falls, or never rises, along the candidates.
    fy, fx : ndarray, shape (V, K) and (U, K), float32
        Fractional pixels beyond, 0..1.
    sy, sx : ndarray, shape (V,) and (U,), float32
        By how many pixels the sample moves as the disparity rises by one.
    reach : float
        Pixels to the farthest sample, along either axis.
    """

    disparities: FloatMap
    row: npt.NDArray[np.int64]
    column: npt.NDArray[np.int64]
    down: npt.NDArray[np.int64]
    fy: FloatMap
    across: npt.NDArray[np.int64]
    fx: FloatMap
    sy: FloatMap
    sx: FloatMap
    reach: float


class Window(NamedTuple):
    """Aggregation window: ``2 radius + 1`` pixels wide, its weights narrow in colour.

    Attributes
    ----------
    guide : ndarray, shape (3, H, W), float32
        Reference view.
    radius : int
    variance : float32
        Squared colour distance at which the weights fall off.
    """

    guide: FloatMap
    radius: int
    variance: np.float32


class ExpectedCosts(NamedTuple):
    """What noise makes of costs: see :mod:`sepi.matching.expected_costs`.

    Attributes
    ----------
    moments : ndarray, shape (2, N, K'), float32
        Of each subset of the views, and candidate, means of the sum of squared weights, and of its square, less what
        they are anywhere. ``K'`` is the number of candidates, rounded up to whole vectors.
    weights : ndarray, shape (2, H, W), float32
        Times them, of each pixel, and summed: the part of a match that noise takes more than anywhere.
    anywhere : ndarray, shape (H, W), float32
        Cost that noise alone makes anywhere.
    """

    moments: FloatMap
    weights: FloatMap
    anywhere: FloatMap


class Visibility(NamedTuple):
    """In which views a pixel is seen, and in which it is looked for at which candidates.

    Attributes
    ----------
    nearest : ndarray, shape (T, S, n, W) or (T, S, n, 0), float32
        From :func:`sepi.matching.nearest_surfaces.nearest_surfaces`, of the rows that the views' detail has; empty: all
        views see all pixels. In memory there are :data:`sepi.kernels.LANES` numbers more behind it.
    occlusion_margin : float32
        By how much an occluder must be nearer, pixels per view step.
    occluded_view_weight : float32
        Weight of a view in which the pixel is occluded; none where the view has no pixel.
    searched : ndarray, shape (T, S), bool
        The views that compare all candidates. Others compare the likely ones.
    likely : ndarray, shape (2, H, W) or (2, 0, 0), int32
        The first and the last of these, 0..K-1; empty where all views compare all candidates.
    """

    nearest: FloatMap
    occlusion_margin: np.float32
    occluded_view_weight: np.float32
    searched: BoolMap
    likely: npt.NDArray[np.int32]


def sampled_candidates(disparities: FloatMap, baselines: npt.NDArray[np.float64]) -> Candidates:
    """Candidates ``(K,)`` and where views of these baselines ``(T, S, 2)`` have the samples of a reference pixel."""
    (down, row), (across, column) = (np.unique(baselines[..., axis], return_inverse=True) for axis in (0, 1))
    entries = (*sample_offsets(disparities, down), *sample_offsets(disparities, across))
    moves = (-down).astype(np.float32), (-across).astype(np.float32)
    reach = float(np.abs(disparities[[0, -1]]).max() * np.abs(baselines).max())
    grid = baselines.shape[:2]
    return Candidates(disparities, row.reshape(grid), column.reshape(grid), *entries, *moves, reach)


def sample_offsets(disparities: FloatMap, baselines: npt.NDArray[np.float64]) -> tuple[npt.NDArray[np.int64], FloatMap]:
    """Whole and fractional pixels from a reference pixel to its sample, along one axis: ``-d`` times the baseline.

    Parameters
    ----------
    disparities : ndarray, shape (K,), float32
    baselines : ndarray, shape (...), float64
        Of each view from the reference view, along the axis, in view steps.

    Returns
    -------
    whole : ndarray, shape (..., K), int64
    fraction : ndarray, shape (..., K), float32
        0..1.
    """
    offset = -disparities.astype(np.float64) * baselines[..., None]
    whole = np.floor(offset)
    return whole.astype(np.int64), (offset - whole).astype(np.float32)
