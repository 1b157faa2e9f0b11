"""Compiled loop that finds specks of a map (:mod:`sepi.boundaries.specks`)."""

from __future__ import annotations

from typing import Any

import numpy as np

from sepi.compiled import njit, prange


@njit(forceinline=True)
def _is_among(pixels: Any, n: int, y: int, x: int) -> bool:
    found = False
    for k in range(n):
        found |= pixels[k, 0] == y and pixels[k, 1] == x
    return found


@njit(forceinline=True)
def _part_of(disparity: Any, difference: Any, y: int, x: int, pixels: Any) -> int:
    """The part of the map that a pixel belongs to, into ``pixels (N, 2)``, and its size; N + 1 where it is larger."""
    H, W = disparity.shape
    pixels[0, 0], pixels[0, 1] = y, x
    n, done = 1, 0
    while done < n:
        i, j = pixels[done]
        done += 1
        for row in range(max(0, i - 1), min(H, i + 2)):
            for column in range(max(0, j - 1), min(W, j + 2)):
                if abs(disparity[row, column] - disparity[i, j]) > difference or _is_among(pixels, n, row, column):
                    continue
                if n == len(pixels):
                    return n + 1
                pixels[n, 0], pixels[n, 1] = row, column
                n += 1
    return n


@njit(forceinline=True)
def _is_hole(disparity: Any, pixels: Any, n: int) -> bool:
    """Whether all pixels beside a part are nearer."""
    H, W = disparity.shape
    for k in range(n):
        i, j = pixels[k]
        for row in range(max(0, i - 1), min(H, i + 2)):
            for column in range(max(0, j - 1), min(W, j + 2)):
                if disparity[row, column] < disparity[i, j] and not _is_among(pixels, n, row, column):
                    return False
    return True


@njit(parallel=True, cache=True)
def specks_of(disparity: Any, difference: Any, most_pixels: int, most_of_hole: int) -> Any:
    """Pixels of parts of a map that are small.

    Parameters
    ----------
    disparity : ndarray, shape (H, W), float32
        Pixels per view step.
    difference : float32
        By how much two of the eight neighbours differ at most to belong to one part.
    most_pixels, most_of_hole : int
        Of a part that is a speck, and of one with nothing but nearer pixels round it.

    Returns
    -------
    ndarray, shape (H, W), bool
    """
    H, W = disparity.shape
    specks = np.zeros((H, W), np.bool_)
    most = max(most_pixels, most_of_hole, 1)
    for y in prange(H):
        pixels = np.empty((most, 2), np.int64)
        for x in range(W):
            n = _part_of(disparity, difference, y, x, pixels)
            specks[y, x] = n <= most_pixels or (n <= most_of_hole and _is_hole(disparity, pixels, n))
    return specks
