"""Pictures of a map: levels and colours for people, 16-bit grey levels for programs.

docs/reference/outputs.md describes them.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import cv2
import numpy as np
import numpy.typing as npt

from sepi.io.images import write_png
from sepi.lightfield import BoolMap, FloatMap, as_unit_float
from sepi.validation import require_map

Picture = npt.NDArray[np.uint8]

BEYOND = 0.005
"""Part of the pixels beyond each end of a colour scale, so that a few wrong pixels do not use it up."""

# none of the colours of the scale
_GREY = 128


def colour_code(values: FloatMap, unknown: BoolMap | None = None) -> Picture:
    """A map in perceptually uniform colours, from dark blue (least) to yellow (greatest).

    Parameters
    ----------
    values : ndarray, shape (H, W), float32
        Disparity, or anything else. The colours span its values but for half a percent at either end.
    unknown : ndarray, shape (H, W), bool, optional
        Pixels to be shown grey, which take no part of the colour scale.

    Returns
    -------
    ndarray, shape (H, W, 3), uint8
        RGB; black where a value is not finite.

    Examples
    --------
    >>> import numpy as np
    >>> from sepi.io.map_pictures import colour_code
    >>> picture = colour_code(np.array([[0, 1, np.nan, 9]], np.float32), np.array([[False, False, False, True]]))
    >>> picture[0, 0].tolist(), picture[0, 1].tolist()  # dark blue, yellow
    ([68, 1, 84], [253, 231, 37])
    >>> picture[0, 2].tolist(), picture[0, 3].tolist()
    ([0, 0, 0], [128, 128, 128])
    """
    require_map("map to colour", values)
    finite = np.isfinite(values)
    # what is unknown takes no part of the scale
    counted = finite if unknown is None else finite & ~unknown
    return in_colours(np.where(finite, _spread(values, counted), np.nan), unknown)


def colour_and_depth(picture: npt.NDArray[np.generic], disparity: FloatMap, unknown: BoolMap) -> Picture:
    """The view and, beside it, its disparity from far, black, to near, white: RGB (H, 2 W, 3), as displays take it."""
    colours = np.broadcast_to(levels(as_unit_float(picture)), (*disparity.shape, 3))
    depth = levels(_spread(disparity, ~unknown & np.isfinite(disparity)))
    return np.hstack([colours, np.repeat(depth[:, :, None], 3, axis=2)])


def _spread(values: FloatMap, counted: BoolMap) -> npt.NDArray[np.floating[Any]]:
    """A map as 0..1, which span what is counted of it, but for a few pixels."""
    low, high = np.quantile(values[counted], (BEYOND, 1 - BEYOND)) if counted.any() else (0.0, 0.0)
    # a constant map gets the middle
    return (values - low) / (high - low) if high > low else np.full(values.shape, 0.5)


def in_colours(unit: npt.NDArray[np.floating[Any]], unknown: BoolMap | None = None) -> Picture:
    """0..1 as RGB from dark blue to yellow; grey where ``unknown`` is set, black where not finite."""
    colours = np.asarray(cv2.applyColorMap(levels(unit), cv2.COLORMAP_VIRIDIS), np.uint8)[:, :, ::-1].copy()
    if unknown is not None:
        colours[unknown] = _GREY
    colours[~np.isfinite(unit)] = 0
    return colours


def levels(unit: npt.NDArray[np.floating[Any]]) -> Picture:
    """0..1 as 0..255; not finite as 0."""
    known = np.nan_to_num(unit, posinf=0, neginf=0)
    return np.asarray(np.rint(255 * np.clip(known, 0, 1)), np.uint8)


def write_16bit(path: Path, disparity: FloatMap) -> None:
    """Write disparity as 16-bit grey levels: 0 where it is not finite, 1 to 65535 from its least to its greatest."""
    finite = np.isfinite(disparity)
    values = disparity[finite].astype(np.float64)
    low, high = (float(values.min()), float(values.max())) if values.size else (0.0, 0.0)
    scale = (high - low) / 65534 if high > low else 1.0
    levels = np.zeros(disparity.shape, np.uint16)
    levels[finite] = np.rint((values - low) / scale) + 1
    write_png(
        path,
        levels,
        {
            "Description": "disparity = (value - 1) * scale + offset; value 0: unknown",
            "scale": repr(scale),
            "offset": repr(low),
            "units": "pixels per view step",
        },
    )
