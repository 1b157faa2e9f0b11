"""Images of maps: colours and grey levels for people, 16-bit grey levels for programs.

docs/reference/outputs.md describes them.
"""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import numpy.typing as npt

from sepi.io.images import write_png
from sepi.lightfield import BoolMap, FloatMap
from sepi.validation import require_map

Picture = npt.NDArray[np.uint8]

BEYOND = 0.005
"""Share of pixels beyond each end of a colour scale, so that a few outliers do not compress it."""

# not a colour of the scale
_GREY = 128
_FORMULA = "disparity = (value - 1) * scale + offset; value 0: not finite"
_STEPS = "pixels per view step"


def colour_code(values: FloatMap, unknown: BoolMap | None = None) -> Picture:
    """Map in perceptually uniform colours, from dark blue (least) to yellow (greatest).

    Parameters
    ----------
    values : ndarray, shape (H, W), float32
        Disparity, or any other map. The colours span its values except half a percent at either end.
    unknown : ndarray, shape (H, W), bool, optional
        Pixels shown grey and not counted in the colour scale.

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
    # unknown pixels do not count in the scale
    counted = finite if unknown is None else finite & ~unknown
    return in_colours(np.where(finite, spread(values, counted), np.nan), unknown)


def spread(values: FloatMap, counted: BoolMap) -> npt.NDArray[np.floating[Any]]:
    """Map scaled so that 0..1 spans the ``counted`` values, except a few outliers."""
    low, high = np.quantile(values[counted], (BEYOND, 1 - BEYOND)) if counted.any() else (0.0, 0.0)
    # a constant map becomes 0.5
    return (values - low) / (high - low) if high > low else np.full(values.shape, 0.5)


def in_colours(unit: npt.NDArray[np.floating[Any]], unknown: BoolMap | None = None) -> Picture:
    """0..1 as RGB from dark blue to yellow; grey where ``unknown`` is set, black where not finite."""
    colours = np.asarray(cv2.applyColorMap(levels(unit), cv2.COLORMAP_VIRIDIS), np.uint8)[:, :, ::-1].copy()
    if unknown is not None:
        colours[unknown] = _GREY
    colours[~np.isfinite(unit)] = 0
    return colours


def levels(unit: npt.NDArray[np.floating[Any]]) -> Picture:
    """0..1 as 0..255; 0 where not finite."""
    return np.asarray(np.rint(255 * np.clip(np.nan_to_num(unit, posinf=0, neginf=0), 0, 1)), np.uint8)


def write_16bit(path: Path, disparity: FloatMap) -> None:
    """Write disparity as 16-bit grey levels: 0 where it is not finite, 1 to 65535 from its least to its greatest."""
    finite = np.isfinite(disparity)
    values = disparity[finite].astype(np.float64)
    low, high = (float(values.min()), float(values.max())) if values.size else (0.0, 0.0)
    scale = (high - low) / 65534 if high > low else 1.0
    levels = np.zeros(disparity.shape, np.uint16)
    levels[finite] = np.rint((values - low) / scale) + 1
    write_png(path, levels, {"Description": _FORMULA, "scale": repr(scale), "offset": repr(low), "units": _STEPS})


# a scale of less than a decade would exaggerate the differences of an almost constant map
_LEAST_SPAN = 10.0
_FONT = cv2.FONT_HERSHEY_SIMPLEX
# pixels, at this height of the image; letters grow with the square root of the height
_LEAST_HEIGHT, _BAR, _GAP, _LETTERS = 160, 14, 8, 0.4
_TITLE = "px / view step"


def sigma_picture(sigma: FloatMap, unknown: BoolMap | None = None) -> Picture:
    """Standard deviation in colours on a logarithmic scale, dark blue (least) to yellow (greatest), and the scale.

    Parameters
    ----------
    sigma : ndarray, shape (H, W), float32
        Pixels per view step. The colours span its values except half a percent at either end, and at least a decade.
    unknown : ndarray, shape (H, W), bool, optional
        Pixels shown grey and not counted in the scale.

    Returns
    -------
    ndarray, shape (at least H, more than W, 3), uint8
        RGB; the map at the upper left, black where not finite, and on its right a bar with numbers.
    """
    finite = np.isfinite(sigma)
    counted = finite & (sigma > 0)
    if unknown is not None:
        counted &= ~unknown
    shown = sigma[counted].astype(np.float64)
    least, most = np.quantile(shown, (BEYOND, 1 - BEYOND)) if shown.size else (0.01, 0.01)
    wider = math.sqrt(max(1.0, _LEAST_SPAN / float(most / least)))
    low, high = float(least) / wider, float(most) * wider
    with np.errstate(divide="ignore", invalid="ignore"):
        unit = np.log(sigma / np.float32(low)) / np.float32(math.log(high / low))
    return _beside_scale(in_colours(np.where(finite, np.clip(unit, 0, 1), np.nan), unknown), low, high)


def _beside_scale(colours: Picture, low: float, high: float) -> Picture:
    """Image with its colour scale on the right, on white."""
    height, width = colours.shape[:2]
    total = max(height, _LEAST_HEIGHT)
    size = math.sqrt(total / _LEAST_HEIGHT)
    bar, gap, letters, thick = round(_BAR * size), round(_GAP * size), _LETTERS * size, max(1, round(size / 2))
    (title_width, line), _ = cv2.getTextSize(_TITLE, _FONT, letters, thick)
    picture = np.full((total, width + 2 * gap + max(title_width, 4 * bar) + gap, 3), 255, np.uint8)
    picture[:height, :width] = colours
    left, top, bottom = width + 2 * gap, 2 * gap + line, total - 2 * gap
    rows = bottom - top
    ramp = np.linspace(1, 0, rows, dtype=np.float32)[:, None]
    picture[top:bottom, left : left + bar] = np.broadcast_to(in_colours(ramp), (rows, bar, 3))

    def write(text: str, x: int, y: int) -> None:
        cv2.putText(picture, text, (x, y), _FONT, letters, (0, 0, 0), thick, cv2.LINE_AA)

    write(_TITLE, left, gap + line)
    for value in _ticks(low, high, most=max(2, rows // (2 * line))):
        row = top + round((rows - 1) * (1 - math.log(value / low) / math.log(high / low)))
        picture[row - thick + 1 : row + 1, left : left + bar + gap // 2] = 0
        write(f"{value:g}", left + bar + gap, min(max(row + line // 2, top + line // 2), bottom))
    return picture


def _ticks(low: float, high: float, most: int) -> list[float]:
    """Round numbers within the scale: powers of ten, with 3, or 2 and 5, times them if there is room."""
    powers = range(math.floor(math.log10(low)), math.ceil(math.log10(high)) + 1)
    ticks: list[float] = []
    for digits in ((1,), (1, 3), (1, 2, 5)):
        # parsed from text, since a product would have rounding errors
        values = [float(f"{digit}e{power}") for power in powers for digit in digits]
        within = [value for value in values if low <= value <= high]
        if not ticks or len(within) <= most:
            ticks = within
    return ticks
