"""Pictures of the kinds PGM and PPM, as bytes or as digits."""

from __future__ import annotations

import re
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from sepi.errors import SepiError

_GAP = rb"(?:\s|#[^\n]*\n)++"
_HEADER = re.compile(rb"P([2356])" + _GAP + rb"([0-9]{1,9})" + _GAP + rb"([0-9]{1,9})" + _GAP + rb"([0-9]{1,5})\s")


class PnmForm(NamedTuple):
    """The header of a PGM or PPM: size, channels, value of white, whether digits follow, and where the pixels begin."""

    height: int
    width: int
    channels: int
    white: int
    digits: bool
    start: int


def pnm_form(head: bytes, size: int) -> PnmForm:
    """Parse the first bytes of a file of ``size`` bytes.

    Raises
    ------
    SepiError
        If they are no header, or the file cannot hold the pixels.
    """
    match = _HEADER.match(head)
    if match is None:
        raise SepiError("damaged PNM: expected 'P5 WIDTH HEIGHT WHITE' or 'P6 WIDTH HEIGHT WHITE' and the pixels")
    kind, width, height, white = map(int, match.groups())
    if not 1 <= white <= 65535:
        raise SepiError(f"damaged PNM: expected a value of white of 1 to 65535, got {white}")
    form = PnmForm(height, width, 1 if kind in (2, 5) else 3, white, kind in (2, 3), match.end())
    values = height * width * form.channels
    if form.start + (2 * values - 1 if form.digits else values * (1 if white < 256 else 2)) > size:
        raise SepiError(f"damaged PNM: the file is cut off after {size} bytes")
    return form


def pnm_pixels(data: bytes) -> npt.NDArray[np.unsignedinteger]:
    """Pixels (H, W, C), uint8 or uint16, over the whole range of their type."""
    height, width, channels, white, digits, start = pnm_form(data, len(data))
    kind = np.dtype("u1" if white < 256 else "u2")
    count, full = height * width * channels, int(np.iinfo(kind).max)
    if digits:
        values = np.fromstring(data[start:], np.int64, sep=" ")[:count]
    else:
        values = np.frombuffer(data, kind.newbyteorder(">"), count, start)
    if len(values) < count:
        raise SepiError("damaged PNM, perhaps cut off: its pixels cannot be decoded")
    if values.max() > white or values.min() < 0:
        raise SepiError(f"damaged PNM: a value of {values.max()}, but white is {white}")
    scaled = values if white == full else np.rint(values * (full / white))
    return scaled.astype(kind).reshape(height, width, channels)
