"""Data of a page's viewer: panels that refer to arrays, and the arrays, each packed once.

An error is a map minus the ground truth, and a page takes that difference itself. ``templates/viewer.js`` draws them.
"""

from __future__ import annotations

import hashlib
import math
from collections.abc import Sequence
from typing import Any

import cv2
import numpy as np
import numpy.typing as npt

from sepi.lightfield import LightField
from sepi.report.panels import Panel
from sepi.report.plots.pictures import ERROR_LIMIT, SIGMA_LIMITS, logarithms, outlines, picture_uri, reference_picture
from sepi.report.web.packing import packed

STEPS = (
    (0.001, 0.01, 0.002),
    (0.001, 0.02, 0.01),
    (0.001, 0.05, 0.01),
    (0.001, 0.05, 0.02),
    (0.001, 0.05, 0.05),
    (0.01, 0.2, 0.2),
)
"""Steps of precise maps, of confidences and of other maps, from the finest; a page has the first of them that
keep a scene within its share."""

PRECISE, CONFIDENCE, OTHER, MASK, LOGARITHM = range(5)
"""What an array is held for: its place in a row of :data:`STEPS`. A mask has steps of 1, a logarithm those of 12 %."""

_FIXED = (1.0, 0.05)

# characters for each pixel of an array, on average: ten scenes of 512x512 and the page round them stay below 20 MB; a
# small scene may take as much as one of 512x512
_SHARE = 0.255
_LEAST_PIXELS = 2**18

# larger pictures are thinned out, so that a browser can hold all their maps
_MOST_PIXELS = 2**20

# of the reference view
_WEBP = [cv2.IMWRITE_WEBP_QUALITY, 90]


class _Arrays:
    """Arrays by their content, thinned out, with what each is held for."""

    def __init__(self, stride: int) -> None:
        self.stride = stride
        self.held: dict[str, tuple[npt.NDArray[Any], int]] = {}

    def thinned(self, values: npt.NDArray[Any]) -> npt.NDArray[Any]:
        """The rows and columns of an array that are held."""
        return np.ascontiguousarray(values[:: self.stride, :: self.stride])

    def number(self, thinned: npt.NDArray[Any], role: int) -> int:
        """Hold an array; returns the number that panels call it by. Equal maps are one, as fine as any needs it."""
        values = thinned if role == MASK else thinned.astype(np.float32)
        key = values.dtype.name + hashlib.sha256(values.tobytes()).hexdigest()
        _, before = self.held.get(key, (None, role))
        self.held[key] = (values, min(role, before))
        return list(self.held).index(key)

    def packed(self, pixels: int) -> list[dict[str, Any]]:
        """All arrays, in the finest steps that keep them within their shares of characters, or the coarsest."""
        # error bars have no share: a page does not grow by them, other maps are a little coarser where it is full
        budget = _SHARE * pixels * sum(role != LOGARITHM for _, role in self.held.values())
        for steps in STEPS:
            found = [packed(values, (*steps, *_FIXED)[role]) for values, role in self.held.values()]
            if sum(len(array["data"]) for array in found) <= budget:
                break
        return found


def viewer_json(
    panels: Sequence[Panel], limits: tuple[float, float], light_field: LightField | None = None
) -> dict[str, Any]:
    """Panels and arrays, ready for ``json.dumps``.

    Parameters
    ----------
    panels : sequence of Panel
        Of maps of one size; one of them at least has values.
    limits : (float, float)
        Ends of the scale of disparity, pixels per view step.
    light_field : LightField, optional
        Gives the reference view, and the camera for a cloud in metres.
    """
    full_height, full_width = next(panel.values.shape for panel in panels if panel.values is not None)
    stride = max(1, math.ceil(math.sqrt(full_height * full_width / _MOST_PIXELS)))
    height, width = -(-full_height // stride), -(-full_width // stride)
    arrays = _Arrays(stride)
    entries = [_entry(panel, arrays) for panel in panels]
    picture = None if light_field is None else arrays.thinned(reference_picture(light_field))
    return {
        "height": height,
        "width": width,
        "stride": stride,
        "limits": list(limits),
        "error_limit": ERROR_LIMIT,
        "sigma_limits": list(SIGMA_LIMITS),
        "camera": None if light_field is None else _camera(light_field),
        "picture": "" if picture is None else picture_uri(picture, "webp", _WEBP),
        "panels": entries,
        "arrays": arrays.packed(max(_LEAST_PIXELS, height * width)),
    }


def _entry(panel: Panel, arrays: _Arrays) -> dict[str, Any]:
    """A panel with the numbers of its arrays, without what it does not have."""
    entry: dict[str, Any] = {"key": panel.key, "title": panel.title, "group": panel.group, "kind": panel.kind}
    texts = {"note": panel.note, "ends": panel.ends, "no_interval": panel.no_interval}
    entry |= {name: text for name, text in texts.items() if text}
    role = {"mask": MASK, "outline": MASK, "confidence": CONFIDENCE, "sigma": LOGARITHM}.get(
        panel.kind, PRECISE if panel.precise else OTHER
    )
    shown = {
        "map": (logarithms(panel.values) if panel.kind == "sigma" and panel.values is not None else panel.values, role),
        "minus": (panel.minus, OTHER),
        "ground_truth": (panel.ground_truth, OTHER),
        "confidence": (panel.confidence, CONFIDENCE),
        **_bars(panel),
    }
    for name, (values, held_for) in shown.items():
        if values is not None:
            thinned = arrays.thinned(values)
            # thinned out first: borders of one pixel would break
            thinned = outlines(thinned) if panel.kind == "outline" else thinned
            entry[name] = arrays.number(thinned, held_for)
    return entry


def _bars(panel: Panel) -> dict[str, tuple[npt.NDArray[Any], int]]:
    """The logarithms of a standard deviation, and of how many of these the interval reaches below and above a map.

    As such they are nearly the same everywhere, and take a fourth of the characters that widths would.
    """
    values, bars = panel.values, panel.bars
    if values is None or bars is None or bars.sigma is None or bars.low is None or bars.high is None:
        return {}
    sigma, below, above = (logarithms(widths) for widths in (bars.sigma, values - bars.low, bars.high - values))
    found = {"sigma": sigma, "below": below - sigma, "above": above - sigma}
    return {name: (logarithm, LOGARITHM) for name, logarithm in found.items()}


def _camera(light_field: LightField) -> dict[str, Any] | None:
    camera = light_field.camera
    if camera is None:
        return None
    return {
        "scale": camera.scale,
        "offset": camera.offset,
        "focal": camera.focal_px,
        "from_centre": list(light_field.from_centre),
    }
