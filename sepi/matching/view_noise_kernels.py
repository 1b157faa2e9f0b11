"""Compiled loop of the views' noise: blocks of the reference view against blocks of others, at whole pixels."""

from __future__ import annotations

from typing import Any

import numpy as np

from sepi.compiled import njit, prange

EXACT = {"nnan", "ninf", "nsz"}
"""Fast-math flags that keep every rounding as written: see :mod:`sepi.matching.plane_sweep_kernels`."""

BLOCK = 8
"""Width of a block, pixels."""


@njit(parallel=True, cache=True, fastmath=EXACT)
def least_differences(colours: Any, t0: int, s0: int, moves: Any) -> Any:
    """Least mean squared difference of each block from what other views have at some whole pixels from it.

    Parameters
    ----------
    colours : ndarray, shape (T, S, 3, H, W)
    t0, s0 : int
        The reference view.
    moves : ndarray, shape (N, 4), int64
        Row and column of a view in the grid, pixels down and across.

    Returns
    -------
    ndarray, shape (H // BLOCK, W // BLOCK), float32
        In squared units of the colours; infinite where no other view holds the block.
    """
    _, _, _, H, W = colours.shape
    rows, columns = H // BLOCK, W // BLOCK
    least = np.full((rows, columns), np.inf, np.float32)
    for i in prange(rows):
        y = i * BLOCK
        reference = np.empty((3, BLOCK, W), np.float32)
        for c in range(3):
            for k in range(BLOCK):
                for x in range(W):
                    reference[c, k, x] = np.float32(colours[t0, s0, c, y + k, x])
        sums, squares = np.empty(W, np.float32), np.empty(W, np.float32)
        energy = np.empty(columns, np.float32)
        for n in range(len(moves)):
            t, s, down, across = moves[n]
            if y + down < 0 or y + down + BLOCK > H:
                continue
            first, last = max(0, -across), min(W, W - across)
            if last - first < BLOCK:
                continue
            first_block, end_block = (first + BLOCK - 1) // BLOCK, last // BLOCK
            energy[first_block:end_block] = 0
            for c in range(3):
                squares[first:last] = 0
                sums[first:last] = 0
                for k in range(BLOCK):
                    other = colours[t, s, c, y + down + k, first + across : last + across]
                    own = reference[c, k, first:last]
                    square, total = squares[first:last], sums[first:last]
                    for x in range(total.size):
                        e = np.float32(other[x]) - own[x]
                        square[x] += e * e
                        total[x] += e
                for j in range(first_block, end_block):
                    square_of_block, sum_of_block = np.float32(0), np.float32(0)
                    for x in range(j * BLOCK, (j + 1) * BLOCK):
                        square_of_block += squares[x]
                        sum_of_block += sums[x]
                    energy[j] += square_of_block - sum_of_block * sum_of_block / np.float32(BLOCK * BLOCK)
            for j in range(first_block, end_block):
                least[i, j] = min(least[i, j], energy[j])
    # less one degree of freedom: the mean, which exposure may change from view to view
    return least / np.float32(3 * (BLOCK * BLOCK - 1))
