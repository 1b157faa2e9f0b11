"""Compiled loops over angular patches: the costs of whole patches, and of patches that an edge splits in two."""

from __future__ import annotations

from typing import Any

import numpy as np

from sepi.compiled import njit, prange


@njit(cache=True, parallel=True)
def whole_patch_costs(sheared: Any, reference: Any, out: Any) -> None:
    """Variance of each angular patch plus the squared difference of its mean from the reference view.

    Parameters
    ----------
    sheared : ndarray, shape (N, 3, H, W), float32
        The views sheared by a candidate, colours in 0..1.
    reference : ndarray, shape (3, H, W), float32
        The reference view.
    out : ndarray, shape (H, W), float32
        Filled: mean over the channels, squared colours.
    """
    N, _, H, W = sheared.shape
    third, count, freedom = np.float32(1 / 3), np.float32(N), np.float32(max(1, N - 1))
    for y in prange(H):
        total, squares = np.zeros((3, W), np.float32), np.zeros(W, np.float32)
        for n in range(N):
            for c in range(3):
                view, centre, sums = sheared[n, c, y], reference[c, y], total[c]
                for x in range(W):
                    # counted from the reference's colour, so that the squares keep their digits
                    difference = view[x] - centre[x]
                    sums[x] += difference
                    squares[x] += difference * difference
        for x in range(W):
            defocus = np.float32(0)
            for c in range(3):
                mean = total[c, x] / count
                defocus += mean * mean
            variance = max(np.float32(0), squares[x] - count * defocus) / freedom
            out[y, x] = (variance + defocus) * third


@njit(inline="always")
def _half(sheared: Any, reference: Any, y: int, x: int, chosen: Any, mean: Any) -> Any:
    """Variance and defocus of the chosen views of a patch; ``mean`` gets their mean, from the reference's colour."""
    squares, count = np.float32(0), 0
    mean[:] = 0
    for n in range(sheared.shape[0]):
        if chosen[n]:
            count += 1
            for c in range(3):
                difference = sheared[n, c, y, x] - reference[c, y, x]
                mean[c] += difference
                squares += difference * difference
    defocus = np.float32(0)
    for c in range(3):
        mean[c] /= np.float32(count)
        defocus += mean[c] * mean[c]
    variance = max(np.float32(0), squares - np.float32(count) * defocus) / np.float32(max(1, count - 1))
    return variance / np.float32(3), defocus / np.float32(3)


@njit(cache=True, parallel=True)
def split_patch_costs(
    sheared: Any, reference: Any, places: Any, halves: Any, beside: Any, tolerance: Any, costs: Any, cues: Any
) -> None:
    """Costs of patches that an edge splits in two halves.

    Parameters
    ----------
    sheared : ndarray, shape (N, 3, H, W), float32
    reference : ndarray, shape (3, H, W), float32
    places : ndarray, shape (P, 3), int64
        Row, column and number of the edge's orientation of each pixel whose patch is split.
    halves : ndarray, shape (orientations, 2, N), bool
        Views of the two halves; none is empty.
    beside : ndarray, shape (P, 2, 3), float32
        Mean colours on the two sides of the edge in the reference view.
    tolerance : float32
        By how much the halves may fit these colours worse than they would if they changed places.
    costs : ndarray, shape (P,), float32
        Filled: variance and defocus of the half of the smaller variance; infinite where the colours are reversed.
    cues : ndarray, shape (P, 3), float32
        Filled: variances of the two halves, absolute difference of their means; means over the channels.
    """
    for p in prange(places.shape[0]):
        y, x, orientation = places[p]
        first, second = np.empty(3, np.float32), np.empty(3, np.float32)
        variance, defocus = _half(sheared, reference, y, x, halves[orientation, 0], first)
        other_variance, other_defocus = _half(sheared, reference, y, x, halves[orientation, 1], second)
        as_they_are, changed, apart = np.float32(0), np.float32(0), np.float32(0)
        for c in range(3):
            a, b = reference[c, y, x] + first[c], reference[c, y, x] + second[c]
            as_they_are += abs(a - beside[p, 0, c]) + abs(b - beside[p, 1, c])
            changed += abs(b - beside[p, 0, c]) + abs(a - beside[p, 1, c])
            apart += abs(a - b)
        cost = variance + defocus if variance <= other_variance else other_variance + other_defocus
        costs[p] = cost if as_they_are <= changed + np.float32(3) * tolerance else np.float32(np.inf)
        cues[p, 0], cues[p, 1], cues[p, 2] = variance, other_variance, apart / np.float32(3)
