"""Compiled loop of the edges beside depth steps (:mod:`sepi.boundaries.edge_lines`)."""

from __future__ import annotations

from typing import Any

import numpy as np

from sepi.compiled import njit, prange

PATCH = 9
"""Pixels of a patch: three by three, row after row."""

STEPS = 3
"""From one share that has a cost to the next."""

_MOST = np.float32(0.2)  # cost of a neighbour that an edge does not fit
_OUTSIDE = np.float32(0.3)  # cost of a pixel away from all steps that is the other surface's
_AT_ONCE = 64  # pixels that a thread does at a stretch


@njit(parallel=True, cache=True)
def evidence_of_lines(
    disparity: Any, middle: Any, number: Any, costs: Any, weights: Any, shares: Any, is_near: Any, own: Any,
    pixels: Any, evidence: Any,
) -> None:  # fmt: skip
    """By how much the best edge that leaves a pixel to the farther surface costs less than the best that does not.

    Parameters
    ----------
    disparity, middle : ndarray, shape (H, W), float32
        The map, and what lies between the two surfaces of a pixel.
    number : ndarray, shape (H, W), int64
        Which row of ``costs`` is a pixel's; -1: it lies beside no step, and stays on its side.
    costs : ndarray, shape (n, K), float32
        Of shares of the nearer surface, from 0 to 1; the best of each costs 0.
    weights : ndarray, shape (PATCH,), float32
    shares : ndarray, shape (M, PATCH), uint8
        What each edge leaves to the nearer surface in the pixels of a patch, in units of one of
        ``STEPS * (K - 1)``.
    is_near : ndarray, shape (M,), bool
        Which surface has the middle of the patch.
    own : ndarray, shape (M,), float32
        Cost of each edge itself.
    pixels : ndarray, shape (n,), int64
        Places in the map of the rows of ``costs``.
    evidence : ndarray, shape (n,), float32
        Filled in.
    """
    H, W = disparity.shape
    count, K = costs.shape
    M, finest = len(shares), STEPS * (K - 1)
    for task in prange((count + _AT_ONCE - 1) // _AT_ONCE):
        table = np.empty((PATCH, finest + 1), np.float32)
        for i in range(task * _AT_ONCE, min(count, (task + 1) * _AT_ONCE)):
            y, x = pixels[i] // W, pixels[i] % W
            for p in range(PATCH):
                row, column = y + p // 3 - 1, x + p % 3 - 1
                if row < 0 or column < 0 or row >= H or column >= W:
                    table[p] = 0
                    continue
                n = number[row, column]
                for k in range(finest + 1):
                    if n < 0:
                        share = np.float32(k) / np.float32(finest)
                        wrong = np.float32(1) - share if disparity[row, column] > middle[y, x] else share
                        table[p, k] = weights[p] * _OUTSIDE * wrong
                    else:
                        low = min(k // STEPS, K - 2)
                        part = np.float32(k - STEPS * low) / np.float32(STEPS)
                        cost = costs[n, low] + part * (costs[n, low + 1] - costs[n, low])
                        # an edge may bend, or end, beside the pixel that is asked about
                        table[p, k] = weights[p] * (cost if p == PATCH // 2 else min(cost, _MOST))
            near = far = np.float32(np.inf)
            for m in range(M):
                total = own[m]
                for p in range(PATCH):
                    total += table[p, shares[m, p]]
                if is_near[m]:
                    near = min(near, total)
                else:
                    far = min(far, total)
            evidence[i] = near - far
