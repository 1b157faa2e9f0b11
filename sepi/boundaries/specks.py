"""Specks of the map: a few pixels whose depth nothing around them shares.

A surface is seen in more than a few pixels, but for the rare tip: a speck is where matching went astray, mostly beside
an edge, where few views see a pixel, or on a plain surface, where a depth farther behind it is as good as any. Holes,
with nothing but nearer pixels round them, may be larger: what is behind a hole hardly any view shows, so that hardly
any contradicts it. The pixels of a speck join the neighbours whose colours are most like their own.
"""

from __future__ import annotations

import numpy as np

from sepi.lightfield import FloatMap

_NEIGHBOURS = [(dy, dx) for dy in (-1, 0, 1) for dx in (-1, 0, 1) if dy or dx]


def join_specks(
    disparity: FloatMap, colours: FloatMap, difference: float, most_pixels: int, most_of_hole: int
) -> FloatMap:
    """Disparity without specks.

    Parameters
    ----------
    disparity : ndarray, shape (H, W), float32
        Pixels per view step.
    colours : ndarray, shape (H, W, 3), float32
        0..1.
    difference : float
        By how much neighbours differ at most to belong together, pixels per view step.
    most_pixels, most_of_hole : int
        Of a speck, and of one with nothing but nearer pixels round it.

    Returns
    -------
    ndarray, shape (H, W), float32
        ``disparity`` itself where all of it is specks, or nothing.
    """
    from sepi.boundaries.speck_kernels import specks_of

    left = specks_of(disparity, np.float32(difference), most_pixels, most_of_hole)
    if not left.any() or left.all():
        return disparity
    height, width = disparity.shape
    joined = np.where(left, np.float32(np.nan), disparity)
    y, x = np.nonzero(left)
    while len(y):
        # from their rims inwards: what was joined in this round has a say in the next
        unlike = np.full(len(y), np.inf)
        values = np.full(len(y), np.nan, np.float32)
        for dy, dx in _NEIGHBOURS:
            there = (y + dy).clip(0, height - 1), (x + dx).clip(0, width - 1)
            beside = joined[there]
            apart = np.where(np.isnan(beside), np.inf, ((colours[there] - colours[y, x]) ** 2).sum(axis=1))
            values = np.where(apart < unlike, beside, values)
            unlike = np.minimum(unlike, apart)
        joined[y, x] = values
        y, x = y[np.isnan(values)], x[np.isnan(values)]
    return joined
