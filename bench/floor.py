"""The arithmetic floor: the time of the plane sweep's multiply-adds alone.

The kernels of :mod:`sepi.kernels.floor` do the operations of the sweep (for a sample, the polynomial of its squared
difference and the robust residual; a row of the window) on a few hundred numbers in the first cache. A sweep cannot be
faster than this.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from bench.measure import Figures, Measurement, Prepared
from sepi.kernels import floor as kernels

NUMBERS = 512
PASSES = 20_000

KERNELS: dict[str, tuple[Any, int]] = {
    "sample": (kernels.samples, 1),
    "multiply-add of the window": (kernels.windows, 7),
}
"""Name to kernel, and its number of operations on a number; their price is seconds over operations."""

WINDOW_OPERATIONS = "window_operations"
"""Figure of a sweep: multiply-adds of its windows, beside its ``samples``."""


def prepare(name: str, threads: int) -> Prepared:
    """One of the kernels on all ``threads``; the figure is its number of operations."""
    kernel, per_number = KERNELS[name]
    data = np.random.default_rng(0).random((threads, 7, NUMBERS), np.float32)
    out = np.zeros((threads, NUMBERS), np.float32)
    operations = float(threads * PASSES * NUMBERS * per_number)
    return Prepared(lambda: kernel(PASSES, data, out), lambda _: {"operations": operations})


def seconds(prices: Mapping[str, Measurement], figures: Figures) -> float | None:
    """Seconds of a sweep's operations alone; None for other stages and grey views.

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
