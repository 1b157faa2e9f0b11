"""Compiled loops of the phase-shifted views' costs."""

from __future__ import annotations

from typing import Any

import numpy as np

from sepi.compiled import njit, prange


@njit(cache=True, parallel=True)
def turn_phases(spectrum: Any, rows: Any, columns: Any, out: Any) -> None:
    """``out[m, c, i, j] = spectrum[c, i, j] * rows[m, i] * columns[m, j]``, complex64."""
    M, C, H, W = out.shape
    for mc in prange(M * C):
        m, c = mc // C, mc % C
        for i in range(H):
            for j in range(W):
                out[m, c, i, j] = spectrum[c, i, j] * (rows[m, i] * columns[m, j])


@njit(cache=True, parallel=True)
def add_differences(
    shifted: Any,
    reference: Any,
    across_share: float,
    colour_share: float,
    colour_truncation: float,
    gradient_truncation: float,
    out: Any,
) -> None:
    """Add one view's truncated differences of colour and gradient to ``out (M, H, W)``.

    ``shifted`` is ``(M, C, H or more, W or more)`` and ``reference (C, H, W)``, float32. Differences are means over the
    channels. Gradients are central differences, which repeat the first and last pixel.
    """
    M, H, W = out.shape
    C = reference.shape[0]
    share, half = np.float32(colour_share), np.float32(0.5 / C)
    across, down = np.float32((1 - colour_share) * across_share), np.float32((1 - colour_share) * (1 - across_share))
    most, steepest = np.float32(colour_truncation), np.float32(gradient_truncation)
    part = np.float32(1 / C)
    for y in prange(H):
        residual = np.empty(W, np.float32)
        colour, right, below = (np.empty(W, np.float32), np.empty(W, np.float32), np.empty(W, np.float32))
        above, under = max(y - 1, 0), min(y + 1, H - 1)
        for m in range(M):
            colour[:] = 0
            right[:] = 0
            below[:] = 0
            for c in range(C):
                for x in range(W):
                    residual[x] = shifted[m, c, y, x] - reference[c, y, x]
                for x in range(W):
                    high = shifted[m, c, under, x] - reference[c, under, x]
                    low = shifted[m, c, above, x] - reference[c, above, x]
                    colour[x] += abs(residual[x])
                    below[x] += abs(high - low)
                for x in range(1, W - 1):
                    right[x] += abs(residual[x + 1] - residual[x - 1])
                right[0] += abs(residual[1] - residual[0])
                right[W - 1] += abs(residual[W - 1] - residual[W - 2])
            for x in range(W):
                out[m, y, x] += (
                    share * min(part * colour[x], most)
                    + across * min(half * right[x], steepest)
                    + down * min(half * below[x], steepest)
                )
