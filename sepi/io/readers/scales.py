"""What white is in an array of views."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from sepi.errors import SepiError
from sepi.io.readers.options import Numbers
from sepi.lightfield import HIGHEST, LOWEST

# integers that values of other types may stand for, and the least brightest value of floats that are not whole: below
# that it is rather 1 that is exceeded
_INTEGERS = (np.uint8, np.uint16)
_LEAST_BRIGHTEST = 16

_Ranges = Mapping[tuple[int, int], tuple[float, float]]


@dataclass(frozen=True)
class Scale:
    """How the values of an array become those of a light field.

    Attributes
    ----------
    dtype : dtype
        uint8, uint16 or float32.
    divisor : float
        What values are divided by: for floats the value that stands for 1.
    notes : tuple of str
        What was assumed.
    """

    dtype: np.dtype[Any]
    divisor: float = 1.0
    notes: tuple[str, ...] = ()


def scale_of(source: str, stack: npt.NDArray[np.generic], numbers: Numbers, white: float | None = None) -> Scale:
    """The scale of views.

    Parameters
    ----------
    source : str
        For messages.
    stack : ndarray, shape (T, S, H, W, C), integers or floats
        Views of the given grid, in any byte order.
    numbers : ndarray, int64
        Number ``t * S + s`` in that grid of the views that are used, by their own positions; -1 for none.
    white : float, optional
        Value that stands for white; found out unless given.

    Raises
    ------
    SepiError
        If a view that is used holds some floats that are not finite, or values beyond every scale.
    """
    floats = stack.dtype.kind == "f"
    if white is None and stack.dtype.kind == "u" and stack.dtype.itemsize <= 2:
        return Scale(np.dtype(f"u{stack.dtype.itemsize}"))
    ranges, whole = {}, True
    for t, s in np.argwhere(numbers >= 0).tolist():
        view = stack[divmod(int(numbers[t, s]), stack.shape[1])]
        values = _range_of(source, (t, s), view)
        if values is not None:
            ranges[t, s] = values
            whole = whole and (not floats or bool((view == np.rint(view)).all()))
    if white is not None:
        return _given(source, stack.dtype, ranges, white)
    low = min((low for low, _ in ranges.values()), default=0.0)
    high = max((high for _, high in ranges.values()), default=0.0)
    if floats and low >= LOWEST and high <= HIGHEST:
        return Scale(np.dtype(np.float32))
    for kind in _INTEGERS:
        white, dtype = np.iinfo(kind).max, np.dtype(kind)
        if low >= 0 and high <= white and (whole or high >= _LEAST_BRIGHTEST):
            word = "floats" if floats else stack.dtype.name
            note = f"{word} from {low:g} to {high:g} taken as {8 * dtype.itemsize} bit, white being {white}"
            return Scale(dtype if whole else np.dtype(np.float32), 1.0 if whole else float(white), (note,))
    bounds = (LOWEST, HIGHEST) if floats else (0, np.iinfo(_INTEGERS[-1]).max)
    expected = f"{'0..1, ' if floats else ''}0..255 or 0..65535; --white says what white is elsewhere"
    raise _beyond(source, ranges, bounds, expected)


def _given(source: str, kind: np.dtype[Any], ranges: _Ranges, white: float) -> Scale:
    """Narrow integers over their whole range, as pictures of few bits are stored; others as parts of white."""
    whole = kind.kind in "iu"
    bounds = (0.0, white) if whole else (LOWEST * white, HIGHEST * white)
    if any(low < bounds[0] or high > bounds[1] for low, high in ranges.values()):
        raise _beyond(source, ranges, bounds, f"{bounds[0]:g} to {bounds[1]:g}, white being {white:g}")
    if whole and kind.itemsize <= 2:
        dtype = np.dtype(f"u{kind.itemsize}")
        return Scale(dtype, white / np.iinfo(dtype).max)
    return Scale(np.dtype(np.float32), white)


def _beyond(source: str, ranges: _Ranges, bounds: tuple[float, float], expected: str) -> SepiError:
    """The error that names the first view with values beyond some bounds."""
    beyond = {place: ends for place, ends in ranges.items() if ends[0] < bounds[0] or ends[1] > bounds[1]}
    (t, s), (low, high) = next(iter(beyond.items()))
    return SepiError(f"{source}: view {t},{s} has values from {low:g} to {high:g}; expected within {expected}")


def _range_of(source: str, position: tuple[int, int], view: npt.NDArray[np.generic]) -> tuple[float, float] | None:
    """The least and the greatest value of a view; None where it is NaN throughout."""
    with np.errstate(invalid="ignore"):
        low, high = float(view.min()), float(view.max())
    if math.isfinite(low) and math.isfinite(high):
        return low, high
    if np.isnan(view).all():
        return None
    at = f"{position[0]},{position[1]}"
    raise SepiError(f"{source}: view {at} holds NaN or infinite values; mend it, or leave it out with --exclude {at}")
