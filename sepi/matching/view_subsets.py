"""Parts of the view grid from which half-SEPIs are put together.

A sweep sums the costs of groups of views; a subset is a union of groups. Occlusion at a straight edge hides the views
on one side of a line through the reference view, so the subsets worth asking for are halves and quarters.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from sepi.lightfield import BoolMap


@dataclass(frozen=True)
class ViewSubsets:
    """Subsets of the views.

    Attributes
    ----------
    groups : ndarray, shape (T, S), int
        Group of each view, 0..G-1.
    subsets : ndarray, shape (N, G), bool
        Which groups make up each subset.
    names : tuple of str, length N
    """

    groups: npt.NDArray[np.int64]
    subsets: BoolMap
    names: tuple[str, ...]


SIDES = {"left": (0, -1), "right": (0, 1), "up": (-1, 0), "down": (1, 0)}
"""Direction ``(dt, ds)`` from the reference view towards the views that a half keeps."""

QUARTERS = (("left", "up"), ("left", "down"), ("right", "up"), ("right", "down"))


def halves_and_quarters(grid: tuple[int, int], reference: tuple[int, int] | None = None) -> ViewSubsets:
    """All views, the four halves of the paper, and their four overlaps; the dividing line belongs to both sides.

    Where a pixel is occluded horizontally and vertically at once, as at any slanted edge, the views it keeps are those
    of both halves.

    Parameters
    ----------
    grid : (int, int)
        Rows and columns of views.
    reference : (int, int), optional
        Position of the reference view, from which sides are seen; the centre unless given.

    Returns
    -------
    ViewSubsets
        Named ``full``, the four ``SIDES``, then the ``QUARTERS`` as ``left-up`` and so on.
    """
    t, s = _baselines(grid, reference)
    sign_t, sign_s = np.meshgrid(np.sign(t), np.sign(s), indexing="ij")
    groups = 3 * (sign_t + 1) + sign_s + 1
    # signs (dt, ds) of each group, in the order of their numbers
    signs = np.array([(dt, ds) for dt in (-1, 0, 1) for ds in (-1, 0, 1)])
    sides = {name: signs @ np.array(direction) >= 0 for name, direction in SIDES.items()}
    named = {"full": np.ones(9, bool), **sides}
    named.update({f"{a}-{b}": sides[a] & sides[b] for a, b in QUARTERS})
    return ViewSubsets(groups, np.array(list(named.values())), tuple(named))


def half_planes(grid: tuple[int, int], directions: int, reference: tuple[int, int] | None = None) -> ViewSubsets:
    """All views, then for each of ``directions`` edge orientations the views on its one and on its other side.

    Parameters
    ----------
    grid : (int, int)
        Rows and columns of views.
    directions : int
        Number of edge orientations over half a turn.
    reference : (int, int), optional
        Position of the reference view; the centre unless given.

    Returns
    -------
    ViewSubsets
        Subset ``1 + n`` for ``n`` in ``0..2 directions - 1`` keeps the views within a quarter turn of the angle
        ``(n + 1/2) pi / directions``, measured from ``+s`` towards ``+t``.
    """
    sectors = 2 * directions
    t, s = _baselines(grid, reference)
    angle = np.arctan2(*np.meshgrid(t, s, indexing="ij"))
    groups = np.round(angle * sectors / (2 * np.pi)).astype(np.int64) % sectors
    start = np.arange(sectors)[:, None]
    # sectors n - directions/2 + 1 .. n + directions/2 lie within a quarter turn of the middle between n and n + 1
    inside = (np.arange(sectors)[None] - start + directions // 2 - 1) % sectors < directions
    subsets = np.concatenate([np.ones((1, sectors), bool), inside])
    return ViewSubsets(groups, subsets, ("full", *(f"half-plane {n}" for n in range(sectors))))


def _baselines(
    grid: tuple[int, int], reference: tuple[int, int] | None
) -> tuple[npt.NDArray[np.int64], npt.NDArray[np.int64]]:
    """View baselines of each row and of each column from the reference view."""
    t0, s0 = reference or (grid[0] // 2, grid[1] // 2)
    return np.arange(grid[0]) - t0, np.arange(grid[1]) - s0
