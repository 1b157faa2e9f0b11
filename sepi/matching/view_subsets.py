"""Parts of the view grid: those from which half-SEPIs are put together, and few views that stand for all.

A sweep sums the costs of groups of views; a subset is a union of groups. Occlusion at a straight edge hides the views
on one side of a line through the reference view, so the subsets worth asking for are halves and quarters.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from sepi.lightfield import BoolMap, LightField


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

# of a number of views, times; of views to one side of the reference view, all are of use
_HARDLY_MORE = 1.1
_SHORT = 2

HALVES_AND_QUARTERS = ("full", *SIDES, *(f"{a}-{b}" for a, b in QUARTERS))
"""Names of the subsets of :func:`halves_and_quarters`."""


def halves_and_quarters(light_field: LightField) -> ViewSubsets:
    """All views, the four halves of the paper, and their four overlaps; the dividing line belongs to both sides.

    Where a pixel is occluded horizontally and vertically at once, as at any slanted edge, the views it keeps are those
    of both halves. A view less than half a row or column from the dividing line stands on it.

    Parameters
    ----------
    light_field : LightField
        Sides are seen from its reference view.

    Returns
    -------
    ViewSubsets
        Named ``HALVES_AND_QUARTERS``.
    """
    steps = light_field.baselines / grid_steps(light_field)
    sign_t, sign_s = np.moveaxis(np.where(np.abs(steps) < 0.5, 0, np.sign(steps)).astype(np.int64), 2, 0)
    groups = 3 * (sign_t + 1) + sign_s + 1
    # signs (dt, ds) of each group, in the order of their numbers
    signs = np.array([(dt, ds) for dt in (-1, 0, 1) for ds in (-1, 0, 1)])
    sides = {name: signs @ np.array(direction) >= 0 for name, direction in SIDES.items()}
    quarters = [sides[a] & sides[b] for a, b in QUARTERS]
    return ViewSubsets(groups, np.array([np.ones(9, bool), *sides.values(), *quarters]), HALVES_AND_QUARTERS)


def half_planes(light_field: LightField, directions: int) -> ViewSubsets:
    """All views, then for each of ``directions`` edge orientations the views on its one and on its other side.

    Parameters
    ----------
    light_field : LightField
        Sides are seen from its reference view.
    directions : int
        Number of edge orientations over half a turn.

    Returns
    -------
    ViewSubsets
        Subset ``1 + n`` for ``n`` in ``0..2 directions - 1`` keeps the views within a quarter turn of the angle
        ``(n + 1/2) pi / directions``, measured from ``+s`` towards ``+t``.
    """
    sectors = 2 * directions
    angle = np.arctan2(*np.moveaxis(light_field.baselines, 2, 0))
    groups = np.round(angle * sectors / (2 * np.pi)).astype(np.int64) % sectors
    start = np.arange(sectors)[:, None]
    # sectors n - directions/2 + 1 .. n + directions/2 lie within a quarter turn of the middle between n and n + 1
    inside = (np.arange(sectors)[None] - start + directions // 2 - 1) % sectors < directions
    subsets = np.concatenate([np.ones((1, sectors), bool), inside])
    return ViewSubsets(groups, subsets, ("full", *(f"half-plane {n}" for n in range(sectors))))


def spread_views(light_field: LightField, at_least: int | None) -> BoolMap:
    """Few views that are spread evenly over the grid and reach as far as all, or nearly so.

    Every second, fourth, ... row and column from the reference view, or of these every other view as on a chess board;
    the fewest that are ``at_least`` so many, and all views where there are not more.

    Parameters
    ----------
    light_field : LightField
    at_least : int or None
        None: all views.

    Returns
    -------
    ndarray, shape (T, S), bool
        Views that are present; the reference view is among them.
    """
    if at_least is None:
        return light_field.present
    t0, s0 = light_field.reference_position
    down, across = np.indices(light_field.grid) - np.array([t0, s0])[:, None, None]
    chosen = light_field.present
    step = 1
    while True:
        rows_and_columns = (down % step == 0) & (across % step == 0)
        chess_board = rows_and_columns & ((down + across) // step % 2 == 0)
        for part in (rows_and_columns, chess_board):
            fewer = light_field.present & part
            if fewer.sum() < at_least:
                return chosen
            chosen = fewer
        step *= 2


def views_without_aliases(light_field: LightField, at_least: int) -> BoolMap:
    """As few views as :func:`spread_views`, or hardly more, that repeat fewer aliases of a texture.

    Those on every second row and column have aliases twice as often as all views do. A third of the views, with
    ``s + t`` divisible by three, does not; nor do 13 views: the reference view, the corners, and eight that stand one
    step from the border along one axis and one step from the reference view along the other.

    Parameters
    ----------
    light_field : LightField
    at_least : int

    Returns
    -------
    ndarray, shape (T, S), bool
        Views that are present; the reference view is among them.
    """
    t0, s0 = light_field.reference_position
    reach = min(t0, s0, light_field.grid[0] - 1 - t0, light_field.grid[1] - 1 - s0)
    down, across = np.indices(light_field.grid) - np.array([t0, s0])[:, None, None]
    near, far = np.sort(np.abs([down, across]), axis=0)
    third = (down + across) % 3 == 0
    star = (far == 0) | ((near == 1) & (far == reach - 1)) | ((near == reach) & (far == reach))
    for views in (third, star):
        few: BoolMap = light_field.present & views
        if reach > _SHORT and at_least <= few.sum() <= _HARDLY_MORE * at_least:
            return few
    return spread_views(light_field, at_least)


def grid_steps(light_field: LightField) -> npt.NDArray[np.float64]:
    """Mean distance from row to row and from column to column, in view steps; shape (2,).

    By least squares where views stand off the grid; 1 along an axis on which all views stand at one place.
    """
    if light_field.positions is None:
        return np.array([light_field.row_spacing, 1.0])
    numbers = np.argwhere(light_field.present).astype(np.float64)
    numbers -= numbers.mean(axis=0)
    along = np.abs((numbers * light_field.positions[light_field.present]).sum(axis=0))
    steps = np.ones(2)
    np.divide(along, (numbers**2).sum(axis=0), out=steps, where=along > 0)
    return steps
