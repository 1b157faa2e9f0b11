"""Bands of picture rows, which bound the memory of steps that need all views at once.

A row of the reference view appears in rows of the other views no farther away than the largest disparity times the
longest baseline. The arrays of the views' rows (detail, splines, z-buffers) do not depend on where a band begins, so
results are the same for any number of bands.
"""

import math
from itertools import pairwise
from typing import NamedTuple

from sepi.lightfield import BoolMap, LightField
from sepi.process.workspace import band_bytes_of

FEWEST_ROWS = 16
"""Of a band, however little memory there is."""


class Rows(NamedTuple):
    """Rows ``low..high`` of the views."""

    low: int
    high: int


class Band(NamedTuple):
    """Rows ``begin..end`` of the reference view, and those of the other views that they may be seen in."""

    begin: int
    end: int
    rows: Rows


def row_bands(
    light_field: LightField,
    present: BoolMap,
    reach: float,
    bytes_per_pixel: int,
    beside: int = 0,
    most_bytes: float = math.inf,
) -> list[Band]:
    """The bands in which a light field is processed.

    Parameters
    ----------
    light_field : LightField
    present : ndarray, shape (T, S), bool
        The views that are compared.
    reach : float
        Largest absolute disparity, pixels per view step.
    bytes_per_pixel : int
        Memory for each pixel of each view of a band.
    beside : int
        Rows above and below a band that its computation reads.
    most_bytes : float
        For a band, even where there is more memory.

    Returns
    -------
    list of Band
        From the top to the bottom; one if all fits.
    """
    height, width = light_field.shape
    moved = _rows_moved(light_field, present, reach) + beside
    memory = min(band_bytes_of(light_field), most_bytes)
    fitting = int(memory // max(1, bytes_per_pixel * width * int(present.sum())))
    number = 1 if fitting >= height else math.ceil(height / max(FEWEST_ROWS, fitting - 2 * moved))
    ends = [round(height * i / number) for i in range(number + 1)]
    return [Band(begin, end, Rows(max(0, begin - moved), min(height, end + moved))) for begin, end in pairwise(ends)]


def least_band_bytes(light_field: LightField, bytes_per_pixel: int) -> int:
    """Upper bound on the bytes of the narrowest bands; the disparity range must be known."""
    known = light_field.require_disparity_range()
    moved = _rows_moved(light_field, light_field.present, max(abs(known.minimum), abs(known.maximum)))
    height, width = light_field.shape
    rows = min(height, FEWEST_ROWS + 2 * moved)
    return bytes_per_pixel * rows * width * int(light_field.present.sum())


def _rows_moved(light_field: LightField, present: BoolMap, reach: float) -> int:
    """Largest shift of a pixel in rows, with the reach of its sample."""
    return math.ceil(reach * float(abs(light_field.baselines[present][:, 0]).max(initial=0.0))) + 2
