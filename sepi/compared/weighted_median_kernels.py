"""Compiled loop of the weighted median."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from sepi.compiled import njit, prange


@njit(cache=True, parallel=True)
def weighted_medians(values: Any, guide: Any, radius: int, sigma: float, weight: Any) -> Any:
    """As :func:`sepi.compared.weighted_median.weighted_median`."""
    H, W = values.shape
    out = np.empty((H, W), np.float32)
    factor = np.float32(-0.5 / sigma**2)
    most = (2 * radius + 1) ** 2
    for y in prange(H):
        found, weights = np.empty(most, np.float32), np.empty(most, np.float32)
        for x in range(W):
            n, total = 0, 0.0
            for v in range(max(0, y - radius), min(H, y + radius + 1)):
                for u in range(max(0, x - radius), min(W, x + radius + 1)):
                    r = guide[v, u, 0] - guide[y, x, 0]
                    g = guide[v, u, 1] - guide[y, x, 1]
                    b = guide[v, u, 2] - guide[y, x, 2]
                    w = weight[v, u] * math.exp(factor * (r * r + g * g + b * b))
                    if w > 0:
                        found[n], weights[n] = values[v, u], w
                        total += w
                        n += 1
            out[y, x] = values[y, x]
            order = np.argsort(found[:n], kind="mergesort")
            below = 0.0
            for i in order:
                below += weights[i]
                if below >= 0.5 * total:
                    out[y, x] = found[i]
                    break
    return out
