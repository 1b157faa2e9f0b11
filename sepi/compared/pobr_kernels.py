"""Compiled loop of the photo-consistency of angular patches."""

from __future__ import annotations

from typing import Any

import numpy as np

from sepi.compiled import njit, prange


@njit(cache=True, parallel=True)
def mean_truncated_differences(sheared: Any, reference: int, truncation: float, out: Any) -> None:
    """Mean over the other views of the truncated colour difference from the reference view.

    Parameters
    ----------
    sheared : ndarray, shape (N, 3, H, W), float32
        Views sheared by one candidate.
    reference : int
        Number of the reference view among them.
    truncation : float
        Mean absolute difference of the channels from which a further one costs no more.
    out : ndarray, shape (H, W), float32
        In parts of the truncation, 0..1.
    """
    N, _, H, W = sheared.shape
    limit = np.float32(3 * truncation)
    scale = np.float32(1) / (limit * np.float32(N - 1))
    for y in prange(H):
        red, green, blue = sheared[reference, 0, y], sheared[reference, 1, y], sheared[reference, 2, y]
        total = out[y]
        total[:] = np.float32(0)
        for n in range(N):
            if n == reference:
                continue
            r, g, b = sheared[n, 0, y], sheared[n, 1, y], sheared[n, 2, y]
            for x in range(W):
                total[x] += min(abs(r[x] - red[x]) + abs(g[x] - green[x]) + abs(b[x] - blue[x]), limit)
        for x in range(W):
            total[x] *= scale
