"""Compiled loop that moves whole views by fractions of a pixel."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from sepi.compiled import njit, prange


@njit(inline="always")
def _weights(fraction: float, cubic: bool, out: Any) -> None:
    """Weights of the pixels at -1, 0, 1 and 2 for a sample at ``fraction``."""
    f = fraction
    if cubic:
        out[0] = np.float32(((-0.5 * f + 1.0) * f - 0.5) * f)
        out[1] = np.float32((1.5 * f - 2.5) * f * f + 1.0)
        out[2] = np.float32(((-1.5 * f + 2.0) * f + 0.5) * f)
        out[3] = np.float32((0.5 * f - 0.5) * f * f)
    else:
        out[0] = np.float32(0)
        out[1] = np.float32(1.0 - f)
        out[2] = np.float32(f)
        out[3] = np.float32(0)


@njit(cache=True, parallel=True)
def shear(views: Any, offsets: Any, cubic: bool, out: Any) -> None:
    """``out[n, c, y, x] = views[n, c, y + offsets[n, 0], x + offsets[n, 1]]``; all ``(N, C, H, W)``, float32."""
    N, C, H, W = views.shape
    for n in prange(N):
        down, across = math.floor(offsets[n, 0]), math.floor(offsets[n, 1])
        wy, wx = np.empty(4, np.float32), np.empty(4, np.float32)
        _weights(offsets[n, 0] - down, cubic, wy)
        _weights(offsets[n, 1] - across, cubic, wx)
        # a row that is interpolated down, with what lies beyond its ends
        row = np.empty(W + 3, np.float32)
        low, high = min(max(0, 1 - across), W), max(min(W, W - 2 - across), 0)
        for c in range(C):
            for y in range(H):
                a = views[n, c, min(max(y + down - 1, 0), H - 1)]
                b = views[n, c, min(max(y + down, 0), H - 1)]
                d = views[n, c, min(max(y + down + 1, 0), H - 1)]
                e = views[n, c, min(max(y + down + 2, 0), H - 1)]
                to = out[n, c, y]
                for x in range(W):
                    row[x] = wy[0] * a[x] + wy[1] * b[x] + wy[2] * d[x] + wy[3] * e[x]
                for x in range(low):
                    to[x] = _clamped(row, x + across, wx, W)
                for x in range(low, high):
                    at = x + across
                    to[x] = wx[0] * row[at - 1] + wx[1] * row[at] + wx[2] * row[at + 1] + wx[3] * row[at + 2]
                for x in range(max(low, high), W):
                    to[x] = _clamped(row, x + across, wx, W)


@njit(inline="always")
def _clamped(row: Any, at: int, wx: Any, W: int) -> Any:
    """A sample near the end of a row of ``W`` pixels, which goes on as it ends."""
    total = np.float32(0)
    for k in range(4):
        total += wx[k] * row[min(max(at + k - 1, 0), W - 1)]
    return total
