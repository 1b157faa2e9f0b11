"""Compiled loop of the second-order smoothing: its matrix, as a stencil.

Pictures have a margin of :data:`MARGIN` pixels of zeros on each side, so that no loop has to look where it is. What
is called in every step of the solver takes a millisecond, and threads that wait for each other take longer than that
where another program has one of the cores: it runs on one.
"""

from __future__ import annotations

from typing import Any

from sepi.compiled import njit

EXACT = {"nnan", "ninf", "nsz"}
"""Fast-math flags that keep every rounding as written: see :mod:`sepi.matching.plane_sweep_kernels`."""

MARGIN = 2
"""How far second differences reach, pixels."""


@njit(inline="always")
def _add_pair(forth: Any, there: Any, back: Any, before: Any, out: Any) -> None:
    """One entry and its mirror image; few arrays at a time, so that the loop vectorises."""
    for x in range(out.size):
        out[x] += forth[x] * there[x] + back[x] * before[x]


@njit(cache=True, fastmath=EXACT)
def product(stencil: Any, vector: Any, out: Any) -> None:
    """The matrix times a picture.

    Parameters
    ----------
    stencil : ndarray, shape (7, H + 2 MARGIN, W + 2 MARGIN), float32 or float64
        Of :func:`sepi.regularization.second_order.second_difference_stencil`, with a margin.
    vector, out : ndarray, shape (H + 2 MARGIN, W + 2 MARGIN), of the same type
        With a margin of zeros; that of ``out`` is not touched.
    """
    m = MARGIN
    n = vector.shape[1] - 2 * m
    for y in range(m, vector.shape[0] - m):
        c, v, target = stencil[0, y, m : m + n], vector[y, m : m + n], out[y, m : m + n]
        for x in range(n):
            target[x] = c[x] * v[x]
        for k, dy, dx in ((1, 0, 1), (2, 0, 2), (3, 1, 0), (4, 2, 0), (5, 1, 1), (6, 1, -1)):
            _add_pair(
                stencil[k, y, m : m + n], vector[y + dy, m + dx : m + dx + n],
                stencil[k, y - dy, m - dx : m - dx + n], vector[y - dy, m - dx : m - dx + n], target,
            )  # fmt: skip
