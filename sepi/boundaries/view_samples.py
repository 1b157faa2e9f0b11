"""Where views show a pixel of some disparity, and the colours between their pixels, in compiled loops."""

from __future__ import annotations

from typing import Any

import numpy as np

from sepi.boundaries.arrays import RimViews
from sepi.compiled import fma, njit
from sepi.vectors import load, spread, store


@njit(forceinline=True, borrows=True)
def sees(views: RimViews, view: int, d: Any, y: int, x: int) -> Any:
    """Whether a view shows a pixel of disparity ``d``, and where: row and column of the sample, and its fractions."""
    H, W = views.lines.shape[2], views.lines.shape[3] // views.channels
    down, across = y - d * views.baselines[view, 0], x - d * views.baselines[view, 1]
    if down < 0 or across < 0 or down >= H - 1 or across >= W - 1:
        return False, 0, 0, 0.0, 0.0
    row, column = int(down), int(across)
    nearest = views.nearest[
        views.places[view, 0], views.places[view, 1], int(down + 0.5) - views.low, int(across + 0.5)
    ]
    return nearest <= d + views.margin, row, column, down - row, across - column


@njit(forceinline=True, borrows=True)
def _cubic(f: Any) -> Any:
    """Weights of four neighbours, the second and third of which a sample lies between (Catmull and Rom's)."""
    half, one, more = np.float32(0.5), np.float32(1), np.float32(1.5)
    return (
        f * (f * (one - half * f) - half),
        one + f * f * (more * f - np.float32(2.5)),
        f * (half + f * (np.float32(2) - more * f)),
        f * f * (half * f - half),
    )


@njit(forceinline=True, borrows=True)
def sample(views: RimViews, view: int, row: int, column: int, fy: Any, fx: Any, sums: Any, out: Any) -> None:
    """Colour between pixels of a view into ``out (3,)``, 0..1; grey counts as three equal channels.

    Cubic, since a bilinear sample takes from the peak of what is two pixels wide. ``sums (12,)`` is scratch.
    """
    lines, t, s, C = views.lines, views.places[view, 0], views.places[view, 1], views.channels
    H, W = lines.shape[2], lines.shape[3] // C
    down, across = _cubic(np.float32(fy)), _cubic(np.float32(fx))
    rows = max(row - 1, 0), row, row + 1, min(row + 2, H - 1)
    red, green, blue = np.float32(0), np.float32(0), np.float32(0)
    if C == 3 and 1 <= column < W - 2:
        # four pixels side by side, of which the first eight numbers and the last eight make up all twelve
        for at in (0, 4):
            i = 3 * (column - 1) + at
            total = spread(down[0]) * load(lines, (t, s, rows[0], i))
            total = fma(spread(down[1]), load(lines, (t, s, rows[1], i)), total)
            total = fma(spread(down[2]), load(lines, (t, s, rows[2], i)), total)
            store(sums, at, fma(spread(down[3]), load(lines, (t, s, rows[3], i)), total))
        for j in range(4):
            red += across[j] * sums[3 * j]
            green += across[j] * sums[3 * j + 1]
            blue += across[j] * sums[3 * j + 2]
    else:
        # green and blue of a grey picture are its last channel, too
        second, third = min(1, C - 1), min(2, C - 1)
        for j in range(4):
            i = C * min(max(column - 1 + j, 0), W - 1)
            for k in range(4):
                weight = across[j] * down[k]
                red += weight * lines[t, s, rows[k], i]
                green += weight * lines[t, s, rows[k], i + second]
                blue += weight * lines[t, s, rows[k], i + third]
    unit = views.units[view]
    out[0], out[1], out[2] = red * unit, green * unit, blue * unit
