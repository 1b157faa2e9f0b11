"""Features of the reference view that are matched in other views, and their disparity.

Features are those of [1]_. A feature of the reference view matches one of another view if their descriptors are mutual
nearest neighbours, pass the ratio test, and the second lies on the first one's epipolar line at a disparity within the
range. The disparity of a feature is the least-squares one over the views that agree with the median over its matches.

References
----------
.. [1] Lowe: Distinctive image features from scale-invariant keypoints. IJCV 60(2), 2004.
   doi:10.1023/B:VISI.0000029664.99615.94
"""

from __future__ import annotations

from typing import NamedTuple

import cv2
import numpy as np
import numpy.typing as npt

from sepi.lightfield import FloatMap, LightField, as_unit_float

FloatArray = npt.NDArray[np.float64]
IntArray = npt.NDArray[np.int64]

_RATIO = 0.8
"""Ratio of distances to the nearest and second nearest descriptor above which a match is rejected [1]_."""

_OFF_LINE = 1.0
"""Maximum distance of a match from its predicted position, pixels."""

_LEAST_SUPPORT = 0.25
"""Share of the other views that must agree on a feature's disparity."""

_SMALLEST = 16
"""Minimum size of views in pixels for the detection of features."""


class Features(NamedTuple):
    """Features of one view.

    Attributes
    ----------
    points : ndarray, shape (N, 2), float64
        Row and column.
    descriptors : ndarray, shape (N, 128), float32
    """

    points: FloatArray
    descriptors: FloatMap


_NO_FEATURES = Features(np.zeros((0, 2)), np.zeros((0, 128), np.float32))


def matched_disparities(light_field: LightField, low: float, high: float) -> tuple[IntArray, IntArray, FloatMap]:
    """Pixels of the reference view whose disparity follows from matched features.

    Parameters
    ----------
    light_field : LightField
    low, high : float
        Disparity range of accepted matches, pixels per view step.

    Returns
    -------
    rows, columns : ndarray, shape (M,), int64
        Each pixel occurs once.
    disparity : ndarray, shape (M,), float32
        Pixels per view step.
    """
    here = features_of(light_field.reference_view)
    others = light_field.present.copy()
    others[light_field.reference_position] = False
    baselines = light_field.baselines[others]
    found = np.full((len(baselines), len(here.points)), np.nan)
    for n, position in enumerate(np.argwhere(others)):
        there = features_of(as_unit_float(light_field.rgb_views[tuple(position)]))
        first, second = mutual_matches(here.descriptors, there.descriptors)
        along, aside = _along(there.points[second] - here.points[first], baselines[n])
        fits = (aside <= _OFF_LINE) & (along >= low) & (along <= high)
        found[n, first[fits]] = along[fits]
    disparity, support = agreed(found, np.hypot(*baselines.T))
    kept = support >= max(1.0, _LEAST_SUPPORT * len(baselines))
    pixels = np.floor(here.points[kept] + 0.5).astype(np.int64)
    # a point with two orientations yields two features
    pixels, once = np.unique(pixels, axis=0, return_index=True)
    return pixels[:, 0], pixels[:, 1], disparity[kept][once].astype(np.float32)


def features_of(view: FloatMap) -> Features:
    """Features of a view ``(H, W, 3)``, colours in 0..1."""
    grey = np.clip(np.rint(view.mean(axis=2) * 255), 0, 255).astype(np.uint8)
    if min(grey.shape) < _SMALLEST:
        return _NO_FEATURES
    keypoints, descriptors = cv2.SIFT.create().detectAndCompute(grey, None)
    if descriptors is None:
        return _NO_FEATURES
    return Features(np.array([keypoint.pt[::-1] for keypoint in keypoints]), np.asarray(descriptors, np.float32))


def mutual_matches(first: FloatMap, second: FloatMap) -> tuple[IntArray, IntArray]:
    """Indices of the matching descriptors of ``(N, 128)`` and ``(M, 128)``; each shape (K,), int64."""
    none = np.zeros(0, np.int64)
    if not (len(first) and len(second) > 1):
        return none, none
    squared = (first**2).sum(axis=1)[:, None] + (second**2).sum(axis=1) - 2 * first @ second.T
    nearest, back = squared.argmin(axis=1), squared.argmin(axis=0)
    least, next_least = np.partition(np.maximum(squared, 0), 1, axis=1)[:, :2].T
    numbers = np.arange(len(first))
    kept = (least < _RATIO**2 * next_least) & (back[nearest] == numbers)
    return numbers[kept], nearest[kept]


def agreed(found: FloatArray, distances: FloatArray) -> tuple[FloatArray, IntArray]:
    """Disparity on which views agree: least squares over those within half a pixel of the median.

    Parameters
    ----------
    found : ndarray, shape (V, N), float64
        Disparity of each feature in each view; NaN where it was not found.
    distances : ndarray, shape (V,), float64
        Distance of the views from the reference view, view steps.

    Returns
    -------
    disparity : ndarray, shape (N,), float64
        NaN where no view found the feature.
    support : ndarray, shape (N,), int64
        Number of views that agree.
    """
    disparity, support = np.full(found.shape[1], np.nan), np.zeros(found.shape[1], np.int64)
    seen = np.isfinite(found).any(axis=0)
    values = found[:, seen]
    with np.errstate(invalid="ignore"):
        agrees = np.abs(values - np.nanmedian(values, axis=0)) * distances[:, None] <= 0.5
    weight = agrees * distances[:, None] ** 2
    total = weight.sum(axis=0)
    disparity[seen] = (weight * np.nan_to_num(values)).sum(axis=0) / np.where(total > 0, total, 1)
    support[seen] = agrees.sum(axis=0)
    return disparity, support


def _along(moved: FloatArray, baseline: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Disparity that fits a displacement ``(K, 2)`` best, and the remaining distance."""
    squared = float(baseline @ baseline)
    disparity = -(moved @ baseline) / squared if squared else np.full(len(moved), np.nan)
    return disparity, np.hypot(*(moved + disparity[:, None] * baseline).T)
