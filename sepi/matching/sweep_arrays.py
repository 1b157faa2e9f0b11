"""Arguments of the plane sweeps' kernels: arrays in named groups.

In C++ each group is a struct of the same fields in the same order.
"""

from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from sepi.lightfield import BoolMap, FloatArray, FloatMap


class ViewStack(NamedTuple):
    """Views of a sweep.

    Attributes
    ----------
    colours : ndarray, shape (T, S, 3, H, W + margin), uint8, uint16 or float32
        The margin is :data:`sepi.kernels.LANES`.
    t0, s0 : int
        Position of the reference view.
    groups : ndarray, shape (T, S), int64
        Group of each view, 0..G-1; -1 leaves a view out.
    subsets : ndarray, shape (N, G), bool
        Groups of each subset.
    scale2 : float32
        Square of the robust scale, in the units of the colours.
    shown : ndarray, shape (T, S, H, 2) or (T, S, 0, 2), int64
        First column with pixels in each row of a view, and the column after the last; empty: all columns have pixels.
    """

    colours: npt.NDArray[Any]
    t0: int
    s0: int
    groups: npt.NDArray[np.int64]
    subsets: BoolMap
    scale2: np.float32
    shown: npt.NDArray[np.int64]


class Candidates(NamedTuple):
    """Candidate disparities, and the positions of a reference pixel's samples in each view.

    Attributes
    ----------
    disparities : ndarray, shape (K,), float32
        Uniform, rising, pixels per view step.
    down, across : ndarray, shape (T, S, K), int64
        Whole pixels from a reference pixel to its sample; monotonic along the candidates.
    fy, fx : ndarray, shape (T, S, K), float32
        Fractional pixels beyond, 0..1.
    sy, sx : ndarray, shape (T, S), float32
        Shift of the sample in pixels per unit of disparity.
    reach : float
        Distance to the farthest sample along either axis, pixels.
    """

    disparities: FloatMap
    down: npt.NDArray[np.int64]
    fy: FloatMap
    across: npt.NDArray[np.int64]
    fx: FloatMap
    sy: FloatMap
    sx: FloatMap
    reach: float


class Window(NamedTuple):
    """Aggregation window, ``2 radius + 1`` pixels wide, with weights by colour.

    Attributes
    ----------
    guide : ndarray, shape (3, H, W), float32
        Reference view.
    radius : int
    variance : ndarray, shape (H, W), float32
        Squared colour distance that scales the weights.
    """

    guide: FloatMap
    radius: int
    variance: FloatMap


class ExpectedCosts(NamedTuple):
    """Expected costs of noise; :mod:`sepi.matching.expected_costs` derives them.

    Attributes
    ----------
    moments : ndarray, shape (2, N, K'), float32
        Means of the sum of squared interpolation weights, and of its square, for each subset of the views and
        candidate, minus their means over all positions. ``K'`` is the number of candidates, rounded up to whole
        vectors.
    weights : ndarray, shape (2, H, W), float32
        Factors of the two moments at each pixel; the sum of the products is the correction of the cost.
    anywhere : ndarray, shape (H, W), float32
        Expected cost of noise alone, over all positions.
    """

    moments: FloatMap
    weights: FloatMap
    anywhere: FloatMap


class Visibility(NamedTuple):
    """Which views see a pixel, and which candidates each view compares.

    Attributes
    ----------
    nearest : ndarray, shape (V, n, W) or (V, n, 0), float32
        From :func:`sepi.matching.nearest_surfaces.nearest_surfaces`, of the present views, for the rows of their
        detail; empty: all views see all pixels. The memory goes on for :data:`sepi.kernels.LANES` numbers after
        its end.
    occlusion_margin : float32
        By how much an occluder must be nearer, pixels per view step.
    occluded_view_weight : float32
        Weight of a view in which the pixel is occluded; 0 where the view has no pixel.
    searched : ndarray, shape (T, S), bool
        Views that compare all candidates; the others compare the likely ones.
    likely : ndarray, shape (2, H, W) or (2, 0, 0), int32
        First and last of the likely candidates, 0..K-1; empty if all views compare all candidates.
    """

    nearest: FloatMap
    occlusion_margin: np.float32
    occluded_view_weight: np.float32
    searched: BoolMap
    likely: npt.NDArray[np.int32]


def sampled_candidates(disparities: FloatMap, baselines: FloatArray) -> Candidates:
    """Candidates ``(K,)`` and their sample positions in views of these baselines ``(T, S, 2)``."""
    down, across = np.moveaxis(baselines, 2, 0)
    entries = (*sample_offsets(disparities, down), *sample_offsets(disparities, across))
    moves = (-down).astype(np.float32), (-across).astype(np.float32)
    reach = float(np.abs(disparities[[0, -1]]).max() * np.abs(baselines).max())
    return Candidates(disparities, *entries, *moves, reach)


def sample_offsets(disparities: FloatMap, baselines: FloatArray) -> tuple[npt.NDArray[np.int64], FloatMap]:
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
