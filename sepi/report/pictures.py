"""Pictures of maps, as RGB arrays."""

from __future__ import annotations

import base64
from collections.abc import Sequence
from functools import cache
from typing import Any

import cv2
import numpy as np
import numpy.typing as npt
from matplotlib import colormaps
from matplotlib.colors import Colormap, ListedColormap
from skimage.color import lab2rgb, rgb2lab

from sepi.lightfield import BoolMap, FloatMap, LightField
from sepi.report.panels import Panel

Picture = npt.NDArray[np.uint8]
"""RGB, (H, W, 3)."""

ERROR_LIMIT = 0.2
"""Error at the ends of the colour scale of all error maps, pixels per view step."""

SIGMA_LIMITS = (-3.0, 0.0)
"""Logarithms to base 10 of the standard deviations at the ends of their colour scale, pixels per view step."""

# least standard deviation on the scale
_LEAST = 1e-4

# ends of the scale of errors, too far and too near; colour-blind people can distinguish blue and red-brown
_FAR, _NEAR = (0, 62, 150), (150, 40, 0)

_UNKNOWN = (1.0, 0.0, 1.0)  # magenta is in none of the colour scales
_MASK = np.array([255, 64, 32], np.float32)
_OUTLINE = np.array([255, 220, 0], np.uint8)


@cache
def error_scale() -> ListedColormap:
    """Colours of signed errors, with lightness falling evenly from white in the middle to both ends (CIELAB)."""
    ends = rgb2lab(np.array([_FAR, _NEAR], np.float64) / 255)
    white = np.array([100.0, 0.0, 0.0])
    share = np.linspace(0, 1, 128)[:, None]
    half = [white + share * (end - white) for end in ends]
    # the middle occurs once, so that zero is exactly white
    return ListedColormap(np.clip(lab2rgb(np.concatenate([half[0][::-1], half[1][1:]])), 0, 1).tolist(), name="error")


def scale_colours(scale: str | Colormap) -> npt.NDArray[np.uint8]:
    """The 256 colours of a scale, low end first; shape (256, 3), uint8."""
    levels: npt.NDArray[np.uint8] = colormaps.get_cmap(scale)(np.linspace(0, 1, 256), bytes=True)
    return levels[:, :3]


def disparity_limits(light_field: LightField) -> tuple[float, float]:
    """Ends of the colour scale of a scene: those of its ground truth; if unknown or flat, of its disparity range."""
    if light_field.ground_truth is not None and np.isfinite(light_field.ground_truth).any():
        known = light_field.ground_truth[np.isfinite(light_field.ground_truth)]
        if known.min() < known.max():
            return float(known.min()), float(known.max())
    found = light_field.require_disparity_range()
    return found.minimum, found.maximum


def reference_picture(light_field: LightField) -> Picture:
    """The reference view as RGB."""
    return as_rgb(light_field.reference_view)


def as_rgb(colours: FloatMap) -> Picture:
    """Colours 0..1 of one or three channels, (H, W, C), as RGB."""
    picture = np.rint(255 * np.clip(colours, 0, 1)).astype(np.uint8)
    return np.repeat(picture, 3, axis=2) if picture.shape[2] == 1 else picture


def picture_uri(picture: Picture, kind: str, options: Sequence[int] = ()) -> str:
    """A picture as a data URI; ``kind`` is ``"png"`` or ``"webp"``, ``options`` are OpenCV's."""
    _, data = cv2.imencode(f".{kind}", cv2.cvtColor(picture, cv2.COLOR_RGB2BGR), list(options))
    return f"data:image/{kind};base64,{base64.b64encode(data.tobytes()).decode('ascii')}"


def panel_picture(panel: Panel, view: Picture, limits: tuple[float, float]) -> Picture:
    """The picture of a panel; ``limits`` are the ends of the scale of disparity, ``view`` is the reference view."""
    values, minus, ground_truth = panel.values, panel.minus, panel.ground_truth
    if values is None:
        return view
    if panel.kind == "mask":
        return mask_picture(view, values)
    if panel.kind == "outline":
        return outline_picture(view, values)
    if panel.kind == "sigma":
        return map_picture(logarithms(values), SIGMA_LIMITS, "gray")
    if panel.kind in ("confidence", "grey"):
        return map_picture(values, (0, 1), "gray")
    if minus is None:
        return map_picture(values, limits)
    if ground_truth is None:
        return error_picture(values - minus)
    return error_picture(np.abs(values - ground_truth) - np.abs(minus - ground_truth))


def map_picture(values: FloatMap, limits: tuple[float, float], scale: str | Colormap = "viridis") -> Picture:
    """A map (H, W) in a colour scale of matplotlib over ``limits``; values that are not finite are magenta."""
    low, high = limits
    unit = (values.astype(np.float64) - low) / max(high - low, 1e-9)
    unit[~np.isfinite(unit)] = np.nan
    colours: npt.NDArray[Any] = colormaps.get_cmap(scale).with_extremes(bad=_UNKNOWN)(np.clip(unit, 0, 1), bytes=True)
    return colours[:, :, :3].astype(np.uint8)


def logarithms(values: FloatMap) -> FloatMap:
    """Logarithms to base 10 of a map (H, W) of positive numbers, at least -4; NaN where it is not finite."""
    known = np.where(np.isfinite(values), np.maximum(values, np.float32(_LEAST)), np.float32(np.nan))
    return np.asarray(np.log10(known), np.float32)


def error_picture(error: FloatMap) -> Picture:
    """A signed error map (H, W): red where too near, blue where too far, magenta where not finite."""
    return map_picture(error, (-ERROR_LIMIT, ERROR_LIMIT), error_scale())


def mask_picture(view: Picture, mask: BoolMap) -> Picture:
    """A mask (H, W) in orange over the darkened reference view."""
    dark = view.astype(np.float32) / 2
    dark[mask] = (dark[mask] + _MASK) / 2 + 32
    return np.clip(dark, 0, 255).astype(np.uint8)


def outline_picture(view: Picture, labels: npt.NDArray[np.integer[Any]]) -> Picture:
    """Borders between regions of equal label (H, W) in yellow over the reference view."""
    picture = view.copy()
    picture[outlines(labels)] = _OUTLINE
    return picture


def outlines(labels: npt.NDArray[np.integer[Any]]) -> BoolMap:
    """Pixels whose left or upper neighbour has another label, (H, W) bool."""
    border = np.zeros(labels.shape, bool)
    border[:, 1:] |= labels[:, 1:] != labels[:, :-1]
    border[1:] |= labels[1:] != labels[:-1]
    return border


# the brightness is stretched to black and white, by at most this factor because of noise
_MOST_CONTRAST = 4.0
# most gain of colours, which would glare on grey surfaces
_MOST_COLOUR = 1.5


def contrast_of(pictures: Sequence[tuple[Picture, BoolMap]]) -> tuple[float, float]:
    """Brightness within the masks that becomes black, and that which becomes white; 0..255."""
    seen = np.concatenate([pixels[inside].mean(axis=1) for pixels, inside in pictures])
    low, high = np.percentile(seen, (0.5, 99.5)) if seen.size else (0.0, 255.0)
    missing = max(0.0, 255 / _MOST_CONTRAST - (high - low)) / 2
    return float(low - missing), float(high + missing)


def stretched(picture: Picture, inside: BoolMap, limits: tuple[float, float]) -> Picture:
    """The picture (H, W, 3) with stretched brightness inside the mask (H, W)."""
    low, high = limits
    brightness = picture.mean(axis=2, keepdims=True)
    gain = 255 / (high - low)
    colour = (picture - brightness) * min(gain, _MOST_COLOUR)
    bright = np.asarray(np.rint(np.clip((brightness - low) * gain + colour, 0, 255)), np.uint8)
    return np.where(inside[:, :, None], bright, picture)
