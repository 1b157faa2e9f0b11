"""Subsets of the views: halves and quarters of the grid for half-SEPIs, and a few views that represent all.

A sweep sums the costs of groups of views; a subset is a union of groups. A straight edge hides a pixel from the views
on one side of a line through the reference view, so halves and quarters are enough.
"""

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from sepi.lightfield import BoolMap, FloatArray, LightField


@dataclass(frozen=True)
class ViewSubsets:
    """Subsets of the views as unions of groups.

    Attributes
    ----------
    groups : ndarray, shape (T, S), int
        Group of each view, 0..G-1.
    subsets : ndarray, shape (N, G), bool
        Groups of each subset.
    names : tuple of str, length N
    """

    groups: npt.NDArray[np.int64]
    subsets: BoolMap
    names: tuple[str, ...]


SIDES = {"left": (0, -1), "right": (0, 1), "up": (-1, 0), "down": (1, 0)}
"""Direction ``(dt, ds)`` from the reference view to the views of a half."""

QUARTERS = (("left", "up"), ("left", "down"), ("right", "up"), ("right", "down"))

# most views, as a multiple of the number asked for
_HARDLY_MORE = 1.2
# reach from the reference view up to which no view is left out, and up to which far views matter more than aliases
_SHORT, _MODERATE = 1, 4
# least mean squared distance of a lattice's views from the reference view, as a multiple of that of all views
_WIDE = 0.99
# of a single row's views, of which every second one repeats twice as often
_FEWEST_OF_A_ROW = 25
# least number of frequencies along each axis at which repetitions are searched
_FREQUENCIES = 48

HALVES_AND_QUARTERS = ("full", *SIDES, *(f"{a}-{b}" for a, b in QUARTERS))
"""Names of the subsets of :func:`halves_and_quarters`."""


def halves_and_quarters(light_field: LightField) -> ViewSubsets:
    """All views, the paper's four halves, and the four quarters in which these overlap.

    A slanted edge occludes a pixel both horizontally and vertically; a quarter holds the views left. Views within half
    a row or column of the dividing line belong to both sides.

    Parameters
    ----------
    light_field : LightField
        Its reference view divides the grid.

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
    """All views, then for each of ``directions`` edge orientations the views on either side.

    Parameters
    ----------
    light_field : LightField
        Its reference view divides the grid.
    directions : int
        Number of edge orientations over half a turn.

    Returns
    -------
    ViewSubsets
        Subset ``1 + n`` for ``n`` in ``0..2 directions - 1`` has the views within a quarter turn of the angle
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
    """A few views, spread evenly over the grid, that reach nearly as far as all views.

    These are the views of every second, fourth, ... row and column, counted from the reference view, or every other one
    of those, as on a chess board. The result is the smallest such set of ``at_least`` views, or else all views.

    Parameters
    ----------
    light_field : LightField
    at_least : int or None
        Least number of views; None: all views.

    Returns
    -------
    ndarray, shape (T, S), bool
        Present views, the reference view among them.
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


def views_without_aliases(light_field: LightField, at_least: int, *, far: bool = False) -> BoolMap:
    """About as many views as :func:`spread_views`, arranged so that a regular texture has fewer aliases.

    Views of every second row and column give twice as many aliases as all views, and a chess board does so for a
    checkered texture. Four arrangements avoid this, with ``s`` and ``t`` counted from the reference view: a third of
    the views, with ``s + t`` divisible by three; nine views: the reference view, and eight at the border along one axis
    and one step from the reference view along the other; 13 views: the reference view, the corners, and eight that
    stand one step from the border and one from the reference view; and three fifths of the views, with ``|s| + |t|``
    within one of a multiple of five. Grids beyond 9x9 have a mirrored lattice: views with ``|s| + a |t|`` divisible by
    ``k``, for the ``a`` and ``k`` with which the views repeat least. A single row keeps more views, every second or
    fourth one.

    Parameters
    ----------
    light_field : LightField
    at_least : int
        Least number of views.
    far : bool
        Whether up to 9x9 views keep far ones, which tell depth best, rather than every row and column.

    Returns
    -------
    ndarray, shape (T, S), bool
        Present views, the reference view among them. :func:`spread_views` where no arrangement fits.
    """
    t0, s0 = light_field.reference_position
    reach = min(t0, s0, light_field.grid[0] - 1 - t0, light_field.grid[1] - 1 - s0)
    down, across = np.indices(light_field.grid) - np.array([t0, s0])[:, None, None]
    near, distant = np.sort(np.abs([down, across]), axis=0)
    third = (down + across) % 3 == 0
    ring = (distant == 0) | ((near == 1) & (distant == reach))
    star = (distant == 0) | ((near == 1) & (distant == reach - 1)) | ((near == reach) & (distant == reach))
    fifths = (near + distant + 1) % 5 <= 2
    for views in (fifths,) if far else (ring, third, star, fifths):
        few: BoolMap = light_field.present & views
        if reach > _SHORT and at_least <= few.sum() <= _HARDLY_MORE * at_least:
            return few
    if 1 in light_field.grid:
        at_least = max(at_least, _FEWEST_OF_A_ROW)
    lattices = _mirrored_lattices(light_field, at_least) if reach > _MODERATE else []
    return min(lattices, key=_repetition) if lattices else spread_views(light_field, at_least)


def _mirrored_lattices(light_field: LightField, at_least: int) -> list[BoolMap]:
    """Lattices of about ``at_least`` views that are mirrored at the reference view, and as wide as the grid."""
    t0, s0 = light_field.reference_position
    down, across = np.abs(np.indices(light_field.grid) - np.array([t0, s0])[:, None, None])
    present, distance2 = light_field.present, down**2 + across**2
    found = []
    for k in range(2, 2 * int(present.sum()) // at_least):
        for a in range(1, k):
            views = present & ((across + a * down) % k == 0)
            enough = at_least <= views.sum() <= _HARDLY_MORE * at_least
            if enough and distance2[views].mean() >= _WIDE * distance2[present].mean():
                found.append(views)
    return found


def _repetition(views: BoolMap) -> float:
    """Largest share of the views that some texture's alias agrees with."""
    size = max(_FREQUENCIES, *views.shape)
    spectrum = np.abs(np.fft.fft2(views, (size, size)))
    down, across = np.abs(np.fft.fftfreq(size)) * np.array(views.shape)[:, None]
    return float(spectrum[np.hypot(down[:, None], across) > 1].max() / views.sum())


def grid_steps(light_field: LightField) -> FloatArray:
    """Mean distance from row to row and from column to column, in view steps; shape (2,).

    By least squares if views stand off the grid; 1 along an axis without extent.
    """
    if light_field.positions is None:
        return np.array([light_field.row_spacing, 1.0])
    numbers = np.argwhere(light_field.present).astype(np.float64)
    numbers -= numbers.mean(axis=0)
    along = np.abs((numbers * light_field.positions[light_field.present]).sum(axis=0))
    steps = np.ones(2)
    np.divide(along, (numbers**2).sum(axis=0), out=steps, where=along > 0)
    return steps
