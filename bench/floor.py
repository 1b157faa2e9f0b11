"""The arithmetic floor: what the multiply-adds of the plane sweep cost where nothing else does.

The two kernels here do the operations of :mod:`sepi.matching.plane_sweep_kernels` (a sample: bilinear interpolation of
three channels and the robust residual; a row of the window) on a few
hundred numbers that stay in the first cache, at fixed places. A sweep cannot be faster than its operations at this
price.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from numba import njit, prange

from bench.measure import Figures, Measurement, Prepared

NUMBERS = 512
PASSES = 20_000


@njit(cache=True, parallel=True, fastmath=True, error_model="numpy")
def _samples(threads: int, passes: int, data: Any, out: Any) -> None:
    """Operations of samples, over ``data (threads, 7, N)``, added to ``out (threads, N)``."""
    for thread in prange(threads):
        a, b, c, d, g = data[thread, 0], data[thread, 1], data[thread, 2], data[thread, 3], data[thread, 4]
        target = out[thread]
        for n in range(passes):
            # weights that change, as they do from candidate to candidate
            w0 = np.float32(0.1) + np.float32(n) * np.float32(1e-6)
            w1, w2, w3, scale2 = np.float32(0.2), np.float32(0.3), np.float32(0.4), np.float32(0.01)
            for x in range(target.size):
                r0 = w0 * a[x] + w1 * b[x] + w2 * c[x] + w3 * d[x] - g[x]
                r1 = w0 * b[x] + w1 * c[x] + w2 * d[x] + w3 * g[x] - a[x]
                r2 = w0 * c[x] + w1 * d[x] + w2 * g[x] + w3 * a[x] - b[x]
                z = r0 * r0 + r1 * r1 + r2 * r2
                target[x] += z / (z + scale2)


@njit(cache=True, parallel=True, fastmath=True, error_model="numpy")
def _windows(threads: int, passes: int, data: Any, out: Any) -> None:
    """Rows of a window, seven numbers of ``data (threads, 7, N)`` each, added to ``out (threads, N)``."""
    for thread in prange(threads):
        a = data[thread]
        target = out[thread]
        for n in range(passes):
            w = np.float32(n) * np.float32(1e-9)
            # different weights, or a compiler would add before it multiplies
            w1, w2, w3 = np.float32(0.01), np.float32(0.02), np.float32(0.03)
            w4, w5, w6 = np.float32(0.04), np.float32(0.05), np.float32(0.06)
            for x in range(target.size):
                target[x] += (
                    (w * a[0, x] + w1 * a[1, x])
                    + (w2 * a[2, x] + w3 * a[3, x])
                    + (w4 * a[4, x] + w5 * a[5, x])
                    + w6 * a[6, x]
                )


KERNELS: dict[str, tuple[Any, int]] = {"sample": (_samples, 1), "multiply-add of the window": (_windows, 7)}
"""Name to kernel, and how many operations it does on a number; their price is seconds over operations."""

WINDOW_OPERATIONS = "window_operations"
"""Figure of a sweep: multiply-adds of its windows, beside its ``samples``."""


def prepare(name: str, threads: int) -> Prepared:
    """One of the kernels, all ``threads`` at work; says how many operations it did."""
    kernel, per_number = KERNELS[name]
    data = np.random.default_rng(0).random((threads, 7, NUMBERS), np.float32)
    out = np.zeros((threads, NUMBERS), np.float32)
    operations = float(threads * PASSES * NUMBERS * per_number)
    return Prepared(lambda: kernel(threads, PASSES, data, out), lambda _: {"operations": operations})


def seconds(prices: Mapping[str, Measurement], figures: Figures) -> float | None:
    """Seconds that a sweep's operations alone take; None for what is no sweep or of grey views.

    Parameters
    ----------
    prices : mapping of str to Measurement
        Of the kernels, by name.
    figures : mapping of str to number
        Of the sweep.
    """
    if not prices or figures.get("channels") != 3:
        return None
    sample, window = (prices[name].median / prices[name].figures["operations"] for name in KERNELS)
    return figures["samples"] * sample + figures[WINDOW_OPERATIONS] * window
