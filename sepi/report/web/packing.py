"""Maps as text small enough for a page: whole steps, predicted from their neighbours, deflated, in base64.

A browser undoes it with what it has: base64, ``DecompressionStream("deflate")``, and a loop over the pixels
(``templates/unpack.js``). Values are whole multiples of a step that the map names, so a page shows exactly the value
that the map holds, rounded to that step. The predictor is the median of the left neighbour, the upper one, and their
sum less the upper left one (median edge detection, as in JPEG-LS [1]_). What it misses is small where the neighbours
agree and large where they do not: residuals are grouped by how much the neighbours differ, so that each group gets a
code of its own.

References
----------
.. [1] Weinberger, Seroussi, Sapiro: The LOCO-I lossless image compression algorithm. IEEE Transactions on Image
   Processing 9(8), 2000. doi:10.1109/83.855427
"""

from __future__ import annotations

import base64
import zlib
from typing import Any

import numpy as np
import numpy.typing as npt

from sepi.lightfield import BoolMap, FloatMap

Levels = npt.NDArray[np.int32]

# differences between the neighbours, in steps, from which a pixel belongs to the next class
_ACTIVITIES = (1, 2, 3, 5, 9, 17, 33)

# largest number of levels that two bytes tell apart, one of them being the unknown
_LEVELS = 2**16 - 1
# largest whole number of steps that is counted exactly
_LARGEST = 2**52


def packed_map(values: FloatMap, step: float) -> dict[str, Any]:
    """A map, rounded to whole steps.

    Parameters
    ----------
    values : ndarray, shape (H, W), float
        Values that are not finite are unknown.
    step : float
        Grows tenfold, or by more such factors, where 65533 steps do not span the values.

    Returns
    -------
    dict
        ``step``; ``base``, the level of the smallest value; ``starts``, where the residuals of each class begin;
        ``data``: base64 of the deflated residuals.
    """
    step = _wide_enough(values, step)
    levels, base = _levels(values, step)
    residuals, starts = _in_classes(levels)
    return {"step": step, "base": base, "starts": starts, "data": _text(_planes(residuals))}


def packed_mask(mask: BoolMap) -> dict[str, Any]:
    """A mask (H, W), eight pixels a byte, row after row without gaps."""
    return {"data": _text(np.packbits(mask.ravel()).tobytes())}


def packed_size(values: FloatMap, step: float) -> int:
    """How many characters :func:`packed_map` takes at most."""
    levels, _ = _levels(values, _wide_enough(values, step))
    return len(_deflated(_planes(_in_classes(levels)[0]), zlib.Z_RLE)) * 4 // 3


def _wide_enough(values: FloatMap, step: float) -> float:
    known = values[np.isfinite(values)]
    if known.size == 0:
        return step
    low, high = float(known.min()), float(known.max())
    while (high - low) / step > _LEVELS - 2 or max(-low, high) / step > _LARGEST:
        step *= 10
    return step


def _levels(values: FloatMap, step: float) -> tuple[Levels, int]:
    """Levels counted from 1, with 0 for unknown, and what level 1 stands for."""
    known = np.isfinite(values)
    # 1 / step is a whole number for the usual steps, and so exact
    whole = np.rint(np.where(known, values, 0).astype(np.float64) * (1 / step)).astype(np.int64)
    base = int(whole[known].min()) if known.any() else 0
    return np.where(known, whole - base + 1, 0).astype(np.int32), base


def _in_classes(levels: Levels) -> tuple[npt.NDArray[np.uint16], list[int]]:
    """Residuals, those of equal class one after the other, and where each class begins."""
    left, up, corner, ahead = np.zeros((4, *levels.shape), np.int32)
    left[:, 1:] = levels[:, :-1]
    up[1:] = levels[:-1]
    corner[1:, 1:] = levels[:-1, :-1]
    ahead[1:, :-1] = levels[:-1, 1:]
    low, high = np.minimum(left, up), np.maximum(left, up)
    missed = (levels - np.clip(left + up - corner, low, high)).astype(np.int16)
    # signs folded in: 0, -1, 1, -2, ... become 0, 1, 2, 3, ... modulo 2^16
    folded = ((missed.astype(np.int32) << 1) ^ (missed >> 15)).astype(np.uint16)
    activity = np.abs(left - corner) + np.abs(up - corner) + np.abs(up - ahead)
    classes = np.searchsorted(_ACTIVITIES, activity.ravel(), side="right").astype(np.uint8)
    counts = np.bincount(classes, minlength=len(_ACTIVITIES) + 1)
    return folded.ravel()[np.argsort(classes, kind="stable")], [0, *np.cumsum(counts)[:-1].tolist()]


def _planes(residuals: npt.NDArray[np.uint16]) -> bytes:
    """All low bytes, then all high ones, which are mostly zero."""
    return (residuals & 255).astype(np.uint8).tobytes() + (residuals >> 8).astype(np.uint8).tobytes()


def _text(data: bytes) -> str:
    # noisy residuals do not repeat, and runs alone serve them better, thirty times as fast as the highest level
    deflated = min(_deflated(data, zlib.Z_RLE), _deflated(data, zlib.Z_DEFAULT_STRATEGY), key=len)
    return base64.b64encode(deflated).decode("ascii")


def _deflated(data: bytes, strategy: int) -> bytes:
    compressor = zlib.compressobj(6, zlib.DEFLATED, zlib.MAX_WBITS, zlib.DEF_MEM_LEVEL, strategy)
    return compressor.compress(data) + compressor.flush()
