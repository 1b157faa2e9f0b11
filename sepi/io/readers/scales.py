"""What white is in an array of views."""

from __future__ import annotations

import math
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


@dataclass(frozen=True)
class Scale:
    """How the values of an array become those of a light field.

    Attributes
    ----------
    dtype : dtype
        uint8, uint16 or float32.
    divisor : float
        Value that stands for 1; 1 for integers.
    notes : tuple of str
        What was assumed.
    """

    dtype: np.dtype[Any]
    divisor: float = 1.0
    notes: tuple[str, ...] = ()


def scale_of(source: str, stack: npt.NDArray[np.generic], numbers: Numbers) -> Scale:
    """The scale of views.

    Parameters
    ----------
    source : str
        For messages.
    stack : ndarray, shape (T, S, H, W, C), integers or floats
        Views of the given grid, in any byte order.
    numbers : ndarray, int64
        Number ``t * S + s`` in that grid of the views that are used, by their own positions; -1 for none.

    Raises
    ------
    SepiError
        If a view that is used holds some floats that are not finite, or values beyond every scale.
    """
    floats = stack.dtype.kind == "f"
    if stack.dtype.kind == "u" and stack.dtype.itemsize <= 2:
        return Scale(np.dtype(f"u{stack.dtype.itemsize}"))
    ranges, whole = {}, True
    for t, s in np.argwhere(numbers >= 0).tolist():
        view = stack[divmod(int(numbers[t, s]), stack.shape[1])]
        values = _range_of(source, (t, s), view)
        if values is not None:
            ranges[t, s] = values
            whole = whole and (not floats or bool((view == np.rint(view)).all()))
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
    least, most = (LOWEST, HIGHEST) if floats else (0, np.iinfo(_INTEGERS[-1]).max)
    position, (low, high) = next(
        (position, values) for position, values in ranges.items() if values[0] < least or values[1] > most
    )
    raise SepiError(
        f"{source}: view {position[0]},{position[1]} has values from {low:g} to {high:g}; expected within "
        f"{'0..1, ' if floats else ''}0..255 or 0..65535, so divide them by their full scale, or store uint8 or uint16"
    )


def _range_of(source: str, position: tuple[int, int], view: npt.NDArray[np.generic]) -> tuple[float, float] | None:
    """The least and the greatest value of a view; None where it is NaN throughout."""
    with np.errstate(invalid="ignore"):
        low, high = float(view.min()), float(view.max())
    if math.isfinite(low) and math.isfinite(high):
        return low, high
    if np.isnan(view).all():
        return None
    at = f"{position[0]},{position[1]}"
    raise SepiError(
        f"{source}: view {at} holds values that are not finite (NaN or infinite); mend it, or leave it out with "
        f"--exclude {at}"
    )
