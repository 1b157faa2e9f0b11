"""Light fields from one array of views: which axis is which, and what value is white."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from itertools import permutations
from math import isqrt, prod
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from sepi.errors import SepiError
from sepi.io.readers.options import ReadOptions, unarranged
from sepi.io.readers.view_grid import Numbers, arrange_numbers
from sepi.lightfield import HIGHEST, LOWEST, BoolMap, LightField

# integer types that values of other types may stand for, and the least maximum of floats that are not whole numbers:
# below it, values rather exceed a white of 1
_INTEGERS = (np.uint8, np.uint16)
_LEAST_BRIGHTEST = 16

Array = npt.NDArray[np.generic]
_Ranges = Mapping[tuple[int, int], tuple[float, float]]


def _scaled(
    source: str, stack: Array, numbers: Numbers, white: float | None
) -> tuple[Array, list[tuple[int, int]], list[str]]:
    """Views at their positions, those that are NaN throughout, which stay zero, and assumptions.

    Parameters
    ----------
    source : str
        For messages.
    stack : ndarray, shape (T, S, H, W, C), integers or floats
        Views of the given grid, in any byte order.
    numbers : ndarray, int64
        Number ``t * S + s`` in that grid of each used view, at its position; -1 for none.
    white : float, optional
        Value of white; default: guessed from the values.

    Returns
    -------
    views : ndarray, uint8, uint16 or float32
    unknown : list of (int, int)
    notes : list of str

    Raises
    ------
    SepiError
        If a used view holds floats that are not finite, or values beyond every scale.
    """
    stored = stack.dtype
    notes: list[str] = []
    used = {(t, s): stack[divmod(int(numbers[t, s]), stack.shape[1])] for t, s in np.argwhere(numbers >= 0).tolist()}
    if white is None and stored.kind == "u" and stored.itemsize <= 2:
        dtype, divisor, known = np.dtype(f"u{stored.itemsize}"), 1.0, list(used)
    else:
        ranges = {place: ends for place, view in used.items() if (ends := _range_of(source, place, view)) is not None}
        known = list(ranges)
        dtype, divisor, notes = _scale(source, stored, [used[place] for place in known], ranges, white)
    views: Array = np.zeros((*numbers.shape, *stack.shape[2:]), dtype)
    for place in known:
        values = used[place] if divisor == 1 else used[place] / divisor
        views[place] = np.rint(values) if divisor != 1 and dtype.kind == "u" else values
    return views, [place for place in used if place not in known], notes


def _scale(
    source: str, stored: np.dtype[Any], views: Sequence[Array], ranges: _Ranges, white: float | None
) -> tuple[np.dtype[Any], float, list[str]]:
    """Type of the views of a light field, the divisor of stored values, and the assumption that was made.

    For a given white, integers of few bits span the range of their type, other values are shares of white.
    """
    floats = stored.kind == "f"
    low = min((low for low, _ in ranges.values()), default=0.0)
    high = max((high for _, high in ranges.values()), default=0.0)
    if white is not None:
        bounds = (LOWEST * white, HIGHEST * white) if floats else (0.0, white)
        if low < bounds[0] or high > bounds[1]:
            raise _beyond(source, ranges, bounds, f"{bounds[0]:g} to {bounds[1]:g}, white being {white:g}")
        if floats or stored.itemsize > 2:
            return np.dtype(np.float32), white, []
        dtype = np.dtype(f"u{stored.itemsize}")
        return dtype, white / np.iinfo(dtype).max, []
    if floats and low >= LOWEST and high <= HIGHEST:
        return np.dtype(np.float32), 1.0, []
    whole = not floats or all((view == np.rint(view)).all() for view in views)
    for kind in _INTEGERS:
        most, dtype = np.iinfo(kind).max, np.dtype(kind)
        if low >= 0 and high <= most and (whole or high >= _LEAST_BRIGHTEST):
            word = "floats" if floats else stored.name
            note = f"{word} from {low:g} to {high:g} taken as {8 * dtype.itemsize} bit, white being {most}"
            return (dtype, 1.0, [note]) if whole else (np.dtype(np.float32), float(most), [note])
    bounds = (LOWEST, HIGHEST) if floats else (0, np.iinfo(_INTEGERS[-1]).max)
    expected = f"{'0..1, ' if floats else ''}0..255 or 0..65535; --white sets another white"
    raise _beyond(source, ranges, bounds, expected)


def _beyond(source: str, ranges: _Ranges, bounds: tuple[float, float], expected: str) -> SepiError:
    """Error that names the first view with values outside the bounds."""
    (t, s), (low, high) = next(one for one in ranges.items() if one[1][0] < bounds[0] or one[1][1] > bounds[1])
    return SepiError(f"{source}: view {t},{s} has values from {low:g} to {high:g}; expected within {expected}")


def _range_of(source: str, position: tuple[int, int], view: npt.NDArray[np.generic]) -> tuple[float, float] | None:
    """Least and greatest value of a view; None if all are NaN."""
    with np.errstate(invalid="ignore"):
        low, high = float(view.min()), float(view.max())
    if math.isfinite(low) and math.isfinite(high):
        return low, high
    if np.isnan(view).all():
        return None
    at = f"{position[0]},{position[1]}"
    raise SepiError(f"{source}: view {at} holds NaN or infinite values; repair it, or leave it out: --exclude {at}")


# possible orders of the axes; "N" is the number t * S + s of a view
_AXES = (("TS", "HW", "C"), ("TS", "HW"), ("N", "HW", "C"), ("N", "HW"))
_LAYOUTS = tuple("".join(order) for axes in _AXES for order in permutations(axes))
_MOST_AXES = 5
_AXES_HELP = "T, S: row and column of the view, or N: its number; H, W: of the pixel; C: colour"
_COLOURS = (1, 3, 4)
# a narrower axis is rather one of the grid than one of a view
_NARROW = 4
# most positions that a note lists
_LISTED = 12


class UnclearAxesError(SepiError):
    """The shape of an array does not tell which axis is which.

    Attributes
    ----------
    readings : tuple of str
        Orders of the axes that the shape allows, as in ``ReadOptions.axes``.
    """

    def __init__(self, source: str, shape: tuple[int, ...], readings: Sequence[str]) -> None:
        self.readings = tuple(readings)
        likely = readings or ["TSHWC" if len(shape) == _MOST_AXES else "TSHW"]
        super().__init__(
            f"{source}: the shape {shape} does not tell which axis is which; say it with --axes, such as "
            f"{' or '.join(f'--axes {letters}' for letters in likely)} ({_AXES_HELP})"
        )


def light_field_from_array(array: Array, path: Path, options: ReadOptions, *, axes: str | None = None) -> LightField:
    """Light field from an array of all its views.

    Views of only zeros, or only NaN, are taken as missing, unless all views are: software of light field cameras pads
    the corners of the grid with zeros. A fourth channel, transparency or a weight, is left out.

    Parameters
    ----------
    array : ndarray of 3 to 5 axes, integers or floats
        uint8 and uint16 span their whole range, floats 0..1. Other types hold 0..255 or 0..65535, as 8 or 16 bit.
        Leading axes of size 1 are dropped.
    path : Path
        File of the array: name and source of the light field.
    options : ReadOptions
        ``axes``, ``grid``, ``central``, ``order``, ``exclude``, ``view`` and ``white`` are used.
    axes : str, optional
        Order of the axes if the format fixes it; default: ``options.axes``, or guessed from the shape.

    Returns
    -------
    LightField
        Views uint8, uint16 or float32 at their positions, zero where missing. They stay in one row if they have a
        single axis and no grid is given.

    Raises
    ------
    UnclearAxesError
        If several orders of the axes are equally likely.
    SepiError
        If the axes contradict the options, the values are of another type or range, or a view that is not excluded
        holds values that are not finite.
    """
    source = str(path)
    if array.dtype.kind not in "iuf" or array.dtype.itemsize > 8:
        raise SepiError(f"{source}: values of type {array.dtype}; expected integers such as uint8, or floats in 0..1")
    given = axes or options.axes
    if given is not None and path.suffix.lower() == ".mat":
        # MATLAB drops axes of size 1 at the end
        array = array.reshape(*array.shape, *[1] * (min(len(given), 5) - array.ndim))
    letters = _found_axes(source, array.shape, options.grid) if given is None else _checked_axes(source, array, given)
    # drop a batch axis of size 1
    array = array.reshape(array.shape[array.ndim - len(letters) :])
    stack, channel_notes = _as_stack(source, array, letters, options.grid)
    arranged = "N" not in letters or options.grid is not None
    if not arranged:
        options = unarranged(options)
    numbers = arrange_numbers(source, stack.shape[:2], options)
    # excluded views may hold any values
    views, unknown, assumptions = _scaled(source, stack, numbers, options.white)
    present: BoolMap = np.any(views, axis=(2, 3, 4))
    black = [(t, s) for t, s in np.argwhere((numbers >= 0) & ~present).tolist() if (t, s) not in unknown]
    if black and not present.any():
        # if all views are black, none is taken as missing
        present[tuple(zip(*black, strict=True))] = True
        black = []
    reference = options.view or (numbers.shape[0] // 2, numbers.shape[1] // 2)
    if arranged and reference in [*black, *unknown]:
        t, s = reference
        raise SepiError(f"{source}: view {t},{s}, whose depth is made, is black or NaN; choose another by --view")
    assumed = [] if given else [f"axes taken as {' '.join(letters)}; --axes sets them otherwise"]
    missing = [*_missing_notes("all zeros", black), *_missing_notes("NaN throughout", unknown)]
    notes = (*assumed, *channel_notes, *assumptions, *missing)
    return LightField(views, path.stem, source, present, view=options.view, notes=notes, arranged=arranged)


def with_white(views: Array, present: BoolMap, path: Path, white: float) -> Array:
    """Views (T, S, H, W, C) scaled so that ``white`` becomes the white of their type."""
    return _scaled(str(path), views, np.where(present, np.arange(present.size).reshape(present.shape), -1), white)[0]


def _checked_axes(source: str, array: Array, text: str) -> str:
    letters = text.upper()
    if sorted(letters) not in map(sorted, _LAYOUTS):
        raise SepiError(f"{source}: --axes {text}: expected T, S, H and W once each, C for colours ({_AXES_HELP})")
    spare = array.ndim - len(letters)
    if spare < 0 or prod(array.shape[:spare]) != 1:
        raise SepiError(f"{source}: --axes {text} names {len(letters)} axes, the array has {array.ndim}: {array.shape}")
    return letters


def _found_axes(source: str, shape: tuple[int, ...], grid: tuple[int, int] | None) -> str:
    """Order of the axes that the shape suggests."""
    found = readings(shape, grid)
    if len(found) == 1:
        return found[0]
    if not found and not is_likely(shape):
        raise SepiError(f"{source}: expected an array of views, of 4 or 5 axes, got {len(shape)}: {shape}")
    raise UnclearAxesError(source, shape, found)


def is_likely(shape: tuple[int, ...]) -> bool:
    """Whether an array has the number of axes of a light field; three axes with colours are one image."""
    axes = len(_without_batch(shape))
    return axes in (4, 5) or (axes == 3 and bool(readings(shape)))


def _without_batch(shape: tuple[int, ...]) -> tuple[int, ...]:
    """Shape without leading axes of size 1: a batch, or a single row of views."""
    while len(shape) > len("TSHW") and shape[0] == 1:
        shape = shape[1:]
    return shape


def readings(shape: tuple[int, ...], grid: tuple[int, int] | None = None) -> list[str]:
    """Orders of the axes that the sizes allow: a grid is smaller than a view, colours are 1, 3 or 4.

    An axis of 1, 3 or 4 may be colours or part of the grid; then both orders are given.
    """
    shape = _without_batch(shape)
    sizes = [dict(zip(axes, shape, strict=True)) for axes in _LAYOUTS if len(axes) == len(shape)]
    sizes = [size for size in sizes if size.get("C", 1) in _COLOURS]
    grids = [size for size in sizes if "T" in size and _is_small(size) and ("C" in size or 1 not in shape)]
    rows = [size for size in sizes if size.get("N", 1) > 1 and min(size["H"], size["W"]) > _NARROW]
    if len(shape) == len("NHW"):
        # an axis of colours makes it one image
        rows = [size for size in rows if size["N"] not in _COLOURS]
    # views are larger than the grid; else prefer an order with colours, or a square number of views
    coloured = [size for size in rows if "C" in size]
    first = [size for size in coloured if size["N"] == shape[0]]
    squares = [size for size in coloured if size["N"] % 2 and isqrt(size["N"]) ** 2 == size["N"]]
    unclear = first if any(size in squares for size in first) else first + squares
    rows = [size for size in rows if _is_small(size)] or unclear or rows
    both = (*grids, *rows)
    found = [size for size in both if grid in (None, (size.get("T"), size.get("S"))) or prod(grid) == size.get("N")]
    return ["".join(size) for size in found or both]


def _is_small(size: dict[str, int]) -> bool:
    """Whether the axes of the grid are clearly smaller than those of a view."""
    return 2 * max(size.get(axis, 1) for axis in "TSN") <= min(size["H"], size["W"])


def _as_stack(source: str, array: Array, letters: str, grid: tuple[int, int] | None) -> tuple[Array, list[str]]:
    """Array as views (T, S, H, W, C), without a copy, and the assumptions."""
    size = dict(zip(letters, array.shape, strict=True))
    if 0 in array.shape:
        raise SepiError(f"{source}: the array is empty: {array.shape}")
    if size.setdefault("C", 1) not in _COLOURS:
        raise SepiError(f"{source}: the axis of colours (axes {letters}) has size {size['C']}; expected 1, 3 or 4")
    notes = ["4th channel (transparency or weight) left out"] if size["C"] == 4 else []
    if "N" in letters and grid is None:
        grid = 1, size["N"]
    elif "N" not in letters and grid not in (None, (size["T"], size["S"])):
        raise SepiError(f"{source}: --grid {grid[0]}x{grid[1]}, but the array has {size['T']}x{size['S']} views")
    rows, columns = grid or (size["T"], size["S"])
    if rows * columns != size.get("N", rows * columns):
        raise SepiError(f"{source}: {size['N']} views make no grid of {rows}x{columns}; --grid ROWSxCOLUMNS sets it")
    views = array.transpose([letters.index(letter) for letter in "NTSHWC" if letter in letters])
    views = views.reshape(rows, columns, size["H"], size["W"], size["C"])
    # drop the fourth channel
    return views[..., :3], notes


def _missing_notes(what: str, positions: Sequence[tuple[int, int]]) -> list[str]:
    listed = " ".join(f"{t},{s}" for t, s in positions[:_LISTED])
    more = f" and {len(positions) - _LISTED} more" if len(positions) > _LISTED else ""
    return [f"views that are {what} taken as missing: {listed}{more}"] if positions else []
