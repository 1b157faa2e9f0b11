"""Maps as short text for a page: whole steps, differences to the row above, deflated, in base64.

A browser unpacks them with base64, ``DecompressionStream("deflate")``, and a sum down the columns
(``templates/unpack.js``). Values are whole multiples of the map's step, so a page shows the map's value exactly rounded
to this step.
"""

from __future__ import annotations

import base64
import zlib
from typing import Any

import numpy as np
import numpy.typing as npt

# number of levels of two bytes, without the one for unknown
_LEVELS = 2**16 - 1
# largest exact whole number of steps
_LARGEST = 2**52


def packed(values: npt.NDArray[Any], step: float) -> dict[str, Any]:
    """A map or mask, rounded to whole steps.

    Parameters
    ----------
    values : ndarray, shape (H, W), float or bool
        Values that are not finite are unknown.
    step : float
        Step in the values' unit; it grows by factors of ten if 65533 steps do not span the values.

    Returns
    -------
    dict
        ``step``; ``base``: level of the smallest value; ``data``: base64 of the deflated differences.
    """
    known = np.isfinite(values)
    exact = np.where(known, values, 0).astype(np.float64)
    low, high = (float(exact[known].min()), float(exact[known].max())) if known.any() else (0.0, 0.0)
    while (high - low) / step > _LEVELS - 2 or max(-low, high) / step > _LARGEST:
        step *= 10
    # 1 / step is a whole number for the usual steps, and so exact
    whole = np.rint(exact * (1 / step)).astype(np.int64)
    base = round(low * (1 / step))
    # counted from 1, with 0 for unknown
    levels = np.where(known, whole - base + 1, 0).astype(np.uint16)
    # modulo 2^16, like the sum
    change = np.diff(levels, axis=0, prepend=np.zeros_like(levels[:1])).view(np.int16)
    # 0, -1, 1, -2, ... as 0, 1, 2, 3, ..., so that high bytes are mostly zero
    folded = ((change << 1) ^ (change >> 15)).view(np.uint16)
    planes = (folded & 255).astype(np.uint8).tobytes() + (folded >> 8).astype(np.uint8).tobytes()
    compressor = zlib.compressobj(6, strategy=zlib.Z_FILTERED)
    data = compressor.compress(planes) + compressor.flush()
    return {"step": step, "base": base, "data": base64.b64encode(data).decode("ascii")}
