"""Compiled loops of the constrained angular entropy and of the constrained adaptive defocus."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from sepi.compiled import njit, prange

LEVELS = 256
"""Bins of the histograms, over colours in 0..1."""

PATCH = 5
"""Width of a sub-patch in pixels; three by three of them make up the neighbourhood of a pixel."""


@njit(inline="always")
def _level(value: Any) -> int:
    """Bin of a colour; what resampling overshoots goes to the last ones."""
    return min(max(int(value * (LEVELS - 1) + np.float32(0.5)), 0), LEVELS - 1)


@njit(inline="always")
def _entropy(patch: Any, own: int, weights: Any, histogram: Any) -> Any:
    """Entropy of the weighted histogram of an angular patch ``(N,)`` of bins; leaves ``histogram`` at zero."""
    reach = weights.size - 1
    total = np.float32(0)
    for level in patch:
        distance = abs(level - own)
        if distance <= reach:
            histogram[level] += weights[distance]
            total += weights[distance]
    # no view is anything like the pixel: as bad as a patch in which all differ
    if total <= 0:
        return np.float32(math.log(patch.size))
    mixed = np.float32(0)
    for level in range(max(own - reach, 0), min(own + reach, LEVELS - 1) + 1):
        if histogram[level] > 0:
            mixed += histogram[level] * math.log(histogram[level])
            histogram[level] = 0
    return math.log(total) - mixed / total


@njit(cache=True, parallel=True)
def constrained_entropies(sheared: Any, own: Any, weights: Any, out: Any) -> None:
    """Entropy of each channel's angular patch, each view weighted by how near its level is to the reference view's.

    ``sheared`` is ``(N, 3, H, W)``, ``own`` (3, H, W) the reference view, ``weights[d]`` the weight at a difference of
    ``d`` levels, 0 beyond its end; ``out`` (3, H, W).
    """
    N, C, H, W = sheared.shape
    for y in prange(H):
        patches = np.empty((W, N), np.int16)
        histogram = np.zeros(LEVELS, np.float32)
        for c in range(C):
            for n in range(N):
                row = sheared[n, c, y]
                for x in range(W):
                    patches[x, n] = _level(row[x])
            for x in range(W):
                out[c, y, x] = _entropy(patches[x], _level(own[c, y, x]), weights, histogram)


@njit(cache=True, parallel=True)
def constrained_least_patch(response: Any, guide: Any, sigma: Any, constraint: Any, out: Any) -> None:
    """Least over the sub-patches round a pixel of their weighted mean response and what their colours add to it.

    ``response`` is ``(H, W, K)``, ``guide`` (H, W, 3), ``out`` (H, W, K). Beyond its border a picture goes on as it
    ends.
    """
    H, W, K = response.shape
    reach = 3 * PATCH // 2
    scale = np.float32(-1 / (2 * guide.shape[2] * sigma * sigma))
    for y in prange(H):
        total = np.empty(K, np.float32)
        for x in range(W):
            least = out[y, x]
            least[:] = np.inf
            for part in range(9):
                top, left = y - reach + part // 3 * PATCH, x - reach + part % 3 * PATCH
                total[:] = 0
                weights = np.float32(0)
                for i in range(top, top + PATCH):
                    for j in range(left, left + PATCH):
                        v, u = min(max(i, 0), H - 1), min(max(j, 0), W - 1)
                        squared = np.float32(0)
                        for c in range(guide.shape[2]):
                            squared += (guide[v, u, c] - guide[y, x, c]) ** 2
                        # a patch of nothing alike still has a mean
                        weight = np.float32(math.exp(max(squared * scale, np.float32(-9))))
                        weights += weight
                        there = response[v, u]
                        for k in range(K):
                            total[k] += weight * there[k]
                added = constraint * (1 - weights / PATCH**2)
                for k in range(K):
                    least[k] = min(least[k], total[k] / weights + added)
